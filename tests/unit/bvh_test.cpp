#include "bvh/bvh.h"

#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "bvh/reinsert.h"
#include "castor/scene.h"
#include "scene/scene_arrays.h"
#include "support/catch.h"

namespace castor {

namespace {

using Random = std::mt19937;
using Uniform = std::uniform_real_distribution<float>;

glm::vec3 random_point(Random& random, float size) {
    Uniform uniform(-size, size);
    const float x = uniform(random), y = uniform(random), z = uniform(random);
    return {x, y, z};
}

void add_triangle(Mesh& mesh, const glm::vec3& p0, const glm::vec3& p1, const glm::vec3& p2) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), {p0, p1, p2});
    mesh.triangles.push_back({first, first + 1, first + 2});
}

SceneArrays arrays_of(Mesh mesh, std::vector<Sphere> spheres = {}) {
    Scene scene;
    scene.materials.resize(1);
    if (!mesh.triangles.empty()) scene.meshes.push_back(std::move(mesh));
    scene.spheres = std::move(spheres);
    return flatten(scene);
}

// Small triangles in a cube.
Mesh random_mesh(std::size_t count, float size, const glm::vec3& center = glm::vec3(0.0f)) {
    Random random(1);
    Mesh mesh;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 p = center + random_point(random, size);
        const glm::vec3 q = p + random_point(random, 0.05f * size), r = p + random_point(random, 0.05f * size);
        add_triangle(mesh, p, q, r);
    }
    return mesh;
}

// Needles through the whole cube.
Mesh sliver_mesh(std::size_t count) {
    Random random(2);
    Mesh mesh;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 p = random_point(random, 10.0f), q = random_point(random, 10.0f);
        add_triangle(mesh, p, q, p + random_point(random, 1e-3f));
    }
    return mesh;
}

// A height field: as even as a mesh can be, and flat if `height` is 0.
Mesh grid_mesh(std::uint32_t side, float height) {
    Mesh mesh;
    for (std::uint32_t j = 0; j <= side; ++j) {
        for (std::uint32_t i = 0; i <= side; ++i) {
            const float x = static_cast<float>(i), y = static_cast<float>(j);
            mesh.positions.push_back({x, height * std::sin(0.3f * x) * std::cos(0.2f * y), y});
        }
    }
    for (std::uint32_t j = 0; j < side; ++j) {
        for (std::uint32_t i = 0; i < side; ++i) {
            const std::uint32_t a = j * (side + 1) + i, b = a + side + 1;
            mesh.triangles.push_back({a, b, a + 1});
            mesh.triangles.push_back({a + 1, b, b + 1});
        }
    }
    return mesh;
}

// Every third triangle has no area.
Mesh partly_degenerate_mesh() {
    Mesh mesh = random_mesh(9999, 1.0f);
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) mesh.triangles[i].y = mesh.triangles[i].x;
    return mesh;
}

