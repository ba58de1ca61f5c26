#pragma once

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>

#include "scene/ply_header.h"

namespace castor {

// The two ways in which a PLY file writes a value. Both codecs have the same functions. Each moves `at` past the value
// that it read and returns whether that succeeded; on a fault `at` stays where the value was expected. `end` is the end
// of the file.

enum class PlyFault {
    none,
    truncated,     // the file ends before the value does
    not_a_number,  // ASCII: something else, or out of the type's range
};

/// Binary values of either byte order; they need not be aligned.
class PlyBinary {
public:
    PlyBinary(const char* end, bool big_endian)
        : end_(end), swap_(big_endian != (std::endian::native == std::endian::big)) {}

    PlyFault scalar(const char*& at, PlyType type, double& value) const {
        if (left(at) < size_of(type)) return PlyFault::truncated;
        switch (type) {
            case PlyType::float32:
                value = std::bit_cast<float>(take<std::uint32_t>(at));
                return PlyFault::none;
            case PlyType::float64:
                value = std::bit_cast<double>(take<std::uint64_t>(at));
                return PlyFault::none;
            default:
                value = static_cast<double>(take_integer(at, type));
                return PlyFault::none;
        }
    }

    PlyFault integer(const char*& at, PlyType type, std::int64_t& value) const {
        if (left(at) < size_of(type)) return PlyFault::truncated;
        value = take_integer(at, type);
        return PlyFault::none;
    }

    /// Skips `count` values. The length of a list has at most 32 bits, so the product does not overflow.
    PlyFault skip(const char*& at, PlyType type, std::uint64_t count) const {
        const std::uint64_t size = count * size_of(type);
        if (left(at) < size) return PlyFault::truncated;
        at += size;
        return PlyFault::none;
    }

    /// Returns `at`: nothing separates two records.
    const char* skip_space(const char* at) const { return at; }

    /// Returns a value of 32 bits. The caller has checked that the file holds it.
    std::uint32_t bits32(const char* at) const { return take<std::uint32_t>(at); }

private:
    std::uint64_t left(const char* at) const { return static_cast<std::uint64_t>(end_ - at); }

    template <class Bits>
    Bits take(const char*& at) const {
        Bits bits;
        std::memcpy(&bits, at, sizeof(bits));
        at += sizeof(bits);
        if (!swap_) return bits;
        if constexpr (sizeof(Bits) == 2) return __builtin_bswap16(bits);
        if constexpr (sizeof(Bits) == 4) return __builtin_bswap32(bits);
        if constexpr (sizeof(Bits) == 8) return __builtin_bswap64(bits);
        return bits;
    }

    std::int64_t take_integer(const char*& at, PlyType type) const {
        switch (type) {
            case PlyType::int8:
                return static_cast<std::int8_t>(take<std::uint8_t>(at));
            case PlyType::uint8:
                return take<std::uint8_t>(at);
            case PlyType::int16:
                return static_cast<std::int16_t>(take<std::uint16_t>(at));
            case PlyType::uint16:
                return take<std::uint16_t>(at);
            case PlyType::int32:
                return static_cast<std::int32_t>(take<std::uint32_t>(at));
            default:
                return take<std::uint32_t>(at);
        }
    }

    const char* end_;
    bool swap_;
};

/// Numbers separated by white space. Line ends mean nothing to the format, although writers put one element on a line.
class PlyAscii {
public:
    explicit PlyAscii(const char* end) : end_(end) {}

    PlyFault scalar(const char*& at, PlyType type, double& value) const {
        at = skip_space(at);
        if (at == end_) return PlyFault::truncated;
        if (type == PlyType::float32) {
            // Rounds once, from the decimal digits.
            float single = 0.0f;
            if (parse(at, single) == std::errc()) {
                value = single;
                return PlyFault::none;
            }
        }
        if (parse(at, value) == std::errc()) return PlyFault::none;
        // A number that is too small for the type fails above, too: the widest type tells it from one that is too large
        // and from a word that is no number.
        long double widest = 0.0L;
        if (parse(at, widest) != std::errc()) return PlyFault::not_a_number;
        value = static_cast<double>(widest);
        return PlyFault::none;
    }

    PlyFault integer(const char*& at, PlyType, std::int64_t& value) const {
        at = skip_space(at);
        if (at == end_) return PlyFault::truncated;
        return parse(at, value) == std::errc() ? PlyFault::none : PlyFault::not_a_number;
    }

    /// Skips `count` words, without a check whether they are numbers.
    PlyFault skip(const char*& at, PlyType, std::uint64_t count) const {
        for (; count > 0; --count) {
            const char* word = skip_space(at);
            if (word == end_) return PlyFault::truncated;
            at = std::find_if(word, end_, is_space);
        }
        return PlyFault::none;
    }

    const char* skip_space(const char* at) const { return std::find_if_not(at, end_, is_space); }

    static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

private:
    template <class Number>
    std::errc parse(const char*& at, Number& number) const {
        const char* first = at + (*at == '+' ? 1 : 0);  // from_chars knows no plus
        const auto [stop, error] = std::from_chars(first, end_, number);
        if (error != std::errc()) return error;
        if (stop != end_ && !is_space(*stop)) return std::errc::invalid_argument;
        at = stop;
        return error;
    }

    const char* end_;
};

}  // namespace castor
