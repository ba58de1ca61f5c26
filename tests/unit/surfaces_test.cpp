#include "trace/surfaces.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <set>

#include "castor/error.h"
#include "castor/renderer.h"
#include "reference/meshes.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/picture.h"
#include "trace/chunk.h"
#include "trace/scene_contents.h"

namespace castor::test {
namespace {

/// Smooth and flat meshes, in place, moved, and mirrored by an instance and by their own transform; a sphere, an
/// ellipsoid and a plane.
Scene many_surfaces() {
    Scene scene = scene_of({moved(bumpy_sphere(3), 0.5f, {-1, 1, 0}), cube_grid(3), icosphere(1)});
    for (int i = 0; i < 4; ++i) scene.materials.emplace_back();
    compute_smooth_normals(scene.meshes[0]);
    compute_smooth_normals(scene.meshes[2]);
    scene.meshes[1].transform = Transform(0.4f);
    scene.meshes[1].transform[3] = {1.2f, 1, -0.5f};
    scene.meshes[2].transform = Transform({-0.5f, 0.1f, 0}, {0, 0.25f, 0.2f}, {0, -0.3f, 0.5f}, {1, -0.8f, 0.5f});
    scene.meshes[2].material = 1;
    const Transform mirrored({0.3f, 0.1f, 0}, {0.1f, -0.4f, 0}, {0, 0.2f, 0.3f}, {0, 0, 1});
    scene.instances = {{1, mirrored, 2, 0}};
    scene.spheres = {{{-1, -0.8f, 0}, 0.6f, 3, 0}, {{0, 0, 0}, 0.5f, 4, 0}};
    scene.spheres[1].transform = Transform({1, 0, 0.5f}, {0, 0.5f, 0}, {0, 0.5f, 1}, {0.1f, -1.2f, 1});
    scene.planes = {{{0, -2, 0}, {0.1f, 3, 0.2f}, 1, 0}};
    return scene;
}

/// Returns a picture's eye rays, and what they hit, by the planes of the film.
std::pair<std::vector<Ray>, std::vector<Hit>> eye_rays(const Camera& camera, const Film& film) {
    const auto plane = [&](const char* name) -> const FilmPlane& {
        return *std::find_if(film.planes.begin(), film.planes.end(), [&](const auto& p) { return p.name == name; });
    };
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    for (std::uint32_t j = 0; j < film.height; ++j)
        for (std::uint32_t i = 0; i < film.width; ++i) {
            const std::size_t pixel = j * film.width + i;
            const glm::vec3 direction(
                camera.left + (float(i) + 0.5f) * (camera.right - camera.left) / float(film.width),
                camera.top - (float(j) + 0.5f) * (camera.top - camera.bottom) / float(film.height), -camera.distance);
            rays.push_back(make_ray(camera.position, direction, 0.0f));
            hits.push_back({plane("t").values[pixel], plane("barycentric").values[2 * pixel],
                            plane("barycentric").values[2 * pixel + 1], plane("primitive").indices[pixel],
                            plane("instance").indices[pixel]});
        }
    return {rays, hits};
}

}  // namespace

TEST_CASE("surfaces of hits are those that a picture's planes show", "[surfaces]") {
    const Scene scene = many_surfaces();
    Camera camera = square_camera({0, 0, 5}, {0, 0, -1}, 0.5f, 96);
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.aovs = eye_planes();
    const Film film = renderer.render(camera, options);
    const auto [rays, hits] = eye_rays(camera, film);
    std::vector<Surface> surfaces(rays.size());
    Tracer tracer(scene, {test_device()});
    tracer.find_surfaces(rays, hits, surfaces);
    std::set<std::uint32_t> materials, instances;
    const auto at = [](const FilmPlane& plane, std::size_t i) {
        return glm::vec3(plane.values[3 * i], plane.values[3 * i + 1], plane.values[3 * i + 2]);
    };
    for (std::size_t i = 0; i < rays.size(); ++i) {
        CAPTURE(i, hits[i].instance, hits[i].primitive);
        const Surface& surface = surfaces[i];
        materials.insert(surface.material);
        instances.insert(hits[i].instance);
        for (const FilmPlane& plane : film.planes) {
            if (plane.name == "material") REQUIRE(surface.material == plane.indices[i]);
            if (surface.material == CASTOR_INVALID_INDEX) continue;
            // Some roundings to float, 6e-8 each, on the way from the camera. A sphere's normal divides that by the
            // radius.
            if (plane.name == "position")
                REQUIRE(glm::distance(surface.position, at(plane, i)) < 1e-6f * (5 + glm::length(surface.position)));
            if (plane.name == "normal") REQUIRE(glm::distance(surface.normal_shading, at(plane, i)) < 5e-5f);
        }
        if (surface.material == CASTOR_INVALID_INDEX) {
            CHECK(surface.normal_geometric == glm::vec3(0.0f));
            continue;
        }
        CHECK(glm::length(surface.normal_geometric) == Approx(1.0f));
        CHECK(glm::dot(surface.normal_geometric, surface.normal_shading) > 0.5f);
        // All is closed, and seen from outside.
        CHECK(glm::dot(surface.normal_geometric, direction_of(rays[i])) < 0.0f);
    }
    CHECK(materials == std::set<std::uint32_t>{0, 1, 2, 3, 4, CASTOR_INVALID_INDEX});
    CHECK(instances == std::set<std::uint32_t>{0, 1, 2, 3, 4, CASTOR_INVALID_INDEX});
}

TEST_CASE("normals point outward, also where a transform mirrors", "[surfaces]") {
    Scene scene = scene_of({rectangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0)});
    scene.meshes[0].normals = {{0, 0, 1}, {0, 0.6f, 0.8f}, {0, 0, 1}, {0, 0, 1}};
    const float mirrors = GENERATE(1.0f, -1.0f);
    scene.meshes[0].transform = Transform({2 * mirrors, 0, 0}, {0, 1, 0}, {0, 0.5f, 4}, {0, 0, 3});
    const Tracer tracer(scene, {test_device()});
    const std::uint32_t instance = mirrors > 0 ? 0 : 1;
    const Ray ray = make_ray({0, 0, 9}, {0, 0, -1}, 0.0f);
    const std::vector<Hit> hits = {{6, 0.5f, 0.25f, 0, instance}};
    std::vector<Surface> surfaces(1);
    tracer.find_surfaces(std::vector<Ray>{ray}, hits, surfaces);
    // The corners (-1,-1,0), (1,-1,0), (1,1,0) weigh 1/4, 1/2, 1/4.
    CHECK(surfaces[0].position == glm::vec3(mirrors, -0.5f, 3));
    CHECK(surfaces[0].normal_geometric == glm::vec3(0, 0, 1));
    // (0, 0.3, 0.9) / |...| by the inverse transpose, whose rows are those of the inverse's columns.
    const glm::vec3 expected = glm::normalize(glm::vec3(0, 0.3f, (0.9f - 0.5f * 0.3f) / 4));
    CHECK(glm::distance(surfaces[0].normal_shading, expected) < 1e-6f);
}

