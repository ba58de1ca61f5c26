#include <bit>
#include <vector>

#include "bvh/compressed.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/boxes.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

struct VisitResult {
    cl_uint octant, nodes, primitives, entered_boxes, wrong_planes;
};

struct Visits {
    std::vector<shared::Ray> rays;
    std::vector<std::array<Box, 8>> boxes;
    std::vector<shared::CompressedNode> nodes;
    float largest = 0.0f;

    /// A ray and a node with inner children and leaves of one primitive, numbered by their places.
    void add(RandomSource& random) {
        boxes.push_back(random_children(random));
        shared::CompressedNode node{};
        compress_boxes(boxes.back(), node);
        std::vector<glm::vec3> corners;
        for (std::uint8_t place = 0; place < 8; ++place) {
            const Box& box = boxes.back()[place];
            if (is_empty(box)) continue;
            const bool is_leaf = random.below(2) != 0;
            node.meta[place] = is_leaf ? 1u << CASTOR_COMPRESSED_COUNT_SHIFT | place : CASTOR_COMPRESSED_INNER + place;
            if (!is_leaf) node.inner_mask |= static_cast<std::uint8_t>(1 << place);
            largest = std::max(largest, largest_coordinate(box));
            for (const Float4& p : {box.lower, box.upper}) corners.emplace_back(p[0], p[1], p[2]);
        }
        nodes.push_back(node);
        // From among the boxes to a corner of one, or along an axis through it.
        const glm::vec3 to = corners[random.below(static_cast<std::uint32_t>(corners.size()))];
        glm::vec3 from = corners[random.below(static_cast<std::uint32_t>(corners.size()))];
        from += (to - from) * random.uniform_float(-1, 1);
        glm::vec3 direction = to - from;
        for (int axis = 0; axis < 3; ++axis)
            if (random.below(4) == 0) direction[axis] = random.below(2) ? 0.0f : -0.0f;
        if (std::fabs(direction.x) + std::fabs(direction.y) + std::fabs(direction.z) < 1e-30f)
            direction = random.direction();
        const float t_max = random.below(2) ? std::numeric_limits<float>::infinity() : random.uniform_float(0, 1);
        rays.push_back(make_ray(from, direction, random.below(2) ? 0.0f : -1.0f, t_max));
    }

    std::vector<VisitResult> run(KernelFixture& fixture) const {
        std::vector<float> planes, lower, upper;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                for (int place = 0; place < 8; ++place) planes.push_back(decompressed_box(nodes[i], place).lower[axis]);
                for (int place = 0; place < 8; ++place) planes.push_back(decompressed_box(nodes[i], place).upper[axis]);
            }
            for (const Box& box : boxes[i]) {
                for (int axis = 0; axis < 3; ++axis) {
                    lower.push_back(box.lower[axis]);
                    upper.push_back(box.upper[axis]);
                }
            }
        }
        return fixture.run<VisitResult>("traverse_simt_test", rays.size(), largest, rays, nodes, planes, lower, upper);
    }
};

}  // namespace

TEST_CASE("a ray enters every child of a compressed node whose box it enters", "[kernels][oclgrind]") {
    RandomSource random(75);
    // One node a scene: the enlargement of boxes goes by the largest coordinate of all.
    const std::size_t count = test_size(100'000);
    Visits visits;
    for (std::size_t i = 0; i < count; ++i) visits.add(random);
    for (const float largest : {0.0f, visits.largest}) {
        CAPTURE(largest);
        visits.largest = largest;
        KernelFixture fixture;
        const std::vector<VisitResult> results = visits.run(fixture);
        std::size_t wrong = 0, entered = 0, passed = 0;
        for (std::size_t i = 0; i < count && wrong < 3; ++i) {
            const VisitResult& result = results[i];
            CAPTURE(i, to_text(visits.rays[i]), result.octant, result.nodes, result.primitives, result.entered_boxes);
            bool right = result.wrong_planes == 0 && (result.nodes & 0x00ffffffu) == visits.nodes[i].inner_mask;
            std::uint32_t children = 0;
            for (std::uint32_t place = 0; place < 8; ++place) {
                const Box& box = visits.boxes[i][place];
                if (is_empty(box)) continue;
                const bool is_inner = visits.nodes[i].inner_mask >> place & 1;
                const std::uint32_t bit =
                    is_inner ? result.nodes >> (24 + (place ^ result.octant)) & 1 : result.primitives >> place & 1;
                children += bit;
                const bool should_enter = result.entered_boxes >> place & 1;
                entered += should_enter;
                passed += !bit;
                if (should_enter && !bit) {
                    right = false;
                    UNSCOPED_INFO("place " << place << ", box " << to_text(box));
                }
            }
            // No bit but those of children.
            right = right && children == static_cast<std::uint32_t>(std::popcount(result.nodes >> 24) +
                                                                    std::popcount(result.primitives));
            CHECK(result.wrong_planes == 0);
            CHECK(right);
            wrong += !right;
        }
        CHECK(entered > count / 10);
        CHECK(passed > count / 10);
    }
}

}  // namespace castor::test
