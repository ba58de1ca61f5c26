#include "bvh/compressed.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "bvh/wide.h"
#include "castor/scene.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "scene/scene_arrays.h"
#include "support/boxes.h"
#include "support/catch.h"

namespace castor::test {
namespace {

bool contains(const Box& outer, const Box& inner) {
    for (int axis = 0; axis < 3; ++axis)
        if (!(outer.lower[axis] <= inner.lower[axis] && outer.upper[axis] >= inner.upper[axis])) return false;
    return true;
}

Box point_box(const glm::vec3& p) {
    return {make_float4(p), make_float4(p)};
}

Box box_of_primitive(const SceneArrays& arrays, std::uint32_t primitive) {
    if (primitive >= arrays.triangle_count())
        return sphere_box(arrays.sphere_center_radius[primitive - arrays.triangle_count()]);
    const glm::uvec3 t = arrays.triangle_vertices[primitive];
    return triangle_box(arrays.vertex_position[t.x], arrays.vertex_position[t.y], arrays.vertex_position[t.z]);
}

/// Walks a tree as a ray that enters everything, and holds it to what compressed.h and types.h promise.
class TreeCheck {
public:
    TreeCheck(const SceneArrays& arrays, const CompressedBvh& bvh)
        : arrays_(arrays), bvh_(bvh), visits_(bvh.nodes.size()) {}

    void run() {
        walk(0, 1);
        CHECK(levels_ == bvh_.levels);
        CHECK(bvh_.levels <= CASTOR_MAX_STACK);
        CHECK(std::all_of(visits_.begin(), visits_.end(), [](int visits) { return visits == 1; }));
        std::vector<std::uint32_t> expected;
        for (std::uint32_t i = 0; i < arrays_.triangle_count() + arrays_.sphere_count(); ++i)
            if (i >= arrays_.triangle_count() || arrays_.triangle_vertices[i].x != arrays_.triangle_vertices[i].y)
                expected.push_back(i);
        std::sort(found_.begin(), found_.end());
        CHECK((found_ == expected));
        CHECK(bvh_.primitives.size() == expected.size());
    }

private:
    /// The union of the boxes of all primitives below.
    Box walk(std::uint32_t index, std::uint32_t level) {
        if (index >= bvh_.nodes.size()) FAIL("node " << index << " of " << bvh_.nodes.size());
        const shared::CompressedNode& node = bvh_.nodes[index];
        ++visits_[index];
        levels_ = std::max(levels_, level);
        Box all;
        std::uint32_t primitive_bits = 0;
        for (std::uint32_t place = 0; place < 8; ++place) {
            const std::uint32_t meta = node.meta[place];
            const bool is_inner = meta == CASTOR_COMPRESSED_INNER + place;
            if (is_inner != (node.inner_mask >> place & 1)) FAIL("inner mask and meta of node " << index << " differ");
            if (meta == 0) continue;
            const std::uint32_t rank = std::popcount(node.inner_mask & ((1u << place) - 1));
            const Box box = is_inner ? walk(node.first_child + rank, level + 1) : leaf(node, meta, primitive_bits);
            if (!contains(decompressed_box(node, static_cast<int>(place)), box))
                FAIL("node " << index << ", place " << place << ": "
                             << to_text(decompressed_box(node, static_cast<int>(place))) << " does not contain "
                             << to_text(box));
            all.extend(box);
        }
        return all;
    }

    Box leaf(const shared::CompressedNode& node, std::uint32_t meta, std::uint32_t& primitive_bits) {
        const std::uint32_t first = meta & 31, count = meta >> CASTOR_COMPRESSED_COUNT_SHIFT;
        if (count != 1 && count != 3 && count != 7) FAIL("the code " << meta << " of a leaf is no count in unary");
        if ((count << first & ~0xffffffu) || (primitive_bits & count << first)) FAIL("leaves of a node overlap");
        primitive_bits |= count << first;
        Box box;
        for (std::uint32_t i = first; i < first + static_cast<std::uint32_t>(std::popcount(count)); ++i) {
            if (node.first_primitive + i >= bvh_.primitives.size()) FAIL("a leaf ends behind the last primitive");
            found_.push_back(bvh_.primitives[node.first_primitive + i]);
            box.extend(box_of_primitive(arrays_, found_.back()));
        }
        return box;
    }

