// What a ray enters of a compressed node, and of the boxes that the node was made from, one by one.
#include "device/traverse_simt.cl"

typedef struct VisitResult {
    uint octant;
    uint nodes;          // visit_node: inner children that are entered, from bit 24 on, and all by place
    uint primitives;     // visit_node: primitives of leaves that are entered
    uint entered_boxes;  // bit i: the box of place i is entered
    uint wrong_planes;   // planes that are not the host's, bit for bit
} VisitResult;

uint wrong_planes(const global uchar *steps, const global float *planes, const uint exponent, const float origin)
{
    uint wrong = 0;
    for (uint half_node = 0; half_node < 2; ++half_node) {
        const uint word = as_uint(vload4(half_node, steps));
        const int4 differs = as_int4(decompressed_planes(word, exponent, origin)) != as_int4(vload4(half_node, planes));
        wrong -= differs.x + differs.y + differs.z + differs.w;
    }
    return wrong;
}

kernel void traverse_simt_test(const uint count, const float largest_coordinate, const global float4 *restrict rays,
                               const global CompressedNode *restrict nodes, const global float *restrict host_planes,
                               const global float *restrict lower, const global float *restrict upper,
                               global VisitResult *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const TraceRay ray = make_trace_ray(rays[2 * i], rays[2 * i + 1], largest_coordinate);
    VisitResult result;
    result.octant = octant_of(ray);
    const NodeVisit visit = visit_node(ray, result.octant, ray.t_max, nodes + i);
    result.nodes = visit.nodes.y;
    result.primitives = visit.primitives;
    result.entered_boxes = 0;
    for (uint place = 0; place < 8; ++place) {
        const float2 interval = box_interval(ray, vload3(8 * i + place, lower), vload3(8 * i + place, upper));
        if (larger(interval.x, ray.t_min) <= smaller(interval.y, ray.t_max)) result.entered_boxes |= 1u << place;
    }
    result.wrong_planes = 0;
    for (uint axis = 0; axis < 3; ++axis) {
        const uint exponent = nodes[i].exponent[axis];
        const global float *planes = host_planes + 48 * i + 16 * axis;
        result.wrong_planes += wrong_planes(nodes[i].lower[axis], planes, exponent, nodes[i].origin[axis]);
        result.wrong_planes += wrong_planes(nodes[i].upper[axis], planes + 8, exponent, nodes[i].origin[axis]);
    }
    results[i] = result;
}
