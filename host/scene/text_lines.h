#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace castor {

/// Returns the text of a file as UTF-8, without a byte-order mark. UTF-16 of either byte order, which only its mark
/// tells from UTF-8, is converted into `storage`; any other text is returned in place.
std::string_view to_utf8(std::string_view bytes, std::string& storage);

/// The lines of a text, one after the other. Lines end with LF, CRLF or CR. A line that ends with a backslash is
/// continued by the next one, with a space between them, unless it is a comment (its first character is '#').
class TextLines {
public:
    explicit TextLines(std::string_view text);

    /// Moves to the next line. Returns false at the end of the text.
    bool next();

    /// The line without its end; valid until the next call of `next`.
    std::string_view line() const { return line_; }
    /// The number of the line in the file, from 1; that of the first one where lines are continued.
    std::size_t number() const { return number_; }
    /// The number of bytes up to the next line.
    std::size_t passed() const { return at_; }

private:
    std::string_view take_line();

    std::string_view text_;
    std::string_view line_;
    std::string joined_;     // a line that is continued
    std::size_t at_ = 0;     // where the next line begins
    std::size_t line_feed_;  // the first one from there on, or the end of the text
    std::size_t carriage_return_;
    std::size_t number_ = 0;
    std::size_t taken_ = 0;  // lines
};

}  // namespace castor