Mesh duplicated_mesh(std::size_t count) {
    Mesh mesh;
    add_triangle(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    mesh.triangles.assign(count, {0, 1, 2});
    return mesh;
}

// On each axis, triangles each twenty times as large and as far out as the one before: every even cut leaves all but
// one together, so that cutting by the heuristic alone would need a level for each.
Mesh exponential_mesh() {
    Mesh mesh;
    for (float size = 1e-38f; size < 1e11f; size *= 20.0f) {
        const float small = 1e-4f * size;
        add_triangle(mesh, {size, 0, 0}, {size + small, small, 0}, {size + small, 0, small});
        add_triangle(mesh, {0, size, 0}, {small, size + small, 0}, {0, size + small, small});
        add_triangle(mesh, {0, 0, size}, {small, 0, size + small}, {0, small, size + small});
    }
    return mesh;
}

std::vector<Sphere> random_spheres(std::size_t count, float size) {
    Random random(3);
    std::vector<Sphere> spheres;
    for (std::size_t i = 0; i < count; ++i) spheres.push_back({random_point(random, size), 0.01f * size, 0, 0});
    return spheres;
}

// So far out that every box is a point.
std::vector<Sphere> far_tiny_spheres(std::size_t count) {
    std::vector<Sphere> spheres;
    for (std::size_t i = 0; i < count; ++i)
        spheres.push_back({{1e11f, static_cast<float>(i % 50), 1e11f}, 1e-20f, 0, 0});
    return spheres;
}

struct Geometry {
    std::string name;
    std::function<SceneArrays()> make;
};

const std::vector<Geometry>& geometries() {
    static const std::vector<Geometry> all = {
        {"random", [] { return arrays_of(random_mesh(20000, 10.0f)); }},
        {"large enough for every parallel path", [] { return arrays_of(random_mesh(200000, 10.0f)); }},
        {"slivers", [] { return arrays_of(sliver_mesh(10000)); }},
        {"height field", [] { return arrays_of(grid_mesh(100, 5.0f)); }},
        {"coplanar", [] { return arrays_of(grid_mesh(100, 0.0f)); }},
        {"partly degenerate", [] { return arrays_of(partly_degenerate_mesh()); }},
        {"duplicated", [] { return arrays_of(duplicated_mesh(100000)); }},
        {"exponential", [] { return arrays_of(exponential_mesh()); }},
        {"far away",
         [] {
             return arrays_of(random_mesh(5000, 1.0f, {1e6f, -1e6f, 1e6f}));
         }},
        {"huge coordinates", [] { return arrays_of(random_mesh(5000, 9e11f)); }},
        {"tiny coordinates", [] { return arrays_of(random_mesh(5000, 1e-30f)); }},
        {"one triangle", [] { return arrays_of(random_mesh(1, 1.0f)); }},
        {"two triangles", [] { return arrays_of(random_mesh(2, 1.0f)); }},
        {"one sphere", [] { return arrays_of({}, random_spheres(1, 1.0f)); }},
        {"spheres", [] { return arrays_of({}, random_spheres(10000, 1.0f)); }},
        {"far tiny spheres", [] { return arrays_of({}, far_tiny_spheres(5000)); }},
        {"triangles and spheres", [] { return arrays_of(random_mesh(3000, 1.0f), random_spheres(3000, 1.0f)); }},
    };
    return all;
}

bool is_degenerate(const glm::uvec3& triangle) {
    return triangle.x == triangle.y && triangle.y == triangle.z;
}

using Corners = std::array<float, 6>;  // lower, upper

Corners primitive_corners(const SceneArrays& arrays, std::uint32_t primitive) {
    if (primitive >= arrays.triangle_count()) {
        const glm::vec4 s = arrays.sphere_center_radius[primitive - arrays.triangle_count()];
        return {s.x - s.w, s.y - s.w, s.z - s.w, s.x + s.w, s.y + s.w, s.z + s.w};
    }
    const glm::uvec3 triangle = arrays.triangle_vertices[primitive];
    const glm::vec3 p0 = arrays.vertex_position[triangle.x], p1 = arrays.vertex_position[triangle.y],
                    p2 = arrays.vertex_position[triangle.z];
    Corners corners;
    for (int i = 0; i < 3; ++i) {
        corners[i] = std::min({p0[i], p1[i], p2[i]});
        corners[i + 3] = std::max({p0[i], p1[i], p2[i]});
    }
    return corners;
}

Corners united(const Corners& a, const Corners& b) {
    Corners corners;
    for (int i = 0; i < 3; ++i) {
        corners[i] = std::min(a[i], b[i]);
        corners[i + 3] = std::max(a[i + 3], b[i + 3]);
    }
    return corners;
}

Corners node_corners(const BvhNode& node) {
    return {node.lower[0], node.lower[1], node.lower[2], node.upper[0], node.upper[1], node.upper[2]};
}

// Walks a tree and holds it to what bvh.h promises.
class TreeCheck {
public:
    TreeCheck(const SceneArrays& arrays, const Bvh& bvh) : arrays_(arrays), bvh_(bvh) {}

    void run() {
        visits_.assign(bvh_.nodes.size(), 0);
        const Corners all = walk(0, 0);
        CHECK(deepest_ == bvh_.depth);
        CHECK(bvh_.depth < CASTOR_MAX_STACK);
        CHECK(bvh_.nodes.size() % 2 == 0);
        CHECK(visits_[1] == 0);
        visits_.erase(visits_.begin() + 1);
        CHECK(std::all_of(visits_.begin(), visits_.end(), [](int visits) { return visits == 1; }));
        CHECK(leaf_primitives_ == bvh_.primitives.size());
        check_primitives();
        check_largest_coordinate(all);
    }

private:
    Corners walk(std::uint32_t index, std::uint32_t depth) {
        if (index >= bvh_.nodes.size()) FAIL("node " << index << " of " << bvh_.nodes.size());
        const BvhNode& node = bvh_.nodes[index];
        ++visits_[index];
        deepest_ = std::max(deepest_, depth);
        const Corners corners = node.count > 0 ? leaf(node) : inner(node, depth);
        if (corners != node_corners(node)) FAIL("the box of node " << index << " is not the union");
        return corners;
    }

    Corners inner(const BvhNode& node, std::uint32_t depth) {
        if (node.first % 2 != 0 || node.first < 2) FAIL("children begin at node " << node.first);
        const Corners left = walk(node.first, depth + 1);
        return united(left, walk(node.first + 1, depth + 1));
    }

    Corners leaf(const BvhNode& node) {
        if (node.first + node.count > bvh_.primitives.size())
            FAIL("a leaf ends at primitive " << node.first + node.count);
        if (node.count > 8) FAIL("a leaf of " << node.count << " primitives");
        leaf_primitives_ += node.count;
        Corners corners = primitive_corners(arrays_, bvh_.primitives[node.first]);
        for (std::uint32_t i = 1; i < node.count; ++i) {
            corners = united(corners, primitive_corners(arrays_, bvh_.primitives[node.first + i]));
        }
        return corners;
    }

    void check_primitives() const {
        std::vector<std::uint32_t> expected;
        for (std::uint32_t i = 0; i < arrays_.triangle_count() + arrays_.sphere_count(); ++i) {
            if (i < arrays_.triangle_count() && is_degenerate(arrays_.triangle_vertices[i])) continue;
            expected.push_back(i);
        }
        std::vector<std::uint32_t> found(bvh_.primitives.begin(), bvh_.primitives.end());
        std::sort(found.begin(), found.end());
        CHECK((found == expected));
    }

    void check_largest_coordinate(const Corners& all) const {
        float largest = 0.0f;
        for (float x : all) largest = std::max(largest, std::abs(x));
        CHECK(arrays_.largest_coordinate() == largest);
    }

    const SceneArrays& arrays_;
    const Bvh& bvh_;
    std::vector<int> visits_;
    std::uint32_t deepest_ = 0;
    std::size_t leaf_primitives_ = 0;
};

double half_area(const Corners& c) {
    const double x = c[3] - c[0], y = c[4] - c[1], z = c[5] - c[2];
    return x * y + y * z + z * x;
}

// Expected box visits plus primitive tests of a random line through the root's box.
double heuristic_cost(const Bvh& bvh) {
    double cost = 0.0;
    for (std::size_t i = 0; i < bvh.nodes.size(); ++i) {
        if (i == 1) continue;
        const BvhNode& node = bvh.nodes[i];
        cost += half_area(node_corners(node)) * (node.count > 0 ? node.count : 1.0);
    }
    return cost / half_area(node_corners(bvh.nodes[0]));
}

// The same cost of the tree that halves the primitives at the median of the longest axis down to four.
double median_split_cost(const SceneArrays& arrays) {
    std::vector<Corners> boxes;
    for (std::uint32_t i = 0; i < arrays.triangle_count(); ++i) boxes.push_back(primitive_corners(arrays, i));
    double root_area = 0.0;
    const std::function<double(std::size_t, std::size_t)> cost = [&](std::size_t begin, std::size_t end) {
        Corners box = boxes[begin];
        for (std::size_t i = begin; i < end; ++i) box = united(box, boxes[i]);
        if (root_area == 0.0) root_area = half_area(box);
        if (end - begin <= 4) return half_area(box) * static_cast<double>(end - begin);
        int axis = 0;
        for (int i = 1; i < 3; ++i) {
            if (box[i + 3] - box[i] > box[axis + 3] - box[axis]) axis = i;
        }
        const std::size_t middle = (begin + end) / 2;
        std::nth_element(
            boxes.begin() + begin, boxes.begin() + middle, boxes.begin() + end,
            [axis](const Corners& a, const Corners& b) { return a[axis] + a[axis + 3] < b[axis] + b[axis + 3]; });
        return half_area(box) + cost(begin, middle) + cost(middle, end);
    };
    return cost(0, boxes.size()) / root_area;
}

Bvh build_with_threads(const SceneArrays& arrays, std::size_t threads, TreeQuality quality = TreeQuality::medium) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    BvhOptions options;
    options.quality = quality;
    return build_bvh(primitives_of(arrays), options);
}