    const SceneArrays& arrays_;
    const CompressedBvh& bvh_;
    std::vector<int> visits_;
    std::vector<std::uint32_t> found_;
    std::uint32_t levels_ = 0;
};

Mesh repeated_triangle(std::size_t count) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(count, {0, 1, 2});
    return mesh;
}

/// Triangles each twenty times as large and as far out as the one before: a deep tree.
Mesh exponential_mesh() {
    Mesh mesh;
    for (float size = 1e-38f; size < 1e11f; size *= 20.0f)
        for (int axis = 0; axis < 3; ++axis) {
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (int corner = 0; corner < 3; ++corner) {
                glm::vec3 p(0.0f);
                p[axis] = size;
                p[(axis + corner) % 3] += 1e-4f * size;
                mesh.positions.push_back(p);
            }
            mesh.triangles.emplace_back(first, first + 1, first + 2);
        }
    return mesh;
}

std::vector<std::pair<std::string, Scene>> scenes() {
    RandomSource random(95);
    std::vector<std::pair<std::string, Scene>> all = {
        {"random triangles", scene_of({random_triangles(random, 20'000, 0.05f)})},
        {"a closed mesh", scene_of({cube_grid(20)})},
        {"one triangle", scene_of({random_triangles(random, 1, 1.0f)})},
        {"nine triangles", scene_of({random_triangles(random, 9, 1.0f)})},
        {"far away", scene_of({moved(random_triangles(random, 3'000, 0.1f), 1.0f, glm::vec3(1e6f, -1e6f, 1e6f))})},
        {"tiny", scene_of({moved(random_triangles(random, 3'000, 0.1f), 1e-30f, glm::vec3(0))})},
        {"denormal", scene_of({moved(random_triangles(random, 500, 0.1f), 1e-40f, glm::vec3(0))})},
        {"huge", scene_of({moved(random_triangles(random, 3'000, 0.1f), 9e11f, glm::vec3(0))})},
        {"one triangle many times", scene_of({repeated_triangle(1'000)})},
        {"exponential", scene_of({exponential_mesh()})},
        {"triangles and spheres", scene_of({random_triangles(random, 500, 0.1f)})},
    };
    for (int i = 0; i < 700; ++i)
        all.back().second.spheres.push_back({random.in_box(-1, 1), random.uniform_float(1e-6f, 0.2f), 0, 0});
    return all;
}

}  // namespace

TEST_CASE("compress_boxes contains every box, by the tightest planes of its grid", "[bvh]") {
    RandomSource random(94);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < 200'000 && wrong < 3; ++i) {
        const std::array<Box, 8> boxes = random_children(random);
        shared::CompressedNode node{};
        compress_boxes(boxes, node);
        for (int place = 0; place < 8; ++place) {
            if (is_empty(boxes[place])) continue;
            const Box found = decompressed_box(node, place);
            bool right = contains(found, boxes[place]);
            // One step less is the same plane, or would not contain it.
            shared::CompressedNode tighter = node;
            for (int axis = 0; axis < 3; ++axis) {
                if (node.lower[axis][place] < 255) ++tighter.lower[axis][place];
                if (node.upper[axis][place] > 0) --tighter.upper[axis][place];
                const Box smaller = decompressed_box(tighter, place);
                right = right &&
                        (smaller.lower[axis] > boxes[place].lower[axis] || smaller.lower[axis] == found.lower[axis]);
                right = right &&
                        (smaller.upper[axis] < boxes[place].upper[axis] || smaller.upper[axis] == found.upper[axis]);
                right = right && node.exponent[axis] >= 1 && node.exponent[axis] <= 254 &&
                        std::fpclassify(node.origin[axis]) != FP_SUBNORMAL;
            }
            if (right) continue;
            ++wrong;
            CAPTURE(i, place, to_text(boxes[place]), to_text(found));
            CHECK(right);
        }
    }
}

TEST_CASE("the grid of compress_boxes is no coarser than 255 steps ask", "[bvh]") {
    RandomSource random(96);
    for (int i = 0; i < 10'000; ++i) {
        std::array<Box, 8> boxes;
        boxes[3] = point_box(random.in_box(-1, 1));
        boxes[5] = point_box(random.in_box(-1, 1));
        shared::CompressedNode node{};
        compress_boxes(boxes, node);
        for (int axis = 0; axis < 3; ++axis) {
            const float extent = std::fabs(boxes[3].lower[axis] - boxes[5].lower[axis]);
            const float step = std::ldexp(1.0f, node.exponent[axis] - 127);
            CAPTURE(i, axis, to_text(boxes[3]), to_text(boxes[5]), step);
            REQUIRE(step <= 2.0f * extent / 255.0f * 1.0001f);
            REQUIRE(step >= extent / 255.0f * 0.9999f);
        }
    }
}

TEST_CASE("compress_bvh keeps every promise of its tree", "[bvh]") {
    for (const auto& [name, scene] : scenes()) {
        const SceneArrays arrays = flatten(scene);
        for (const BvhOptions& options : {BvhOptions{}, kForBlocks}) {
            CAPTURE(name, options.block_bits);
            const CompressedBvh bvh = compress_bvh(primitives_of(arrays), build_bvh(primitives_of(arrays), options));
            REQUIRE_FALSE(bvh.nodes.empty());
            TreeCheck(arrays, bvh).run();
        }
    }
}

TEST_CASE("compress_bvh makes an empty tree where nothing is bounded", "[bvh]") {
    const SceneArrays arrays = flatten(scene_of({}));
    const CompressedBvh bvh = compress_bvh(primitives_of(arrays), build_bvh(primitives_of(arrays)));
    CHECK(bvh.nodes.empty());
    CHECK(bvh.primitives.empty());
    CHECK(bvh.levels == 0);
}

TEST_CASE("compress_bvh puts children at the places of their corners", "[bvh]") {
    // Eight groups of triangles at the corners of a cube.
    RandomSource random(97);
    std::vector<Mesh> meshes;
    for (int place = 0; place < 8; ++place)
        meshes.push_back(moved(random_triangles(random, 20, 0.1f), 0.1f,
                               glm::vec3(place & 1, place >> 1 & 1, place >> 2 & 1) * 10.0f));
    const SceneArrays arrays = flatten(scene_of(meshes));
    const CompressedBvh bvh = compress_bvh(primitives_of(arrays), build_bvh(primitives_of(arrays)));
    REQUIRE(bvh.nodes[0].inner_mask == 0xff);
    for (int place = 0; place < 8; ++place)
        for (int axis = 0; axis < 3; ++axis) {
            CAPTURE(place, axis);
            CHECK((decompressed_box(bvh.nodes[0], place).lower[axis] > 5.0f) == (place >> axis & 1));
        }
}

TEST_CASE("a compressed tree is small", "[bvh]") {
    const SceneArrays arrays = flatten(scene_of({cube_grid(50)}));
    const CompressedBvh bvh = compress_bvh(primitives_of(arrays), build_bvh(primitives_of(arrays)));
    const std::size_t bytes =
        bvh.nodes.size() * sizeof(shared::CompressedNode) + bvh.primitives.size() * sizeof(std::uint32_t);
    CHECK(static_cast<double>(bytes) / static_cast<double>(arrays.triangle_count()) < 16.0);
}

}  // namespace castor::test
