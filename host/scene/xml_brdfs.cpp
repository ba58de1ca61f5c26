#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

struct Model {
    const char* name;
    BrdfModel model;
    const char* attribute;  // that it has beside the id; null: none
};
constexpr Model kModels[] = {
    {"OriginalBlinnPhong", BrdfModel::blinn_phong, nullptr},
    {"ModifiedBlinnPhong", BrdfModel::modified_blinn_phong, "normalized"},
    {"OriginalPhong", BrdfModel::phong, nullptr},
    {"ModifiedPhong", BrdfModel::modified_phong, "normalized"},
    {"TorranceSparrow", BrdfModel::torrance_sparrow, "kdfresnel"},
};

XmlBrdf read_brdf(XmlDocument& document, pugi::xml_node element, const Model& model) {
    if (model.attribute == nullptr)
        document.expect_attributes(element);
    else
        document.expect_attributes(element, {model.attribute});
    document.expect_children(element, {"Exponent"});
    const bool has_attribute =
        model.attribute != nullptr &&
        read_word_attribute(document, element, model.attribute, false, {{"true", true}, {"false", false}});
    const bool is_torrance_sparrow = model.model == BrdfModel::torrance_sparrow;
    XmlBrdf brdf{model.model, has_attribute && !is_torrance_sparrow, has_attribute && is_torrance_sparrow};
    brdf.exponent = read_float(document, element, "Exponent", brdf.exponent);
    check_child(document, brdf.exponent >= 0.0f, element, "Exponent", "a number of at least 0");
    return brdf;
}

}  // namespace

XmlBrdfs read_brdfs(XmlDocument& document) {
    XmlBrdfs brdfs;
    for (const pugi::xml_node container : document.root().children("BRDFs")) {
        document.expect_attributes(container);
        document.expect_children(
            container, {},
            {"OriginalBlinnPhong", "ModifiedBlinnPhong", "OriginalPhong", "ModifiedPhong", "TorranceSparrow"});
        for (const pugi::xml_node element : container.children())
            for (const Model& model : kModels) {
                if (element.name() != std::string_view(model.name)) continue;
                const std::int64_t id = require_id(document, element);
                if (!brdfs.emplace(id, read_brdf(document, element, model)).second)
                    document.warn(element, fmt::format("the BRDF id {} occurs again: materials get the first one", id));
            }
    }
    return brdfs;
}

}  // namespace castor