// Holds the leaves to what presplit.h promises: points of a primitive lie in boxes of leaves that hold it, and these in
// its own.
class PieceCheck {
public:
    PieceCheck(const SceneArrays& arrays, const Bvh& bvh) : arrays_(arrays), bvh_(bvh) {}

    void run() {
        std::vector<std::vector<Corners>> boxes(arrays_.triangle_count() + arrays_.sphere_count());
        for (std::size_t i = 0; i < bvh_.nodes.size(); ++i) {
            const BvhNode& node = bvh_.nodes[i];
            if (i == 1) continue;
            for (std::uint32_t k = 0; k < node.count; ++k)
                boxes[bvh_.primitives[node.first + k]].push_back(node_corners(node));
        }
        Random random(4);
        std::uniform_real_distribution<double> uniform(0.0, 1.0);
        for (std::uint32_t i = 0; i < boxes.size(); ++i) {
            if (i >= arrays_.triangle_count()) {
                CHECK(boxes[i].size() == 1);
                continue;
            }
            const glm::uvec3 triangle = arrays_.triangle_vertices[i];
            if (is_degenerate(triangle)) continue;
            for (int point = 0; point < 4; ++point) {
                double u = uniform(random), v = uniform(random);
                if (u + v > 1.0) {
                    u = 1.0 - u;
                    v = 1.0 - v;
                }
                if (point == 3) v = 0.0;
                std::array<double, 3> p;
                double size = 0.0;
                for (int axis = 0; axis < 3; ++axis) {
                    const double a = arrays_.vertex_position[triangle.x][axis],
                                 b = arrays_.vertex_position[triangle.y][axis],
                                 c = arrays_.vertex_position[triangle.z][axis];
                    p[axis] = (1.0 - u - v) * a + u * b + v * c;
                    size = std::max({size, std::abs(a), std::abs(b), std::abs(c)});
                }
                const double rounding = 1e-15 * size;  // of p itself
                const bool found = std::any_of(boxes[i].begin(), boxes[i].end(), [&](const Corners& box) {
                    for (int axis = 0; axis < 3; ++axis)
                        if (p[axis] < box[axis] - rounding || p[axis] > box[axis + 3] + rounding) return false;
                    return true;
                });
                if (!found)
                    FAIL("triangle " << i << " at u " << u << ", v " << v << " is in none of " << boxes[i].size()
                                     << " leaves");
            }
        }
    }

private:
    const SceneArrays& arrays_;
    const Bvh& bvh_;
};

