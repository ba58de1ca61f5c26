#pragma once

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace castor::test {

/// A writer of PLY files in any of the three formats, value by value.
class PlyWriter {
public:
    enum class Format { ascii, little, big };
    static constexpr Format kFormats[] = {Format::ascii, Format::little, Format::big};

    explicit PlyWriter(Format format, std::string line_end = "\n") : format_(format), line_end_(std::move(line_end)) {
        line("ply");
        line(fmt::format("format {} 1.0", name(format)));
    }

    static const char* name(Format format) {
        constexpr const char* kNames[] = {"ascii", "binary_little_endian", "binary_big_endian"};
        return kNames[static_cast<int>(format)];
    }

    /// Adds a header line as it is.
    PlyWriter& line(const std::string& text) {
        bytes_ += text + line_end_;
        return *this;
    }

    /// Adds values of one type, which has the name of the PLY format.
    PlyWriter& put(const std::string& type, const std::vector<double>& values) {
        for (const double value : values) put_one(type, value);
        return *this;
    }

    /// Ends an element, which is visible only in text.
    PlyWriter& end_line() {
        if (format_ == Format::ascii) bytes_ += line_end_;
        return *this;
    }

    const std::string& bytes() const { return bytes_; }

private:
    void put_one(const std::string& type, double value) {
        if (format_ == Format::ascii) {
            bytes_ += fmt::format("{} ", value);
        } else if (type == "char" || type == "int8") {
            put_bits(static_cast<std::uint8_t>(static_cast<std::int8_t>(value)));
        } else if (type == "uchar" || type == "uint8") {
            put_bits(static_cast<std::uint8_t>(value));
        } else if (type == "short" || type == "int16") {
            put_bits(static_cast<std::uint16_t>(static_cast<std::int16_t>(value)));
        } else if (type == "ushort" || type == "uint16") {
            put_bits(static_cast<std::uint16_t>(value));
        } else if (type == "int" || type == "int32") {
            put_bits(static_cast<std::uint32_t>(static_cast<std::int32_t>(value)));
        } else if (type == "uint" || type == "uint32") {
            put_bits(static_cast<std::uint32_t>(value));
        } else if (type == "float" || type == "float32") {
            put_bits(std::bit_cast<std::uint32_t>(static_cast<float>(value)));
        } else {
            put_bits(std::bit_cast<std::uint64_t>(value));
        }
    }

    template <class Bits>
    void put_bits(Bits bits) {
        for (std::size_t i = 0; i < sizeof(Bits); ++i) {
            const std::size_t byte = format_ == Format::little ? i : sizeof(Bits) - 1 - i;
            bytes_ += static_cast<char>(bits >> (8 * byte) & 0xff);
        }
    }

    Format format_;
    std::string line_end_;
    std::string bytes_;
};

}  // namespace castor::test
