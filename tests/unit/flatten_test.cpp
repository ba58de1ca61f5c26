#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/scene.h"
#include "scene/scene_arrays.h"
#include "support/catch.h"

namespace castor {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kPi = 3.14159265f;

Light point_light() {
    Light light;
    light.line = 31;
    return light;
}

Light directional_light() {
    Light light;
    light.kind = Light::Kind::directional;
    light.line = 32;
    return light;
}

Light spot_light() {
    Light light;
    light.kind = Light::Kind::spot;
    light.line = 33;
    return light;
}

// One of everything, valid: the first mesh is smooth, the second is flat and a square.
Scene small_scene() {
    Scene scene;
    scene.file = "small.xml";
    scene.materials = {Material{}, Material{}};
    scene.lights = {point_light(), directional_light(), spot_light()};
    const glm::vec3 z(0.0f, 0.0f, 1.0f);
    scene.meshes.push_back({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {z, z, z}, {{0, 1, 2}}, 0, 10});
    scene.meshes.push_back({{{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}}, {}, {{0, 1, 2}, {0, 2, 3}}, 1, 20});
    scene.spheres.push_back({{1, 2, 3}, 4, 1, 40});
    scene.planes.push_back({{0, -1, 0}, {0, 2, 0}, 0, 50});
    scene.images = {{"a.png", 2, 1, {1, 2, 3, 4, 5, 6}}, {"", 1, 1, {}, {1, 2, 3}}};
    scene.textures.resize(3);
    for (std::size_t i = 0; i < 3; ++i) scene.textures[i].line = 60 + i;
    scene.textures[1].kind = TextureKind::perlin;
    scene.textures[2].target = TextureTarget::background;
    return scene;
}

struct BadScene {
    std::string what;
    std::function<void(Scene&)> damage;
    std::string reason;  // part of the message
    std::size_t line;
};

const std::vector<BadScene>& bad_scenes() {
    static const std::vector<BadScene> scenes = {
        {"vertex index", [](Scene& s) { s.meshes[1].triangles[1].y = 4; },
         "mesh 1, triangle 1: vertex index 4, but the mesh has 4 vertices", 20},
        {"largest index", [](Scene& s) { s.meshes[0].triangles[0].x = 0xffffffffu; }, "vertex index 4294967295", 10},
        {"no vertices", [](Scene& s) { s.meshes[1].positions.clear(); }, "vertex index 2, but the mesh has 0 vertices",
         20},
        {"mesh material", [](Scene& s) { s.meshes[0].material = 2; },
         "mesh 0: material index 2, but the scene has 2 materials", 10},
        {"no materials", [](Scene& s) { s.materials.clear(); }, "material index 0, but the scene has 0 materials", 10},
        {"NaN vertex", [](Scene& s) { s.meshes[1].positions[3].y = kNan; },
         "mesh 1: position of vertex 3 is (0, nan, 5)", 20},
        {"infinite vertex", [](Scene& s) { s.meshes[1].positions[0].x = -kInfinity; },
         "position of vertex 0 is (-inf, 0, 5)", 20},
        {"far vertex", [](Scene& s) { s.meshes[0].positions[1].x = 1.1e12f; }, "magnitude at most 1e+12", 10},
        {"normal count", [](Scene& s) { s.meshes[0].normals.pop_back(); }, "mesh 0: 2 normals for 3 vertices", 10},
        {"NaN normal", [](Scene& s) { s.meshes[0].normals[2].x = kNan; }, "mesh 0: normal of vertex 2 is (nan, 0, 1)",
         10},
        {"huge normal", [](Scene& s) { s.meshes[0].normals[2].x = 1e30f; }, "mesh 0: normal of vertex 2", 10},
        {"sphere material", [](Scene& s) { s.spheres[0].material = 9; }, "sphere 0: material index 9", 40},
        {"sphere center", [](Scene& s) { s.spheres[0].center.z = kNan; }, "sphere 0: center is (1, 2, nan)", 40},
        {"negative radius", [](Scene& s) { s.spheres[0].radius = -1; }, "sphere 0: radius is -1", 40},
        {"zero radius", [](Scene& s) { s.spheres[0].radius = 0; }, "radius is 0", 40},
        {"NaN radius", [](Scene& s) { s.spheres[0].radius = kNan; }, "radius is nan", 40},
        {"infinite radius", [](Scene& s) { s.spheres[0].radius = kInfinity; }, "radius is inf", 40},
        {"sphere too high",
         [](Scene& s) {
             s.spheres[0] = {{0, 9e11f, 0}, 2e11f, 0, 40};
         },
         "upper corner of the box", 40},
        {"sphere too low",
         [](Scene& s) {
             s.spheres[0] = {{0, -9e11f, 0}, 2e11f, 0, 40};
         },
         "lower corner of the box", 40},
        {"plane material", [](Scene& s) { s.planes[0].material = 2; }, "plane 0: material index 2", 50},
        {"plane point", [](Scene& s) { s.planes[0].point.x = 2e12f; }, "plane 0: point is", 50},
        {"zero plane normal", [](Scene& s) { s.planes[0].normal = glm::vec3(0); }, "plane 0: normal is (0, 0, 0)", 50},
        {"infinite plane normal", [](Scene& s) { s.planes[0].normal.y = kInfinity; }, "plane 0: normal is (0, inf, 0)",
         50},
        {"ambient", [](Scene& s) { s.materials[0].ambient.x = kNan; }, "material 0: ambient reflectance", 0},
        {"diffuse", [](Scene& s) { s.materials[1].diffuse.y = kInfinity; }, "material 1: diffuse reflectance", 0},
        {"specular", [](Scene& s) { s.materials[0].specular.z = kNan; }, "material 0: specular reflectance", 0},
        {"mirror", [](Scene& s) { s.materials[0].mirror.x = kNan; }, "material 0: mirror reflectance", 0},
        {"phong exponent", [](Scene& s) { s.materials[0].phong_exponent = kInfinity; },
         "material 0: Phong exponent is inf", 0},
        {"negative Phong exponent", [](Scene& s) { s.materials[1].phong_exponent = -1; },
         "material 1: Phong exponent is -1, expected a number of at least 0", 0},
        {"NaN Phong exponent", [](Scene& s) { s.materials[0].phong_exponent = kNan; },
         "material 0: Phong exponent is nan", 0},
        {"refraction index", [](Scene& s) { s.materials[0].refraction_index = kNan; }, "material 0: refraction index",
         0},
        {"negative refraction index", [](Scene& s) { s.materials[0].refraction_index = -1.5f; },
         "material 0: refraction index is -1.5", 0},
        {"negative absorption index", [](Scene& s) { s.materials[1].absorption_index = -0.25f; },
         "material 1: absorption index is -0.25", 0},
        {"absorption index", [](Scene& s) { s.materials[0].absorption_index = kNan; }, "material 0: absorption index",
         0},
        {"point light position", [](Scene& s) { s.lights[0].point.position.x = kInfinity; }, "light 0: position", 31},
        {"point light intensity", [](Scene& s) { s.lights[0].point.intensity.x = kNan; }, "light 0: intensity", 31},
        {"directional direction", [](Scene& s) { s.lights[1].directional.direction = glm::vec3(0); },
         "light 1: direction is (0, 0, 0)", 32},
        {"directional radiance", [](Scene& s) { s.lights[1].directional.radiance.z = kNan; }, "light 1: radiance", 32},
        {"spot position", [](Scene& s) { s.lights[2].spot.position.y = 1e13f; }, "light 2: position", 33},
        {"spot direction", [](Scene& s) { s.lights[2].spot.direction = glm::vec3(kNan); }, "light 2: direction", 33},
        {"spot intensity", [](Scene& s) { s.lights[2].spot.intensity.y = kInfinity; }, "light 2: intensity", 33},
        {"spot coverage", [](Scene& s) { s.lights[2].spot.coverage_radians = 6.3f; },
         "light 2: coverage angle is 6.3 radians", 33},
        {"spot NaN coverage", [](Scene& s) { s.lights[2].spot.coverage_radians = kNan; },
         "light 2: coverage angle is nan", 33},
        {"spot falloff", [](Scene& s) { s.lights[2].spot.falloff_radians = -1; }, "light 2: falloff angle is -1", 33},
        {"spot falloff of no kind", [](Scene& s) { s.lights[2].spot.falloff = static_cast<SpotFalloff>(2); },
         "light 2: falloff 2 is none of 0 and 1", 33},
        {"spot falloff above coverage", [](Scene& s) { s.lights[2].spot.falloff_radians = 1.5f; },
         "light 2: falloff angle is 1.5 radians, expected 0 to the coverage angle, 1 radians", 33},
        {"light kind", [](Scene& s) { s.lights[0].kind = static_cast<Light::Kind>(8); }, "light 0: its kind", 31},
        {"no absorption", [](Scene& s) { s.materials[0].absorption.y = -1; },
         "material 0: absorption is (0, -1, 0), expected numbers of at least 0", 0},
        {"NaN absorption", [](Scene& s) { s.materials[0].absorption.y = kNan; }, "material 0: absorption", 0},
        {"roughness", [](Scene& s) { s.materials[0].roughness = -1; }, "material 0: roughness is -1", 0},
        {"NaN roughness", [](Scene& s) { s.materials[0].roughness = kNan; }, "material 0: roughness is nan", 0},
        {"emission", [](Scene& s) { s.materials[0].emission.z = kInfinity; }, "material 0: emission", 0},
        {"BRDF", [](Scene& s) { s.materials[0].brdf = static_cast<BrdfModel>(5); }, "material 0: its BRDF", 0},
        {"material texture",
         [](Scene& s) {
             s.materials[1].textures = {0, 3};
         },
         "material 1: texture index 3, but the scene has 3 textures", 0},
        {"background on a material", [](Scene& s) { s.materials[1].textures = {2}; },
         "material 1: texture 2 is for the background", 0},
        {"texture's image", [](Scene& s) { s.textures[0].image = 2; },
         "texture 0: image index 2, but the scene has 2 images", 60},
        {"texture kind", [](Scene& s) { s.textures[0].kind = static_cast<TextureKind>(3); }, "texture 0: its kind", 60},
        {"texture target", [](Scene& s) { s.textures[0].target = static_cast<TextureTarget>(8); },
         "texture 0: its target", 60},
        {"texture filter", [](Scene& s) { s.textures[0].filter = static_cast<TextureFilter>(3); },
         "texture 0: its filter", 60},
        {"normalizer", [](Scene& s) { s.textures[0].normalizer = 0; }, "texture 0: normalizer is 0", 60},
        {"bump factor", [](Scene& s) { s.textures[0].bump_factor = kNan; }, "texture 0: bump factor is nan", 60},
        {"noise scale", [](Scene& s) { s.textures[1].noise_scale = kInfinity; }, "texture 1: noise scale is inf", 61},
        {"octaves", [](Scene& s) { s.textures[1].noise_octaves = 33; }, "texture 1: 33 octaves of noise", 61},
        {"no octaves", [](Scene& s) { s.textures[1].noise_octaves = 0; }, "texture 1: 0 octaves of noise", 61},
        {"checker colour", [](Scene& s) { s.textures[1].black.x = kNan; }, "texture 1: black", 61},
        {"checker scale", [](Scene& s) { s.textures[1].checker_scale = kNan; }, "texture 1: checker scale", 61},
        {"checker offset", [](Scene& s) { s.textures[1].checker_offset = kNan; }, "texture 1: checker offset", 61},
        {"empty image", [](Scene& s) { s.images[0].width = 0; }, "image 0 (a.png): its size is 0 x 1", 0},
        {"short image", [](Scene& s) { s.images[0].bytes.pop_back(); },
         "image 0 (a.png): 5 values for 2 x 1 texels of 3, expected 6", 0},
        {"huge image", [](Scene& s) { s.images[0].width = s.images[0].height = 0xffffffffu; }, "image 0", 0},
        {"no image", [](Scene& s) { s.images[0].bytes.clear(); }, "image 0 (a.png): it has neither bytes nor floats",
         0},
        {"two images", [](Scene& s) { s.images[0].floats.resize(6); }, "image 0 (a.png): it has both", 0},
        {"NaN image", [](Scene& s) { s.images[1].floats[2] = kNan; }, "image 1: value 2 is nan", 0},
        {"background texture", [](Scene& s) { s.background_texture = 3; }, "scene: texture index 3", 0},
        {"another background", [](Scene& s) { s.background_texture = 0; }, "scene: the background's texture 0", 0},
        {"texture coordinate count", [](Scene& s) { s.meshes[0].texture_coordinates.resize(2); },
         "mesh 0: 2 texture coordinates for 3 vertices", 10},
        {"texture coordinates",
         [](Scene& s) {
             s.meshes[0].texture_coordinates = {{0, 0}, {0, kNan}, {0, 0}};
         },
         "mesh 0: texture coordinates of vertex 1 are (0, nan)", 10},
        {"vertex colours",
         [](Scene& s) {
             s.meshes[0].colors = {{1, 1, 1, 1}, {1, 1, 1, 1}, {0, 1.5f, 0, 1}};
         },
         "mesh 0: colors of vertex 2 are (0, 1.5, 0, 1), expected numbers from 0 to 1", 10},
        {"mesh motion", [](Scene& s) { s.meshes[0].motion.x = kNan; }, "mesh 0: motion", 10},
        {"sphere motion", [](Scene& s) { s.spheres[0].motion.x = 2e12f; }, "sphere 0: motion", 40},
        {"instance motion",
         [](Scene& s) {
             s.instances.push_back({0, Transform(1.0f), 0, 70, {0, kNan, 0}});
         },
         "instance 0: motion", 70},
        {"area light size",
         [](Scene& s) {
             s.lights[0].kind = Light::Kind::area;
             s.lights[0].area.size = 0;
         },
         "light 0: size is 0", 31},
        {"mesh light",
         [](Scene& s) {
             s.lights[0].kind = Light::Kind::mesh;
             s.lights[0].object.object = 2;
         },
         "light 0: mesh index 2, but the scene has 2 meshes", 31},
        {"sphere light",
         [](Scene& s) {
             s.lights[0].kind = Light::Kind::sphere;
             s.lights[0].object.object = 1;
         },
         "light 0: sphere index 1, but the scene has 1 spheres", 31},
        {"environment",
         [](Scene& s) {
             s.lights[0].kind = Light::Kind::environment;
             s.lights[0].environment.image = 2;
         },
         "light 0: image index 2", 31},
        {"negative environment",
         [](Scene& s) {
             s.lights[0].kind = Light::Kind::environment;
             s.lights[0].environment.image = 1;
             s.images[1].floats.back() = -0.5f;
         },
         "light 0: its image 1: the texel in column 0, row 0 has the value -0.5, expected radiances of at least 0", 31},
        {"background", [](Scene& s) { s.background.x = kNan; }, "scene: background", 0},
        {"ambient light", [](Scene& s) { s.ambient_light.x = kInfinity; }, "scene: ambient light", 0},
        {"negative epsilon", [](Scene& s) { s.shadow_ray_epsilon = -1e-3f; }, "scene: shadow ray epsilon is -0.001", 0},
        {"NaN epsilon", [](Scene& s) { s.shadow_ray_epsilon = kNan; }, "scene: shadow ray epsilon is nan", 0},
    };
    return scenes;
}

float length(const float (&v)[3]) {
    return std::hypot(v[0], v[1], v[2]);
}

}  // namespace

