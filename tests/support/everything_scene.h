#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "castor/scene.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "support/picture.h"

namespace castor::test {

/// Whatever a scene may have, in one: lights of all kinds, some of which move, glass in glass, rough metal, textures of
/// all kinds, BRDFs, instances, objects that move, and a camera with a lens.
inline Scene everything_scene() {
    RandomSource random(23);
    Scene scene;
    scene.background = {10, 20, 30};
    scene.ambient_light = glm::vec3(20);
    const auto add_image = [&](std::uint32_t width, std::uint32_t height) {
        Image image{"", width, height, {}, {}};
        for (std::uint32_t i = 0; i < 3 * width * height; ++i)
            image.bytes.push_back(static_cast<std::uint8_t>(random.below(256)));
        scene.images.push_back(image);
        return static_cast<std::uint32_t>(scene.images.size() - 1);
    };
    const auto add_texture = [&](TextureKind kind, TextureTarget target, TextureFilter filter = TextureFilter::nearest,
                                 std::uint32_t image = 0) {
        Texture texture;
        texture.kind = kind;
        texture.target = target;
        texture.filter = filter;
        texture.image = image;
        texture.noise_scale = 3.0f;
        texture.noise_octaves = 2;
        texture.checker_scale = 2.0f;
        texture.bump_factor = kind == TextureKind::image ? 0.01f : 0.3f;
        scene.textures.push_back(texture);
        return static_cast<std::uint32_t>(scene.textures.size() - 1);
    };
    const std::uint32_t small = add_image(7, 5), large = add_image(32, 32);
    using Target = TextureTarget;

    Material shiny = diffuse_material({0.5f, 0.4f, 0.3f});
    shiny.ambient = glm::vec3(0.5f);
    shiny.specular = glm::vec3(0.4f);
    shiny.phong_exponent = 20.0f;
    std::vector<std::uint32_t> materials;
    const auto add = [&](const Material& material) { materials.push_back(add_material(scene, material)); };
    for (const std::vector<std::uint32_t>& textures : std::vector<std::vector<std::uint32_t>>{
             {add_texture(TextureKind::image, Target::replace_diffuse, TextureFilter::trilinear, large),
              add_texture(TextureKind::image, Target::bump_map, TextureFilter::bilinear, large)},
             {add_texture(TextureKind::image, Target::blend_diffuse, TextureFilter::bilinear, small),
              add_texture(TextureKind::image, Target::normal_map, TextureFilter::nearest, large)},
             {add_texture(TextureKind::perlin, Target::replace_specular),
              add_texture(TextureKind::perlin, Target::bump_map)},
             {add_texture(TextureKind::checkerboard, Target::replace_diffuse)},
             {add_texture(TextureKind::image, Target::replace_all, TextureFilter::nearest, small)}}) {
        Material material = shiny;
        material.textures = textures;
        add(material);
    }
    Material phong = shiny, torrance_sparrow = shiny, metal = shiny, mirror = mirror_material(glm::vec3(0.6f));
    phong.brdf = BrdfModel::modified_phong;
    phong.brdf_normalized = true;
    torrance_sparrow.brdf = BrdfModel::torrance_sparrow;
    torrance_sparrow.diffuse_fresnel = true;
    torrance_sparrow.refraction_index = 1.4f;
    metal.kind = MaterialKind::conductor;
    metal.mirror = glm::vec3(0.8f);
    metal.refraction_index = 0.4f;
    metal.absorption_index = 2.5f;
    metal.roughness = 0.2f;
    for (const Material& material : {phong, torrance_sparrow, metal, mirror}) add(material);
    Material green, brown, lamp;
    green.kind = brown.kind = MaterialKind::dielectric;
    green.refraction_index = 1.5f;
    green.absorption = {0.8f, 0.1f, 0.8f};
    brown.refraction_index = 1.3f;
    brown.absorption = {0.1f, 0.5f, 1.0f};
    brown.roughness = 0.1f;
    lamp.emission = {60, 50, 40};
    const std::uint32_t outer = add_material(scene, green), inner = add_material(scene, brown);
    const std::uint32_t shining = add_material(scene, lamp);

    Mesh smooth = bumpy_sphere(2);
    compute_smooth_normals(smooth);
    scene.meshes = {random_triangles(random, 400, 0.25f), smooth, cube_grid(2), moved(bumpy_sphere(1), 0.3f, {2, 1, 0}),
                    moved(bumpy_sphere(1), 0.2f, {-1.5f, 1.5f, 1})};
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        Mesh& mesh = scene.meshes[i];
        mesh.material = i == 4 ? shining : materials[i];
        for (std::size_t k = 0; k < mesh.positions.size(); ++k)
            mesh.texture_coordinates.emplace_back(random.uniform_float(-2.0f, 3.0f), random.uniform_float(-2.0f, 3.0f));
    }
    scene.meshes[3].transform[3] = {0.3f, 0.2f, -0.4f};
    scene.meshes[3].motion = {0, 0.4f, 0.1f};
    scene.meshes[4].motion = {0.5f, 0, 0};
    for (std::uint32_t i = 0; i < 6; ++i) {
        Transform transform(0.3f + 0.1f * static_cast<float>(i));
        transform[3] = random.in_box(-2, 2);
        scene.instances.push_back({1 + i % 2, transform, materials[i]});
        if (i % 2) scene.instances.back().motion = random.in_box(-0.4f, 0.4f);
    }
    for (std::size_t i = 0; i < 18; ++i) {
        Sphere sphere{random.in_box(-2, 2), random.uniform_float(0.1f, 0.3f), materials[i % materials.size()], 0};
        if (i % 3 == 0) sphere.transform[1] *= 1.5f;
        if (i % 4 == 0) sphere.motion = random.in_box(-0.3f, 0.3f);
        scene.spheres.push_back(sphere);
    }
    const auto lamp_number = static_cast<std::uint32_t>(scene.spheres.size());
    for (const Sphere& sphere : {Sphere{{1, 1.5f, 1.5f}, 0.2f, shining, 0}, Sphere{{-1, 0, 2}, 0.2f, shining, 0},
                                 Sphere{{0.3f, 0, 2.5f}, 0.6f, outer, 0}, Sphere{{0.3f, 0, 2.5f}, 0.3f, inner, 0}})
        scene.spheres.push_back(sphere);
    scene.spheres[lamp_number].motion = {0, -0.3f, 0};
    scene.spheres[lamp_number + 1].transform[0] *= 2.0f;
    scene.spheres[lamp_number + 1].motion = {0, 0.3f, 0.1f};
    scene.planes = {{{0, -2, 0}, {0, 1, 0}, materials[3], 0}};

