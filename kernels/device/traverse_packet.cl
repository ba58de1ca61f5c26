// A bundle of 16 coherent rays down the 8-wide tree: one interval test of a node's eight boxes for the whole bundle, then vectors over rays. Where few
// rays of the bundle enter a child, each of them goes on alone.
//
// The interval test may only say no where every ray's own test (enter_children) says no. Those compute, for a plane p, near or far,
// p * inverse + offset with offset = -(o * inverse) -+ padding * |inverse|, and the rounding of these takes at most 4 of the 16 units of
// CASTOR_BOX_PADDING. The bundle's bound is the least (greatest) of (p - o) * inverse over the corners of the bundle's intervals of o and inverse, enlarged by
// CASTOR_PACKET_PADDING, which is another 8 units: 4 for their rounding and 4 for its own.
#include "castor/shared/layout.h"
#include "device/traverse_wide.cl"

#define CASTOR_PACKET_RAYS 16
#define CASTOR_PACKET_PADDING (1.5f * CASTOR_BOX_PADDING)

// Bundles of no more active rays than this are not worth a vector.
#ifndef CASTOR_PACKET_FEW
#define CASTOR_PACKET_FEW 3
#endif

// 16 rays, and what bounds them all.
typedef struct Packet {
    // One element a ray, along the world's axes, or along the permuted ones (origin, shear).
    float16 inverse_x, inverse_y, inverse_z;
    float16 entry_x, entry_y, entry_z;
    float16 exit_x, exit_y, exit_z;
    float16 origin_x, origin_y, origin_z;
    float16 shear_x, shear_y, shear_z;
    float16 t_min, t_max, t_scale;
    float16 best_t, best_u, best_v;  // best_t: t_max before the first hit; -INFINITY: the ray takes no part any more
    uint16 best_primitive;
#if CASTOR_HAS_SPHERES
    float16 world_origin_x, world_origin_y, world_origin_z;
    float16 direction_x, direction_y, direction_z;
    DoubleFloat16 direction_squared;
#endif
    // Of the bundle.
    float3 least_inverse, greatest_inverse;
    float3 least_origin, greatest_origin;
    float3 padding;  // of (p - o) * inverse
    float least_t_min;
    uint near_x, near_y, near_z;
    uint kx, ky, kz;
} Packet;

CASTOR_INLINE float16 larger16(const float16 a, const float16 b) { return a > b ? a : b; }
CASTOR_INLINE float16 smaller16(const float16 a, const float16 b) { return a < b ? a : b; }
CASTOR_INLINE uint mask_of_16(const int16 is_true) { return mask_of_8(is_true.lo) | mask_of_8(is_true.hi) << 8; }

CASTOR_INLINE float get_lane(const float16 *vector, const uint lane) { return ((const float *)vector)[lane]; }
CASTOR_INLINE void set_lane(float16 *vector, const uint lane, const float value) { ((float *)vector)[lane] = value; }
CASTOR_INLINE float3 smaller3(const float3 a, const float3 b) { return a < b ? a : b; }
CASTOR_INLINE float3 larger3(const float3 a, const float3 b) { return a > b ? a : b; }

CASTOR_INLINE float least_of_16(const float16 v)
{
    const float8 a = smaller8(v.lo, v.hi);
    const float4 b = smaller4(a.lo, a.hi);
    const float2 c = b.lo < b.hi ? b.lo : b.hi;
    return smaller(c.x, c.y);
}

CASTOR_INLINE float greatest_of_16(const float16 v)
{
    const float8 a = larger8(v.lo, v.hi);
    const float4 b = larger4(a.lo, a.hi);
    const float2 c = b.lo > b.hi ? b.lo : b.hi;
    return larger(c.x, c.y);
}

// slab_inverse, ray by ray.
CASTOR_INLINE float16 slab_inverse16(const float16 d)
{
    const float16 smallest = d < 0.0f ? (float16)(-CASTOR_SMALLEST_DIRECTION) : (float16)(CASTOR_SMALLEST_DIRECTION);
    return divide16((float16)(1.0f), fabs(d) < CASTOR_SMALLEST_DIRECTION ? smallest : d);
}

