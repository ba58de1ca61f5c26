#include "scene/material_variants.h"

namespace castor {

std::uint32_t MaterialVariants::find(const MaterialUse& use) {
    if (use.textures.empty() && use.emission == glm::vec3(0.0f)) return use.material;
    const auto index = static_cast<std::uint32_t>(materials_.size());
    const Key key{use.material, use.textures, {use.emission.x, use.emission.y, use.emission.z}};
    const auto [known, is_new] = variants_.emplace(key, index);
    if (!is_new) return known->second;
    Material variant = materials_[use.material];
    if (!use.textures.empty()) variant.textures = use.textures;
    variant.emission += use.emission;
    materials_.push_back(std::move(variant));
    uses_.emplace(index, use);
    return index;
}

MaterialUse MaterialVariants::use_of(std::uint32_t index) const {
    const auto found = uses_.find(index);
    return found == uses_.end() ? MaterialUse{index} : found->second;
}

}  // namespace castor