template <class T>
bool same_bytes(const Column<T>& a, const Column<T>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

// Some long walls around much small detail: where to cut matters.
Mesh room_mesh() {
    Mesh mesh = random_mesh(20000, 1.0f);
    for (int i = 0; i < 50; ++i) {
        const float x = -100.0f + 4.0f * static_cast<float>(i);
        add_triangle(mesh, {x, -100, -100}, {x, 100, -100}, {x, 0, 100});
    }
    return mesh;
}

// A tree that halves the primitives by their numbers, whatever their places, or cuts off one at a time.
class NumberTree {
public:
    NumberTree(const SceneArrays& arrays, bool is_chain) : arrays_(arrays), is_chain_(is_chain) {
        bvh_.nodes.resize(2);
        build(0, 0, static_cast<std::uint32_t>(arrays.triangle_count() + arrays.sphere_count()), 0);
    }

    const Bvh& bvh() const { return bvh_; }

private:
    Corners build(std::uint32_t at, std::uint32_t begin, std::uint32_t end, std::uint32_t depth) {
        bvh_.depth = std::max(bvh_.depth, depth);
        Corners corners;
        std::uint32_t first = begin, count = end - begin;
        if (count == 1) {
            corners = primitive_corners(arrays_, begin);
            bvh_.primitives.push_back(begin);
        } else {
            first = static_cast<std::uint32_t>(bvh_.nodes.size());
            count = 0;
            bvh_.nodes.resize(first + 2);
            const std::uint32_t middle = is_chain_ ? begin + 1 : (begin + end) / 2;
            corners = build(first, begin, middle, depth + 1);
            corners = united(corners, build(first + 1, middle, end, depth + 1));
        }
        bvh_.nodes[at] = {{corners[0], corners[1], corners[2]}, first, {corners[3], corners[4], corners[5]}, count};
        return corners;
    }

    const SceneArrays& arrays_;
    bool is_chain_;
    Bvh bvh_;
};

// Boxes around boxes: wherever a node stands, nearly all others hold it.
Mesh nested_mesh(std::size_t count) {
    Mesh mesh;
    for (std::size_t i = 0; i < count; ++i) {
        const float size = 1.0f + static_cast<float>(i * 7919 % count);
        add_triangle(mesh, {-size, -size, -size}, {size, -size, size}, {-size, size, size});
    }
    return mesh;
}

// Groups of triangles that overlap: cuts by their centres tear them apart.
Mesh objects_mesh(std::size_t count) {
    Random random(5);
    Mesh mesh;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 center = random_point(random, 10.0f);
        for (int k = 0; k < 12; ++k)
            add_triangle(mesh, center + random_point(random, 1.0f), center + random_point(random, 1.0f),
                         center + random_point(random, 1.0f));
    }
    return mesh;
}

}  // namespace

