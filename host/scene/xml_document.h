#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "castor/scene.h"

namespace castor {

using XmlNames = std::initializer_list<std::string_view>;

/// An XML file whose elements, attributes and text know their lines, and the warnings about it.
class XmlDocument {
public:
    /// Throws SceneError where the file cannot be read or is not well-formed.
    explicit XmlDocument(const std::filesystem::path& file);

    const std::filesystem::path& file() const { return file_; }
    pugi::xml_node root() const { return document_.document_element(); }

    /// The line of an element, or of a name, value or text of this document (a pointer into it); 0 if it is none.
    std::size_t line(pugi::xml_node element) const { return line(element.name()); }
    std::size_t line(const char* text) const;

    [[noreturn]] void fail(pugi::xml_node element, const std::string& reason) const { fail(element.name(), reason); }
    [[noreturn]] void fail(const char* text, const std::string& reason) const;

    /// Warnings of the same text become one, with the first line and the count.
    void warn(pugi::xml_node element, const std::string& text) { warn(element.name(), text); }
    void warn(const char* where, const std::string& text);

    /// Warns of child elements in neither list, which are ignored, of those in `once` that occur again, of which the
    /// first counts, and of text.
    void expect_children(pugi::xml_node element, XmlNames once, XmlNames repeated = {});
    /// Warns of child elements, which are ignored: the element holds text.
    void expect_text(pugi::xml_node element);
    /// Warns of attributes other than `id` and `known`, which are ignored.
    void expect_attributes(pugi::xml_node element, XmlNames known = {});

    /// By line.
    std::vector<Warning> warnings() const;

private:
    struct Notice {
        std::size_t line = 0;
        std::size_t count = 0;
    };

    void parse();
    void expect_single_root();
    void warn_unknown(pugi::xml_node element);
    std::size_t line_at(std::size_t offset) const;

    std::filesystem::path file_;
    std::string text_;  // parsed in place: the document points into it
    std::vector<std::size_t> line_starts_;
    pugi::xml_document document_;
    std::map<std::string, Notice> notices_;
};

/// What the file holds there, for a message: up to the next white space or markup, cut where long, printable.
std::string xml_excerpt(std::string_view text);

}  // namespace castor