    scene.lights = {point_light({3, 4, 5}, glm::vec3(900)), directional_light({1, -2, -1}, glm::vec3(40))};
    Light spot, area, mesh, sphere, ellipsoid, environment;
    spot.kind = Light::Kind::spot;
    spot.spot = {{-3, 4, 3}, {3, -4, -3}, glm::vec3(900), 0.9f, 0.5f};
    area.kind = Light::Kind::area;
    area.area = {{0, 4, 0}, {0.2f, -1, 0}, 1.5f, {60, 70, 80}};
    mesh.kind = Light::Kind::mesh;
    mesh.object.object = 4;
    sphere.kind = ellipsoid.kind = Light::Kind::sphere;
    sphere.object.object = lamp_number;
    ellipsoid.object.object = lamp_number + 1;
    environment.kind = Light::Kind::environment;
    environment.environment = {small, EnvironmentMapping::latlong, EnvironmentSampling::cosine};
    scene.lights.insert(scene.lights.end(), {spot, area, mesh, sphere, ellipsoid, environment});
    scene.background_texture = add_texture(TextureKind::image, Target::background, TextureFilter::nearest, large);
    scene.max_recursion_depth = 3;
    Camera camera;
    camera.position = {0, 0.5f, 6};
    camera.gaze = {0, -0.05f, -1};
    camera.distance = 1.5f;
    camera.width = 28;
    camera.height = 20;
    camera.aperture_size = 0.1f;
    camera.focus_distance = 5.0f;
    scene.cameras = {camera};
    return scene;
}

}  // namespace castor::test
