#include "bvh/presplit.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace castor {

namespace {

// References that are added, as a share of those that there are; and the most for one triangle.
constexpr double kMorePieces = 0.5;
constexpr int kMaxCuts = 63;
constexpr std::size_t kChunk = 16384;
constexpr int kGridBits = 20;

/// Cubic cells over the scene, halved again and again: the planes that a tree by spatial medians would cut at.
struct Grid {
    Float4 base;
    float cell;  // 0: the scene has no extent

    explicit Grid(const Box& scene)
        : base(scene.lower), cell(longest_side(scene) * std::exp2(static_cast<float>(-kGridBits))) {}

    std::uint32_t index(float x, int axis) const { return static_cast<std::uint32_t>((x - base[axis]) / cell); }
};

/// A plane that cuts a box.
struct Plane {
    int axis = -1;  // -1: there is none
    float position = 0.0f;
    int level = 0;  // of the grid: cells of 2^level cells meet here
};

/// The coarsest plane of the grid that crosses the box.
Plane coarsest_plane(const Grid& grid, const Box& box) {
    Plane best;
    for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t lower = grid.index(box.lower[axis], axis), upper = grid.index(box.upper[axis], axis);
        if (lower == upper) continue;
        const int level = std::bit_width(lower ^ upper) - 1;
        if (best.axis >= 0 && level <= best.level) continue;
        const float position = grid.base[axis] + static_cast<float>(upper >> level << level) * grid.cell;
        if (position > box.lower[axis] && position < box.upper[axis]) best = {axis, position, level};
    }
    return best;
}

struct Triangle {
    glm::vec3 p[3];

    Triangle(const Primitives& primitives, std::uint32_t number) {
        for (int i = 0; i < 3; ++i) p[i] = primitives.vertex_position[primitives.triangle_vertices[number][i]];
    }
};

float rounded_down(double x) {
    const float nearest = static_cast<float>(x);
    return nearest > x ? std::nextafter(nearest, -Box::kInfinity) : nearest;
}

float rounded_up(double x) {
    return -rounded_down(-x);
}

void intersect(Box& box, const Box& other) {
    box.lower = box.lower > other.lower ? box.lower : other.lower;
    box.upper = box.upper < other.upper ? box.upper : other.upper;
}

/// The boxes of what of the triangle is in `box`, on the two sides of the plane. What is computed is rounded outwards.
void cut(const Triangle& triangle, const Box& box, const Plane& plane, Box& left, Box& right) {
    const int axis = plane.axis;
    left = right = Box{};
    for (int i = 0; i < 3; ++i) {
        const glm::vec3 &a = triangle.p[i], &b = triangle.p[(i + 1) % 3];
        if (a[axis] <= plane.position) left.extend(make_float4(a));
        if (a[axis] >= plane.position) right.extend(make_float4(a));
        if (!((a[axis] < plane.position && b[axis] > plane.position) ||
              (a[axis] > plane.position && b[axis] < plane.position)))
            continue;
        const double share = (static_cast<double>(plane.position) - a[axis]) / (static_cast<double>(b[axis]) - a[axis]);
        Box crossing;
        for (int k = 0; k < 3; ++k) {
            // Five roundings of at most 2^-53 of the larger coordinate.
            const double error = 0x1p-49 * (std::abs(static_cast<double>(a[k])) + std::abs(static_cast<double>(b[k])));
            const double p = a[k] + share * (static_cast<double>(b[k]) - a[k]);
            crossing.lower[k] = k == axis ? plane.position : rounded_down(p - error);
            crossing.upper[k] = k == axis ? plane.position : rounded_up(p + error);
        }
        left.extend(crossing);
        right.extend(crossing);
    }
    intersect(left, box);
    intersect(right, box);
}

