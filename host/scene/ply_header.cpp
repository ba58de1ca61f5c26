#include "scene/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <initializer_list>
#include <set>

#include "castor/error.h"

namespace castor {

namespace {

struct TypeName {
    std::string_view name;
    PlyType type;
};

constexpr std::array<TypeName, 16> kTypeNames = {{{"char", PlyType::int8},
                                                  {"int8", PlyType::int8},
                                                  {"uchar", PlyType::uint8},
                                                  {"uint8", PlyType::uint8},
                                                  {"short", PlyType::int16},
                                                  {"int16", PlyType::int16},
                                                  {"ushort", PlyType::uint16},
                                                  {"uint16", PlyType::uint16},
                                                  {"int", PlyType::int32},
                                                  {"int32", PlyType::int32},
                                                  {"uint", PlyType::uint32},
                                                  {"uint32", PlyType::uint32},
                                                  {"float", PlyType::float32},
                                                  {"float32", PlyType::float32},
                                                  {"double", PlyType::float64},
                                                  {"float64", PlyType::float64}}};

std::vector<std::string_view> split(std::string_view line) {
    std::vector<std::string_view> words;
    std::size_t at = 0;
    while ((at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos) {
        const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
        words.push_back(line.substr(at, end - at));
        at = end;
    }
    return words;
}

/// Returns whether the reader uses the properties of this name.
bool is_read(const PlyElement& element, std::string_view property) {
    const auto is_among = [&](std::initializer_list<std::string_view> names) {
        return std::find(names.begin(), names.end(), property) != names.end();
    };
    if (element.name == "vertex") return is_among({"x", "y", "z", "nx", "ny", "nz"});
    if (element.name == "face" || element.name == "tristrips") return is_among({"vertex_indices", "vertex_index"});
    return false;
}

class HeaderParser {
public:
    HeaderParser(std::string_view bytes, const std::string& file) : bytes_(bytes), file_(file) {}

    PlyHeader parse() {
        if (bytes_.empty()) throw SceneError(file_, 0, "the file is empty, not a PLY file");
        if (bytes_.substr(0, 3) != "ply" || bytes_.find_first_of("\r\n") != 3) {
            throw SceneError(file_, 1,
                             fmt::format("not a PLY file: found '{}' where 'ply' was expected",
                                         printable(bytes_.substr(0, bytes_.find_first_of("\r\n")))));
        }
        // Old files end lines with '\r' alone; a '\r' before '\n' is white space.
        if (bytes_[3] == '\r' && bytes_.substr(4, 1) != "\n") line_end_ = '\r';
        next_line();
        while (true) {
            const std::vector<std::string_view> words = split(next_line());
            if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
            if (words[0] == "end_header") break;
            parse_line(words);
        }
        if (!has_format_) fail("the header ends without a format line");
        header_.bytes = at_;
        return std::move(header_);
    }

private:
    [[noreturn]] void fail(const std::string& reason) const { throw SceneError(file_, line_, reason); }

    std::string_view next_line() {
        const std::size_t end = bytes_.find(line_end_, at_);
        if (end == std::string_view::npos) fail("the file ends within the header: no end_header line");
        const std::string_view line = bytes_.substr(at_, end - at_);
        at_ = end + 1;
        ++line_;
        return line;
    }

    void parse_line(const std::vector<std::string_view>& words) {
        if (words[0] == "format") {
            parse_format(words);
        } else if (words[0] == "element") {
            parse_element(words);
        } else if (words[0] == "property") {
            parse_property(words);
        } else {
            fail(fmt::format("found '{}' where format, element, property, comment or end_header was expected",
                             printable(words[0])));
        }
    }

    void parse_format(const std::vector<std::string_view>& words) {
        if (has_format_) fail("a second format line");
        if (words.size() != 3) fail("a format line has two words: the format and its version");
        if (words[1] == "ascii") {
            header_.format = PlyFormat::ascii;
        } else if (words[1] == "binary_little_endian") {
            header_.format = PlyFormat::binary_little_endian;
        } else if (words[1] == "binary_big_endian") {
            header_.format = PlyFormat::binary_big_endian;
        } else {
            fail(fmt::format("found format '{}' where ascii, binary_little_endian or binary_big_endian was expected",
                             printable(words[1])));
        }
        if (words[2] != "1.0") fail(fmt::format("found version '{}' where 1.0 was expected", printable(words[2])));
        has_format_ = true;
    }

    void parse_element(const std::vector<std::string_view>& words) {
        if (words.size() != 3) fail("an element line has two words: its name and its count");
        PlyElement element;
        element.name = words[1];
        element.line = line_;
        const char* end = words[2].data() + words[2].size();
        const auto [stop, error] = std::from_chars(words[2].data(), end, element.count);
        if (error != std::errc() || stop != end) {
            fail(fmt::format("found '{}' where the number of elements was expected", printable(words[2])));
        }
        if (!element_names_.insert(words[1]).second) fail(fmt::format("a second element '{}'", printable(words[1])));
        header_.elements.push_back(std::move(element));
    }

    void parse_property(const std::vector<std::string_view>& words) {
        if (header_.elements.empty()) fail("a property before the first element");
        PlyProperty property;
        property.is_list = words.size() > 1 && words[1] == "list";
        if (words.size() != (property.is_list ? 5 : 3)) {
            fail("a property line is 'property TYPE NAME' or 'property list COUNT_TYPE TYPE NAME'");
        }
        if (property.is_list) {
            property.count_type = parse_type(words[2]);
            if (!is_integer(property.count_type)) {
                fail(fmt::format("found '{}' where an integer type for the length of a list was expected", words[2]));
            }
        }
        property.type = parse_type(words[words.size() - 2]);
        property.name = words.back();
        // Any other name may occur again: padding of several properties has one name in some files.
        if (is_read(header_.elements.back(), property.name)) {
            for (const PlyProperty& other : header_.elements.back().properties) {
                if (other.name == property.name) fail(fmt::format("a second property '{}'", printable(property.name)));
            }
        }
        header_.elements.back().properties.push_back(std::move(property));
    }

    PlyType parse_type(std::string_view word) const {
        for (const TypeName& entry : kTypeNames) {
            if (entry.name == word) return entry.type;
        }
        fail(fmt::format(
            "found '{}' where a type was expected: char, uchar, short, ushort, int, uint, float, double, or "
            "int8 … float64",
            printable(word)));
    }

    std::string_view bytes_;
    const std::string& file_;
    PlyHeader header_;
    std::set<std::string_view> element_names_;
    char line_end_ = '\n';
    std::size_t at_ = 0;
    std::size_t line_ = 0;
    bool has_format_ = false;
};

}  // namespace

PlyHeader parse_ply_header(std::string_view file_bytes, const std::string& file) {
    return HeaderParser(file_bytes, file).parse();
}

std::string printable(std::string_view text) {
    constexpr std::size_t kLongest = 40;
    std::string result(text.substr(0, kLongest));
    for (char& c : result) {
        if (c < ' ' || c > '~') c = '?';
    }
    if (text.size() > kLongest) result += "...";
    return result;
}

}  // namespace castor
