#pragma once

// Geometry and rays that trees, triangle tests and compilers get wrong.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <vector>

#include "castor/shared/constants.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "scene/scene_arrays.h"

namespace castor::reference {

using glm::vec3;
using shared::Ray;

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Makes rays about a scene in [-1, 1]^3 * scale + offset: random ones, towards corners of triangles, along axes, with
/// zeros of both signs.
inline std::vector<Ray> rays_about(const Scene& scene, RandomSource& random, std::size_t count, float scale = 1.0f,
                                   vec3 offset = vec3(0)) {
    std::vector<vec3> targets;
    for (const Mesh& mesh : scene.meshes)
        for (const glm::uvec3& t : mesh.triangles)
            targets.push_back(mesh.positions[t[static_cast<int>(targets.size() % 3)]]);
    for (const MeshInstance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[instance.mesh];
        for (std::size_t i = 0; i < mesh.positions.size(); i += 7)
            targets.push_back(instance.transform * glm::vec4(mesh.positions[i], 1));
    }
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
        vec3 origin = offset + random.in_box(-2, 2) * scale;
        vec3 direction = random.direction() * std::exp2(random.uniform_float(-3, 3));
        const std::uint32_t kind = random.below(8);
        if (kind < 4 && !targets.empty())
            direction = targets[random.below(static_cast<std::uint32_t>(targets.size()))] - origin;
        if (kind == 4)  // towards the middle
            direction = offset + random.in_box(-1, 1) * scale - origin;
        if (kind == 5 || kind == 3) direction[static_cast<int>(random.below(3))] = random.below(2) ? 0.0f : -0.0f;
        if (kind == 6) {  // along an axis, through a corner if there is one
            const int axis = static_cast<int>(random.below(3));
            direction = vec3(random.below(2) ? 0.0f : -0.0f);
            direction[axis] = random.below(2) ? 1.0f : -1.0f;
            if (!targets.empty()) {
                const vec3 target = targets[random.below(static_cast<std::uint32_t>(targets.size()))];
                for (int k = 0; k < 3; ++k)
                    if (k != axis) origin[k] = target[k];
            }
        }
        const float t_min = random.below(4) ? 0.0f : random.uniform_float(-2, 1);
        const float t_max = random.below(4) ? kInfinity : random.uniform_float(0, 3);
        rays.push_back(make_ray(origin, direction, t_min, t_max));
    }
    return rays;
}

/// Makes the shadow rays of 16 neighbours about a ray's origin: towards a point light in the scene, beside it, at the
/// origin itself or far away, or towards a sun, with directions of any length. Some end before the light, some beyond
/// it, and some are none.
inline std::vector<Ray> shadow_rays_about(const Ray& ray, RandomSource& random, float spread, float scale) {
    const vec3 origin(ray.origin[0], ray.origin[1], ray.origin[2]);
    const vec3 towards = random.direction();
    const float distances[] = {0.0f, 0.01f, 1.0f, 3.0f, 1e3f, 1e6f, 1e9f, 1e11f};
    vec3 light = origin + towards * (distances[random.below(8)] * scale);
    const std::uint32_t flat = random.below(8);  // from the first three axes on, in the light's plane or nearly
    if (flat < 3) light[static_cast<int>(flat)] = origin[static_cast<int>(flat)];
    const bool is_sun = random.below(6) == 0;
    const float sun_reach = random.below(2) ? kInfinity : std::numeric_limits<float>::max();
    const bool has_scaled = random.below(4) == 0;
    std::vector<Ray> rays;
    for (int k = 0; k < 16; ++k) {
        vec3 from = origin + random.in_box(-1, 1) * (spread * scale);
        if (flat < 3 && random.below(2)) from[static_cast<int>(flat)] = origin[static_cast<int>(flat)];
        const vec3 direction = is_sun ? towards : light - from;
        const float length = has_scaled ? std::exp2(random.uniform_float(-80, 80)) : 1.0f;
        float end = is_sun ? sun_reach : random.below(8) ? 1.0f / length : random.uniform_float(0, 2) / length;
        if (random.below(10) == 0) end = -1.0f;
        rays.push_back(make_ray(from, direction * length, 0.0f, end));
    }
    return rays;
}