TEST_CASE("build_bvh keeps every promise of its tree", "[bvh]") {
    for (const Geometry& geometry : geometries()) {
        CAPTURE(geometry.name);
        const SceneArrays arrays = geometry.make();
        const Bvh bvh = build_bvh(primitives_of(arrays));
        REQUIRE_FALSE(bvh.nodes.empty());
        TreeCheck(arrays, bvh).run();
    }
}

TEST_CASE("build_bvh stops following the heuristic before the levels run out", "[bvh]") {
    const SceneArrays arrays = arrays_of(exponential_mesh());
    REQUIRE(arrays.triangle_count() > CASTOR_MAX_STACK + 8);  // the heuristic would cut off one triangle a level
    const Bvh bvh = build_bvh(primitives_of(arrays));
    CHECK(bvh.depth >= CASTOR_MAX_STACK - 8);
    CHECK(bvh.depth < CASTOR_MAX_STACK);
}

TEST_CASE("build_bvh makes an empty tree where nothing is bounded", "[bvh]") {
    Scene scene;
    scene.materials.resize(1);
    scene.planes.push_back(Plane{});
    Mesh mesh;
    add_triangle(mesh, {1, 2, 3}, {1, 2, 3}, {4, 5, 6});  // degenerate
    scene.meshes.push_back(mesh);
    for (const Scene& each : {Scene{}, scene}) {
        const Bvh bvh = build_bvh(primitives_of(flatten(each)));
        CHECK(bvh.nodes.empty());
        CHECK(bvh.primitives.empty());
        CHECK(bvh.depth == 0);
    }
}

