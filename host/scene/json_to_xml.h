#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace castor {

/// The XML text that says the same as a JSON text, and the lines of the latter.
struct XmlFromJson {
    struct Place {
        std::size_t offset;  // in `text`; from here to the next place
        std::size_t line;    // of the JSON text
    };
    std::string text;
    std::vector<Place> places;  // by offset; the first is at 0
};

/// Turns a scene in JSON into XML, as the courses of 2025 turned XML into JSON: an object is an element, keys that
/// begin with an underscore are attributes, `_data` is the text beside attributes, and an array repeats its element.
/// Values are strings; numbers, true and false are taken as what they say, null as nothing, and an array of numbers as
/// their list. Throws SceneError with the line for what is no JSON, a key twice in one object, a name that no element
/// can have, an array in an array, and objects nested more than 100 deep. `file` is for messages.
XmlFromJson json_to_xml(std::string_view json, const std::string& file);

}  // namespace castor