/// Appends the pieces of what of the triangle is in `box`.
void add_pieces(const Grid& grid, const Triangle& triangle, const Box& box, std::uint32_t number, int cuts,
                std::vector<PrimitiveRef>& pieces) {
    const Plane plane = cuts > 0 ? coarsest_plane(grid, box) : Plane{};
    if (plane.axis < 0) {
        pieces.push_back(PrimitiveRef::make(box, number));
        return;
    }
    Box left, right;
    cut(triangle, box, plane, left, right);
    if (left.is_empty() || right.is_empty()) {
        pieces.push_back(PrimitiveRef::make(box, number));
        return;
    }
    const double left_side = longest_side(left), share = left_side / (left_side + longest_side(right));
    const int left_cuts = static_cast<int>(std::lround(share * (cuts - 1)));
    add_pieces(grid, triangle, left, number, left_cuts, pieces);
    add_pieces(grid, triangle, right, number, cuts - 1 - left_cuts, pieces);
}

/// How much is won by cutting.
double priority(const Primitives& primitives, const Grid& grid, const PrimitiveRef& ref) {
    const Plane plane = coarsest_plane(grid, ref.box);
    return plane.axis < 0 ? 0.0 : std::cbrt(wasted_half_area(primitives, ref) * std::exp2(plane.level));
}

}  // namespace

double wasted_half_area(const Primitives& primitives, const PrimitiveRef& ref) {
    if (ref.primitive() >= primitives.triangle_count()) return 0.0;
    const Triangle triangle(primitives, ref.primitive());
    const glm::dvec3 a(triangle.p[1] - triangle.p[0]), b(triangle.p[2] - triangle.p[0]);
    // The least half area that boxes around pieces can come down to: that of the projections.
    const double least =
        0.5 * (std::abs(a.y * b.z - a.z * b.y) + std::abs(a.z * b.x - a.x * b.z) + std::abs(a.x * b.y - a.y * b.x));
    return std::max(0.0, half_area(ref.box) - least);
}

std::vector<std::vector<PrimitiveRef>> presplit(const Primitives& primitives, std::span<const PrimitiveRef> refs,
                                                float least_side, const Progress& progress) {
    Box scene;
    for (const PrimitiveRef& ref : refs) scene.extend(ref.box);
    const Grid grid(scene);

    const std::size_t chunk_count = (refs.size() + kChunk - 1) / kChunk;
    const auto for_each_in_chunk = [&](std::size_t chunk, const auto& body) {
        for (std::size_t i = chunk * kChunk; i < std::min(refs.size(), (chunk + 1) * kChunk); ++i) body(i);
    };
    ProgressCount chunks_done(progress, 2 * chunk_count);
    std::vector<float> priorities(refs.size());
    std::vector<double> sums(chunk_count, 0.0);
    tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t chunk) {
        for_each_in_chunk(chunk, [&](std::size_t i) {
            const bool is_cut = grid.cell > 0.0f && longest_side(refs[i].box) >= least_side;
            priorities[i] = is_cut ? static_cast<float>(priority(primitives, grid, refs[i])) : 0.0f;
            sums[chunk] += priorities[i];
        });
        chunks_done.add(1);
    });
    double sum = 0.0;
    for (const double each : sums) sum += each;
    const double cuts_per_priority = sum > 0.0 ? kMorePieces * static_cast<double>(refs.size()) / sum : 0.0;

    std::vector<std::vector<PrimitiveRef>> pieces(chunk_count);
    tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t chunk) {
        for_each_in_chunk(chunk, [&](std::size_t i) {
            const int cuts = static_cast<int>(std::min<double>(kMaxCuts, cuts_per_priority * priorities[i] + 0.5));
            if (cuts == 0)
                pieces[chunk].push_back(refs[i]);
            else
                add_pieces(grid, Triangle(primitives, refs[i].primitive()), refs[i].box, refs[i].primitive(), cuts,
                           pieces[chunk]);
        });
        chunks_done.add(1);
    });
    return pieces;
}

}  // namespace castor