TEST_CASE("build_bvh gives the same tree with any number of threads", "[bvh]") {
    for (const Geometry& geometry : geometries()) {
        CAPTURE(geometry.name);
        const SceneArrays arrays = geometry.make();
        const Bvh one = build_with_threads(arrays, 1);
        for (const std::size_t threads : {2, 5}) {
            CAPTURE(threads);
            const Bvh many = build_with_threads(arrays, threads);
            CHECK(same_bytes(one.nodes, many.nodes));
            CHECK(same_bytes(one.primitives, many.primitives));
            CHECK(one.depth == many.depth);
        }
    }
}

TEST_CASE("pieces of high quality cover their triangles, whatever the number of threads", "[bvh]") {
    for (const Geometry& geometry : geometries()) {
        CAPTURE(geometry.name);
        const SceneArrays arrays = geometry.make();
        const Bvh bvh = build_with_threads(arrays, 1, TreeQuality::high);
        const Bvh other = build_with_threads(arrays, 3, TreeQuality::high);
        CHECK(same_bytes(bvh.nodes, other.nodes));
        CHECK(same_bytes(bvh.primitives, other.primitives));
        CHECK(bvh.primitives.size() <= 2 * (arrays.triangle_count() + arrays.sphere_count()) + 64);
        CHECK(bvh.depth < CASTOR_MAX_STACK);
        PieceCheck(arrays, bvh).run();
    }
}

TEST_CASE("medium quality cuts long triangles of large scenes alone", "[bvh]") {
    const auto piece_count = [](Mesh mesh) {
        const SceneArrays arrays = arrays_of(std::move(mesh));
        const Bvh bvh = build_with_threads(arrays, 1);
        const Bvh other = build_with_threads(arrays, 3);
        CHECK(same_bytes(bvh.nodes, other.nodes));
        CHECK(same_bytes(bvh.primitives, other.primitives));
        PieceCheck(arrays, bvh).run();
        return bvh.primitives.size() - arrays.triangle_count();
    };
    CHECK(piece_count(sliver_mesh(65535)) == 0);
    CHECK(piece_count(sliver_mesh(65536)) > 20000);
    CHECK(piece_count(random_mesh(65536, 1.0f)) == 0);
    // Some long ones among short ones, one in twenty and one in six
    for (const std::size_t count : {3500, 13000}) {
        CAPTURE(count);
        Mesh mesh = random_mesh(65536, 10.0f);
        const Mesh slivers = sliver_mesh(count);
        for (const glm::uvec3& t : slivers.triangles)
            add_triangle(mesh, slivers.positions[t.x], slivers.positions[t.y], slivers.positions[t.z]);
        CHECK((piece_count(mesh) > 0) == (count == 13000));
    }
}

TEST_CASE("pieces make trees over long thin triangles much cheaper", "[bvh]") {
    const SceneArrays slivers = arrays_of(sliver_mesh(10000));
    const Bvh medium = build_with_threads(slivers, 2), high = build_with_threads(slivers, 2, TreeQuality::high);
    CHECK(high.primitives.size() > 1.3 * static_cast<double>(medium.primitives.size()));
    CHECK(heuristic_cost(high) < 0.8 * heuristic_cost(medium));
}

TEST_CASE("build_bvh cuts where the surface area heuristic says", "[bvh]") {
    const SceneArrays room = arrays_of(room_mesh());
    CHECK(heuristic_cost(build_bvh(primitives_of(room))) < 0.53 * median_split_cost(room));
    const SceneArrays slivers = arrays_of(sliver_mesh(10000));
    CHECK(heuristic_cost(build_bvh(primitives_of(slivers))) < 0.7 * median_split_cost(slivers));
    const SceneArrays objects = arrays_of(objects_mesh(2000));
    CHECK(heuristic_cost(build_bvh(primitives_of(objects))) < 0.79 * median_split_cost(objects));
}