/// Makes bundles of 16 neighbours about some of these rays: near enough to be traced together, far enough to diverge,
/// some from one point, some towards one point and some towards a light, now and then with a ray of another kind among
/// them.
inline std::vector<Ray> bundles_about(const std::vector<Ray>& rays, RandomSource& random, float scale) {
    std::vector<Ray> bundled;
    for (std::size_t i = 0; i + 16 <= rays.size(); i += 16) {
        const float spread = std::exp2(random.uniform_float(-12, 0));
        const vec3 origin(rays[i].origin[0], rays[i].origin[1], rays[i].origin[2]);
        const vec3 direction(rays[i].direction[0], rays[i].direction[1], rays[i].direction[2]);
        const std::uint32_t kind = random.below(5);
        std::vector<Ray> bundle;
        if (kind > 2) {
            bundle = shadow_rays_about(rays[i], random, spread, scale);
        } else {
            for (std::size_t k = 0; k < 16; ++k) {
                const vec3 moved = kind == 0 ? vec3(0) : random.in_box(-1, 1) * (spread * scale);
                const vec3 turned = kind == 1 ? -moved : random.in_box(-1, 1) * (spread * glm::length(direction));
                bundle.push_back(make_ray(origin + moved, direction + turned, rays[i].t_min, rays[i].t_max));
            }
        }
        for (std::size_t k = 0; k < 16; ++k) bundled.push_back(random.below(200) ? bundle[k] : rays[i + k]);
    }
    bundled.resize(bundled.size() - bundled.size() % 16 + (bundled.empty() ? 0 : 16 - 5),
                   bundled.empty() ? Ray{} : bundled.back());
    return bundled;
}

/// Makes a transform that rotates, scales by 2^-2 to 2^2 along each axis, may mirror, shears and translates.
inline Transform random_transform(RandomSource& random, float reach, float log_scale = 2.0f) {
    const vec3 x = random.direction(), y = glm::normalize(glm::cross(x, random.direction())), z = glm::cross(x, y);
    const auto factor = [&] {
        return std::exp2(random.uniform_float(-log_scale, log_scale)) * (random.below(4) ? 1.0f : -1.0f);
    };
    const float shear = random.below(3) ? 0.0f : random.uniform_float(-1, 1);
    const vec3 a = x * factor(), b = y * factor(), c = z * factor();
    return Transform(a, b + shear * a, c, random.in_box(-reach, reach));
}

/// Makes a scene with a mesh that is placed once, a mesh with many instances, spheres, ellipsoids, and planes if
/// wanted.
inline Scene instanced(RandomSource& random, std::size_t count, float log_scale = 2.0f) {
    Scene scene = scene_of({random_triangles(random, 60, 0.3f), random_triangles(random, 40, 0.3f), cube_grid(2)});
    scene.meshes[0].transform = random_transform(random, 0.5f, 0.5f);
    scene.meshes[2].transform =
        Transform(vec3(-0.3f, 0, 0), vec3(0, 0.3f, 0), vec3(0, 0, 0.3f), vec3(0.5f));  // mirrored
    for (std::size_t i = 0; i < count; ++i)
        scene.instances.push_back(
            {1 + static_cast<std::uint32_t>(i % 5 == 0), random_transform(random, 1.0f, log_scale), 0});
    for (int i = 0; i < 20; ++i) {
        Sphere sphere{random.in_box(-1, 1), random.uniform_float(0.05f, 0.3f), 0, 0};
        if (i % 2) sphere.transform = random_transform(random, 0.5f, log_scale);
        scene.spheres.push_back(sphere);
    }
    return scene;
}

/// Cubes placed at `distance` from the world's origin, and rays that pass a corner of a cube within about the rounding
/// error, across the axis on which it is the outermost corner. They start up to `reach` away, or near the world's
/// origin if `reach` is 0. Each ray has its distance from the cube's box in the world, in double precision: positive is
/// outside.
struct NearCorners {
    Scene scene;
    std::vector<Ray> rays;
    std::vector<double> outside;
};

