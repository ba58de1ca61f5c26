#include "scene/validate.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "base/box.h"
#include "base/vec3.h"
#include "castor/error.h"
#include "castor/shared/constants.h"
#include "image/decode.h"
#include "scene/environment_table.h"
#include "scene/placement.h"
#include "scene/scene_limits.h"
#include "scene/texture_columns.h"

namespace castor {

namespace {

// The largest number of things that 32-bit indices can count: the last index is CASTOR_INVALID_INDEX, and the count
// itself must have 32 bits, too.
constexpr std::uint64_t kMaxCount = 0xfffffffeu;
constexpr float kFullAngle = 6.28318530717958647692f;
constexpr float kMaxCoordinate = CASTOR_MAX_COORDINATE;

// An element of the scene, with the name and the line that messages give it.
struct Element {
    const Scene& scene;
    std::size_t line;
    std::string name;

    [[noreturn]] void reject(const std::string& reason) const {
        throw SceneError(scene.file, line, fmt::format("{}: {}", name, reason));
    }
};

// Returns false for NaN, too.
bool is_in_range(float x) {
    return std::abs(x) <= kMaxCoordinate;
}
bool is_in_range(const glm::vec3& v) {
    return is_in_range(v.x) && is_in_range(v.y) && is_in_range(v.z);
}

// Returns false for NaN, too.
bool is_share(float x) {
    return x >= 0.0f && x <= 1.0f;
}

// Refuses NaN, too.
void check_angle(const Element& element, float radians) {
    if (!(radians >= 0.0f && radians <= std::numbers::pi_v<float>))
        element.reject(fmt::format("angle is {} radians, expected 0 to pi", radians));
}

// Refuses NaN, too.
void check_not_negative(const Element& element, const char* what, float x) {
    if (!(x >= 0.0f && std::isfinite(x)))
        element.reject(fmt::format("{} is {}, expected a number of at least 0", what, x));
}

void check_not_negative(const Element& element, const char* what, const glm::vec3& v) {
    if (!(is_finite(v) && v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f))
        element.reject(fmt::format("{} is {}, expected numbers of at least 0", what, text(v)));
}

void check_finite(const Element& element, const char* what, const glm::vec3& v) {
    if (!is_finite(v)) element.reject(fmt::format("{} is {}, expected finite numbers", what, text(v)));
}

void check_finite(const Element& element, const char* what, float x) {
    if (!std::isfinite(x)) element.reject(fmt::format("{} is {}, expected a finite number", what, x));
}

void check_in_range(const Element& element, const char* what, const glm::vec3& v) {
    if (is_in_range(v)) return;
    element.reject(
        fmt::format("{} is {}, expected finite coordinates of magnitude at most {:g}", what, text(v), kMaxCoordinate));
}

void check_direction(const Element& element, const char* what, const glm::vec3& v) {
    check_finite(element, what, v);
    if (v == glm::vec3(0.0f)) element.reject(fmt::format("{} is (0, 0, 0), which has no direction", what));
}

void check_index(const Element& element, const char* what, std::uint32_t index, std::size_t count) {
    if (index >= count)
        element.reject(fmt::format("{} index {}, but the scene has {} {}{}", what, index, count, what,
                                   std::string_view(what).ends_with("h") ? "es" : "s"));
}

void check_material_index(const Element& element, std::uint32_t material) {
    check_index(element, "material", material, element.scene.materials.size());
}

// Returns the smallest index for which the predicate holds, or `count`, so that the message does not depend on the
// threads.
template <class Predicate>
std::size_t first_index_where(std::size_t count, const Predicate& predicate) {
    using Range = tbb::blocked_range<std::size_t>;
    constexpr std::size_t kGrain = 16384;
    const auto search = [&](const Range& range, std::size_t best) {
        for (std::size_t i = range.begin(); i != range.end() && i < best; ++i) {
            if (predicate(i)) return i;
        }
        return best;
    };
    const auto smaller = [](std::size_t a, std::size_t b) { return std::min(a, b); };
    return tbb::parallel_reduce(Range(0, count, kGrain), count, search, smaller);
}

// Checks what a mesh has one of for each vertex, or nothing. `what`: in the plural. `expected`: what `is_good` says of
// each component.
template <class Value, class IsGood>
void check_of_vertices(const Element& element, const Mesh& mesh, const char* what, const std::vector<Value>& values,
                       const IsGood& is_good, const std::string& expected) {
    if (values.empty()) return;
    if (values.size() != mesh.positions.size())
        element.reject(fmt::format("{} {} for {} vertices, expected none or one for each", values.size(), what,
                                   mesh.positions.size()));
    const std::size_t bad = first_index_where(values.size(), [&](std::size_t i) {
        for (int c = 0; c < Value::length(); ++c)
            if (!is_good(values[i][c])) return true;
        return false;
    });
    if (bad == values.size()) return;
    std::string found;
    for (int c = 0; c < Value::length(); ++c) found += fmt::format("{}{}", c == 0 ? "" : ", ", values[bad][c]);
    element.reject(fmt::format("{} of vertex {} are ({}), expected {}", what, bad, found, expected));
}

template <class Value>
void check_of_vertices(const Element& element, const Mesh& mesh, const char* what, const std::vector<Value>& values) {
    check_of_vertices(
        element, mesh, what, values, [](float x) { return is_in_range(x); },
        fmt::format("finite numbers of magnitude at most {:g}", kMaxCoordinate));
}

void check_vertices(const Element& element, const Mesh& mesh) {
    const auto& positions = mesh.positions;
    const auto& normals = mesh.normals;
    const std::size_t bad =
        first_index_where(positions.size(), [&](std::size_t i) { return !is_in_range(positions[i]); });
    if (bad < positions.size())
        check_in_range(element, fmt::format("position of vertex {}", bad).c_str(), positions[bad]);
    check_of_vertices(element, mesh, "texture coordinates", mesh.texture_coordinates);
    check_of_vertices(element, mesh, "second texture coordinates", mesh.texture_coordinates_1);
    check_of_vertices(element, mesh, "colors", mesh.colors, is_share, "numbers from 0 to 1");
    check_of_vertices(element, mesh, "tangents", mesh.tangents);
    if (normals.empty()) return;
    if (normals.size() != positions.size()) {
        element.reject(
            fmt::format("{} normals for {} vertices, expected none or one for each", normals.size(), positions.size()));
    }
    // Normals need not have length one, but their squares must not overflow.
    const std::size_t bad_normal =
        first_index_where(normals.size(), [&](std::size_t i) { return !is_in_range(normals[i]); });
    if (bad_normal < normals.size()) {
        check_in_range(element, fmt::format("normal of vertex {}", bad_normal).c_str(), normals[bad_normal]);
    }
}

void check_triangles(const Element& element, const Mesh& mesh) {
    const std::size_t vertex_count = mesh.positions.size();
    const auto largest_index = [&](std::size_t i) {
        const glm::uvec3& triangle = mesh.triangles[i];
        return std::max({triangle.x, triangle.y, triangle.z});
    };
    const std::size_t bad =
        first_index_where(mesh.triangles.size(), [&](std::size_t i) { return largest_index(i) >= vertex_count; });
    if (bad == mesh.triangles.size()) return;
    const Element triangle{element.scene, element.line, fmt::format("{}, triangle {}", element.name, bad)};
    triangle.reject(fmt::format("vertex index {}, but the mesh has {} vertices", largest_index(bad), vertex_count));
}

// The limits under which the rounding errors stay within the bounds that InstanceBounds and ray.cl assume.
constexpr double kMaxCondition = 0x1p20;
constexpr double kMaxScale = 0x1p28;

void check_transform(const Element& element, const Transform& transform, bool is_placed) {
    for (int column = 0; column < 3; ++column) check_finite(element, "column of the transform", transform[column]);
    check_in_range(element, "translation of the transform", transform[3]);
    const TransformNorms size = norms(transform);
    if (!std::isfinite(size.back))
        element.reject("the transform has no inverse: it flattens space to a plane, a line or a point");
    if (!(size.forth * size.back <= kMaxCondition))
        element.reject(fmt::format(
            "the transform stretches one direction {:.3g} times as much as another, expected at most {:.3g} times",
            size.forth * size.back, kMaxCondition));
    if (is_placed && !(size.forth <= kMaxScale && size.back <= kMaxScale))
        element.reject(fmt::format(
            "the transform scales lengths by up to {:.3g} and its inverse by up to {:.3g}, expected at most {:.3g}",
            size.forth, size.back, kMaxScale));
}

// Checks the corners of the transformed box, and where they move. `box` is not empty.
void check_placed_box(const Element& element, const Transform& transform, const glm::vec3& motion, const Box& box) {
    for (int corner = 0; corner < 8; ++corner) {
        const glm::vec3 p(corner & 1 ? box.upper[0] : box.lower[0], corner & 2 ? box.upper[1] : box.lower[1],
                          corner & 4 ? box.upper[2] : box.lower[2]);
        check_in_range(element, "a corner of the transformed box", transformed_point(transform, p));
        check_in_range(element, "a corner of the moved box", transformed_point(transform, p) + motion);
    }
}

Box box_of(const Mesh& mesh) {
    Box box;
    for (const glm::vec3& position : mesh.positions) box.extend(make_float4(position));
    return box;
}

void check_mesh(const Element& element, const Mesh& mesh) {
    check_material_index(element, mesh.material);
    check_vertices(element, mesh);
    check_triangles(element, mesh);
    check_in_range(element, "motion", mesh.motion);
    if (mesh.transform == Transform(1.0f) && mesh.motion == glm::vec3(0.0f)) return;
    check_transform(element, mesh.transform, false);
    if (!mesh.positions.empty()) check_placed_box(element, mesh.transform, mesh.motion, box_of(mesh));
}

void check_instances(const Scene& scene) {
    std::vector<Box> boxes(scene.meshes.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const MeshInstance& instance = scene.instances[i];
        const Element element{scene, instance.line, fmt::format("instance {}", i)};
        if (instance.mesh >= scene.meshes.size())
            element.reject(
                fmt::format("mesh index {}, but the scene has {} meshes", instance.mesh, scene.meshes.size()));
        check_material_index(element, instance.material);
        check_in_range(element, "motion", instance.motion);
        check_transform(element, instance.transform, true);
        const Mesh& mesh = scene.meshes[instance.mesh];
        if (mesh.positions.empty()) continue;
        Box& box = boxes[instance.mesh];
        if (box.lower[0] > box.upper[0]) box = box_of(mesh);
        check_placed_box(element, instance.transform, instance.motion, box);
    }
    const std::vector<bool> by_instance = meshes_placed_by_instances(scene);
    for (std::size_t i = 0; i < scene.meshes.size(); ++i)
        if (by_instance[i])
            check_transform({scene, scene.meshes[i].line, fmt::format("mesh {}", i)}, scene.meshes[i].transform, true);
}

void check_sphere(const Element& element, const Sphere& sphere) {
    check_material_index(element, sphere.material);
    check_in_range(element, "center", sphere.center);
    check_in_range(element, "motion", sphere.motion);
    if (!(sphere.radius > 0.0f) || !std::isfinite(sphere.radius)) {
        element.reject(fmt::format("radius is {}, expected a positive number", sphere.radius));
    }
    const Box box = sphere_box(glm::vec4(sphere.center, sphere.radius));
    check_in_range(element, "lower corner of the box (center - radius)",
                   glm::vec3(box.lower[0], box.lower[1], box.lower[2]));
    check_in_range(element, "upper corner of the box (center + radius)",
                   glm::vec3(box.upper[0], box.upper[1], box.upper[2]));
    if (sphere.transform == Transform(1.0f) && sphere.motion == glm::vec3(0.0f)) return;
    check_transform(element, sphere.transform, false);
    check_placed_box(element, sphere.transform, sphere.motion, box);
    const auto world = sphere_in_world(sphere);
    if (world && !((*world).w > 0.0f)) element.reject("the transform leaves no radius: it is too small for a number");
    if (has_own_space(element.scene, sphere))
        check_transform(element, sphere.transform, true);
    else if (!sphere_in_world(element.scene, sphere))
        check_transform(element, unit_sphere_transform(sphere), true);
}

void check_plane(const Element& element, const Plane& plane) {
    check_material_index(element, plane.material);
    check_in_range(element, "point", plane.point);
    check_direction(element, "normal", plane.normal);
}

void check_share(const Element& element, const char* what, float x) {
    if (!is_share(x)) element.reject(fmt::format("{} is {}, expected a number from 0 to 1", what, x));
}

void check_shares(const Element& element, const char* what, const glm::vec3& v) {
    if (!(is_share(v.x) && is_share(v.y) && is_share(v.z)))
        element.reject(fmt::format("{} is {}, expected numbers from 0 to 1", what, text(v)));
}

void check_principled(const Element& element, const PrincipledMaterial& m) {
    check_shares(element, "base colour", m.base_color);
    check_share(element, "alpha", m.alpha);
    check_not_negative(element, "alpha cutoff", m.alpha_cutoff);
    check_share(element, "metallic", m.metallic);
    check_share(element, "roughness", m.roughness);
    check_finite(element, "normal scale", m.normal_scale);
    check_not_negative(element, "emission", m.emissive);
    check_not_negative(element, "emissive strength", m.emissive_strength);
    check_finite(element, "emission times its strength", m.emissive_strength * m.emissive);
    if (!(m.ior == 0.0f || (m.ior >= 1.0f && std::isfinite(m.ior))))
        element.reject(fmt::format("the refraction index is {}, expected 0, or a number from 1 on", m.ior));
    check_share(element, "specular", m.specular);
    check_not_negative(element, "specular colour", m.specular_color);
    check_share(element, "transmission", m.transmission);
    check_not_negative(element, "thickness", m.thickness);
    if (!(m.attenuation_distance > 0.0f))
        element.reject(fmt::format("the attenuation distance is {}, expected more than 0", m.attenuation_distance));
    check_shares(element, "attenuation colour", m.attenuation_color);
    check_shares(element, "multiscatter colour", m.multiscatter_color);
    if (!(std::abs(m.scattering_anisotropy) < 1.0f))
        element.reject(fmt::format("the scattering anisotropy is {}, expected more than -1 and less than 1",
                                   m.scattering_anisotropy));
    check_not_negative(element, "dispersion", m.dispersion);
    check_share(element, "diffuse transmission", m.diffuse_transmission);
    check_shares(element, "diffuse transmission colour", m.diffuse_transmission_color);
    check_share(element, "diffuse roughness", m.diffuse_roughness);
    check_share(element, "clearcoat", m.clearcoat);
    check_share(element, "clearcoat roughness", m.clearcoat_roughness);
    check_shares(element, "sheen colour", m.sheen_color);
    check_share(element, "sheen roughness", m.sheen_roughness);
    check_share(element, "anisotropy", m.anisotropy);
    check_finite(element, "anisotropy rotation", m.anisotropy_rotation_radians);
    check_finite(element, "clearcoat normal scale", m.clearcoat_normal_scale);
    check_share(element, "iridescence", m.iridescence);
    if (!(m.iridescence_ior >= 1.0f && std::isfinite(m.iridescence_ior)))
        element.reject(
            fmt::format("the iridescence's refraction index is {}, expected a number from 1 on", m.iridescence_ior));
    check_not_negative(element, "iridescence thickness minimum", m.iridescence_thickness_minimum);
    check_not_negative(element, "iridescence thickness maximum", m.iridescence_thickness_maximum);
    for (const PrincipledMaterial::TextureIndex& texture :
         {m.base_color_texture, m.metallic_roughness_texture, m.normal_texture, m.emissive_texture, m.specular_texture,
          m.specular_color_texture, m.transmission_texture, m.thickness_texture, m.diffuse_transmission_texture,
          m.diffuse_transmission_color_texture, m.clearcoat_texture, m.clearcoat_roughness_texture,
          m.clearcoat_normal_texture, m.sheen_color_texture, m.sheen_roughness_texture, m.anisotropy_texture,
          m.iridescence_texture, m.iridescence_thickness_texture, m.diffuse_roughness_texture}) {
        if (!texture) continue;
        check_index(element, "texture", *texture, element.scene.textures.size());
        const Texture& used = element.scene.textures[*texture];
        if (used.target != TextureTarget::principled)
            element.reject(fmt::format("texture {} is not for principled materials", *texture));
        if (used.image < element.scene.images.size() && element.scene.images[used.image].bytes.empty())
            element.reject(fmt::format("texture {} has an image of floats, expected one of bytes", *texture));
    }
}

void check_material(const Element& element, const Material& material) {
    check_finite(element, "ambient reflectance", material.ambient);
    check_finite(element, "diffuse reflectance", material.diffuse);
    check_finite(element, "specular reflectance", material.specular);
    check_finite(element, "mirror reflectance", material.mirror);
    check_not_negative(element, "Phong exponent", material.phong_exponent);
    check_not_negative(element, "refraction index", material.refraction_index);
    check_not_negative(element, "absorption index", material.absorption_index);
    check_not_negative(element, "absorption", material.absorption);
    check_not_negative(element, "roughness", material.roughness);
    check_not_negative(element, "emission", material.emission);
    if (static_cast<unsigned>(material.brdf) > static_cast<unsigned>(BrdfModel::torrance_sparrow))
        element.reject("its BRDF is none of those that materials have");
    if (material.principled) check_principled(element, *material.principled);
    for (const std::uint32_t texture : material.textures) {
        check_index(element, "texture", texture, element.scene.textures.size());
        const TextureTarget target = element.scene.textures[texture].target;
        if (target == TextureTarget::background)
            element.reject(fmt::format("texture {} is for the background, not for materials", texture));
        if (target == TextureTarget::principled)
            element.reject(fmt::format("texture {} is for principled materials alone", texture));
    }
}

void check_image(const Element& element, const Image& image) {
    if (image.width == 0 || image.height == 0)
        element.reject(fmt::format("its size is {} x {}, expected at least one texel", image.width, image.height));
    if (image.bytes.empty() == image.floats.empty())
        element.reject(image.bytes.empty() ? "it has neither bytes nor floats" : "it has both bytes and floats");
    const std::uint64_t expected = std::uint64_t{image.width} * image.height * 3;
    const std::uint64_t found = image.bytes.empty() ? image.floats.size() : image.bytes.size();
    if (found != expected)
        element.reject(
            fmt::format("{} values for {} x {} texels of 3, expected {}", found, image.width, image.height, expected));
    if (!image.alpha.empty() && (image.bytes.empty() || image.alpha.size() * 3 != expected))
        element.reject(
            fmt::format("{} values of alpha for {} x {} texels, expected none, or one beside the bytes of "
                        "each",
                        image.alpha.size(), image.width, image.height));
    const std::size_t bad =
        first_index_where(image.floats.size(), [&](std::size_t i) { return !std::isfinite(image.floats[i]); });
    if (bad < image.floats.size())
        element.reject(fmt::format("value {} is {}, expected a finite number", bad, image.floats[bad]));
}

void check_texture(const Element& element, const Texture& texture) {
    switch (texture.kind) {
        case TextureKind::image:
            check_index(element, "image", texture.image, element.scene.images.size());
            break;
        case TextureKind::perlin:
        case TextureKind::checkerboard:
            break;
        default:
            element.reject("its kind is none of image, perlin and checkerboard");
    }
    if (static_cast<unsigned>(texture.target) > static_cast<unsigned>(TextureTarget::principled))
        element.reject("its target is none of those that textures have");
    const bool needs_image = texture.target == TextureTarget::background ||
                             texture.target == TextureTarget::normal_map || texture.target == TextureTarget::principled;
    if (needs_image && texture.kind != TextureKind::image)
        element.reject(
            "noise and checkerboards are neither backgrounds nor normal maps nor of principled materials, "
            "expected an image");
    if (texture.target == TextureTarget::bump_map && texture.kind == TextureKind::checkerboard)
        element.reject("a checkerboard has no slopes for a bump map, expected an image or noise");
    if (static_cast<unsigned>(texture.filter) > static_cast<unsigned>(TextureFilter::trilinear))
        element.reject("its filter is none of nearest, bilinear and trilinear");
    if (!(texture.normalizer > 0.0f && std::isfinite(texture.normalizer)))
        element.reject(fmt::format("normalizer is {}, expected a positive number", texture.normalizer));
    for (const TextureWrap wrap : {texture.wrap, texture.wrap_v.value_or(texture.wrap)})
        if (static_cast<unsigned>(wrap) > static_cast<unsigned>(TextureWrap::mirror))
            element.reject("its wrap is none of repeat, clamp and mirror");
    for (int i = 0; i < 3; ++i)
        check_in_range(element, "column of the transform", glm::vec3(texture.transform[i], 0.0f));
    if (texture.coordinate_set > 1)
        element.reject(fmt::format("its coordinate set is {}, expected 0 or 1", texture.coordinate_set));
    check_finite(element, "bump factor", texture.bump_factor);
    check_finite(element, "noise scale", texture.noise_scale);
    if (texture.noise_octaves < 1 || texture.noise_octaves > kMaxNoiseOctaves)
        element.reject(fmt::format("{} octaves of noise, expected 1 to {}", texture.noise_octaves, kMaxNoiseOctaves));
    check_finite(element, "black", texture.black);
    check_finite(element, "white", texture.white);
    check_finite(element, "checker scale", texture.checker_scale);
    check_finite(element, "checker offset", texture.checker_offset);
}

/// Light of a shorter range than this could not be divided by it.
void check_light_range(const Element& element, float range) {
    constexpr float kLeast = 1e-30f;
    if (!(range >= kLeast)) element.reject(fmt::format("range is {}, expected at least {:g}", range, kLeast));
}

void check_spot_light(const Element& element, const SpotLight& light) {
    check_light_range(element, light.range);
    check_in_range(element, "position", light.position);
    check_direction(element, "direction", light.direction);
    check_finite(element, "intensity", light.intensity);
    if (!(light.coverage_radians > 0.0f && light.coverage_radians <= kFullAngle)) {
        element.reject(
            fmt::format("coverage angle is {} radians, expected more than 0 and at most 2 pi", light.coverage_radians));
    }
    if (!(light.falloff_radians >= 0.0f && light.falloff_radians <= light.coverage_radians)) {
        element.reject(fmt::format("falloff angle is {} radians, expected 0 to the coverage angle, {} radians",
                                   light.falloff_radians, light.coverage_radians));
    }
    if (static_cast<unsigned>(light.falloff) > static_cast<unsigned>(SpotFalloff::square))
        element.reject(fmt::format("falloff {} is none of 0 and 1", static_cast<unsigned>(light.falloff)));
}

void check_area_light(const Element& element, const AreaLight& light) {
    check_in_range(element, "position", light.position);
    check_direction(element, "normal", light.normal);
    check_finite(element, "radiance", light.radiance);
    if (!(light.size > 0.0f && is_in_range(light.size)))
        element.reject(
            fmt::format("size is {}, expected a positive number of at most {:g}", light.size, kMaxCoordinate));
}

void check_environment(const Element& element, const EnvironmentLight& light) {
    check_index(element, "image", light.image, element.scene.images.size());
    const Image& image = element.scene.images[light.image];
    const std::size_t bad =
        first_index_where(image.floats.size(), [&](std::size_t i) { return image.floats[i] < 0.0f; });
    if (bad < image.floats.size())
        element.reject(fmt::format("its image {}{}: {}, expected radiances of at least 0", light.image,
                                   image.file.empty() ? "" : fmt::format(" ({})", image.file),
                                   describe_value(image, bad)));
}

void check_light(const Element& element, const Light& light) {
    switch (light.kind) {
        case Light::Kind::point:
            check_in_range(element, "position", light.point.position);
            check_finite(element, "intensity", light.point.intensity);
            check_light_range(element, light.point.range);
            return;
        case Light::Kind::directional:
            check_direction(element, "direction", light.directional.direction);
            check_finite(element, "radiance", light.directional.radiance);
            check_angle(element, light.directional.angle_radians);
            return;
        case Light::Kind::spot:
            check_spot_light(element, light.spot);
            return;
        case Light::Kind::area:
            check_area_light(element, light.area);
            return;
        case Light::Kind::mesh:
            check_index(element, "mesh", light.object.object, element.scene.meshes.size());
            return;
        case Light::Kind::sphere:
            check_index(element, "sphere", light.object.object, element.scene.spheres.size());
            return;
        case Light::Kind::instance:
            check_index(element, "instance", light.object.object, element.scene.instances.size());
            return;
        case Light::Kind::environment:
            check_environment(element, light.environment);
            return;
    }
    element.reject("its kind is none of those that lights have");
}

void check_globals(const Element& scene) {
    check_finite(scene, "background colour", scene.scene.background);
    check_finite(scene, "ambient light", scene.scene.ambient_light);
    const float epsilon = scene.scene.shadow_ray_epsilon;
    if (!(epsilon >= 0.0f && epsilon <= kMaxCoordinate)) {
        scene.reject(
            fmt::format("shadow ray epsilon is {}, expected a number from 0 to {:g}", epsilon, kMaxCoordinate));
    }
    if (const auto texture = scene.scene.background_texture) {
        check_index(scene, "texture", *texture, scene.scene.textures.size());
        if (scene.scene.textures[*texture].target != TextureTarget::background)
            scene.reject(fmt::format("the background's texture {} is for materials, not for the background", *texture));
    }
}

void check_counts(const Element& scene) {
    std::uint64_t vertices = 0;
    std::uint64_t primitives = scene.scene.spheres.size() + scene.scene.planes.size() +
                               1;  // the 1 is for the unit sphere that all ellipsoids share
    for (const Mesh& mesh : scene.scene.meshes) {
        vertices += mesh.positions.size();
        primitives += mesh.triangles.size();
    }
    const auto check = [&](std::uint64_t count, const char* what) {
        if (count > kMaxCount) scene.reject(fmt::format("{} {}, expected at most {}", count, what, kMaxCount));
    };
    check(vertices, "vertices");
    check(primitives, "primitives");
    check(scene.scene.materials.size(), "materials");
    check(scene.scene.images.size(), "images");
    check(scene.scene.textures.size(), "textures");
    check(scene.scene.lights.size(), "lights");
    check(scene.scene.instances.size() + scene.scene.meshes.size() + scene.scene.spheres.size(),
          "instances, meshes and spheres");
}

std::uint64_t element_count(const Mesh& mesh) {
    return mesh.triangles.size() + mesh.positions.size() + mesh.normals.size();
}

}  // namespace

std::uint64_t element_count(const Scene& scene) {
    std::uint64_t count = 0;
    for (const Mesh& mesh : scene.meshes) count += element_count(mesh);
    return count;
}

void validate(const Scene& scene, const Progress& progress) {
    ProgressCount elements_done(progress, element_count(scene));
    const Element whole{scene, 0, "scene"};
    check_counts(whole);
    check_globals(whole);
    const auto name = [](const char* kind, std::size_t i) { return fmt::format("{} {}", kind, i); };
    for (std::size_t i = 0; i < scene.images.size(); ++i) {
        const std::string& file = scene.images[i].file;
        check_image({scene, 0, name("image", i) + (file.empty() ? "" : fmt::format(" ({})", file))}, scene.images[i]);
    }
    for (std::size_t i = 0; i < scene.textures.size(); ++i) {
        check_texture({scene, scene.textures[i].line, name("texture", i)}, scene.textures[i]);
    }
    if (const std::uint64_t words = texel_words(scene); words > kMaxCount)
        whole.reject(fmt::format("its images take {} words on a device, expected at most {}", words, kMaxCount));
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        check_material({scene, 0, name("material", i)}, scene.materials[i]);
    }
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        check_light({scene, scene.lights[i].line, name("light", i)}, scene.lights[i]);
    }
    if (const std::uint64_t words = environment_table_words(scene); words > kMaxCount)
        whole.reject(fmt::format("its environments take {} words on a device, expected at most {}", words, kMaxCount));
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        check_mesh({scene, scene.meshes[i].line, name("mesh", i)}, scene.meshes[i]);
        elements_done.add(element_count(scene.meshes[i]));
    }
    check_instances(scene);
    for (std::size_t i = 0; i < scene.spheres.size(); ++i) {
        check_sphere({scene, scene.spheres[i].line, name("sphere", i)}, scene.spheres[i]);
    }
    for (std::size_t i = 0; i < scene.planes.size(); ++i) {
        check_plane({scene, scene.planes[i].line, name("plane", i)}, scene.planes[i]);
    }
}

}  // namespace castor
