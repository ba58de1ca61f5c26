#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "castor/castor_c.h"
#include "castor/error.h"
#include "castor/progress.h"

namespace castor::c {

/// A wrong argument: "`name` `fault`", to which `guarded` adds the function's name.
class ArgumentError : public UsageError {
public:
    ArgumentError(std::string_view name, std::string_view fault) : UsageError(fmt::format("{} {}", name, fault)) {}
};

/// Stores the exception that is being handled as this thread's last error, and returns its status.
castor_status store_current_exception(const char* function) noexcept;

/// Runs the body of an exported function: exceptions become a status and the thread's last error.
template <class Action>
castor_status guarded(Action&& action, const char* function = __builtin_FUNCTION()) noexcept {
    try {
        action();
        return CASTOR_STATUS_DONE;
    } catch (...) {
        return store_current_exception(function);
    }
}

// What arguments must be. All throw ArgumentError.

/// Not null.
template <class Value>
Value& require(Value* pointer, std::string_view name) {
    if (!pointer) throw ArgumentError(name, "is NULL");
    return *pointer;
}

/// An array of so many elements, null only without any. `Element` has the layout of what the caller has.
template <class Element, class Value>
auto array(Value* first, std::size_t count, std::string_view name) {
    using Target = std::conditional_t<std::is_const_v<Value>, const Element, Element>;
    if (count == 0) return std::span<Target>();
    if (!first) throw ArgumentError(name, "is NULL");
    if (reinterpret_cast<std::uintptr_t>(first) % alignof(Element) != 0)
        throw ArgumentError(name, fmt::format("is not aligned to {} bytes", alignof(Element)));
    if (count > std::numeric_limits<std::ptrdiff_t>::max() / sizeof(Element))
        throw ArgumentError(name, fmt::format("cannot have {} elements of {} bytes", count, sizeof(Element)));
    return std::span<Target>(reinterpret_cast<Target*>(first), count);
}

/// One of `count` enumerators, which have the same numbers as in C. Flags are enumerators of two.
template <class Enumeration>
Enumeration enumerator(std::uint32_t value, std::uint32_t count, std::string_view name) {
    if (value >= count) throw ArgumentError(name, fmt::format("is {}, expected 0 to {}", value, count - 1));
    return static_cast<Enumeration>(value);
}
inline bool flag(std::uint32_t value, std::string_view name) {
    return enumerator<std::uint32_t>(value, 2, name) == 1;
}

/// A member that later versions may give a meaning.
inline void require_zero(std::uint32_t reserved) {
    enumerator<std::uint32_t>(reserved, 1, "reserved");
}

/// The position of one of `count` things.
inline std::size_t position(std::size_t i, std::size_t count, std::string_view things) {
    if (i >= count) throw ArgumentError(things, fmt::format("are {}: there is no number {}", count, i));
    return i;
}

// Structs that begin with their size.

inline constexpr std::size_t kLargestStruct = 4096;  // what is larger was not initialised

template <class Struct>
std::size_t checked_size(const Struct& given, std::string_view name) {
    if (given.size < sizeof(std::size_t) || given.size > kLargestStruct)
        throw ArgumentError(name, fmt::format("has size {}, expected sizeof, which is {}", given.size, sizeof(Struct)));
    return given.size;
}

/// Copies what the caller's header and this one both know; all else is 0.
template <class Struct>
Struct read_struct(const Struct& given, std::string_view name) {
    const std::size_t size = checked_size(given, name);
    const auto* const bytes = reinterpret_cast<const std::byte*>(&given);
    if (size > sizeof(Struct) &&
        std::any_of(bytes + sizeof(Struct), bytes + size, [](std::byte b) { return b != std::byte{0}; }))
        throw ArgumentError(name, fmt::format("has size {} and sets what this library does not know; it knows {} bytes",
                                              size, sizeof(Struct)));
    Struct known{};
    std::memcpy(&known, &given, std::min(size, sizeof(Struct)));
    return known;
}

/// The same of options, which may be null.
template <class Struct>
Struct read_options(const Struct* given) {
    return given ? read_struct(*given, "options") : Struct{};
}

/// Copies as much as the caller's header knows, except the size; what this one does not know becomes 0.
template <class Struct>
void write_struct(Struct* target, const Struct& value, std::string_view name) {
    const std::size_t size = checked_size(require(target, name), name);
    auto* const bytes = reinterpret_cast<std::byte*>(target);
    if (size > sizeof(Struct)) std::memset(bytes + sizeof(Struct), 0, size - sizeof(Struct));
    const std::size_t first = sizeof(std::size_t);
    std::memcpy(bytes + first, reinterpret_cast<const std::byte*>(&value) + first,
                std::min(size, sizeof(Struct)) - first);
}

/// What a 0 stands for.
template <class Value>
Value value_or(Value value, Value default_value) {
    return value == Value{} ? default_value : value;
}

inline ProgressHook progress_hook(castor_progress_function function, void* user) {
    if (!function) return {};
    return [=](double fraction) { return function(fraction, user) != 0; };
}

/// Makes a handle of what `make` returns, which may be a prvalue that cannot be moved.
template <class Handle, class Make>
void make_handle(Handle** target, std::string_view name, const Make& make) {
    require(target, name) = nullptr;
    *target = make();
}

}  // namespace castor::c