inline NearCorners near_corners(RandomSource& random, std::size_t ray_count, float distance, float reach) {
    NearCorners result{scene_of({cube_grid(1)}), {}, {}};
    result.scene.meshes[0].transform[3] = vec3(-10 * distance - 10);
    for (int i = 0; i < 20; ++i) {
        Transform transform = random_transform(random, 1.0f, 1.0f);
        transform[3] = random.direction() * distance;
        transform[3][i % 3] = random.uniform_float(-2, 2);
        result.scene.instances.push_back({0, transform, 0});
    }
    const SceneArrays arrays = flatten(result.scene);
    for (std::size_t i = 0; i < ray_count; ++i) {
        const std::uint32_t number = random.below(static_cast<std::uint32_t>(result.scene.instances.size()));
        const shared::Instance& instance = arrays.instances[1 + number];
        glm::dmat3 to_object;
        glm::dvec3 moved;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) to_object[column][row] = instance.to_object[row][column];
            moved[row] = instance.to_object[row][3];
        }
        const glm::dmat3 to_world = glm::inverse(to_object);
        const int axis = static_cast<int>(number % 3);
        const double side = random.below(2) ? 1.0 : -1.0;
        glm::dvec3 corner;
        for (int k = 0; k < 3; ++k) corner[k] = side * to_world[k][axis] > 0 ? 1.0 : -1.0;
        const glm::dvec3 target = to_world * (corner - moved);
        glm::dvec3 across = reach > 0 ? glm::dvec3(random.direction()) : target;
        across[axis] = 0.0;
        const vec3 direction(glm::normalize(across));
        const double t = reach > 0 ? random.uniform(0.5, 1.0) * reach : glm::length(across);
        const double rounding = 0x1p-24 * (distance + reach) * random.uniform(-1.0, 2.0);
        glm::dvec3 origin = target - t * glm::dvec3(direction);
        origin[axis] = target[axis] + side * rounding;
        result.rays.push_back(make_ray(vec3(origin), direction));
        result.outside.push_back(side * (double(result.rays.back().origin[axis]) - target[axis]));
    }
    return result;
}

inline Mesh slivers(RandomSource& random, std::size_t count) {
    Mesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
        const vec3 a = random.in_box(-1, 1), b = random.in_box(-1, 1);
        mesh.positions.insert(mesh.positions.end(),
                              {a, b, a + random.uniform_float(0, 1) * (b - a) + random.in_box(-1e-6f, 1e-6f)});
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return mesh;
}

/// Makes triangles side by side in one plane, and stacked at distances of a few ulp.
inline Mesh coplanar_stack(RandomSource& random, std::size_t count) {
    Mesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
        const float z = 0.5f + 0x1p-24f * static_cast<float>(random.below(4));
        for (int k = 0; k < 3; ++k)
            mesh.positions.emplace_back(random.uniform_float(-1, 1), random.uniform_float(-1, 1), z);
        mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    return mesh;
}

/// Small triangles in one tilted plane, and rays within this plane: rounding decides where they cross it, and at what
/// t.
struct Grazing {
    Mesh mesh;
    std::vector<Ray> rays;
};

inline Grazing grazing(RandomSource& random, std::size_t triangle_count, std::size_t ray_count) {
    const vec3 x = glm::normalize(vec3(1, 2, 3)), y = glm::normalize(glm::cross(x, vec3(0.3f, -1, 0.2f)));
    const auto point = [&](float reach) {
        return random.uniform_float(-reach, reach) * x + random.uniform_float(-reach, reach) * y;
    };
    Grazing result;
    for (std::uint32_t i = 0; i < triangle_count; ++i) {
        const vec3 place = point(1);
        for (int k = 0; k < 3; ++k) result.mesh.positions.push_back(place + point(0.3f));
        result.mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    for (std::size_t i = 0; i < ray_count; ++i) {
        const vec3 origin = point(2);
        result.rays.push_back(make_ray(origin, point(1) - origin));
    }
    return result;
}

inline Mesh degenerate(RandomSource& random, std::size_t count) {
    Mesh mesh = random_triangles(random, count, 0.3f);
    for (std::size_t i = 0; i < count; ++i) {
        if (i % 3 == 0) mesh.triangles[i].z = mesh.triangles[i].y;
        if (i % 3 == 1) {
            const vec3 a = mesh.positions[3 * i];
            mesh.positions[3 * i + 1] = a + vec3(0.25f, 0, 0);
            mesh.positions[3 * i + 2] = a + vec3(0.5f, 0, 0);
        }
    }
    return mesh;
}

inline Scene mixed(RandomSource& random) {
    Scene scene = scene_of({random_triangles(random, 300, 0.2f), cube_grid(3)});
    for (int i = 0; i < 60; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.01f, 0.4f), 0, 0});
    scene.spheres.push_back(scene.spheres[7]);
    for (int i = 0; i < 5; ++i) scene.planes.push_back({random.in_box(-1, 1), random.direction(), 0, 0});
    scene.planes.push_back({vec3(0, -1, 0), vec3(0, 1, 0), 0, 0});
    scene.planes.push_back(scene.planes[2]);
    return scene;
}