TEST_CASE("attributes of vertices that a mesh has not are zero, whatever the memory held", "[flatten]") {
    Scene scene;
    scene.materials.emplace_back().principled.emplace();
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.colors.assign(3, {1, 1, 1, 1});
    scene.meshes = {mesh};
    for (int round = 0; round < 10; ++round) {
        for (std::size_t size = 16; size <= 1024; size += 16) std::vector<std::uint8_t>(size, 0xff);
        const SceneArrays arrays = flatten(scene);
        REQUIRE(arrays.vertex_attributes.size() == 3);
        for (const shared::VertexAttributes& attributes : arrays.vertex_attributes) {
            for (const float value : attributes.uv_1) CHECK(value == 0.0f);
            for (const auto value : attributes.reserved) CHECK(value == 0);
        }
    }
}

TEST_CASE("flatten names what is wrong with a scene, and where", "[flatten]") {
    for (const BadScene& bad : bad_scenes()) {
        CAPTURE(bad.what);
        Scene scene = small_scene();
        bad.damage(scene);
        try {
            flatten(scene);
            FAIL_CHECK("no error");
        } catch (const SceneError& error) {
            CHECK(error.file() == "small.xml");
            CHECK(error.line() == bad.line);
            CAPTURE(error.reason());
            CHECK(error.reason().find(bad.reason) != std::string::npos);
        }
    }
}