TEST_CASE("build_bvh sets clusters apart at the root", "[bvh]") {
    Mesh mesh = random_mesh(1000, 1.0f);
    for (const glm::uvec3& triangle : random_mesh(500, 1.0f).triangles) {
        const glm::vec3 away(50.0f, 0.0f, 0.0f);
        add_triangle(mesh, mesh.positions[triangle.x] + away, mesh.positions[triangle.y] + away,
                     mesh.positions[triangle.z] + away);
    }
    const Bvh bvh = build_bvh(primitives_of(arrays_of(mesh)));
    CHECK(bvh.nodes[2].upper[0] < 2.0f);
    CHECK(bvh.nodes[3].lower[0] > 48.0f);
}

TEST_CASE("reinsert_nodes makes a good tree of any", "[bvh]") {
    for (const auto& [name, mesh] : {std::pair{"random", random_mesh(5000, 1.0f)}, {"room", room_mesh()}}) {
        CAPTURE(name);
        const SceneArrays arrays = arrays_of(mesh);
        Bvh bvh = NumberTree(arrays, false).bvh();
        CHECK(heuristic_cost(bvh) > 0.9 * median_split_cost(arrays));
        reinsert_nodes(bvh, 0.001f);
        TreeCheck(arrays, bvh).run();
        CHECK(heuristic_cost(bvh) < median_split_cost(arrays));
    }
}

TEST_CASE("reinsert_nodes moves nothing where it is not worth the time", "[bvh]") {
    const SceneArrays arrays = arrays_of(grid_mesh(100, 5.0f));
    const Bvh before = build_bvh(primitives_of(arrays));
    Bvh bvh = build_bvh(primitives_of(arrays));
    reinsert_nodes(bvh, 0.01f);
    CHECK(same_bytes(bvh.nodes, before.nodes));
    CHECK(same_bytes(bvh.primitives, before.primitives));
}

TEST_CASE("reinsert_nodes keeps to the levels that there are", "[bvh]") {
    for (const std::uint32_t count : {8u, 33u, 64u}) {
        CAPTURE(count);
        for (const Mesh& mesh : {random_mesh(count, 1.0f), sliver_mesh(count), nested_mesh(count)}) {
            const SceneArrays arrays = arrays_of(mesh);
            Bvh bvh = NumberTree(arrays, true).bvh();
            REQUIRE(bvh.depth < CASTOR_MAX_STACK);
            reinsert_nodes(bvh, 0.0f);
            TreeCheck(arrays, bvh).run();
        }
    }
}

TEST_CASE("reinsert_nodes ends where all boxes overlap, are equal, tiny or huge", "[bvh]") {
    for (const auto& [name, mesh] : {std::pair{"nested", nested_mesh(20000)},
                                     {"slivers", sliver_mesh(20000)},
                                     {"equal", duplicated_mesh(20000)},
                                     {"tiny", random_mesh(5000, 1e-30f)},
                                     {"huge", random_mesh(5000, 9e11f)},
                                     {"exponential", exponential_mesh()}}) {
        CAPTURE(name);
        const SceneArrays arrays = arrays_of(mesh);
        Bvh bvh = NumberTree(arrays, false).bvh();
        reinsert_nodes(bvh, 0.0f);
        TreeCheck(arrays, bvh).run();
    }
}

TEST_CASE("reinsert_nodes gives the same tree with any number of threads", "[bvh]") {
    const SceneArrays arrays = arrays_of(objects_mesh(2000));
    std::vector<Bvh> trees;
    for (const std::size_t threads : {1, 2, 5}) {
        CAPTURE(threads);
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        trees.push_back(NumberTree(arrays, false).bvh());
        reinsert_nodes(trees.back(), 0.001f);
        CHECK(same_bytes(trees.back().nodes, trees.front().nodes));
        CHECK(same_bytes(trees.back().primitives, trees.front().primitives));
        CHECK(trees.back().depth == trees.front().depth);
    }
}

}  // namespace castor
