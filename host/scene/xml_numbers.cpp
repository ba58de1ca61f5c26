#include "scene/xml_numbers.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>

namespace castor {

namespace {

/// Skips a plus sign, which std::from_chars does not accept.
const char* skip_plus(const char* begin, const char* end) {
    return end - begin > 1 && begin[0] == '+' && begin[1] != '-' ? begin + 1 : begin;
}

/// Returns whether a number that is out of range is too small, and so zero, rather than too large.
bool is_underflow(std::string_view number) {
    if (const std::size_t exponent = number.find_first_of("eE"); exponent != number.npos)
        return exponent + 1 < number.size() && number[exponent + 1] == '-';
    return number.substr(number.find_first_of("0123456789.")).find_first_not_of("0.") > 1;
}

}  // namespace

XmlNumbers::XmlNumbers(const XmlDocument& document, pugi::xml_node element)
    : document_(document), element_(element), text_(element.first_child()) {
    if (!text_) return;
    cursor_ = text_.value();
    end_ = cursor_ + std::strlen(cursor_);
}

bool XmlNumbers::find_next() {
    for (;;) {
        while (cursor_ != end_ && is_xml_space(*cursor_)) ++cursor_;
        if (cursor_ != end_) break;
        if (text_) text_ = text_.next_sibling();
        if (!text_) return false;
        cursor_ = text_.value();
        end_ = cursor_ + std::strlen(cursor_);
    }
    where_ = cursor_;
    constexpr std::uint32_t kOften = 1 << 14;
    if (++count_ % kOften == 0) document_.reach(where_);
    return true;
}

bool XmlNumbers::next(float& value) {
    if (!find_next()) return false;
    const char* begin = skip_plus(cursor_, end_);
    const auto [end, status] = std::from_chars(begin, end_, value);
    if (status == std::errc::result_out_of_range) {
        if (!is_underflow({begin, end})) refuse("a number within the range of float");
        value = 0.0f;
    } else if (status != std::errc{} || !std::isfinite(value)) {
        refuse("a finite number");
    }
    if (end != end_ && !is_xml_space(*end)) refuse("a finite number");
    cursor_ = end;
    return true;
}

bool XmlNumbers::next(std::int64_t& value) {
    if (!find_next()) return false;
    const auto [digits_end, status] = std::from_chars(skip_plus(cursor_, end_), end_, value);
    const char* end = digits_end;
    if (end != end_ && *end == '.') end = std::find_if(end + 1, end_, [](char c) { return c != '0'; });  // as in 800.0
    if (status != std::errc{} || (end != end_ && !is_xml_space(*end))) refuse("an integer");
    cursor_ = end;
    return true;
}

void XmlNumbers::refuse(const char* expected) const {
    const std::string_view rest(where_, static_cast<std::size_t>(end_ - where_));
    document_.fail(where_,
                   fmt::format("<{}> holds '{}': {} was expected", element_.name(), xml_excerpt(rest), expected));
}

pugi::xml_node require_child(const XmlDocument& document, pugi::xml_node element, const char* name) {
    const pugi::xml_node child = element.child(name);
    if (!child) document.fail(element, fmt::format("<{}> needs a <{}>", element.name(), name));
    return child;
}

float require_float(XmlDocument& document, pugi::xml_node element, const char* name) {
    return read_numbers<float, 1>(document, require_child(document, element, name))[0];
}

glm::vec3 require_vec3(XmlDocument& document, pugi::xml_node element, const char* name) {
    const auto [x, y, z] = read_numbers<float, 3>(document, require_child(document, element, name));
    return {x, y, z};
}

std::int64_t require_integer(XmlDocument& document, pugi::xml_node element, const char* name) {
    return read_numbers<std::int64_t, 1>(document, require_child(document, element, name))[0];
}

glm::vec3 require_direction(XmlDocument& document, pugi::xml_node element, const char* name) {
    const glm::vec3 direction = require_vec3(document, element, name);
    check_child(document, direction != glm::vec3(0.0f), element, name, "a direction, not (0, 0, 0)");
    return direction;
}

float read_float(XmlDocument& document, pugi::xml_node element, const char* name, float absent) {
    return element.child(name) ? require_float(document, element, name) : absent;
}

glm::vec3 read_vec3(XmlDocument& document, pugi::xml_node element, const char* name, const glm::vec3& absent) {
    return element.child(name) ? require_vec3(document, element, name) : absent;
}

std::int64_t read_integer(XmlDocument& document, pugi::xml_node element, const char* name, std::int64_t absent) {
    return element.child(name) ? require_integer(document, element, name) : absent;
}

std::string read_string(XmlDocument& document, pugi::xml_node element) {
    document.expect_attributes(element);
    document.expect_text(element);
    std::string text;
    for (const pugi::xml_node child : element.children()) text += child.value();
    const auto not_space = [](char character) { return !is_xml_space(character); };
    text.erase(std::find_if(text.rbegin(), text.rend(), not_space).base(), text.end());
    text.erase(text.begin(), std::find_if(text.begin(), text.end(), not_space));
    return text;
}

std::int64_t read_integer_attribute(const XmlDocument& document, pugi::xml_node element, const char* name,
                                    std::int64_t absent) {
    const pugi::xml_attribute attribute = element.attribute(name);
    if (!attribute) return absent;
    std::string_view text = attribute.value();
    while (!text.empty() && is_xml_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_xml_space(text.back())) text.remove_suffix(1);
    std::int64_t value = 0;
    const char* last = text.data() + text.size();
    const auto [end, status] = std::from_chars(skip_plus(text.data(), last), last, value);
    if (status != std::errc{} || end != last)
        document.fail(attribute.name(), fmt::format("{}=\"{}\" of <{}>: an integer was expected", name,
                                                    xml_excerpt(attribute.value()), element.name()));
    return value;
}

std::int64_t require_id(const XmlDocument& document, pugi::xml_node element) {
    if (!element.attribute("id"))
        document.fail(element, fmt::format("<{}> needs an attribute id, by which others name it", element.name()));
    return read_integer_attribute(document, element, "id", 0);
}

void check_child(const XmlDocument& document, bool valid, pugi::xml_node element, const char* name,
                 const char* expected) {
    if (valid) return;
    const pugi::xml_node child = element.child(name);
    std::string found;
    for (const pugi::xml_node text : child.children()) found += text.value();
    // The message quotes the text on one line, with single spaces.
    std::string words;
    for (const char character : found) {
        if (!is_xml_space(character))
            words += std::isprint(static_cast<unsigned char>(character)) ? character : '?';
        else if (!words.empty() && words.back() != ' ')
            words += ' ';
        if (words.size() > 80) break;
    }
    if (!words.empty() && words.back() == ' ') words.pop_back();
    document.fail(child, fmt::format("<{}> of <{}> is '{}': expected is {}", name, element.name(), words, expected));
}

bool equals_ignoring_case(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

}  // namespace castor