TEST_CASE("flatten reports the first of many bad triangles", "[flatten]") {
    Scene scene = small_scene();
    Mesh& mesh = scene.meshes[1];
    mesh.triangles.assign(100000, {0, 1, 2});
    for (std::size_t i = 31234; i < mesh.triangles.size(); i += 7) mesh.triangles[i].z = 12;
    CHECK_THROWS_WITH(flatten(scene),
                      "small.xml:20: mesh 1, triangle 31234: vertex index 12, but the mesh has 4 vertices");
}

TEST_CASE("flatten lays meshes one behind the other", "[flatten]") {
    Scene scene = small_scene();
    scene.meshes.insert(scene.meshes.begin() + 1, Mesh{{{9, 9, 9}}, {{0, 0, 1}}, {}, 0, 15});  // no triangles: left out
    const SceneArrays arrays = flatten(scene);
    REQUIRE(arrays.vertex_position.size() == 7);
    REQUIRE(arrays.vertex_normal.size() == 3);
    REQUIRE(arrays.triangle_count() == 3);
    CHECK(arrays.vertex_position[5] == glm::vec3(1, 1, 5));
    CHECK(arrays.triangle_vertices[0] == glm::uvec3(0, 1, 2));
    CHECK(arrays.triangle_vertices[1] == glm::uvec3(3, 4, 5));
    CHECK(arrays.triangle_vertices[2] == glm::uvec3(3, 5, 6));
    REQUIRE(arrays.mesh_ranges.size() == 2);
    CHECK(arrays.mesh_ranges[0].first_triangle == 0);
    CHECK(arrays.mesh_ranges[0].first_vertex == 0);
    CHECK(arrays.mesh_ranges[0].first_normal == 0);
    CHECK(arrays.mesh_ranges[0].material == 0);
    CHECK(arrays.mesh_ranges[1].first_triangle == 1);
    CHECK(arrays.mesh_ranges[1].first_vertex == 3);
    CHECK(arrays.mesh_ranges[1].first_normal == CASTOR_INVALID_INDEX);
    CHECK(arrays.mesh_ranges[1].material == 1);
    CHECK(arrays.warnings.empty());
}

