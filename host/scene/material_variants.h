#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <tuple>
#include <vector>

#include "castor/scene.h"

namespace castor {

/// A material as an object uses it: with the object's textures, and with the radiance of a lamp.
struct MaterialUse {
    std::uint32_t material = 0;  // index in Scene::materials
    std::vector<std::uint32_t> textures{};
    glm::vec3 emission{0.0f};
};

/// The variants of materials that objects need: one for each material with the same textures and emission. They are
/// appended to the scene's materials.
class MaterialVariants {
public:
    explicit MaterialVariants(std::vector<Material>& materials) : materials_(materials) {}

    /// Returns the index of the variant. A use without textures and emission is the material itself.
    std::uint32_t find(const MaterialUse& use);
    /// Returns the use for which `find` returned the index.
    MaterialUse use_of(std::uint32_t index) const;

private:
    using Key = std::tuple<std::uint32_t, std::vector<std::uint32_t>, std::array<float, 3>>;

    std::vector<Material>& materials_;
    std::map<Key, std::uint32_t> variants_;
    std::map<std::uint32_t, MaterialUse> uses_;
};

}  // namespace castor
