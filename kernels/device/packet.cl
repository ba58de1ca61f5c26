// A bundle of up to 16 rays of a group that are alike, and the interval that holds all of them.
//
// The interval test may only say no where every ray's own test (enter_children) says no. Those compute, for a plane p,
// near or far, p * inverse + offset with offset = -(o * inverse) -+ padding * |inverse|, and the rounding of these
// takes at most 4 of the 64 units of CASTOR_BOX_PADDING. The bundle's bound is the least (greatest) of (p - o) *
// inverse over the corners of the bundle's intervals of o and inverse, enlarged by CASTOR_PACKET_PADDING, which is
// another 32 units, where 8 are needed: 4 for their rounding and 4 for its own, as it is computed in the same way.
// Where inverse is positive, (p - o) * inverse is least at the greatest o.
//
// For any hit, where nothing is compared with times of hits, two things make the intervals smaller. Times of each ray
// are multiplied by its speed along the longest axis, as if all directions had been given with the same component
// there: each inverse is rounded once more for it, which takes 2 units. And in place of the origins a bundle may have
// the ends of its rays, from where all times count then: shadow rays end at the same light, or near it, however far
// from each other they begin. An end is o + t_max / inverse; its rounding takes at most 7 units of the largest
// coordinate of origins and ends (division may be wrong by 2.5 ulp), and that of t_min - t_max 2.
#include "castor/shared/layout.h"
#include "device/make_ray_group.cl"

// In the tree over instances, a ray's own padding is the slope of InstanceNode times its origin's largest coordinate,
// which two roundings change by less than a part in 10^4.
#define CASTOR_PACKET_PADDING (1.5f * CASTOR_BOX_PADDING)
#define CASTOR_PACKET_OWN_PADDING (0.5f * CASTOR_BOX_PADDING)
#define CASTOR_PACKET_SLOPE 1.0001f

// How far a bundle's bounds are enlarged: by fixed + per_origin * (largest coordinate of the origins), which is then
// multiplied by the inverse.
typedef struct PacketPadding {
    float fixed, per_origin;
} PacketPadding;

CASTOR_INLINE PacketPadding padding_for_boxes(const float largest_coordinate)
{
    const PacketPadding padding = {CASTOR_PACKET_PADDING * largest_coordinate, CASTOR_PACKET_PADDING};
    return padding;
}

// A group of rays that are alike, and the bounds of all of them.
typedef struct Packet {
    RayGroup *rays;
    uint active;  // the rays that take part, as bits
    float3 least_inverse, greatest_inverse;
    // What is added to p * inverse of either, for planes through which rays enter boxes and for those through which
    // they leave them.
    float3 entry_of_least, entry_of_greatest;
    float3 exit_of_least, exit_of_greatest;
    float least_t_min, greatest_t_max;  // the latter for any hit alone
    uint near_x, near_y, near_z;
    uint kx, ky, kz;
} Packet;

#define CASTOR_COLUMN(packet, name) vload16(0, (packet)->rays->name)

CASTOR_INLINE float3 smaller3(const float3 a, const float3 b) { return a < b ? a : b; }
CASTOR_INLINE float3 larger3(const float3 a, const float3 b) { return a > b ? a : b; }

CASTOR_INLINE float greatest_of_16(const float16 v)
{
    const float8 a = larger8(v.lo, v.hi);
    const float4 b = larger4(a.lo, a.hi);
    const float2 c = b.lo > b.hi ? b.lo : b.hi;
    return larger(c.x, c.y);
}

// Bounds of a point of each ray of a bundle, and the least t_min, counted from these points.
typedef struct PointBounds {
    float3 least, greatest;
    float least_t_min;
} PointBounds;

CASTOR_INLINE PointBounds bounds_of_points(const int16 counts, const float16 x, const float16 y, const float16 z,
                                           const float16 t_min)
{
    const float16 nothing = (float16)(INFINITY);
    const float4 least =
        least_of_four_16(counts ? x : nothing, counts ? y : nothing, counts ? z : nothing, counts ? t_min : nothing);
    PointBounds bounds;
    bounds.least = least.xyz;
    bounds.greatest =
        -least_of_four_16(counts ? -x : nothing, counts ? -y : nothing, counts ? -z : nothing, nothing).xyz;
    bounds.least_t_min = least.w;
    return bounds;
}

CASTOR_INLINE float largest_coordinate_in(const PointBounds bounds)
{
    const float3 farthest = larger3(fabs(bounds.least), fabs(bounds.greatest));
    return larger(farthest.x, larger(farthest.y, farthest.z));
}

// Returns about how far points of a bundle's rays lie apart: by those of two rays, and with what their coordinates add
// to the bundle's padding.
CASTOR_INLINE float spread_of_points(const float16 x, const float16 y, const float16 z, const uint first,
                                     const uint last, const PacketPadding padding)
{
    float at[3][CASTOR_GROUP_RAYS] __attribute__((aligned(64)));
    store_reals16(x, at[0]);
    store_reals16(y, at[1]);
    store_reals16(z, at[2]);
    float sum = 0.0f;
    for (uint i = 0; i < 3; ++i)
        sum += fabs(at[i][first] - at[i][last]) + 2.0f * padding.per_origin * fabs(at[i][first]);
    return sum;
}