// Makes rays [begin, end) of the columns, at most 16, ready: make_trace_ray, ray by ray, in the same order. Returns the rays that can hit anything, as bits, or
// ~0 if they are too unlike to share a bundle: signs or longest axes differ.
CASTOR_INLINE uint make_packet(Packet *packet, const TraceParams params, const uint begin, const uint end,
                               const global float4 *restrict ray_origin_tmin, const global float4 *restrict ray_direction_tmax)
{
    float16 columns[8];
    for (uint i = 0; i < CASTOR_PACKET_RAYS; ++i) {
        // Lanes beyond the end repeat the last ray, and take no part.
        const size_t row = (size_t)min(begin + i, end - 1) * params.ray_stride;
        const float4 origin_tmin = ray_origin_tmin[row];
        const float4 direction_tmax = ray_direction_tmax[row + params.direction_offset];
        set_lane(&columns[0], i, origin_tmin.x);
        set_lane(&columns[1], i, origin_tmin.y);
        set_lane(&columns[2], i, origin_tmin.z);
        set_lane(&columns[3], i, origin_tmin.w);
        set_lane(&columns[4], i, direction_tmax.x);
        set_lane(&columns[5], i, direction_tmax.y);
        set_lane(&columns[6], i, direction_tmax.z);
        set_lane(&columns[7], i, direction_tmax.w);
    }
    float16 ox = columns[0];
    float16 oy = columns[1];
    float16 oz = columns[2];
    float16 t_min = columns[3];
    float16 dx = columns[4];
    float16 dy = columns[5];
    float16 dz = columns[6];
    float16 t_max = columns[7];

    // is_traceable
    const float16 ax = fabs(dx);
    const float16 ay = fabs(dy);
    const float16 az = fabs(dz);
    const int16 origin_is_near = (fabs(ox) <= CASTOR_MAX_COORDINATE) & (fabs(oy) <= CASTOR_MAX_COORDINATE) & (fabs(oz) <= CASTOR_MAX_COORDINATE);
    const int16 direction_is_finite = (ax <= FLT_MAX) & (ay <= FLT_MAX) & (az <= FLT_MAX);
    const int16 direction_is_normal = (ax >= FLT_MIN) | (ay >= FLT_MIN) | (az >= FLT_MIN);
    const int16 traceable = origin_is_near & direction_is_finite & direction_is_normal & (t_min <= t_max);
    const int16 lane = (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const int16 takes_part = traceable & (lane < (int)(end - begin));
    const uint valid = mask_of_16(takes_part);
    if (!valid) return 0;

    // The others copy one of these, so that bounds and comparisons are those of valid rays.
    const uint leader = lowest_bit(valid);
    ox = traceable ? ox : (float16)(get_lane(&columns[0], leader));
    oy = traceable ? oy : (float16)(get_lane(&columns[1], leader));
    oz = traceable ? oz : (float16)(get_lane(&columns[2], leader));
    t_min = traceable ? t_min : (float16)(get_lane(&columns[3], leader));
    t_max = traceable ? t_max : (float16)(get_lane(&columns[7], leader));
    dx = traceable ? dx : (float16)(get_lane(&columns[4], leader));
    dy = traceable ? dy : (float16)(get_lane(&columns[5], leader));
    dz = traceable ? dz : (float16)(get_lane(&columns[6], leader));

    const float16 largest = larger16(fabs(dx), larger16(fabs(dy), fabs(dz)));
    const int16 exponent = as_int16(largest) >> 23;
    const int16 scale_exponent = exponent > 253 ? (int16)(1) : 254 - exponent;
    const float16 scale = as_float16(scale_exponent << 23);
    const float16 inverse_scale = as_float16((254 - scale_exponent) << 23);
    dx *= scale;
    dy *= scale;
    dz *= scale;
    packet->t_scale = scale;
    const float16 finite_t_max = smaller16(t_max, (float16)(FLT_MAX));
    const float16 scaled_min = t_min * inverse_scale;
    const float16 scaled_max = finite_t_max * inverse_scale;
    packet->t_min = scaled_min * scale < t_min ? scaled_min + 0x1p-149f : scaled_min;
    packet->t_max = scaled_max * scale > finite_t_max ? scaled_max - 0x1p-149f : scaled_max;

    const int16 axis = fabs(dz) > larger16(fabs(dx), fabs(dy)) ? (int16)(2) : fabs(dy) > fabs(dx) ? (int16)(1) : (int16)(0);
    const int leader_axis = ((const int *)&axis)[leader];
    const uint down_x = mask_of_16(dx < 0.0f);
    const uint down_y = mask_of_16(dy < 0.0f);
    const uint down_z = mask_of_16(dz < 0.0f);
    const int is_alike = (down_x == 0 || down_x == 0xffffu) && (down_y == 0 || down_y == 0xffffu) && (down_z == 0 || down_z == 0xffffu) &&
                         mask_of_16(axis == leader_axis) == 0xffffu;
    if (!is_alike) return ~0u;

    const float16 ix = slab_inverse16(dx);
    const float16 iy = slab_inverse16(dy);
    const float16 iz = slab_inverse16(dz);
    packet->inverse_x = ix;
    packet->inverse_y = iy;
    packet->inverse_z = iz;
    const float16 farthest = larger16(fabs(ox), larger16(fabs(oy), fabs(oz)));
    const float16 padding = CASTOR_BOX_PADDING * (params.largest_coordinate + farthest);
    packet->entry_x = -(ox * ix) - padding * fabs(ix);
    packet->entry_y = -(oy * iy) - padding * fabs(iy);
    packet->entry_z = -(oz * iz) - padding * fabs(iz);
    packet->exit_x = -(ox * ix) + padding * fabs(ix);
    packet->exit_y = -(oy * iy) + padding * fabs(iy);
    packet->exit_z = -(oz * iz) + padding * fabs(iz);

    packet->near_x = 0 * CASTOR_PLANE_BYTES + (down_x ? CASTOR_PLANE_BYTES : 0u);
    packet->near_y = 2 * CASTOR_PLANE_BYTES + (down_y ? CASTOR_PLANE_BYTES : 0u);
    packet->near_z = 4 * CASTOR_PLANE_BYTES + (down_z ? CASTOR_PLANE_BYTES : 0u);
    const uint next = leader_axis == 2 ? 0 : leader_axis + 1;
    const uint last = next == 2 ? 0 : next + 1;
    const uint mirrored = leader_axis == 0 ? down_x : leader_axis == 1 ? down_y : down_z;
    packet->kz = leader_axis;
    packet->kx = mirrored ? last : next;
    packet->ky = mirrored ? next : last;
    const float16 origin[3] = {ox, oy, oz};
    const float16 direction[3] = {dx, dy, dz};
    const float16 inverse[3] = {ix, iy, iz};
    packet->origin_x = origin[packet->kx];
    packet->origin_y = origin[packet->ky];
    packet->origin_z = origin[packet->kz];
    packet->shear_x = -(direction[packet->kx] * inverse[packet->kz]);
    packet->shear_y = -(direction[packet->ky] * inverse[packet->kz]);
    packet->shear_z = inverse[packet->kz];

#if CASTOR_HAS_SPHERES
    packet->world_origin_x = ox;
    packet->world_origin_y = oy;
    packet->world_origin_z = oz;
    packet->direction_x = dx;
    packet->direction_y = dy;
    packet->direction_z = dz;
    packet->direction_squared =
        add_double_float16(add_double_float16(two_product16(dx, dx), two_product16(dy, dy)), two_product16(dz, dz));
#endif
    packet->least_inverse = (float3)(least_of_16(ix), least_of_16(iy), least_of_16(iz));
    packet->greatest_inverse = (float3)(greatest_of_16(ix), greatest_of_16(iy), greatest_of_16(iz));
    packet->least_origin = (float3)(least_of_16(ox), least_of_16(oy), least_of_16(oz));
    packet->greatest_origin = (float3)(greatest_of_16(ox), greatest_of_16(oy), greatest_of_16(oz));
    const float reach = params.largest_coordinate + greatest_of_16(farthest);
    packet->padding = (CASTOR_PACKET_PADDING * reach) * larger3(fabs(packet->least_inverse), fabs(packet->greatest_inverse));
    packet->least_t_min = least_of_16(packet->t_min);

    packet->best_t = takes_part ? packet->t_max : (float16)(-INFINITY);
    packet->best_u = (float16)(0.0f);
    packet->best_v = (float16)(0.0f);
    packet->best_primitive = (uint16)(CASTOR_INVALID_INDEX);
    return valid;
}

// The rays of the bundle that enter the box at `place` of the node no later than their best hit, as bits.
CASTOR_INLINE uint rays_in_child(const Packet *packet, const global WideNode *wide_node, const uint place)
{
    const global uchar *node = (const global uchar *)wide_node + 4 * place;
    const float16 near_x = (float16)(*(const global float *)(node + packet->near_x));
    const float16 near_y = (float16)(*(const global float *)(node + packet->near_y));
    const float16 near_z = (float16)(*(const global float *)(node + packet->near_z));
    const float16 far_x = (float16)(*(const global float *)(node + (packet->near_x ^ CASTOR_PLANE_BYTES)));
    const float16 far_y = (float16)(*(const global float *)(node + (packet->near_y ^ CASTOR_PLANE_BYTES)));
    const float16 far_z = (float16)(*(const global float *)(node + (packet->near_z ^ CASTOR_PLANE_BYTES)));
    const float16 entry = larger16(larger16(fma(near_x, packet->inverse_x, packet->entry_x), fma(near_y, packet->inverse_y, packet->entry_y)),
                                   larger16(fma(near_z, packet->inverse_z, packet->entry_z), packet->t_min));
    const float16 exit = smaller16(smaller16(fma(far_x, packet->inverse_x, packet->exit_x), fma(far_y, packet->inverse_y, packet->exit_y)),
                                   smaller16(fma(far_z, packet->inverse_z, packet->exit_z), packet->best_t));
    return mask_of_16(entry <= exit);
}

// Bounds of (p - o) * inverse over the bundle, for eight planes of one axis: where inverse is positive, least at the greatest origin.
CASTOR_INLINE float8 least_entry(const float8 plane, const float origin, const float least, const float greatest, const float padding)
{
    const float8 d = plane - origin;
    return smaller8(fma(d, (float8)(least), (float8)(-padding)), fma(d, (float8)(greatest), (float8)(-padding)));
}

CASTOR_INLINE float8 greatest_exit(const float8 plane, const float origin, const float least, const float greatest, const float padding)
{
    const float8 d = plane - origin;
    return larger8(fma(d, (float8)(least), (float8)(padding)), fma(d, (float8)(greatest), (float8)(padding)));
}

// The children that some ray of the bundle may enter no later than `limit`, as bits; *entry is a lower bound of when.
CASTOR_INLINE uint enter_children_together(const Packet *packet, const global WideNode *wide_node, const float limit, float8 *entry)
{
    const global uchar *node = (const global uchar *)wide_node;
    const float3 low = packet->least_inverse;
    const float3 high = packet->greatest_inverse;
    const float near_ox = low.x < 0.0f ? packet->least_origin.x : packet->greatest_origin.x;
    const float near_oy = low.y < 0.0f ? packet->least_origin.y : packet->greatest_origin.y;
    const float near_oz = low.z < 0.0f ? packet->least_origin.z : packet->greatest_origin.z;
    const float far_ox = low.x < 0.0f ? packet->greatest_origin.x : packet->least_origin.x;
    const float far_oy = low.y < 0.0f ? packet->greatest_origin.y : packet->least_origin.y;
    const float far_oz = low.z < 0.0f ? packet->greatest_origin.z : packet->least_origin.z;
    const float8 entry_x = least_entry(node_planes(node, packet->near_x), near_ox, low.x, high.x, packet->padding.x);
    const float8 entry_y = least_entry(node_planes(node, packet->near_y), near_oy, low.y, high.y, packet->padding.y);
    const float8 entry_z = least_entry(node_planes(node, packet->near_z), near_oz, low.z, high.z, packet->padding.z);
    const float8 exit_x = greatest_exit(node_planes(node, packet->near_x ^ CASTOR_PLANE_BYTES), far_ox, low.x, high.x, packet->padding.x);
    const float8 exit_y = greatest_exit(node_planes(node, packet->near_y ^ CASTOR_PLANE_BYTES), far_oy, low.y, high.y, packet->padding.y);
    const float8 exit_z = greatest_exit(node_planes(node, packet->near_z ^ CASTOR_PLANE_BYTES), far_oz, low.z, high.z, packet->padding.z);
    *entry = larger8(larger8(entry_x, entry_y), larger8(entry_z, (float8)(packet->least_t_min)));
    const float8 exit = smaller8(smaller8(exit_x, exit_y), smaller8(exit_z, (float8)(limit)));
    return mask_of_8(*entry <= exit);
}

CASTOR_INLINE float16 exact_where_zero16(const float16 difference, const float16 ax, const float16 ay, const float16 bx, const float16 by)
{
    const float16 exact = fma(ax, by, -(ax * by)) - fma(ay, bx, -(ay * bx));
    return difference == 0.0f ? exact : difference;
}

// The own-box rule and nearer_hit, ray by ray: takes the candidates of one primitive where they count and are better.
CASTOR_INLINE void accept_together(Packet *packet, const float3 lower, const float3 upper, int16 accepted, const float16 t, const float16 u,
                                   const float16 v, const uint primitive)
{
    const float3 near_plane = packet->least_inverse < 0.0f ? upper : lower;
    const float3 far_plane = packet->least_inverse < 0.0f ? lower : upper;
    float16 entry = larger16(fma((float16)(near_plane.x), packet->inverse_x, packet->entry_x),
                             larger16(fma((float16)(near_plane.y), packet->inverse_y, packet->entry_y),
                                      fma((float16)(near_plane.z), packet->inverse_z, packet->entry_z)));
    float16 exit = smaller16(fma((float16)(far_plane.x), packet->inverse_x, packet->exit_x),
                             smaller16(fma((float16)(far_plane.y), packet->inverse_y, packet->exit_y),
                                       fma((float16)(far_plane.z), packet->inverse_z, packet->exit_z)));
    entry = larger16(entry, packet->t_min);
    exit = smaller16(exit, packet->t_max);
    accepted &= (t >= packet->t_min) & (t <= packet->t_max) & (entry <= exit);
    const float16 limited = smaller16(larger16(t, entry), exit);
    accepted &= (limited < packet->best_t) | ((limited == packet->best_t) & ((uint16)(primitive) < packet->best_primitive));
    packet->best_t = accepted ? limited : packet->best_t;
    packet->best_u = accepted ? u : packet->best_u;
    packet->best_v = accepted ? v : packet->best_v;
    packet->best_primitive = accepted ? (uint16)(primitive) : packet->best_primitive;
}

// One triangle of a block against the bundle: intersect_triangle, ray by ray, in the same order.
CASTOR_INLINE void visit_triangle_together(Packet *packet, const SceneColumns scene, const global TriangleBlock *block, const uint place)
{
    CASTOR_COUNT(scene, BUNDLE_TRIANGLE);
    const global float *at = (const global float *)block + place;
    const uint kx = 4 * packet->kx;
    const uint ky = 4 * packet->ky;
    const uint kz = 4 * packet->kz;
    const float16 az = at[kz] - packet->origin_z;
    const float16 bz = at[12 + kz] - packet->origin_z;
    const float16 cz = at[24 + kz] - packet->origin_z;
    const float16 ax = fma(packet->shear_x, az, at[kx] - packet->origin_x);
    const float16 ay = fma(packet->shear_y, az, at[ky] - packet->origin_y);
    const float16 bx = fma(packet->shear_x, bz, at[12 + kx] - packet->origin_x);
    const float16 by = fma(packet->shear_y, bz, at[12 + ky] - packet->origin_y);
    const float16 cx = fma(packet->shear_x, cz, at[24 + kx] - packet->origin_x);
    const float16 cy = fma(packet->shear_y, cz, at[24 + ky] - packet->origin_y);
    float16 u = cx * by - cy * bx;
    float16 v = ax * cy - ay * cx;
    float16 w = bx * ay - by * ax;
    const float16 least = smaller16(u, smaller16(v, w));
    const float16 most = larger16(u, larger16(v, w));
    int16 accepted = (least >= 0.0f) | (most <= 0.0f);
    if (!mask_of_16(accepted)) return;

    if (mask_of_16(accepted & ((u == 0.0f) | (v == 0.0f) | (w == 0.0f)))) {
        u = exact_where_zero16(u, cx, cy, bx, by);
        v = exact_where_zero16(v, ax, ay, cx, cy);
        w = exact_where_zero16(w, bx, by, ax, ay);
        accepted &= ~(((u < 0.0f) | (v < 0.0f) | (w < 0.0f)) & ((u > 0.0f) | (v > 0.0f) | (w > 0.0f)));
    }
    const float16 determinant = u + v + w;
    accepted &= fabs(determinant) >= FLT_MIN;
    const uint primitive = block->primitive[place];
    if (scene.params.flags & CASTOR_TRACE_CULL_BACK_FACES) {
        Candidate from_behind = no_candidate();
        from_behind.from_behind = 1;
        if (is_culled(scene, primitive, from_behind)) accepted &= determinant > 0.0f;
    }
    if (!mask_of_16(accepted)) return;

    const float16 r = divide16((float16)(1.0f), determinant);
    const float16 hit_u = v * r;
    const float16 hit_v = w * r;
    const float16 t = fma(u * r, packet->shear_z * az, fma(hit_u, packet->shear_z * bz, hit_v * (packet->shear_z * cz)));

    const float3 p0 = (float3)(at[0], at[4], at[8]);
    const float3 p1 = (float3)(at[12], at[16], at[20]);
    const float3 p2 = (float3)(at[24], at[28], at[32]);
    accept_together(packet, smaller3(p0, smaller3(p1, p2)), larger3(p0, larger3(p1, p2)), accepted, t, hit_u, hit_v, primitive);
}

#if CASTOR_HAS_SPHERES
// One sphere of a block against the bundle: intersect_sphere, ray by ray.
CASTOR_INLINE void visit_sphere_together(Packet *packet, const global SphereBlock *block, const uint place)
{
    const float3 center = (float3)(block->center_radius[0][place], block->center_radius[1][place], block->center_radius[2][place]);
    const float radius = block->center_radius[3][place];
    const SphereRoots16 roots =
        sphere_roots16(packet->world_origin_x, packet->world_origin_y, packet->world_origin_z, packet->direction_x, packet->direction_y,
                       packet->direction_z, packet->direction_squared, (float16)(center.x), (float16)(center.y), (float16)(center.z),
                       (float16)(radius));
    const int16 near_counts = (roots.near_t >= packet->t_min) & (roots.near_t <= packet->t_max);
    const float16 t = near_counts ? roots.near_t : roots.far_t;
    accept_together(packet, center - radius, center + radius, t == t, t, (float16)(0.0f), (float16)(0.0f), block->primitive[place]);
}
#endif

// The greatest best t of the bundle: nothing beyond it matters.
CASTOR_INLINE float packet_limit(const Packet *packet) { return greatest_of_16(packet->best_t); }

// With any hit, a ray that has one takes no part any more.
CASTOR_INLINE void retire_decided(Packet *packet)
{
    packet->best_t = packet->best_primitive != CASTOR_INVALID_INDEX ? (float16)(-INFINITY) : packet->best_t;
}

CASTOR_INLINE Hit best_of_lane(const Packet *packet, const uint place)
{
    Hit best;
    best.t = get_lane(&packet->best_t, place);
    best.u = get_lane(&packet->best_u, place);
    best.v = get_lane(&packet->best_v, place);
    best.primitive = ((const uint *)&packet->best_primitive)[place];
    best.instance = 0;
    return best;
}

CASTOR_INLINE void set_best_of_lane(Packet *packet, const uint place, const Hit best)
{
    set_lane(&packet->best_t, place, best.t);
    set_lane(&packet->best_u, place, best.u);
    set_lane(&packet->best_v, place, best.v);
    ((uint *)&packet->best_primitive)[place] = best.primitive;
}

// One ray of the bundle, to go on alone.
CASTOR_INLINE void leave_bundle(const Packet *packet, WideLane *lane, const uint place)
{
    BlockRay *ray = &lane->ray;
    ray->inverse_x = get_lane(&packet->inverse_x, place);
    ray->inverse_y = get_lane(&packet->inverse_y, place);
    ray->inverse_z = get_lane(&packet->inverse_z, place);
    ray->entry_x = get_lane(&packet->entry_x, place);
    ray->entry_y = get_lane(&packet->entry_y, place);
    ray->entry_z = get_lane(&packet->entry_z, place);
    ray->exit_x = get_lane(&packet->exit_x, place);
    ray->exit_y = get_lane(&packet->exit_y, place);
    ray->exit_z = get_lane(&packet->exit_z, place);
    ray->t_min = get_lane(&packet->t_min, place);
    ray->t_max = get_lane(&packet->t_max, place);
    ray->origin_x = get_lane(&packet->origin_x, place);
    ray->origin_y = get_lane(&packet->origin_y, place);
    ray->origin_z = get_lane(&packet->origin_z, place);
    ray->shear_x = get_lane(&packet->shear_x, place);
    ray->shear_y = get_lane(&packet->shear_y, place);
    ray->shear_z = get_lane(&packet->shear_z, place);
#if CASTOR_HAS_SPHERES
    ray->world_origin = (float3)(get_lane(&packet->world_origin_x, place), get_lane(&packet->world_origin_y, place),
                                 get_lane(&packet->world_origin_z, place));
    ray->world_direction = (float3)(get_lane(&packet->direction_x, place), get_lane(&packet->direction_y, place),
                                    get_lane(&packet->direction_z, place));
    ray->direction_squared.high = get_lane(&packet->direction_squared.high, place);
    ray->direction_squared.low = get_lane(&packet->direction_squared.low, place);
#endif
    ray->kx = packet->kx;
    ray->ky = packet->ky;
    ray->kz = packet->kz;
    lane->near_x = packet->near_x;
    lane->near_y = packet->near_y;
    lane->near_z = packet->near_z;
    lane->best = best_of_lane(packet, place);
}

// One ray of the bundle goes on alone, below `child`.
CASTOR_INLINE void visit_child_alone(Packet *packet, const SceneColumns scene, const uint place,
                                     const uint child, const int wants_any, WaitingChild *waiting)
{
    WideLane alone;
    WideLane *lane = &alone;
    leave_bundle(packet, lane, place);
    lane->current = child;
    lane->waiting_count = 0;
    follow_lane(lane, &scene, wants_any, waiting);
    set_best_of_lane(packet, place, lane->best);
}

// A child that waits: `place` of `node`, entered by no ray before `entry`.
typedef struct WaitingGroup {
    float entry;
    uint node;
    uint place;
} WaitingGroup;

// The bundle from the root down.
CASTOR_INLINE void trace_packet(Packet *packet, const SceneColumns scene, const int wants_any, WaitingGroup *groups,
                                WaitingChild *waiting)
{
    float limit = packet_limit(packet);
    int group_count = 0;
    uint node_index = scene.params.wide_root;
    while (1) {
        const global WideNode *node = scene.wide_nodes + node_index;
        CASTOR_COUNT(scene, BUNDLE_NODE);
        float8 entry;
        uint mask = enter_children_together(packet, node, limit, &entry);
        const int base = group_count;
        float entries[8];
        vstore8(entry, 0, entries);
        for (; mask; mask &= mask - 1) {
            const uint place = lowest_bit(mask);
            const WaitingGroup group = {entries[place], node_index, place};
            int at = group_count++;
            if (!wants_any)
                for (; at > base && groups[at - 1].entry < group.entry; --at) groups[at] = groups[at - 1];
            groups[at] = group;
        }

        // Children that few rays enter, and leaves, are done here; the first other one is entered by all.
        node_index = CASTOR_INVALID_INDEX;
        while (group_count > 0 && node_index == CASTOR_INVALID_INDEX) {
            const WaitingGroup group = groups[--group_count];
            if (!(group.entry <= limit)) continue;
            const global WideNode *parent = scene.wide_nodes + group.node;
            CASTOR_COUNT(scene, BUNDLE_BOX);
            uint entering = rays_in_child(packet, parent, group.place);
            if (!entering) continue;
            const uint child = parent->child[group.place];
            const int is_leaf = (child & CASTOR_WIDE_LEAF) != 0;
            if (popcount(entering) <= CASTOR_PACKET_FEW) {
                for (; entering; entering &= entering - 1)
                    visit_child_alone(packet, scene, lowest_bit(entering), child, wants_any, waiting);
#if CASTOR_HAS_SPHERES
            } else if (is_leaf && (child & CASTOR_WIDE_SPHERES)) {
                for (uint i = first_block(child); i < end_block(child); ++i) {
                    const global SphereBlock *block = scene.sphere_blocks + i;
                    for (uint place = 0; place < 4 && block->primitive[place] != CASTOR_INVALID_INDEX; ++place) {
                        CASTOR_COUNT(scene, BUNDLE_SPHERE);
                        visit_sphere_together(packet, block, place);
                    }
                }
#endif
            } else if (is_leaf) {
                for (uint i = first_block(child); i < end_block(child); ++i) {
                    const global TriangleBlock *block = scene.triangle_blocks + i;
                    for (uint place = 0; place < 4 && block->primitive[place] != CASTOR_INVALID_INDEX; ++place)
                        visit_triangle_together(packet, scene, block, place);
                }
            } else {
                node_index = child;
                continue;
            }
            if (wants_any) retire_decided(packet);
            limit = packet_limit(packet);
        }
        if (node_index == CASTOR_INVALID_INDEX) return;
    }
}

// Traces rays [begin, end) of the columns, at most 16: as a bundle where they are alike, else one by one.
CASTOR_INLINE void trace_bundle(const SceneColumns scene, const uint begin, const uint end, const int wants_any,
                                const global float4 *restrict ray_origin_tmin, const global float4 *restrict ray_direction_tmax,
                                global Hit *restrict hits, global uchar *restrict occluded)
{
    Packet packet;
    const uint valid = make_packet(&packet, scene.params, begin, end, ray_origin_tmin, ray_direction_tmax);
    WaitingChild waiting[CASTOR_MAX_WIDE_STACK];
    if (valid == ~0u) {
        for (uint i = begin; i < end; ++i) {
            WideLane lane;
            begin_lane(&lane, scene, load_ray(scene.params, i, ray_origin_tmin, ray_direction_tmax), i);
            if (!(wants_any && lane.best.primitive != CASTOR_INVALID_INDEX)) follow_lane(&lane, &scene, wants_any, waiting);
            if (wants_any)
                occluded[i] = lane.best.primitive != CASTOR_INVALID_INDEX;
            else
                hits[i] = finished_hit(lane.t_scale, lane.best);
        }
        return;
    }
    if (CASTOR_HAS_PLANES) {
        for (uint mask = valid; mask; mask &= mask - 1) {
            const uint place = lowest_bit(mask);
            const TraceRay ray = load_ray(scene.params, begin + place, ray_origin_tmin, ray_direction_tmax);
            set_best_of_lane(&packet, place, nearest_plane(scene, ray, best_of_lane(&packet, place)));
        }
        if (wants_any) retire_decided(&packet);
    }
    if (valid && scene.params.wide_root != CASTOR_INVALID_INDEX) {
        WaitingGroup groups[CASTOR_MAX_WIDE_STACK];
        trace_packet(&packet, scene, wants_any, groups, waiting);
    }
    for (uint i = 0; begin + i < end; ++i) {
        const Hit best = valid >> i & 1 ? best_of_lane(&packet, i) : miss();
        if (wants_any)
            occluded[begin + i] = best.primitive != CASTOR_INVALID_INDEX;
        else
            hits[begin + i] = finished_hit(get_lane(&packet.t_scale, i), best);
    }
}
