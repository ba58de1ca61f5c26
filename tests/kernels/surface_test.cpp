#include <algorithm>
#include <cmath>
#include <cstdint>
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

std::vector<Result> run(const Columns& columns, std::uint32_t flags = 0) {
    shared::TraceParams params{};
    params.flags = flags;
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

TEST_CASE("bent normals mirror rays to the side of the triangle from which they come", "[kernels][oclgrind]") {
    RandomSource random(46);
    Columns columns;
    columns.positions.clear();
    columns.triangles.clear();
    const cl_uint count = static_cast<cl_uint>(test_size(1000));
    for (cl_uint i = 0; i < count; ++i) {
        const vec3 a = random.in_box(-1, 1), e = random.in_box(-1, 1), f = random.in_box(-1, 1);
        const vec3 normal = glm::normalize(glm::cross(e, f)) * (i % 3 == 0 ? -1.0f : 1.0f);  // any winding
        for (const vec3& p : {a, a + e, a + f}) {
            columns.positions.push_back(p);
            columns.normals.push_back(glm::normalize(normal + 0.6f * random.direction()));
        }
        columns.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
        const float u = 0.3f, v = 0.5f;
        const vec3 point = a + u * e + v * f;
        const vec3 from = point + random.direction() * 2.0f;
        columns.add_hit(i, u, v, make_ray(from, point - from), 1.0f);
    }
    columns.normals.erase(columns.normals.begin());
    columns.ranges = {{0, 0, 0, 2, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX, {}}};
    const auto plain = run(columns), bent = run(columns, CASTOR_TRACE_BENDS_NORMALS);
    std::size_t bent_count = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const dvec3 p0(columns.positions[3 * i]), p1(columns.positions[3 * i + 1]), p2(columns.positions[3 * i + 2]);
        const shared::Ray& ray = columns.rays[i];
        const dvec3 along = glm::normalize(dvec3(ray.direction[0], ray.direction[1], ray.direction[2]));
        dvec3 up = glm::normalize(glm::cross(p1 - p0, p2 - p0));
        if (glm::dot(up, along) > 0.0) up = -up;
        const auto mirrored = [&](const vec3& normal) {
            return along - 2.0 * glm::dot(along, dvec3(normal)) * dvec3(normal);
        };
        const double least = std::min(-0.9 * glm::dot(up, along), 0.01);
        CAPTURE(i, to_text(columns.positions[3 * i]), to_text(plain[i].normal), to_text(bent[i].normal));
        CHECK(std::abs(glm::length(bent[i].normal) - 1.0f) <= 1e-6f);
        CHECK(glm::dot(mirrored(bent[i].normal), up) >= least - 1e-4);
        // Seen from behind where the triangle is, as the side of the normal says what is outside.
        const bool is_behind = glm::dot(up, dvec3(plain[i].normal)) < 0.0;
        CHECK((glm::dot(dvec3(bent[i].normal), along) > 0.0) == is_behind);
        const bool is_right = glm::dot(mirrored(plain[i].normal), up) >= least;
        if (is_right && (glm::dot(dvec3(plain[i].normal), along) > 0.0) == is_behind)
            CHECK(distance(bent[i].normal, dvec3(plain[i].normal)) <= 1e-3);
        else
            ++bent_count;
        // No further than must be: what is mirrored is lifted just above the triangle.
        const double height = glm::dot(mirrored(plain[i].normal), up);
        const double lifted = least / std::sqrt(1.0 + least * least - height * height);
        if (!is_right) CHECK(std::abs(glm::dot(mirrored(bent[i].normal), up) - lifted) <= 1e-4);
    }
    CHECK(bent_count > count / 20);
    CHECK(bent_count < count / 2);
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