// Returns which of these rays, given as bits, are like the first of them: signs and longest axes are the same.
CASTOR_INLINE uint rays_like_first(const RayGroup *rays, const uint valid)
{
    const uint first = lowest_bit(valid);
    const uint negative_x = mask_of16(vload16(0, rays->inverse_x) < 0.0f);
    const uint negative_y = mask_of16(vload16(0, rays->inverse_y) < 0.0f);
    const uint negative_z = mask_of16(vload16(0, rays->inverse_z) < 0.0f);
    const uint same_axis = mask_of16(as_int16(vload16(0, rays->kz) == rays->kz[first]));
    const uint like_x = (negative_x >> first) & 1u ? negative_x : ~negative_x;
    const uint like_y = (negative_y >> first) & 1u ? negative_y : ~negative_y;
    const uint like_z = (negative_z >> first) & 1u ? negative_z : ~negative_z;
    return valid & same_axis & like_x & like_y & like_z;
}

// Makes a bundle of rays of the group that are alike, given as bits, of which there is at least one.
CASTOR_NOINLINE void make_packet(Packet *packet, RayGroup *rays, const uint valid, const PacketPadding padding,
                                 const int wants_any)
{
    packet->rays = rays;
    packet->active = valid;
    const uint leader = lowest_bit(valid);
    packet->near_x = rays->near_x[leader];
    packet->near_y = rays->near_y[leader];
    packet->near_z = rays->near_z[leader];
    packet->kx = rays->kx[leader];
    packet->ky = rays->ky[leader];
    packet->kz = rays->kz[leader];
    float16 ix = vload16(0, rays->inverse_x);
    float16 iy = vload16(0, rays->inverse_y);
    float16 iz = vload16(0, rays->inverse_z);

    // Rays that do not count bound nothing.
    const int16 counts = lanes_of_mask16(valid);
    const float16 nothing = (float16)(INFINITY);
    const float16 ox = vload16(0, rays->world_origin_x);
    const float16 oy = vload16(0, rays->world_origin_y);
    const float16 oz = vload16(0, rays->world_origin_z);
    float16 t_min = vload16(0, rays->t_min), t_max = vload16(0, rays->best_t);
    if (wants_any) {  // times by which all go equally far along the longest axis
        const float16 speed = 1.0f / fabs(packet->kz == 0 ? ix : packet->kz == 1 ? iy : iz);
        ix *= speed;
        iy *= speed;
        iz *= speed;
        t_min *= speed;
        t_max *= speed;
    }
    packet->least_inverse =
        least_of_four_16(counts ? ix : nothing, counts ? iy : nothing, counts ? iz : nothing, nothing).xyz;
    const float4 greatest = -least_of_four_16(counts ? -ix : nothing, counts ? -iy : nothing, counts ? -iz : nothing,
                                              counts ? -t_max : nothing);
    packet->greatest_inverse = greatest.xyz;
    PointBounds bounds = {(float3)(0.0f), (float3)(0.0f), 0.0f};
    float farthest = INFINITY;
    if (wants_any) {
        const float16 end_x = ox + t_max / ix, end_y = oy + t_max / iy, end_z = oz + t_max / iz;
        const uint last = 31 - clz(valid);
        if (spread_of_points(end_x, end_y, end_z, leader, last, padding) <
            spread_of_points(ox, oy, oz, leader, last, padding)) {
            const float16 of_origin = larger16(fabs(ox), larger16(fabs(oy), fabs(oz)));
            bounds = bounds_of_points(counts, end_x, end_y, end_z, t_min - t_max);
            farthest = larger(largest_coordinate_in(bounds), greatest_of_16(counts ? of_origin : (float16)(0.0f)));
            packet->greatest_t_max = 0.0f;
        }
    }
    if (!(farthest <= CASTOR_MAX_COORDINATE)) {  // of the origins it never is more
        bounds = bounds_of_points(counts, ox, oy, oz, t_min);
        farthest = largest_coordinate_in(bounds);
        packet->greatest_t_max = greatest.w;
    }
    packet->least_t_min = bounds.least_t_min;
    const float3 least_inverse = packet->least_inverse, greatest_inverse = packet->greatest_inverse;
    const float3 near_origin = least_inverse < 0.0f ? bounds.least : bounds.greatest;
    const float3 far_origin = least_inverse < 0.0f ? bounds.greatest : bounds.least;
    const float3 enlargement =
        fma(padding.per_origin, farthest, padding.fixed) * larger3(fabs(least_inverse), fabs(greatest_inverse));
    packet->entry_of_least = -(near_origin * least_inverse) - enlargement;
    packet->entry_of_greatest = -(near_origin * greatest_inverse) - enlargement;
    packet->exit_of_least = -(far_origin * least_inverse) + enlargement;
    packet->exit_of_greatest = -(far_origin * greatest_inverse) + enlargement;
}
