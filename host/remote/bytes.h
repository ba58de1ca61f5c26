#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "castor/error.h"

namespace castor {

using Bytes = std::vector<std::byte>;

template <class T>
concept Plain = std::is_trivially_copyable_v<T>;

/// Writes values one after another, as they stand in memory. Only processes of one version and byte order exchange
/// them.
class ByteWriter {
public:
    template <Plain T>
    ByteWriter& add(const T& value) {
        return add_bytes(&value, sizeof(T));
    }
    /// The number of elements, then the elements.
    template <Plain T>
    ByteWriter& add(const std::vector<T>& values) {
        add(std::uint64_t{values.size()});
        return add_bytes(values.data(), values.size() * sizeof(T));
    }
    ByteWriter& add(std::string_view text) {
        add(std::uint64_t{text.size()});
        return add_bytes(text.data(), text.size());
    }
    Bytes take() { return std::move(bytes_); }

private:
    ByteWriter& add_bytes(const void* data, std::size_t count) {
        const auto* first = static_cast<const std::byte*>(data);
        bytes_.insert(bytes_.end(), first, first + count);
        return *this;
    }

    Bytes bytes_;
};

/// Reads what a ByteWriter wrote. Throws DeviceError where the bytes end too early, or too late.
class ByteReader {
public:
    explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

    template <Plain T>
    T take() {
        T value;
        take_bytes(&value, 1, sizeof(T));
        return value;
    }
    template <Plain T>
    std::vector<T> take_vector() {
        std::vector<T> values(checked_count(sizeof(T)));
        take_bytes(values.data(), values.size(), sizeof(T));
        return values;
    }
    std::string take_text() {
        std::string text(checked_count(1), '\0');
        take_bytes(text.data(), text.size(), 1);
        return text;
    }
    std::span<const std::byte> rest() { return bytes_; }
    void expect_end() const {
        if (!bytes_.empty()) refuse();
    }

private:
    [[noreturn]] static void refuse() {
        throw DeviceError("", "", 0, "sent a message of another length than expected");
    }

    std::size_t checked_count(std::size_t element_bytes) {
        const auto count = take<std::uint64_t>();
        if (count > bytes_.size() / element_bytes) refuse();
        return static_cast<std::size_t>(count);
    }
    void take_bytes(void* target, std::size_t count, std::size_t element_bytes) {
        const std::size_t bytes = count * element_bytes;
        if (bytes > bytes_.size()) refuse();
        if (bytes > 0) std::memcpy(target, bytes_.data(), bytes);
        bytes_ = bytes_.subspan(bytes);
    }

    std::span<const std::byte> bytes_;
};

}  // namespace castor
