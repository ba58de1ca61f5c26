#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <numbers>

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

/// Returns the factor of a spot light: 1 inside the falloff cone, 0 outside the coverage cone, between them a fourth
/// power or a square.
inline double spot_falloff(double cos_angle, const shared::Light& light) {
    const double cos_coverage{light.cos_coverage}, cos_falloff{light.cos_falloff};
    if (cos_angle >= cos_falloff) return 1.0;
    if (cos_angle <= cos_coverage) return 0.0;
    return std::pow((cos_angle - cos_coverage) / (cos_falloff - cos_coverage),
                    light.mapping == CASTOR_SPOT_SQUARE ? 2.0 : 4.0);
}

/// Returns the light at a point by the inverse square law; `light` must not lie at `position`.
inline LightSample sample_light(const shared::Light& light, glm::dvec3 position) {
    const glm::dvec3 intensity = to_dvec3(light.intensity), direction = to_dvec3(light.direction);
    if (light.kind == CASTOR_LIGHT_DIRECTIONAL) return {-direction, std::numeric_limits<double>::infinity(), intensity};
    const glm::dvec3 to_light = to_dvec3(light.position) - position;
    const double distance = glm::length(to_light);
    const glm::dvec3 wi = to_light / distance;
    const double falloff = light.kind == CASTOR_LIGHT_SPOT ? spot_falloff(glm::dot(-wi, direction), light) : 1.0;
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

/// What becomes of light that meets a dielectric.
struct Refraction {
    double reflectance;    // the rest is refracted
    glm::dvec3 direction;  // unit; means nothing where all is reflected
};

/// Refracts by Snell's law, with the Fresnel reflectance of unpolarised light. `wo` is unit and looks back along the
/// ray, which is inside unless wo.normal > 0. `index` is the dielectric's, against what is around it.
inline Refraction refract(double index, glm::dvec3 normal, glm::dvec3 wo) {
    const bool enters = glm::dot(wo, normal) > 0.0;
    const glm::dvec3 facing = enters ? normal : -normal;
    const double here = enters ? 1.0 : index, there = enters ? index : 1.0;
    const double c = glm::dot(wo, facing), ratio = here / there;
    const double squared = 1.0 - ratio * ratio * (1.0 - c * c);
    if (squared <= 0.0) return {1.0, glm::dvec3(0.0)};
    const double d = std::sqrt(squared);
    const double parallel = (there * c - here * d) / (there * c + here * d);
    const double perpendicular = (here * c - there * d) / (here * c + there * d);
    return {(parallel * parallel + perpendicular * perpendicular) / 2,
            glm::normalize(-wo * ratio + facing * (ratio * c - d))};
}

/// Returns the light that a material of another model than Blinn and Phong's reflects: see BrdfModel in scene.h. The
/// microfacets are those of Torrance, Sparrow 1967 with a Blinn distribution and Schlick's Fresnel term (1994).
inline glm::dvec3 brdf(const shared::Material& material, glm::dvec3 normal, glm::dvec3 wo, const LightSample& light) {
    constexpr double kPi = std::numbers::pi;
    const double l = glm::dot(normal, light.wi), v = glm::dot(normal, wo), p = material.phong_exponent;
    if (l <= 0.0) return glm::dvec3(0.0);
    const glm::dvec3 half = glm::normalize(light.wi + wo), mirrored = 2.0 * l * normal - light.wi;
    const double h = glm::dot(normal, half);
    const glm::dvec3 kd = to_dvec3(material.diffuse), ks = to_dvec3(material.specular);
    const auto lobe = [p](double cosine) { return cosine > 0.0 ? std::pow(cosine, p) : 0.0; };
    const bool is_normalized = material.brdf & CASTOR_BRDF_NORMALIZED;
    const glm::dvec3 matt = is_normalized ? kd / kPi : kd;
    switch (material.brdf & CASTOR_BRDF_MODEL_MASK) {
        case CASTOR_BRDF_MODIFIED_BLINN_PHONG:
            return light.irradiance * l * (matt + ks * lobe(h) * (is_normalized ? (p + 8) / (8 * kPi) : 1.0));
        case CASTOR_BRDF_PHONG:
            return light.irradiance * (kd * l + ks * lobe(glm::dot(mirrored, wo)));
        case CASTOR_BRDF_MODIFIED_PHONG:
            return light.irradiance * l *
                   (matt + ks * lobe(glm::dot(mirrored, wo)) * (is_normalized ? (p + 2) / (2 * kPi) : 1.0));
        default:
            break;
    }
    const double n = material.refraction_index, k = material.absorption_index, w = glm::dot(wo, half);
    const double r0 = ((n - 1) * (n - 1) + k * k) / ((n + 1) * (n + 1) + k * k);
    const double fresnel = r0 + (1 - r0) * std::pow(1 - w, 5);
    const double diffuse = (material.brdf & CASTOR_BRDF_DIFFUSE_FRESNEL ? 1 - fresnel : 1.0) / kPi;
    if (v <= 0.0) return light.irradiance * l * kd * diffuse;
    const double distribution = (p + 2) / (2 * kPi) * lobe(h);
    const double geometry = std::min({1.0, 2 * h * v / w, 2 * h * l / w});
    return light.irradiance * l * (kd * diffuse + ks * (distribution * fresnel * geometry / (4 * l * v)));
}

}  // namespace castor::reference
