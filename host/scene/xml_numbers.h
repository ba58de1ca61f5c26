#pragma once

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <map>
#include <string>
#include <utility>

#include "scene/xml_document.h"

namespace castor {

/// The numbers in the text of an element, one after the other. They are separated by white space and perhaps comments.
class XmlNumbers {
public:
    XmlNumbers(const XmlDocument& document, pugi::xml_node element);

    /// Reads the next number. Returns false at the end of the text. Throws SceneError if the next word is not a finite
    /// number, or not an integer.
    bool next(float& value);
    bool next(std::int64_t& value);

    /// Returns the position of the number that `next` read last.
    const char* where() const { return where_; }

private:
    bool find_next();
    void accept(const char* end);
    [[noreturn]] void refuse(const char* expected) const;

    const XmlDocument& document_;
    pugi::xml_node element_;
    pugi::xml_node text_;
    const char* cursor_ = "";
    const char* end_ = cursor_;
    const char* where_ = cursor_;
    std::uint32_t count_ = 0;
};

/// Reads the first N numbers of an element (T: float or std::int64_t). Throws SceneError if there are fewer, and warns
/// if there are more.
template <class T, std::size_t N>
std::array<T, N> read_numbers(XmlDocument& document, pugi::xml_node element) {
    document.expect_attributes(element);
    document.expect_text(element);
    XmlNumbers numbers(document, element);
    std::array<T, N> values{};
    for (std::size_t i = 0; i < N; ++i)
        if (!numbers.next(values[i]))
            document.fail(element, fmt::format("<{}> holds {} numbers: {} were expected", element.name(), i, N));
    T extra{};
    if (numbers.next(extra))
        document.warn(numbers.where(),
                      fmt::format("<{}> holds more than {} numbers: the others are ignored", element.name(), N));
    return values;
}

/// Returns the child of that name. Throws SceneError if there is none.
pugi::xml_node require_child(const XmlDocument& document, pugi::xml_node element, const char* name);

/// Returns the value of the child of that name. Throws SceneError if there is none.
float require_float(XmlDocument& document, pugi::xml_node element, const char* name);
glm::vec3 require_vec3(XmlDocument& document, pugi::xml_node element, const char* name);
std::int64_t require_integer(XmlDocument& document, pugi::xml_node element, const char* name);
/// Returns the same, and throws SceneError if it is (0, 0, 0).
glm::vec3 require_direction(XmlDocument& document, pugi::xml_node element, const char* name);

/// Returns the value of the child of that name, or `absent` if there is none.
float read_float(XmlDocument& document, pugi::xml_node element, const char* name, float absent);
glm::vec3 read_vec3(XmlDocument& document, pugi::xml_node element, const char* name, const glm::vec3& absent);
std::int64_t read_integer(XmlDocument& document, pugi::xml_node element, const char* name, std::int64_t absent);

/// Returns the text of an element without the white space around it.
std::string read_string(XmlDocument& document, pugi::xml_node element);

/// Returns the value of an attribute that is an integer, or `absent` if there is none.
std::int64_t read_integer_attribute(const XmlDocument& document, pugi::xml_node element, const char* name,
                                    std::int64_t absent);

/// Returns the meaning of an attribute that is one of a few words (in any case), or `absent` if there is none.
template <class T>
T read_word_attribute(const XmlDocument& document, pugi::xml_node element, const char* name, T absent,
                      std::initializer_list<std::pair<const char*, T>> words);

/// Returns the meaning of a text that is one of a few words (in any case). Throws SceneError with the line of the
/// element.
template <class T>
T read_word(XmlDocument& document, pugi::xml_node element, std::initializer_list<std::pair<const char*, T>> words);

/// Returns the same of the child of that name, or `absent` if there is none.
template <class T>
T read_word_child(XmlDocument& document, pugi::xml_node element, const char* name, T absent,
                  std::initializer_list<std::pair<const char*, T>> words) {
    const pugi::xml_node child = element.child(name);
    return child ? read_word(document, child, words) : absent;
}

/// Returns the attribute `id` of an element that others name by it. Throws SceneError if there is none.
std::int64_t require_id(const XmlDocument& document, pugi::xml_node element);

/// Returns the ids that there are, for a message: "the scene has 1, 2", or that it has none of these things.
template <class T>
std::string list_ids(const std::map<std::int64_t, T>& ids, const char* things) {
    constexpr std::size_t kMost = 10;
    std::string list;
    std::size_t count = 0;
    for (const auto& [id, thing] : ids) {
        if (count++ == kMost) return fmt::format("the ids of the {} {} begin with {}", ids.size(), things, list);
        list += fmt::format("{}{}", list.empty() ? "" : ", ", id);
    }
    return ids.empty() ? fmt::format("the scene has no {}", things) : fmt::format("the scene has {}", list);
}

/// Throws SceneError with the value of the child, unless `valid`.
void check_child(const XmlDocument& document, bool valid, pugi::xml_node element, const char* name,
                 const char* expected);

bool equals_ignoring_case(std::string_view a, std::string_view b);

template <class T>
std::string list_words(std::initializer_list<std::pair<const char*, T>> words) {
    std::string list;
    for (const auto& [word, meaning] : words) list += fmt::format("{}{}", list.empty() ? "" : ", ", word);
    return list;
}

template <class T>
T read_word_attribute(const XmlDocument& document, pugi::xml_node element, const char* name, T absent,
                      std::initializer_list<std::pair<const char*, T>> words) {
    const pugi::xml_attribute attribute = element.attribute(name);
    if (!attribute) return absent;
    for (const auto& [word, meaning] : words)
        if (equals_ignoring_case(attribute.value(), word)) return meaning;
    document.fail(attribute.name(), fmt::format("{}=\"{}\" of <{}> is not known: allowed are {}", name,
                                                xml_excerpt(attribute.value()), element.name(), list_words(words)));
}

template <class T>
T read_word(XmlDocument& document, pugi::xml_node element, std::initializer_list<std::pair<const char*, T>> words) {
    const std::string text = read_string(document, element);
    for (const auto& [word, meaning] : words)
        if (equals_ignoring_case(text, word)) return meaning;
    document.fail(element,
                  fmt::format("<{}> is '{}': allowed are {}", element.name(), xml_excerpt(text), list_words(words)));
}

}  // namespace castor
