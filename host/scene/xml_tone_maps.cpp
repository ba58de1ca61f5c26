#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

void read_gamma(XmlDocument& document, pugi::xml_node element, ToneMap& tone_map) {
    const pugi::xml_node gamma = element.child("Gamma");
    if (!gamma) return;
    tone_map.is_srgb = equals_ignoring_case(read_string(document, gamma), "sRGB");
    if (tone_map.is_srgb) return;
    tone_map.gamma = require_float(document, element, "Gamma");
    check_child(document, tone_map.gamma > 0.0f, element, "Gamma", "a positive number, or sRGB");
}

void read_options(XmlDocument& document, pugi::xml_node element, ToneMap& tone_map) {
    const pugi::xml_node options = element.child("TMOOptions");
    if (!options) return;
    const auto [key, burn_percent] = read_numbers<float, 2>(document, options);
    check_child(document, key > 0.0f && burn_percent >= 0.0f && burn_percent <= 100.0f, element, "TMOOptions",
                "a positive key, and a percentage of 0 to 100");
    tone_map.key = key;
    tone_map.burn_percent = burn_percent;
}

ToneMap read_tone_map(XmlDocument& document, pugi::xml_node element) {
    document.expect_attributes(element);
    document.expect_children(element, {"TMO", "TMOOptions", "Saturation", "Gamma", "Extension"});
    ToneMap tone_map;
    tone_map.tone_operator = read_word<ToneOperator>(document, require_child(document, element, "TMO"),
                                                     {{"Photographic", ToneOperator::photographic},
                                                      {"ACES", ToneOperator::aces},
                                                      {"Filmic", ToneOperator::filmic},
                                                      {"AgX", ToneOperator::agx}});
    read_options(document, element, tone_map);
    tone_map.saturation = read_float(document, element, "Saturation", tone_map.saturation);
    check_child(document, tone_map.saturation >= 0.0f, element, "Saturation", "a number of at least 0");
    read_gamma(document, element, tone_map);
    if (const pugi::xml_node extension = element.child("Extension")) {
        tone_map.extension = read_string(document, extension);
        check_child(document, tone_map.extension.find_first_of("/\\") == std::string::npos, element, "Extension",
                    "the end of a file name, without slashes");
    }
    return tone_map;
}

}  // namespace

std::vector<ToneMap> read_tone_maps(XmlDocument& document, pugi::xml_node camera) {
    std::vector<ToneMap> tone_maps;
    for (const pugi::xml_node element : camera.children("Tonemap"))
        tone_maps.push_back(read_tone_map(document, element));
    return tone_maps;
}

}  // namespace castor