TEST_CASE("flatten copies spheres, planes and globals", "[flatten]") {
    Scene scene = small_scene();
    scene.background = {1, 2, 3};
    scene.ambient_light = {4, 5, 6};
    scene.shadow_ray_epsilon = 0.25f;
    scene.max_recursion_depth = 17;
    const SceneArrays arrays = flatten(scene);
    REQUIRE(arrays.sphere_count() == 1);
    CHECK(arrays.sphere_center_radius[0] == glm::vec4(1, 2, 3, 4));
    CHECK(arrays.sphere_material[0] == 1);
    REQUIRE(arrays.plane_count() == 1);
    CHECK(arrays.plane_point[0] == glm::vec4(0, -1, 0, 0));
    CHECK(arrays.plane_normal[0] == glm::vec4(0, 1, 0, 0));
    CHECK(arrays.plane_material[0] == 0);
    CHECK(arrays.background == scene.background);
    CHECK(arrays.ambient_light == scene.ambient_light);
    CHECK(arrays.shadow_ray_epsilon == 0.25f);
    CHECK(arrays.max_recursion_depth == 17);
    CHECK(arrays.largest_coordinate() == 7.0f);  // the sphere's z + radius
}

TEST_CASE("flatten keeps every field of a material", "[flatten]") {
    Scene scene = small_scene();
    scene.materials[1] = {
        MaterialKind::dielectric,    {1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {10, 11, 12}, 13, 14, 15, {16, 17, 18}, 19, {},
        BrdfModel::torrance_sparrow, true,      true};
    const shared::Material material = flatten(scene).materials.at(1);
    const shared::Material expected = {
        {1, 2, 3},
        13,
        {4, 5, 6},
        14,
        {7, 8, 9},
        15,
        {10, 11, 12},
        CASTOR_MATERIAL_DIELECTRIC,
        {16, 17, 18},
        19,
        {},
        CASTOR_BRDF_TORRANCE_SPARROW | CASTOR_BRDF_NORMALIZED | CASTOR_BRDF_DIFFUSE_FRESNEL,
        0,
        0,
        CASTOR_INVALID_INDEX,
        1,
        CASTOR_INVALID_INDEX,
        {}};
    CHECK(std::memcmp(&material, &expected, sizeof material) == 0);

    scene.materials[1].emission = {20, 21, 22};
    const shared::Material lamp = flatten(scene).materials.at(1);
    const shared::Material expected_lamp = {{},
                                            0,
                                            {},
                                            0,
                                            {},
                                            0,
                                            {},
                                            CASTOR_MATERIAL_PLAIN,
                                            {},
                                            0,
                                            {20, 21, 22},
                                            0,
                                            0,
                                            0,
                                            CASTOR_INVALID_INDEX,
                                            1,
                                            CASTOR_INVALID_INDEX,
                                            {}};
    CHECK(std::memcmp(&lamp, &expected_lamp, sizeof lamp) == 0);

    const MaterialKind kinds[] = {MaterialKind::plain, MaterialKind::mirror, MaterialKind::conductor,
                                  MaterialKind::dielectric};
    const std::uint32_t codes[] = {CASTOR_MATERIAL_PLAIN, CASTOR_MATERIAL_MIRROR, CASTOR_MATERIAL_CONDUCTOR,
                                   CASTOR_MATERIAL_DIELECTRIC};
    for (int i = 0; i < 4; ++i) {
        CAPTURE(i);
        scene.materials[0].kind = kinds[i];
        CHECK(flatten(scene).materials.at(0).kind == codes[i]);
    }
}

TEST_CASE("flatten keeps lights in order, directions unit and cones as cosines of half angles", "[flatten]") {
    Scene scene = small_scene();
    scene.lights[0].point = {{1, 2, 3}, {4, 5, 6}};
    scene.lights[1].directional = {{1e-40f, 0, 0}, {7, 8, 9}};  // squares underflow in float
    scene.lights[2].spot = {{1, 1, 1}, {3e38f, 3e38f, 0}, {2, 2, 2}, 2.0f * kPi / 3.0f, kPi / 2.0f};
    const SceneArrays arrays = flatten(scene);
    REQUIRE(arrays.lights.size() == 3);
    const shared::Light &point = arrays.lights[0], &directional = arrays.lights[1], &spot = arrays.lights[2];
    CHECK(point.kind == CASTOR_LIGHT_POINT);
    CHECK(point.position[2] == 3.0f);
    CHECK(point.intensity[0] == 4.0f);
    CHECK(directional.kind == CASTOR_LIGHT_DIRECTIONAL);
    CHECK(directional.direction[0] == 1.0f);
    CHECK(directional.intensity[1] == 8.0f);
    CHECK(spot.kind == CASTOR_LIGHT_SPOT);
    CHECK(std::abs(length(spot.direction) - 1.0f) <= 1e-7f);
    CHECK(spot.intensity[2] == 2.0f);
    CHECK(std::abs(spot.cos_coverage - 0.5f) <= 1e-7f);
    CHECK(std::abs(spot.cos_falloff - std::sqrt(0.5f)) <= 1e-7f);
    CHECK(spot.mapping == CASTOR_SPOT_FOURTH_POWER);
}

TEST_CASE("flatten takes a spot light that shines all around", "[flatten]") {
    Scene scene = small_scene();
    scene.lights[2].spot.coverage_radians = scene.lights[2].spot.falloff_radians = 2.0f * kPi;
    const shared::Light light = flatten(scene).lights.at(2);
    CHECK(light.cos_coverage == -1.0f);
    CHECK(light.cos_falloff == -1.0f);
}

TEST_CASE("flatten collapses degenerate triangles and counts them", "[flatten]") {
    Scene scene = small_scene();
    scene.meshes[1].positions.push_back({1, 0, 5});        // 4: equal to vertex 1
    scene.meshes[1].positions.push_back({0.5f, 0.5f, 5});  // 5: on the diagonal
    scene.meshes[1].positions.push_back({5e11f, 0, 0});    // 6: only of a degenerate triangle
    scene.meshes[1].triangles = {{0, 1, 2}, {1, 1, 2}, {1, 4, 2}, {2, 3, 2}, {0, 5, 2}, {6, 6, 6}, {0, 2, 3}};
    const SceneArrays arrays = flatten(scene);
    const std::vector<glm::uvec3> expected = {{3, 4, 5}, {4, 4, 4}, {4, 4, 4}, {5, 5, 5},
                                              {3, 3, 3}, {9, 9, 9}, {3, 5, 6}};
    for (std::size_t i = 0; i < expected.size(); ++i) {
        CAPTURE(i);
        CHECK(arrays.triangle_vertices.at(1 + i) == expected[i]);
    }
    REQUIRE(arrays.warnings.size() == 1);
    CHECK(arrays.warnings[0].file == "small.xml");
    CHECK(arrays.warnings[0].line == 20);
    CHECK(arrays.warnings[0].text == "mesh 1: 5 of 7 triangles have no area and cannot be hit");
    CHECK(arrays.largest_coordinate() == 7.0f);
}

TEST_CASE("flatten keeps triangles whose area only float precision loses", "[flatten]") {
    Scene scene = small_scene();
    scene.spheres.clear();
    const float tiny = 1e-30f;  // squares underflow in float
    scene.meshes[0].positions = {{0, 0, 0}, {tiny, 0, 0}, {0, tiny, 0}};
    scene.meshes[1].positions = {{1e12f, 0, 0}, {-1e12f, 1, 0}, {0, -1e12f, 0}, {0, 0, 1e12f}};
    const SceneArrays arrays = flatten(scene);
    CHECK(arrays.warnings.empty());
    CHECK(arrays.triangle_vertices[0] == glm::uvec3(0, 1, 2));
    CHECK(arrays.largest_coordinate() == CASTOR_MAX_COORDINATE);
}

TEST_CASE("flatten takes an empty scene", "[flatten]") {
    const SceneArrays arrays = flatten(Scene{});
    CHECK(arrays.triangle_count() == 0);
    CHECK(arrays.sphere_count() == 0);
    CHECK(arrays.plane_count() == 0);
    CHECK(arrays.mesh_ranges.empty());
    CHECK(arrays.largest_coordinate() == 0.0f);
}

}  // namespace castor
