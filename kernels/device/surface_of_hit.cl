// Where one ray met a primitive of any instance.
#include "device/surface.x1.cl"
#include "device/vector.cl"

CASTOR_INLINE Vectors vectors_of(const float3 v) { return vectors(v.x, v.y, v.z); }
CASTOR_INLINE float3 float3_of(const Vectors v) { return (float3)(v.x, v.y, v.z); }

CASTOR_INLINE float3 rows_times(const global float *m, const float3 v, const float w)
{
    return (float3)(fma(m[0], v.x, fma(m[1], v.y, fma(m[2], v.z, m[3] * w))),
                    fma(m[4], v.x, fma(m[5], v.y, fma(m[6], v.z, m[7] * w))),
                    fma(m[8], v.x, fma(m[9], v.y, fma(m[10], v.z, m[11] * w))));
}

CASTOR_INLINE float3 columns_times(const global float *m, const float3 v)
{
    return (float3)(fma(m[0], v.x, fma(m[4], v.y, m[8] * v.z)), fma(m[1], v.x, fma(m[5], v.y, m[9] * v.z)),
                    fma(m[2], v.x, fma(m[6], v.y, m[10] * v.z)));
}

// The inverse transpose takes normals to the world. What comes in is brought to a size near 1 before it is squared,
// since the matrix may scale a lot.
CASTOR_INLINE float3 world_normal(const global Instance *instance, const float3 normal)
{
    const float3 n = columns_times(&instance->to_object[0][0], normal);
    const float3 a = fabs(n);
    const float largest = larger(a.x, larger(a.y, a.z));
    return largest > 0.0f ? normalized(n * divide(1.0f, largest)) : n;
}

// Returns the surface of a hit in the space of what it hit; the material is that of the geometry. `primitive`: what
// primitive_of_hit says of the hit.
CASTOR_INLINE Surfaces surface_in_object(const SurfaceColumns columns, const uint primitive, const Hit hit,
                                         const float3 origin, const float3 direction)
{
    if (hit.instance == 0)
        return surfaces_in_place(columns, 1, primitive, hit.t, hit.u, hit.v, vectors_of(origin), vectors_of(direction));
    if (primitive < columns.params.triangle_count) return triangle_surfaces(columns, primitive, hit.u, hit.v);
    const global float *m = &columns.instances[hit.instance].to_object[0][0];
    const float3 point = point_on_ray(rows_times(m, origin, 1.0f), hit.t, rows_times(m, direction, 0.0f));
    const uint sphere = primitive - columns.params.triangle_count;
    return sphere_surfaces(vectors_of(point), load_rows(columns.sphere_center_radius + sphere), 0);
}

// Returns the surface of a hit.
CASTOR_INLINE Surfaces surface_of_hit(const SurfaceColumns columns, const uint primitive, const Hit hit,
                                      const float3 origin, const float3 direction)
{
    Surfaces surface = surface_in_object(columns, primitive, hit, origin, direction);
    if (hit.instance == 0) return surface;
    const global Instance *instance = columns.instances + hit.instance;
    surface.position = vectors_of(rows_times(&instance->to_world[0][0], float3_of(surface.position), 1.0f));
    surface.normal = vectors_of(world_normal(instance, float3_of(surface.normal)));
    surface.material = instance->material;
    return surface;
}