/// Triangles across the z axis at z = i + 1/2 whose first edge is so close to the axis that the products of its edge
/// function round to about the same number; and whether the axis is inside, exactly, since double precision holds the
/// products exactly.
struct NearEdges {
    Mesh mesh;
    std::vector<bool> inside;
    std::size_t undecided = 0;  // both products round to the same number although they differ
};

inline NearEdges near_edges(RandomSource& random, std::uint32_t count) {
    const auto side = [](vec3 a, vec3 b) {
        const double left = double(a.x) * b.y, right = double(a.y) * b.x;
        return left > right ? 1 : left < right ? -1 : 0;
    };
    NearEdges result;
    for (std::uint32_t i = 0; i < count; ++i) {
        const float z = static_cast<float>(i) + 0.5f;
        const vec3 a(random.uniform_float(-1, 1), random.uniform_float(-1, 1), z);
        const float back = -random.uniform_float(0.1f, 1);
        const vec3 b(a.x * back, a.y * back, z);
        const vec3 c(random.uniform_float(-1, 1), random.uniform_float(-1, 1), z);
        result.mesh.positions.insert(result.mesh.positions.end(), {a, b, c});
        result.mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
        const int ab = side(a, b), bc = side(b, c), ca = side(c, a);
        result.inside.push_back((ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0));
        result.undecided += ab != 0 && a.x * b.y == a.y * b.x;
    }
    return result;
}

/// Makes rays at the limits of valid rays, many of which must miss, about a scene around the origin.
inline std::vector<Ray> strange_rays() {
    const float huge = std::numeric_limits<float>::max(), smallest = std::numeric_limits<float>::min();
    const float values[] = {0.0f,    -0.0f,  1.0f,  -1.0f,  0.25f, 1e-42f, -1e-42f,   smallest,   1e-30f,
                            -1e-30f, 1e-19f, 1e19f, -1e30f, huge,  -huge,  kInfinity, -kInfinity, kNaN};
    std::vector<Ray> rays;
    for (float x : values)
        for (float y : values)
            for (float z : values) {
                rays.push_back(make_ray({0.1f, 0.2f, -0.3f}, {x, y, z}, -kInfinity));
                rays.push_back(make_ray({x, y, z}, {0.3f, -0.2f, 0.1f}, -kInfinity));
                rays.push_back(make_ray({x, y, z}, {0.0f, -0.0f, 1.0f}));
            }
    for (float t_min : values)
        for (float t_max : values)
            for (float scale : {1.0f, 1e-30f, 1e30f})
                rays.push_back(make_ray({0.1f, 0.2f, -0.3f}, vec3(0.5f, -1, 0.7f) * scale, t_min, t_max));
    return rays;
}

inline bool is_number(const Ray& ray) {
    for (float value : {ray.origin[0], ray.origin[1], ray.origin[2]})
        if (!(std::fabs(value) <= CASTOR_MAX_COORDINATE)) return false;
    float largest = 0.0f;
    for (float value : ray.direction) {
        if (!std::isfinite(value)) return false;
        largest = std::fmax(largest, std::fabs(value));
    }
    return largest >= std::numeric_limits<float>::min() && ray.t_min <= ray.t_max;
}

}  // namespace castor::reference