TEST_CASE("surfaces are the same whether a scene is cut or not", "[surfaces]") {
    const Scene scene = many_surfaces();
    const std::vector<StrategyChoice> strategies{StrategyChoice::all(Strategy::wide)};
    const SceneContents whole = build_scene(scene, strategies);
    const ChunkLimits limits{sizes_of(whole.chunks.front(), {}, TreeQuality::medium).largest_column / 5};
    const SceneContents cut = build_scene(scene, strategies, TreeQuality::medium, limits);
    REQUIRE(cut.chunks.size() > 3);
    const Ray ray = make_ray({0, 0, 9}, {0.1f, 0, -1}, 0.0f);
    const auto same = [&](const Hit& hit) {
        const Surface a = surface_of_hit(whole, ray, hit), b = surface_of_hit(cut, ray, hit);
        CAPTURE(hit.instance, hit.primitive);
        REQUIRE(a.position == b.position);
        REQUIRE(a.normal_geometric == b.normal_geometric);
        REQUIRE(a.normal_shading == b.normal_shading);
        REQUIRE(a.material == b.material);
        REQUIRE(a.material != CASTOR_INVALID_INDEX);
    };
    const auto wrong = [&](std::uint32_t primitive, std::uint32_t instance) {
        for (const SceneContents* contents : {&whole, &cut})
            CHECK_THROWS_AS(surface_of_hit(*contents, ray, {1, 0, 0, primitive, instance}), UsageError);
    };
    const auto bumpy = static_cast<std::uint32_t>(scene.meshes[0].triangles.size());
    for (std::uint32_t i = 0; i < bumpy + 2; ++i) same({3, 0.25f, 0.5f, i, 0});  // one sphere and the plane
    for (std::uint32_t i = 0; i < scene.meshes[1].triangles.size(); ++i) same({3, 0.25f, 0.5f, i, 1});
    for (std::uint32_t i = 0; i < scene.meshes[2].triangles.size(); ++i) same({3, 0.25f, 0.5f, i, 3});
    same({3, 0, 0, 0, 4});
    wrong(bumpy + 2, 0);
    wrong(static_cast<std::uint32_t>(scene.meshes[1].triangles.size()), 1);
    wrong(1, 4);
    wrong(0, 5);
    wrong(CASTOR_INVALID_INDEX, 0);
    wrong(0, CASTOR_INVALID_INDEX);
}

}  // namespace castor::test
