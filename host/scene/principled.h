#pragma once

#include <glm/vec3.hpp>

#include "castor/scene.h"
#include "castor/shared/types.h"

namespace castor {

constexpr float kWhite = 255.0f;  // a radiance of 1 in glTF

/// Returns what surfaces of the material emit, without their texture: radiance, 255 is white. Surfaces without shading
/// emit what they show. Of light from below a clear coat, the coat takes what it reflects head-on, in all directions;
/// one with a texture takes nothing.
glm::vec3 emission_of(const Material& material);
/// Whether a mesh of the material can be a light that is sampled: all of it is there, and its radiance is not all of
/// its appearance.
bool can_be_light(const Material& material);

/// Returns a principled material as a device has it. What stands in `Material` is not in it: see to_shared in
/// flatten.cpp.
shared::PrincipledMaterial to_shared(const PrincipledMaterial& material);
/// Returns which share of light a way of length 1 inside of a solid of the material leaves, as e^-result.
glm::vec3 absorption_of(const PrincipledMaterial& material);
/// Returns which share of what is taken there goes on in another direction: the albedo of a single scattering, by that
/// of many in a medium without end (Kulla, Conty 2017, "Revisiting Physically Based Shading at Imageworks"; the fit is
/// that of KHR_materials_volume_scatter). Black where nothing is scattered.
glm::vec3 scattering_albedo_of(const PrincipledMaterial& material);

/// Makes lights of all meshes that emit, and of their instances, with a warning where these have more triangles than
/// are kept. What is no light gives light to the rays that meet it alone.
void add_mesh_lights(Scene& scene);

}  // namespace castor
