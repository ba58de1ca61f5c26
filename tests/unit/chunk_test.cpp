// Scenes that are cut into chunks.
#include "trace/chunk.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "reference/meshes.h"
#include "reference/random_source.h"
#include "support/catch.h"
#include "trace/scene_contents.h"

namespace castor::test {
namespace {

const TreeNeeds kBoth{true, true};

/// Flat and smooth meshes with different materials, spheres, planes, degenerate triangles, and two further geometries.
Scene scene_of_many_kinds() {
    RandomSource random(91);
    Mesh smooth = bumpy_sphere(3), small = cube_grid(2);
    compute_smooth_normals(smooth);
    Scene scene =
        scene_of({random_triangles(random, 1000, 0.2f), smooth, random_triangles(random, 300, 0.1f), small, smooth});
    scene.materials.resize(5);
    for (std::uint32_t i = 0; i < 5; ++i) scene.meshes[i].material = i;
    for (std::size_t i = 0; i < 1000; i += 13) scene.meshes[0].triangles[i].y = scene.meshes[0].triangles[i].x;
    for (int i = 0; i < 300; ++i)
        scene.spheres.push_back(
            {random.in_box(-1, 1), random.uniform_float(0.01f, 0.1f), static_cast<std::uint32_t>(i % 5), 0});
    scene.planes = {{{0, -1, 0}, {0, 1, 0}, 1, 0}, {{0, 3, 0}, {0, 1, 0}, 2, 0}};
    scene.instances = {{3, Transform(0.5f), 0}, {4, Transform(0.25f), 1}, {3, Transform(0.75f), 2}};
    return scene;
}

/// All that a device sees of a primitive, but for its number.
struct Looks {
    std::vector<float> shape;  // of a triangle, with normals where there are any; or of a sphere
    std::uint32_t material;
    bool operator==(const Looks&) const = default;
};

void append(std::vector<float>& to, const glm::vec3& v) {
    to.insert(to.end(), {v.x, v.y, v.z});
}

Looks triangle_looks(const SceneArrays& arrays, std::uint32_t triangle) {
    const auto after =
        std::upper_bound(arrays.mesh_ranges.begin(), arrays.mesh_ranges.end(), triangle,
                         [](std::uint32_t t, const shared::MeshRange& range) { return t < range.first_triangle; });
    const shared::MeshRange& range = *std::prev(after);
    Looks looks{{}, range.material};
    for (int i = 0; i < 3; ++i) {
        const std::uint32_t vertex = arrays.triangle_vertices[triangle][i];
        append(looks.shape, arrays.vertex_position.at(vertex));
        if (range.first_normal != CASTOR_INVALID_INDEX)
            append(looks.shape, arrays.vertex_normal.at(range.first_normal + vertex - range.first_vertex));
    }
    return looks;
}

/// By geometry and number within it.
std::map<std::pair<std::size_t, std::uint32_t>, Looks> all_looks(const std::vector<Chunk>& chunks) {
    std::map<std::pair<std::size_t, std::uint32_t>, Looks> all;
    for (const Chunk& chunk : chunks) {
        const SceneArrays& arrays = chunk.arrays;
        for (std::size_t g = 0; g < arrays.geometries.size(); ++g) {
            const shared::Geometry& geometry = arrays.geometries[g];
            const auto add = [&](std::uint32_t place, std::uint32_t number_of_whole, Looks looks) {
                const std::uint32_t number =
                    chunk.primitive_numbers.empty() ? number_of_whole : chunk.primitive_numbers.at(place);
                CAPTURE(g, place, number);
                REQUIRE(all.try_emplace({g, number}, std::move(looks)).second);
            };
            for (std::uint32_t i = 0; i < geometry.triangle_count; ++i) {
                const std::uint32_t triangle = geometry.first_triangle + i;
                if (arrays.triangle_vertices[triangle].x == arrays.triangle_vertices[triangle].y) continue;
                add(triangle, i, triangle_looks(arrays, triangle));
            }
            for (std::uint32_t i = 0; i < geometry.sphere_count; ++i) {
                const std::uint32_t sphere = geometry.first_sphere + i;
                const glm::vec4 shape = arrays.sphere_center_radius.at(sphere);
                add(static_cast<std::uint32_t>(arrays.triangle_count()) + sphere, geometry.triangle_count + i,
                    {{shape.x, shape.y, shape.z, shape.w}, arrays.sphere_material.at(sphere)});
            }
        }
        const auto first_plane = static_cast<std::uint32_t>(arrays.triangle_count() + arrays.sphere_count());
        for (std::uint32_t i = 0; i < arrays.plane_count(); ++i) {
            const shared::Geometry& geometry = arrays.geometries.front();
            const std::uint32_t number = chunk.primitive_numbers.empty()
                                             ? geometry.triangle_count + geometry.sphere_count + i
                                             : chunk.primitive_numbers.at(first_plane + i);
            REQUIRE(all.try_emplace({0, number}, Looks{{}, arrays.plane_material[i]}).second);
        }
    }
    return all;
}

std::vector<Chunk> chunks_of(const Scene& scene, std::uint64_t column_bytes,
                             TreeQuality quality = TreeQuality::medium) {
    return build_scene(scene, {StrategyChoice::all(Strategy::wide), StrategyChoice::all(Strategy::simt)}, quality,
                       {column_bytes})
        .chunks;
}

}  // namespace

TEST_CASE("a scene that is cut has every primitive once, as it was", "[chunks]") {
    const Scene scene = scene_of_many_kinds();
    const std::vector<Chunk> whole = chunks_of(scene, ChunkLimits::kUnlimited);
    REQUIRE(whole.size() == 1);
    REQUIRE(whole.front().primitive_numbers.empty());
    const auto expected = all_looks(whole);
    std::size_t fewer = 10'000;
    for (const std::uint64_t limit : {1000u, 5000u, 30'000u, 60'000u}) {
        CAPTURE(limit);
        for (const TreeQuality quality : {TreeQuality::medium, TreeQuality::high}) {
            const std::vector<Chunk> chunks = chunks_of(scene, limit, quality);
            CHECK(all_looks(chunks) == expected);
            if (quality == TreeQuality::high) continue;
            CHECK(chunks.size() > 1);
            CHECK(chunks.size() < fewer);
            fewer = chunks.size();
        }
    }
}

TEST_CASE("columns of the same things have the same number of elements", "[chunks]") {
    const Scene scene = scene_of_many_kinds();
    for (const std::uint64_t limit : {ChunkLimits::kUnlimited, std::uint64_t{5000}})
        for (const Chunk& chunk : chunks_of(scene, limit)) {
            std::map<std::string, std::size_t> counts;
#define CASTOR_CHECK_COUNT(name, host, device, per, place, made, trace, surface)     \
    {                                                                                \
        const std::size_t count = CASTOR_COLUMN_OF_CHUNK_##made(chunk, name).size(); \
        CAPTURE(#name, #per, limit);                                                 \
        CHECK(counts.try_emplace(#per, count).first->second == count);               \
    }
            CASTOR_SCENE_COLUMNS(CASTOR_CHECK_COUNT)
#undef CASTOR_CHECK_COUNT
            CHECK(counts.at("compact_tree") == counts.at("geometry"));
            CHECK(counts.at("wide_tree") == counts.at("geometry"));
            if (counts.at("primitive") > 0)
                CHECK(counts.at("primitive") == counts.at("triangle") + counts.at("sphere") + counts.at("plane"));
        }
}

TEST_CASE("chunks keep to the limits, number ascending, and share what is not cut", "[chunks]") {
    const Scene scene = scene_of_many_kinds();
    const std::vector<Chunk> whole = chunks_of(scene, ChunkLimits::kUnlimited);
    for (const std::uint64_t limit : {300u, 5000u, 20'000u}) {
        CAPTURE(limit);
        const std::vector<Chunk> chunks = chunks_of(scene, limit);
        for (std::size_t i = 0; i < chunks.size(); ++i) {
            CAPTURE(i);
            const Chunk& chunk = chunks[i];
            for_each_cut_column(chunk, [&](const char* name, const auto& column) {
                CAPTURE(name);
                CHECK(column.size() * sizeof column[0] <= limit);
            });
            CHECK(chunk.arrays.plane_count() == (i == 0 ? 2 : 0));
            CHECK(chunk.arrays.instances.size() == (i == 0 ? whole.front().arrays.instances.size() : 0));
            CHECK(chunk.arrays.materials.size() == (i == 0 ? 5 : 0));
            CHECK((chunk.has_wide && chunk.has_compressed));
            REQUIRE(chunk.arrays.geometries.size() == whole.front().arrays.geometries.size());
            for (std::size_t g = 0; g < chunk.arrays.geometries.size(); ++g) {
                const shared::Geometry& geometry = chunk.arrays.geometries[g];
                CHECK(geometry.largest_coordinate == whole.front().arrays.geometries[g].largest_coordinate);
                const auto triangles = chunk.primitive_numbers.begin() + geometry.first_triangle;
                CHECK(std::is_sorted(triangles, triangles + geometry.triangle_count));
                const auto spheres = chunk.primitive_numbers.begin() +
                                     static_cast<std::ptrdiff_t>(chunk.arrays.triangle_count()) + geometry.first_sphere;
                CHECK(std::is_sorted(spheres, spheres + geometry.sphere_count));
            }
        }
    }
}

TEST_CASE("a chunk that is cut again is as if it was cut at once", "[chunks]") {
    const Scene scene = scene_of_many_kinds();
    const auto expected = all_looks(chunks_of(scene, ChunkLimits::kUnlimited));
    SceneContents built = build_scene(scene, {StrategyChoice::all(Strategy::wide)}, TreeQuality::medium, {20'000});
    const std::size_t before = built.chunks.size();
    const ChunkLimits smaller{5'000};
    CHECK_FALSE(fits(built, kBoth, TreeQuality::medium, smaller));
    cut_to_fit(built, kBoth, TreeQuality::medium, smaller);
    CHECK(fits(built, kBoth, TreeQuality::medium, smaller));
    CHECK(built.chunks.size() > before);
    CHECK(all_looks(built.chunks) == expected);
    CHECK((built.has_wide() && built.has_compressed()));
    CHECK(built.arrays().instances.size() == 6);  // with instance 0, and both meshes as they stand themselves
}

TEST_CASE("a device's memory limits a chunk only where it does not hold the scene", "[chunks]") {
    const ChunkLimits limits{.column_bytes = 1000, .scene_bytes = 4000};
    CHECK(chunks_needed({900, 4000}, 4000, limits) == 1);
    CHECK(chunks_needed({900, 4001}, 4001, limits) == 5);  // a fourth each, nine tenths full
    CHECK(chunks_needed({900, 1000}, 8000, limits) == 1);  // of a larger scene
    CHECK(chunks_needed({900, 1001}, 8000, limits) == 2);
    CHECK(chunks_needed({1001, 2000}, 2000, limits) == 2);
    CHECK(chunks_needed({10'000, 20'000}, 20'000, {}) == 1);
    Device device;
    device.max_allocation_bytes = 7;
    device.global_memory_bytes = std::uint64_t{4} << 30;
    CHECK(limits_of(device).column_bytes == 7);
    CHECK(limits_of(device).scene_bytes == (std::uint64_t{4} << 30) - (256u << 20));
    Device little = device;
    little.max_allocation_bytes = 9;
    little.global_memory_bytes = 100;
    CHECK(limits_of(little).scene_bytes == 50);
    CHECK(limits_of({device, little}).column_bytes == 7);
    CHECK(limits_of({device, little}).scene_bytes == 50);
}

}  // namespace castor::test
