#include "tune/work_per_ray.h"

namespace castor {

namespace {

// A slab test has six fma, four comparisons for entry and exit, two for the ray's limits, and one of entry with exit.
constexpr double kBox = 6 * 2 + 4 + 2 + 1;
// The six planes of a compressed node's child take a conversion and an fma each.
constexpr double kPlanes = 6 * (1 + 2);
// A bundle's slab test takes two fma and a comparison for each of six planes.
constexpr double kBundleBounds = 6 * (2 * 2 + 1) + 4 + 2 + 1;
// The box of a triangle takes two comparisons for each of six planes.
constexpr double kTriangleBox = 6 * 2;
// Three vertices are moved and sheared; three edge functions, and the comparison of their signs.
constexpr double kTriangle = 3 * (3 + 2 * 2) + 3 * 3 + 6;
// A sphere takes its box with the slab test, and the quadratic equation in double-floats.
constexpr double kSphereBox = 6 + 6 * 2 + 4 + 1;
constexpr double kSphereRoots = 3 * 6 + (3 * 8 + 2 * 11) + (3 * 10 + 2 * 11) + (3 + 11) + (2 * 10 + 11) + 5;
// A plane takes two scalar products, a difference, a division and two comparisons.
constexpr double kPlane = 2 * 5 + 3 + 1 + 2;

}  // namespace

const std::array<WorkFigures, CASTOR_WORK_KINDS> kWorkFigures{{
    {"compressed_node", &TraceWork::compressed_nodes, true, 80, 8 * (kBox + kPlanes)},
    {"node", &TraceWork::wide_nodes, true, 6 * 32 + 32, 8 * kBox},
    {"bundle_node", &TraceWork::bundle_nodes, true, 6 * 32 + 32, 8 * kBundleBounds},
    {"bundle_box", &TraceWork::bundle_boxes, true, 6 * 4 + 4, 16 * kBox},
    {"triangle", &TraceWork::triangles, false, 12 + 36, kTriangle + 3},  // the scalar test shears z as well
    {"sphere", &TraceWork::spheres, false, 16, kSphereBox},
    {"plane", &TraceWork::planes, false, 32, kPlane},
    {"triangle_block", &TraceWork::triangle_blocks, false, 4 * 36, 4 * kTriangle},
    {"sphere_block", &TraceWork::sphere_blocks, false, 4 * 16,
     4 * (kSphereBox + kSphereRoots)},  // one box hit out of four costs all of the quadratics
    {"bundle_block", &TraceWork::bundle_blocks, false, 4 * 36, 4 * (kTriangleBox + kBundleBounds)},
    {"bundle_triangle", &TraceWork::bundle_triangles, false, 36, 16 * kTriangle},
    {"bundle_sphere", &TraceWork::bundle_spheres, false, 16, 16 * (kSphereBox + kSphereRoots)},
    {"instance_node", &TraceWork::instance_nodes, true, 2 * 48, 2 * kBox},
}};

WorkPerRay work_per_ray(const TraceWork& work, std::size_t rays, Query query) {
    WorkPerRay all;
    for (const WorkFigures& figures : kWorkFigures) {
        const double count = static_cast<double>(work.*figures.count);
        (figures.is_of_tree ? all.nodes : all.tests) += count;
        all.bytes += count * figures.bytes;
        all.flops += count * figures.flops;
    }
    const double of_ray = 1.0 / static_cast<double>(rays);
    const double answer = query == Query::closest ? sizeof(Hit) : 1;
    return {all.nodes * of_ray, all.tests * of_ray, all.bytes * of_ray + kRayFigures.bytes + answer,
            all.flops * of_ray + kRayFigures.flops};
}

}  // namespace castor
