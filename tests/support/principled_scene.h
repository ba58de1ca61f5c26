#pragma once

#include <glm/vec3.hpp>

#include "castor/scene.h"

namespace castor::test {

inline Material material_of(const PrincipledMaterial& principled) {
    Material material;
    material.principled = principled;
    return material;
}

/// Reflects as Lambert's law says, and nothing else.
inline PrincipledMaterial matt(const glm::vec3& albedo) {
    PrincipledMaterial material;
    material.base_color = albedo;
    material.metallic = 0.0f;
    material.specular = 0.0f;
    return material;
}

/// A scene without objects, in light of this radiance from everywhere.
inline Scene empty_scene_in(float radiance) {
    Scene scene;
    Image sky{"", 1, 1};
    sky.floats = {radiance, radiance, radiance};
    scene.images = {sky};
    Light environment;
    environment.kind = Light::Kind::environment;
    environment.environment.sampling = EnvironmentSampling::cosine;
    scene.lights = {environment};
    return scene;
}

}  // namespace castor::test
