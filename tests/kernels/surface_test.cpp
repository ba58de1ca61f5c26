#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "castor/shared/types.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

using glm::dvec3;
using glm::vec3;
using glm::vec4;

/// The first mesh, flat.
shared::MeshRange flat_range(cl_uint material) {
    return {0, 0, CASTOR_INVALID_INDEX, material, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX, {}};
}

/// A scene's columns and rays that met it.
struct Columns {
    std::vector<vec3> positions{vec3(0)}, normals{vec3(0)};
    std::vector<glm::uvec3> triangles{glm::uvec3(0)};
    std::vector<shared::MeshRange> ranges;
    std::vector<vec4> sphere{vec4(0, 0, 0, 1)}, plane_normal{vec4(0, 0, 1, 0)};
    std::vector<cl_uint> sphere_material{7}, plane_material{8};
    std::vector<cl_uint> numbers;  // within the geometry; none: they are the columns'
    std::vector<shared::Instance> instances{shared::Instance{}};
    std::vector<shared::Ray> rays;
    std::vector<shared::Hit> hits;

    void add_hit(cl_uint primitive, float u, float v, const shared::Ray& ray = make_ray({0, 0, 0}, {0, 0, 1}),
                 float t = 1) {
        hits.push_back({t, u, v, primitive, 0});
        rays.push_back(ray);
    }
};

struct Result {
    vec3 position;
    float material;
    vec3 normal;
    float unused;
};

std::vector<Result> run(const Columns& columns) {
    shared::TraceParams params{};
    params.mesh_count = static_cast<cl_uint>(columns.ranges.size());
    params.triangle_count = static_cast<cl_uint>(columns.triangles.size());
    params.sphere_count = params.plane_count = 1;
    params.number_count = static_cast<cl_uint>(columns.numbers.size());
    shared::Geometry geometry{};
    geometry.triangle_count = params.triangle_count;
    geometry.sphere_count = 1;
    KernelFixture fixture;
    return fixture.run<Result>("surface_test", columns.hits.size(), params, columns.positions, columns.triangles,
                               columns.normals, columns.ranges, columns.sphere, columns.sphere_material,
                               columns.plane_normal, columns.plane_material, std::vector{geometry}, columns.instances,
                               columns.numbers, columns.rays, columns.hits);
}

double distance(vec3 found, dvec3 expected) {
    return glm::length(dvec3(found) - expected);
}

}  // namespace

TEST_CASE("flat triangles have their geometric normal, however small, large or thin", "[kernels][oclgrind]") {
    RandomSource random(45);
    Columns columns;
    columns.positions.clear();
    columns.triangles.clear();
    columns.ranges = {flat_range(3)};
    for (cl_uint i = 0; i < test_size(2000); ++i) {
        const float scales[] = {1, 1e-30f, 1e-18f, 1e6f, 1e11f};
        const vec3 a = random.in_box(-1, 1), e = random.in_box(-1, 1);
        const vec3 f = i % 2 ? random.in_box(-1, 1) : e + random.direction() * 1e-3f;  // thin
        for (vec3 p : {a, a + e, a + f}) columns.positions.push_back(p * scales[i % 5]);
        columns.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
        columns.add_hit(i, 0.25f, 0.5f);
    }
    const auto found = run(columns);
    for (std::size_t i = 0; i < found.size(); ++i) {
        const dvec3 p0(columns.positions[3 * i]), p1(columns.positions[3 * i + 1]), p2(columns.positions[3 * i + 2]);
        const dvec3 normal = glm::cross(p1 - p0, p2 - p0);
        // The edges are rounded, by half an ulp of each: what that turns the normal depends on the triangle's angle.
        const double condition = glm::length(p1 - p0) * glm::length(p2 - p0) / glm::length(normal);
        CAPTURE(i, to_text(columns.positions[3 * i]), to_text(columns.positions[3 * i + 1]),
                to_text(columns.positions[3 * i + 2]), condition);
        REQUIRE(distance(found[i].normal, glm::normalize(normal)) <= (8 * condition + 8) * 0x1p-24);
        const dvec3 position = 0.25 * p0 + 0.25 * p1 + 0.5 * p2;
        const double size = glm::length(p0) + glm::length(p1) + glm::length(p2);
        REQUIRE(distance(found[i].position, position) <= 4 * 0x1p-24 * size);
        REQUIRE(found[i].material == 3.0f);
    }
}

TEST_CASE("smooth triangles interpolate their normals, each mesh its own", "[kernels][oclgrind]") {
    Columns columns;
    // Two meshes of two triangles: the first is flat, the second has normals.
    columns.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}};
    columns.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
    columns.ranges = {flat_range(1), {2, 4, 0, 2, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX, {}}};
    columns.normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
    columns.add_hit(1, 0.25f, 0.25f);
    columns.add_hit(2, 0.0f, 0.0f);
    columns.add_hit(2, 1.0f, 0.0f);
    columns.add_hit(2, 0.25f, 0.5f);
    columns.add_hit(3, 0.0f, 1.0f);  // a corner whose normal is zero: the triangle's own
    const auto found = run(columns);
    CHECK(found[0].normal == vec3(0, 0, 1));
    CHECK(found[0].material == 1.0f);
    CHECK(found[0].position == vec3(0.25f, 0.5f, 0));
    CHECK(found[1].normal == vec3(1, 0, 0));
    CHECK(found[1].material == 2.0f);
    CHECK(found[2].normal == vec3(0, 1, 0));
    CHECK(distance(found[3].normal, glm::normalize(dvec3(0.25, 0.25, 0.5))) < 0x1p-22);
    CHECK(found[4].normal == vec3(0, 0, 1));
    CHECK(found[4].position == vec3(0, 1, 5));
}

TEST_CASE("spheres and planes have outward normals, and points on themselves", "[kernels][oclgrind]") {
    Columns columns;
    columns.ranges = {flat_range(0)};
    columns.sphere = {vec4(1, 2, 3, 2)};
    columns.plane_normal = {vec4(0, 1, 0, 0)};
    // Next to the sphere by some roundings: the point is put back onto it.
    columns.add_hit(1, 0, 0, make_ray({1, 2, 6}, {0, 0, -1}), 0.9999f);
    columns.add_hit(1, 0, 0, make_ray({1, 2, 3}, {1, 0, 0}), 2.0f);  // from inside
    columns.add_hit(2, 0, 0, make_ray({0, 4, 0}, {1, -2, 0}), 2.0f);
    columns.add_hit(2, 0, 0, make_ray({0, -4, 0}, {0, 2, 0}), 2.0f);  // from below: not turned
    const auto found = run(columns);
    CHECK(found[0].position == vec3(1, 2, 5));
    CHECK(found[0].normal == vec3(0, 0, 1));
    CHECK(found[0].material == 7.0f);
    CHECK(found[1].position == vec3(3, 2, 3));
    CHECK(found[1].normal == vec3(1, 0, 0));
    CHECK(found[2].position == vec3(2, 0, 0));
    CHECK(found[2].normal == vec3(0, 1, 0));
    CHECK(found[2].material == 8.0f);
    CHECK(found[3].normal == vec3(0, 1, 0));
}

}  // namespace castor::test
