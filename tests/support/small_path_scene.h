#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "castor/scene.h"
#include "reference/random_source.h"
#include "scene/principled.h"
#include "support/picture.h"

namespace castor::test {

/// A scene that shows much of what path tracing has in few pixels: principled materials with textures, one of them in
/// part transparent, a pane, rough glass, a ball that scatters light within, a sky that is sampled by its picture, a
/// lamp that is a mesh and its instance, a point light, and a material of the scene format.
inline Scene small_path_scene() {
    using reference::RandomSource;
    RandomSource random(7);
    Scene scene;
    Image sky{"", 8, 4};
    for (int i = 0; i < 3 * 8 * 4; ++i) sky.floats.push_back(random.uniform_float(0, i / 3 == 11 ? 900.0f : 60.0f));
    scene.images = {sky};
    const auto add_texture = [&](std::uint32_t size, TextureFilter filter) {
        Image image{"", size, size};
        for (std::uint32_t i = 0; i < 3 * size * size; ++i)
            image.bytes.push_back(static_cast<std::uint8_t>(random.below(256)));
        for (std::uint32_t i = 0; i < size * size; ++i)
            image.alpha.push_back(static_cast<std::uint8_t>(random.below(256)));
        Texture texture;
        texture.target = TextureTarget::principled;
        texture.filter = filter;
        texture.image = static_cast<std::uint32_t>(scene.images.size());
        scene.images.push_back(image);
        scene.textures.push_back(texture);
        return static_cast<std::uint32_t>(scene.textures.size() - 1);
    };
    const std::uint32_t colors = add_texture(16, TextureFilter::trilinear),
                        numbers = add_texture(5, TextureFilter::bilinear);
    PrincipledMaterial all;
    all.metallic = 0.3f;
    all.base_color_texture = all.emissive_texture = colors;
    all.metallic_roughness_texture = all.normal_texture = all.specular_texture = numbers;
    all.emissive = glm::vec3(0.1f);
    all.alpha_mode = AlphaMode::blend;
    all.clearcoat = all.iridescence = all.anisotropy = all.diffuse_roughness = 0.5f;
    all.clearcoat_normal_texture = numbers;
    all.sheen_color = glm::vec3(0.4f);
    PrincipledMaterial leaf;
    leaf.base_color = {0.3f, 0.8f, 0.2f};
    leaf.metallic = 0.0f;
    leaf.diffuse_transmission = 0.5f;
    leaf.alpha_mode = AlphaMode::mask;
    leaf.base_color_texture = colors;
    PrincipledMaterial bottle;
    bottle.metallic = 0.0f;
    bottle.roughness = 0.3f;
    bottle.transmission = bottle.thickness = bottle.dispersion = 1.0f;
    bottle.attenuation_color = {0.5f, 0.9f, 0.6f};
    bottle.attenuation_distance = 1.0f;
    PrincipledMaterial pane = bottle;
    pane.thickness = pane.roughness = pane.dispersion = 0.0f;
    pane.base_color = {0.9f, 0.8f, 0.6f};
    PrincipledMaterial milk = bottle;
    milk.dispersion = 0.0f;
    milk.multiscatter_color = {0.8f, 0.4f, 0.6f};
    milk.scattering_anisotropy = 0.3f;
    PrincipledMaterial lamp;
    lamp.emissive = {3, 2, 1};
    const auto number_of = [&](const PrincipledMaterial& principled) {
        Material material;
        material.principled = principled;
        return add_material(scene, material);
    };
    Mesh wall = rectangle({0, 0, -3}, {2, 0, 0}, {0, 2, 0}, number_of(all));
    wall.texture_coordinates = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    wall.colors = {{1, 1, 1, 1}, {0.5f, 1, 1, 1}, {1, 0.5f, 1, 0.5f}, {1, 1, 0.5f, 1}};
    Mesh curtain = rectangle({0.4f, 0.2f, -2}, {0.6f, 0, 0}, {0, 0.6f, 0}, number_of(leaf));
    curtain.texture_coordinates = wall.texture_coordinates;
    const std::uint32_t of_lamp = number_of(lamp), classic = add_material(scene, diffuse_material(glm::vec3(0.5f)));
    scene.meshes = {wall, curtain, rectangle({0, 1.8f, -2}, {1, 0, 0}, {0, 0, 1}, of_lamp),
                    rectangle({0, 0.9f, -2}, {2, 0, 0}, {0, 0, 1}, number_of(pane)),
                    rectangle({0, -1, -2}, {2, 0, 0}, {0, 0, -2}, classic)};
    scene.spheres = {{{-0.5f, -0.4f, -2}, 0.5f, number_of(bottle), 0},
                     {{0.5f, -0.5f, -1.8f}, 0.4f, number_of(milk), 0}};
    Transform placed(0.2f);
    placed[3] = {-0.9f, 0.3f, -1.8f};
    scene.instances = {{2, placed, of_lamp, 0}};
    Light environment;
    environment.kind = Light::Kind::environment;
    environment.environment.sampling = EnvironmentSampling::picture;
    scene.lights = {environment, point_light({0, 0, -0.5f}, glm::vec3(100.0f))};
    add_mesh_lights(scene);
    scene.shadow_ray_epsilon = 1e-4f;
    scene.cameras = {square_camera({}, {0, 0, -1}, 0.6f, 6)};
    scene.cameras[0].path_tracing.emplace().bounces = 2;
    return scene;
}

}  // namespace castor::test
