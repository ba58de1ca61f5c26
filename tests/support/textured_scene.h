#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "castor/scene.h"
#include "reference/random_source.h"
#include "support/busy_scene.h"
#include "support/picture.h"

namespace castor::test {

inline Image random_image(std::uint32_t width, std::uint32_t height) {
    RandomSource random(width);
    Image image{"", width, height, {}, {}};
    for (std::uint32_t i = 0; i < 3 * width * height; ++i)
        image.bytes.push_back(static_cast<std::uint8_t>(random.below(256)));
    return image;
}

inline std::uint32_t add_texture(Scene& scene, const Texture& texture) {
    scene.textures.push_back(texture);
    return static_cast<std::uint32_t>(scene.textures.size() - 1);
}

inline Texture image_texture(std::uint32_t image, TextureTarget target, TextureFilter filter = TextureFilter::nearest) {
    Texture texture;
    texture.image = image;
    texture.target = target;
    texture.filter = filter;
    return texture;
}

inline Texture noise_texture(TextureTarget target, std::uint32_t octaves = 1) {
    Texture texture;
    texture.kind = TextureKind::perlin;
    texture.target = target;
    texture.noise_scale = 3.0f;
    texture.noise_octaves = octaves;
    return texture;
}

inline Transform turned(float angle, const glm::vec3& scale, const glm::vec3& translation) {
    const float c = std::cos(angle), s = std::sin(angle);
    return Transform(scale.x * glm::vec3(c, 0, -s), scale.y * glm::vec3(0, 1, 0), scale.z * glm::vec3(s, 0, c),
                     translation);
}

/// All kinds of textures and targets, on all kinds of objects.
inline Scene textured_scene() {
    Scene scene = busy_scene();
    scene.images = {random_image(16, 9), random_image(5, 7), random_image(32, 32)};
    scene.images.push_back({"", 2, 2, {}, {0.5f, 0, 0, 0, 1.5f, 0, 0, 0, 0.25f, 1, 1, 1}});
    const auto add = [&](const Texture& texture) { return add_texture(scene, texture); };
    Texture clamped = image_texture(2, TextureTarget::blend_diffuse, TextureFilter::bilinear);
    clamped.wrap = TextureWrap::clamp;
    Texture floats = image_texture(3, TextureTarget::replace_specular, TextureFilter::trilinear);
    floats.normalizer = 1.0f;
    Texture checkers;
    checkers.kind = TextureKind::checkerboard;
    checkers.checker_scale = 2.0f;
    checkers.checker_offset = 0.3f;
    Texture bumps = image_texture(0, TextureTarget::bump_map, TextureFilter::bilinear);
    bumps.bump_factor = 0.01f;
    const std::vector<std::vector<std::uint32_t>> uses{
        {add(image_texture(0, TextureTarget::replace_diffuse, TextureFilter::bilinear)), add(bumps)},
        {add(clamped), add(floats), add(image_texture(1, TextureTarget::normal_map))},
        {add(noise_texture(TextureTarget::replace_diffuse, 3)), add(noise_texture(TextureTarget::bump_map))},
        {add(image_texture(1, TextureTarget::replace_all))},
        {add(checkers)},
        {add(image_texture(2, TextureTarget::replace_diffuse, TextureFilter::trilinear))}};
    std::vector<std::uint32_t> materials;
    for (const auto& textures : uses) {
        Material material = diffuse_material({0.5f, 0.4f, 0.3f});
        material.specular = glm::vec3(0.4f);
        material.phong_exponent = 20.0f;
        material.textures = textures;
        materials.push_back(add_material(scene, material));
    }
    scene.background_texture = add(image_texture(0, TextureTarget::background));
    RandomSource random(5);
    for (Mesh& mesh : scene.meshes)
        for (std::size_t i = 0; i < mesh.positions.size(); ++i)
            mesh.texture_coordinates.emplace_back(random.uniform_float(-2.0f, 3.0f), random.uniform_float(-2.0f, 3.0f));
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) scene.meshes[i].material = materials[i % materials.size()];
    scene.meshes[3].transform = turned(0.4f, {1, 1.5f, 1}, {-0.3f, 0.2f, 0.5f});
    for (std::size_t i = 0; i < scene.spheres.size(); ++i) {
        scene.spheres[i].material = materials[i % materials.size()];
        if (i % 3 == 0) scene.spheres[i].transform = turned(0.7f, {1, i % 2 ? 1.0f : 1.7f, 1}, {0.1f, 0, 0});
    }
    for (std::size_t i = 0; i < scene.instances.size(); ++i) scene.instances[i].material = materials[i % 6];
    scene.planes[0].material = materials[4];
    return scene;
}

}  // namespace castor::test
