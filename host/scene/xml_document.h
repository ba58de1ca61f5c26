#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "castor/scene.h"
#include "scene/json_to_xml.h"

namespace castor {

/// Whether a character separates numbers and words in a scene file, whatever the locale.
inline bool is_xml_space(char character) {
    return character == ' ' || (character >= '\t' && character <= '\r');
}

using XmlNames = std::initializer_list<std::string_view>;

/// An XML file whose elements, attributes and text know their lines, and the warnings about it. A file in JSON is taken
/// as the XML that says the same (json_to_xml), with the lines of the JSON file.
class XmlDocument {
public:
    /// Reads and parses the file. Throws SceneError if it cannot be read or is not well-formed.
    explicit XmlDocument(const std::filesystem::path& file, const Progress& progress = {});

    const std::filesystem::path& file() const { return file_; }
    pugi::xml_node root() const { return document_.document_element(); }

    /// Returns the line of an element, or of a name, value or text of this document; 0 for a pointer to anything else.
    std::size_t line(pugi::xml_node element) const { return line(element.name()); }
    std::size_t line(const char* text) const;

    [[noreturn]] void fail(pugi::xml_node element, const std::string& reason) const { fail(element.name(), reason); }
    [[noreturn]] void fail(const char* text, const std::string& reason) const;

    /// Adds a warning. Warnings with the same text become one, with the first line and the count.
    void warn(pugi::xml_node element, const std::string& text) { warn(element.name(), text); }
    void warn(const char* where, const std::string& text);

    /// Warns of children in neither list and of text, which are ignored, and of children in `once` that occur again, of
    /// which the first is used.
    void expect_children(pugi::xml_node element, XmlNames once, XmlNames repeated = {});
    /// Warns of children, which are ignored in an element that holds text.
    void expect_text(pugi::xml_node element);
    /// Warns of attributes other than `id` and `known`, which are ignored.
    void expect_attributes(pugi::xml_node element, XmlNames known = {});

    /// Sets the size of the files that the text names: progress is counted in bytes of the text and of these files.
    void expect_file_bytes(std::uintmax_t bytes);
    /// Reports that the text is read up to a pointer into it.
    void reach(const char* text) const;
    /// Returns the progress for the next of these files.
    Progress next_file(std::uintmax_t bytes);

    /// Returns the warnings, ordered by line.
    std::vector<Warning> warnings() const;

private:
    struct Notice {
        std::size_t line = 0;
        std::size_t count = 0;
    };

    void convert_json();
    void parse();
    void expect_single_root();
    void warn_unknown(pugi::xml_node element);
    std::size_t line_at(std::size_t offset) const;
    bool is_within(const char* text) const;

    std::filesystem::path file_;
    std::string text_;  // parsed in place: the document points into it
    std::vector<std::size_t> line_starts_;
    std::vector<XmlFromJson::Place> json_places_;  // of a file in JSON, in place of the former
    pugi::xml_document document_;
    std::map<std::string, Notice> notices_;
    Progress progress_;
    std::uintmax_t total_bytes_ = 0;  // of text and files
    std::uintmax_t file_bytes_passed_ = 0;
    mutable std::uintmax_t text_passed_ = 0;  // bytes
};

/// Returns the beginning of a text for a message: up to white space or markup, shortened, and printable.
std::string xml_excerpt(std::string_view text);

}  // namespace castor
