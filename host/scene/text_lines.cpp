#include "scene/text_lines.h"

#include <algorithm>
#include <cstdint>

namespace castor {

namespace {

constexpr std::uint32_t kReplacement = 0xfffd;  // stands for what is no character

void append_utf8(std::string& text, std::uint32_t code) {
    const auto put = [&](std::uint32_t bits) { text += static_cast<char>(bits); };
    if (code < 0x80) {
        put(code);
    } else if (code < 0x800) {
        put(0xc0 | code >> 6);
        put(0x80 | (code & 0x3f));
    } else if (code < 0x10000) {
        put(0xe0 | code >> 12);
        put(0x80 | (code >> 6 & 0x3f));
        put(0x80 | (code & 0x3f));
    } else {
        put(0xf0 | code >> 18);
        put(0x80 | (code >> 12 & 0x3f));
        put(0x80 | (code >> 6 & 0x3f));
        put(0x80 | (code & 0x3f));
    }
}

std::string utf8_of_utf16(std::string_view bytes, bool big_endian) {
    const std::size_t count = bytes.size() / 2;
    const auto unit = [&](std::size_t i) -> std::uint32_t {
        const auto first = static_cast<unsigned char>(bytes[2 * i]);
        const auto second = static_cast<unsigned char>(bytes[2 * i + 1]);
        return big_endian ? std::uint32_t{first} << 8 | second : std::uint32_t{second} << 8 | first;
    };
    const auto is_high = [](std::uint32_t code) { return code >= 0xd800 && code < 0xdc00; };
    const auto is_low = [](std::uint32_t code) { return code >= 0xdc00 && code < 0xe000; };
    std::string text;
    text.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t code = unit(i);
        if (is_high(code) && i + 1 < count && is_low(unit(i + 1)))
            append_utf8(text, 0x10000 + ((code - 0xd800) << 10) + (unit(++i) - 0xdc00));
        else
            append_utf8(text, is_high(code) || is_low(code) ? kReplacement : code);
    }
    if (bytes.size() % 2 != 0) append_utf8(text, kReplacement);
    return text;
}

}  // namespace

std::string_view to_utf8(std::string_view bytes, std::string& storage) {
    if (bytes.starts_with("\xef\xbb\xbf")) return bytes.substr(3);
    const bool big_endian = bytes.starts_with("\xfe\xff");
    if (!big_endian && !bytes.starts_with("\xff\xfe")) return bytes;
    storage = utf8_of_utf16(bytes.substr(2), big_endian);
    return storage;
}

TextLines::TextLines(std::string_view text)
    : text_(text),
      line_feed_(std::min(text.find('\n'), text.size())),
      carriage_return_(std::min(text.find('\r'), text.size())) {}

bool TextLines::next() {
    if (at_ == text_.size()) return false;
    number_ = taken_ + 1;
    line_ = take_line();
    if (!line_.ends_with('\\')) return true;
    if (line_[std::min(line_.find_first_not_of(" \t"), line_.size() - 1)] == '#') return true;
    joined_.clear();
    while (line_.ends_with('\\')) {
        joined_.append(line_.substr(0, line_.size() - 1)).append(1, ' ');
        line_ = at_ == text_.size() ? std::string_view() : take_line();
    }
    joined_.append(line_);
    line_ = joined_;
    return true;
}

std::string_view TextLines::take_line() {
    if (line_feed_ < at_) line_feed_ = std::min(text_.find('\n', at_), text_.size());
    if (carriage_return_ < at_) carriage_return_ = std::min(text_.find('\r', at_), text_.size());
    const std::size_t end = std::min(line_feed_, carriage_return_);
    const std::string_view line = text_.substr(at_, end - at_);
    const std::size_t end_bytes = text_.substr(end, 2) == "\r\n" ? 2 : 1;
    at_ = std::min(end + end_bytes, text_.size());
    ++taken_;
    return line;
}

}  // namespace castor
