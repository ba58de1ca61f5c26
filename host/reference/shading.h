#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>

#include "castor/shared/constants.h"
#include "castor/shared/types.h"

namespace castor::reference {

inline glm::dvec3 to_dvec3(const float (&v)[3]) {
    return {v[0], v[1], v[2]};
}

/// The light that arrives at a point from one light source.
struct LightSample {
    glm::dvec3 wi;    // unit, towards the light
    double distance;  // infinite for directional lights
    glm::dvec3 irradiance;
};

/// Returns the factor of a spot light: 1 inside the falloff cone, 0 outside the coverage cone, a fourth power between.
inline double spot_falloff(double cos_angle, double cos_coverage, double cos_falloff) {
    if (cos_angle >= cos_falloff) return 1.0;
    if (cos_angle <= cos_coverage) return 0.0;
    return std::pow((cos_angle - cos_coverage) / (cos_falloff - cos_coverage), 4.0);
}

/// Returns the light at a point by the inverse square law; `light` must not lie at `position`.
inline LightSample sample_light(const shared::Light& light, glm::dvec3 position) {
    const glm::dvec3 intensity = to_dvec3(light.intensity), direction = to_dvec3(light.direction);
    if (light.kind == CASTOR_LIGHT_DIRECTIONAL) return {-direction, std::numeric_limits<double>::infinity(), intensity};
    const glm::dvec3 to_light = to_dvec3(light.position) - position;
    const double distance = glm::length(to_light);
    const glm::dvec3 wi = to_light / distance;
    const double falloff = light.kind == CASTOR_LIGHT_SPOT
                               ? spot_falloff(glm::dot(-wi, direction), light.cos_coverage, light.cos_falloff)
                               : 1.0;
    return {wi, distance, intensity * (falloff / (distance * distance))};
}

/// Returns the reflected light by Blinn 1977, "Models of light reflection for computer synthesized pictures", with
/// Lambert's term. With `highlight_behind` there is a highlight even if the light is behind the surface.
inline glm::dvec3 blinn_phong(const shared::Material& material, bool highlight_behind, glm::dvec3 normal, glm::dvec3 wo,
                              const LightSample& light) {
    const double cos_light = glm::dot(normal, light.wi);
    const double cos_half = glm::dot(normal, glm::normalize(light.wi + wo));
    glm::dvec3 reflected(0.0);
    if (cos_light > 0.0) reflected += to_dvec3(material.diffuse) * cos_light;
    if ((cos_light > 0.0 || highlight_behind) && cos_half > 0.0)
        reflected += to_dvec3(material.specular) * std::pow(cos_half, double(material.phong_exponent));
    return reflected * light.irradiance;
}

/// Returns the Fresnel reflectance of a conductor for unpolarised light, by the approximation for n^2 + k^2 >> 1 (Born,
/// Wolf, Principles of Optics, §14.2).
inline double conductor_reflectance(double n, double k, double cos_angle) {
    const double s = n * n + k * k, c = cos_angle;
    const double perpendicular = (s - 2 * n * c + c * c) / (s + 2 * n * c + c * c);
    const double parallel = (s * c * c - 2 * n * c + 1) / (s * c * c + 2 * n * c + 1);
    return (perpendicular + parallel) / 2;
}

}  // namespace castor::reference
