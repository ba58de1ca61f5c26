// Makes one ray ready in the space of an instance, its three axes side by side.
#include "device/ray.x4.cl"
#include "device/ray_group.x1.cl"
#include "device/store_rays.x1.cl"

#if CASTOR_HAS_INSTANCES
// Returns a matrix's column; the fourth component repeats the third.
CASTOR_INLINE float4 column_of_rows(const float x, const float y, const float z) { return (float4)(x, y, z, z); }

// Stores the ray at place 0 of `world` at place 0 of `object`, in the instance's space, without any hit: bit for bit
// what make_object_ray and store_rays do, but with axes x, y and z as the components of vectors, which needs a third of
// the divisions. Stores only what the tests in an instance read. Returns 0, and stores nothing, where the ray can hit
// nothing there.
CASTOR_INLINE int store_object_ray(RayGroup *object, const RayGroup *world, const global Instance *instance,
                                   const float largest_coordinate)
{
    float x = world->world_origin_x[0], y = world->world_origin_y[0], z = world->world_origin_z[0];
#if CASTOR_HAS_MOTION  // as if the instance rested: see moved_point
    x = fma(-world->time[0], instance->motion[0], x);
    y = fma(-world->time[0], instance->motion[1], y);
    z = fma(-world->time[0], instance->motion[2], z);
#endif
    const global float(*m)[4] = instance->to_object;
    const float4 column_x = column_of_rows(m[0][0], m[1][0], m[2][0]);
    const float4 column_y = column_of_rows(m[0][1], m[1][1], m[2][1]);
    const float4 column_z = column_of_rows(m[0][2], m[1][2], m[2][2]);
    const float4 shift = column_of_rows(m[0][3], m[1][3], m[2][3]);
    const float4 origin = fma(column_x, (float4)(x), fma(column_y, (float4)(y), fma(column_z, (float4)(z), shift)));
    const float4 direction = fma(column_x, (float4)(world->direction_x[0]),
                                 fma(column_y, (float4)(world->direction_y[0]), column_z * world->direction_z[0]));
    const float4 size = fabs(direction);
    const float t_min = world->t_min[0], t_max = world->t_max[0];
    // As in is_traceable.
    const int4 is_finite = (fabs(origin) <= CASTOR_MAX_COORDINATE) & (size <= FLT_MAX);
    if (mask_of4(is_finite) != 15u || !mask_of4(size >= FLT_MIN) || !(t_min <= t_max)) return 0;
    object->t_min[0] = t_min;
    object->t_max[0] = t_max;

    // As in with_slabs_and_shear.
    const float4 inverse = slab_inverse4(direction);
    const float farthest = larger(fabs(origin.x), larger(fabs(origin.y), fabs(origin.z)));
    const float4 padding = CASTOR_BOX_PADDING * (largest_coordinate + farthest) * fabs(inverse);
    const float4 offset = -(origin * inverse);
    const float4 entry = offset - padding;
    const float4 exit = offset + padding;
    object->inverse_x[0] = inverse.x;
    object->inverse_y[0] = inverse.y;
    object->inverse_z[0] = inverse.z;
    object->entry_x[0] = entry.x;
    object->entry_y[0] = entry.y;
    object->entry_z[0] = entry.z;
    object->exit_x[0] = exit.x;
    object->exit_y[0] = exit.y;
    object->exit_z[0] = exit.z;
    object->near_x[0] = near_plane_bytes(direction.x, 0);
    object->near_y[0] = near_plane_bytes(direction.y, 1);
    object->near_z[0] = near_plane_bytes(direction.z, 2);

    float origins[4], directions[4], inverses[4];
    vstore4(origin, 0, origins);
    vstore4(direction, 0, directions);
    vstore4(inverse, 0, inverses);
    const uint kz = size.z > larger(size.x, size.y) ? 2u : size.y > size.x ? 1u : 0u;
    const uint next = kz == 2u ? 0u : kz + 1u;
    const uint last = next == 2u ? 0u : next + 1u;
    const int mirrored = directions[kz] < 0.0f;
    const uint kx = mirrored ? last : next;
    const uint ky = mirrored ? next : last;
    object->kx[0] = kx;
    object->ky[0] = ky;
    object->kz[0] = kz;
    object->origin_x[0] = origins[kx];
    object->origin_y[0] = origins[ky];
    object->origin_z[0] = origins[kz];
    object->shear_x[0] = directions[kx] * inverses[kz];
    object->shear_y[0] = directions[ky] * inverses[kz];
    object->shear_z[0] = inverses[kz];
#if CASTOR_HAS_SPHERES
    object->world_origin_x[0] = origin.x;
    object->world_origin_y[0] = origin.y;
    object->world_origin_z[0] = origin.z;
    object->direction_x[0] = direction.x;
    object->direction_y[0] = direction.y;
    object->direction_z[0] = direction.z;
    const DoubleFloat squared = direction_squared(direction.x, direction.y, direction.z);
    object->direction_squared_high[0] = squared.high;
    object->direction_squared_low[0] = squared.low;
#endif
    return 1;
}
#endif
