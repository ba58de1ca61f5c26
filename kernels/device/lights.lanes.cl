// Lights with an extent, for CASTOR_LANES lanes (see lanes.cl): a sample is the light that one random point of them
// sends, divided by the density with which it is drawn.
//
// Emitting surfaces send their radiance to both sides. They hide one another, and the far sides of themselves, as any
// surface does: a closed lamp lights by what is seen of it.
#include "device/features.cl"
#include "device/frame.lanes.cl"
#include "device/random.lanes.cl"
#include "device/shading.lanes.cl"

#define CASTOR_EMITTER_WORDS 20u  // types.h asserts the sizes
#define CASTOR_LIGHT_ROWS 6u
// The cosine that smooth_densities supposes at a light. Any is without bias. Of 0.3, 0.5, 0.65, 0.8 and 1, this one
// leaves the variance that the triangles' own normals would: between 0.95 and 1.03 times as much, under balls.
#define CASTOR_SUPPOSED_COSINE 0.8f

CASTOR_INLINE LANES(Vectors) LANES(limited_light)(const LANES(Vectors) radiance, const Real factor)
{
    const Real limited = LANES(limited_irradiance)(factor);
    return LANES(vectors)(LANES(limited_irradiance)(radiance.x * limited),
                          LANES(limited_irradiance)(radiance.y * limited),
                          LANES(limited_irradiance)(radiance.z * limited));
}

// Returns 1 / x; 0 where there is none.
CASTOR_INLINE Real LANES(inverse_or_zero)(const Real x)
{
    const Mask is_usual = (x > 0.0f) & (x <= FLT_MAX);
    return is_usual ? LANES(divide)((Real)(1.0f), is_usual ? x : (Real)(1.0f)) : (Real)(0.0f);
}

#if CASTOR_TRACES_PATHS
// Returns the density with which directions to the disk of a directional light are drawn, by solid angle; 0 where it is
// not seen.
CASTOR_INLINE float density_of_sun(const Light light)
{
    return CASTOR_IS_SUN(light) ? divide(1.0f, 6.2831855f * light.size) : 0.0f;
}

// Tells which unit directions lead to the disk of a sun. The difference of directions is exact where a cosine is not.
CASTOR_INLINE Mask LANES(lead_to_sun)(const Light light, const LANES(Vectors) direction)
{
    const LANES(Vectors) off = LANES(sum_of_vectors)(direction, LANES(same_vectors)(light.direction));
    return LANES(dot_products)(off, off) <= 2.0f * light.size;
}
#endif

// Returns what arrives from directions to the disk of a directional light.
CASTOR_INLINE LANES(LightSamples)
    LANES(sample_disk)(const Light light, const LANES(Vectors) position, const LANES(Points) at)
{
    LANES(LightSamples) sample = LANES(sample_light)(light, position);
    const Real off_axis = at.x * light.size;  // 1 - the cosine
    const Real sine = LANES(square_root)(off_axis * (2.0f - off_axis));
    sample.wi = LANES(normalized_vectors)(LANES(directions_around)(sample.wi, 1.0f - off_axis, sine, at.y));
#if CASTOR_TRACES_PATHS
    sample.density = (Real)(density_of_sun(light));
#endif
    return sample;
}

// Returns what arrives from points, of a uniform density on a surface of this area, where `normal` is the surface's:
// radiance * area * cosine / distance^2.
CASTOR_INLINE LANES(LightSamples)
    LANES(light_of_surface)(const LANES(Vectors) radiance, const LANES(Vectors) position, const LANES(Vectors) point,
                            const LANES(Vectors) normal, const Real area)
{
    const LANES(Vectors) to_light = LANES(difference_of_vectors)(point, position);
    const Real distance_squared = LANES(dot_products)(to_light, to_light);
    LANES(LightSamples) sample;
    sample.wi = LANES(normalized_vectors)(to_light);
    sample.distance = LANES(square_root)(distance_squared);
    sample.point = point;
    const Mask is_far = distance_squared >= FLT_MIN;
    const Real cos_light = fabs(LANES(dot_products)(normal, sample.wi));
    const Real factor = LANES(divide)(area * cos_light, is_far ? distance_squared : (Real)(1.0f));
    sample.irradiance = LANES(limited_light)(radiance, is_far ? factor : (Real)(0.0f));
#if CASTOR_TRACES_PATHS
    sample.density = is_far ? LANES(inverse_or_zero)(factor) : (Real)(0.0f);
#endif
    return sample;
}

CASTOR_INLINE LANES(LightSamples)
    LANES(sample_area)(const Light light, const LANES(Vectors) position, const LANES(Points) at)
{
    const LANES(Vectors) normal = LANES(same_vectors)(light.direction), tangent = LANES(same_vectors)(light.tangent);
    const LANES(Vectors) middle = LANES(same_vectors)(light.position);
    const LANES(Vectors) point =
        LANES(points_on_rays)(LANES(points_on_rays)(middle, light.size * (at.x - 0.5f), tangent),
                              light.size * (at.y - 0.5f), LANES(cross_products)(normal, tangent));
    return LANES(light_of_surface)(LANES(same_vectors)(light.intensity), position, point, normal,
                                   (Real)(light.size * light.size));
}

// Meshes that emit: what Light says of them.
typedef struct LANES(MeshLights) {
    LANES(Vectors) radiance;
    Real area;
    Whole first, count;
    Mask has_texture;
#if CASTOR_TRACES_PATHS
    LANES(Vectors) motion;
    Mask is_smooth;                     // see smooth_densities
    Whole hull;                         // CASTOR_MESH_...
    LANES(Vectors) middle, half_edges;  // of the box around a closed mesh
#endif
} LANES(MeshLights);

CASTOR_INLINE LANES(MeshLights) LANES(same_mesh_lights)(const Light light)
{
    LANES(MeshLights) mesh;
    mesh.radiance = LANES(same_vectors)(light.intensity);
    mesh.area = (Real)(light.size);
    mesh.first = (Whole)(light.first);
    mesh.count = (Whole)(light.count);
    mesh.has_texture = (Whole)(light.principled) != CASTOR_INVALID_INDEX;
#if CASTOR_TRACES_PATHS
    mesh.motion = LANES(same_vectors)(light.direction);
    mesh.is_smooth = (Whole)(light.sampling) == CASTOR_MESH_SMOOTH;
    mesh.hull = (Whole)(light.mapping);
    mesh.middle = LANES(same_vectors)(light.position);
    mesh.half_edges = LANES(same_vectors)(light.tangent);
#endif
    return mesh;
}

#if CASTOR_TRACES_PATHS
// Returns the meshes with these numbers, which have no textures of emission.
CASTOR_INLINE LANES(MeshLights) LANES(gather_mesh_lights)(const global Light *restrict lights, const Whole number)
{
    const global float4 *const rows = (const global float4 *)lights;
    const Whole row = number * CASTOR_LIGHT_ROWS;
    const LANES(Rows) tangent = LANES(gather_rows)(rows, row + 3u), range = LANES(gather_rows)(rows, row + 4u);
    LANES(MeshLights) mesh;
    mesh.radiance = LANES(gather_vectors)(rows, row + 1u);
    mesh.area = tangent.w;
    mesh.first = LANES(as_uint)(range.x);
    mesh.count = LANES(as_uint)(range.y);
    mesh.has_texture = (Whole)(0) != 0u;
    mesh.motion = LANES(gather_vectors)(rows, row + 2u);
    mesh.is_smooth = LANES(as_uint)(range.w) == CASTOR_MESH_SMOOTH;
    mesh.hull = LANES(as_uint)(range.z);
    mesh.middle = LANES(gather_vectors)(rows, row);
    mesh.half_edges = LANES(vectors_of_rows)(tangent);
    return mesh;
}
#endif

// Returns which emitters of meshes have these parts of their areas. Of a mesh without area, some emitter of another.
CASTOR_INLINE Whole LANES(emitters_of_parts)(const LANES(MeshLights) mesh, const global Emitter *restrict emitters,
                                             const Whole part)
{
    const global uint *const ends = &emitters[0].end;
    Whole count = mesh.count;
    Whole first = count > 0u ? mesh.first : (Whole)(LANES(largest_of_lanes)(count > 0u ? mesh.first : (Whole)(0)));
    for (Mask is_left = count > 1u; LANES(mask_of)(is_left); is_left = count > 1u) {
        const Whole half_count = count / 2u;
        const Whole last = first + (is_left ? half_count - 1u : (Whole)(0));
        const Mask is_later = is_left & (LANES(gather_wholes)(ends, last, CASTOR_EMITTER_WORDS) <= part);
        first = is_later ? first + half_count : first;
        count -= half_count;
    }
    return first;
}

// Points of meshes' triangles.
typedef struct LANES(MeshPoints) {
    LANES(Vectors) point;
    LANES(Vectors) across;  // the cross product of the triangle's edges
#if CASTOR_TRACES_PATHS
    Real per_across;  // 1 / its length
#endif
#if CASTOR_TRACES_PATHS && CASTOR_HAS_ATTRIBUTES
    Whole row;              // of the triangle in the emitters
    Real along_u, along_v;  // its edges
#endif
} LANES(MeshPoints);

// Emitters, one a lane.
typedef struct LANES(Emitters) {
    LANES(Vectors) corner, edge_u, edge_v;
    Whole begin, end;
#if CASTOR_TRACES_PATHS
    Real inverse_double_area;
#endif
} LANES(Emitters);

CASTOR_INLINE LANES(Emitters) LANES(load_emitters)(const global Emitter *restrict emitters, const Whole number)
{
    const global float4 *const rows = (const global float4 *)emitters;
    LANES(Rows) corner, edge_u, edge_v;
    if (LANES(are_same)(number)) {
        const uint row = CASTOR_EMITTER_WORDS / 4u * LANES(first_lane)(number);
        corner = LANES(same_rows)(rows[row]);
        edge_u = LANES(same_rows)(rows[row + 1u]);
        edge_v = LANES(same_rows)(rows[row + 2u]);
    } else {
        const Whole row = CASTOR_EMITTER_WORDS / 4u * number;
        corner = LANES(gather_rows)(rows, row);
        edge_u = LANES(gather_rows)(rows, row + 1u);
        edge_v = LANES(gather_rows)(rows, row + 2u);
    }
    LANES(Emitters) emitter;
    emitter.corner = LANES(vectors_of_rows)(corner);
    emitter.edge_u = LANES(vectors_of_rows)(edge_u);
    emitter.edge_v = LANES(vectors_of_rows)(edge_v);
    emitter.begin = LANES(as_uint)(corner.w);
    emitter.end = LANES(as_uint)(edge_u.w);
#if CASTOR_TRACES_PATHS
    emitter.inverse_double_area = edge_v.w;
#endif
    return emitter;
}

// Returns points of emitters, for points of the unit square: Turk 1990, "Generating Random Points in Triangles".
CASTOR_INLINE LANES(MeshPoints)
    LANES(points_of_emitters)(const LANES(Emitters) emitter, const Whole number, const Real x, const Real y)
{
    const Real root = LANES(square_root)(clamp(x, (Real)(0.0f), (Real)(1.0f)));
    const Real along_u = root * (1.0f - y), along_v = root * y;
    LANES(MeshPoints) drawn;
    drawn.point =
        LANES(points_on_rays)(LANES(points_on_rays)(emitter.corner, along_u, emitter.edge_u), along_v, emitter.edge_v);
    drawn.across = LANES(cross_products)(emitter.edge_u, emitter.edge_v);
#if CASTOR_TRACES_PATHS
    drawn.per_across = emitter.inverse_double_area;
#endif
#if CASTOR_TRACES_PATHS && CASTOR_HAS_ATTRIBUTES
    drawn.row = CASTOR_EMITTER_WORDS / 4u * number;
    drawn.along_u = along_u;
    drawn.along_v = along_v;
#endif
    return drawn;
}

// Draws points: a part of the area chooses a triangle, and where the part begins and ends there is what is left of the
// sample's first number.
CASTOR_INLINE LANES(MeshPoints) LANES(draw_mesh_points)(const LANES(MeshLights) mesh,
                                                        const global Emitter *restrict emitters, const LANES(Points) at)
{
    const Real place = at.x * (float)CASTOR_EMITTER_PARTS;
    const Whole number = LANES(emitters_of_parts)(mesh, emitters, LANES(convert_uint)(place));
    const LANES(Emitters) emitter = LANES(load_emitters)(emitters, number);
    const Real x =
        LANES(divide)(place - LANES(convert_float)(emitter.begin), LANES(convert_float)(emitter.end - emitter.begin));
    return LANES(points_of_emitters)(emitter, number, x, at.y);
}

CASTOR_INLINE LANES(LightSamples) LANES(no_light_samples)(void)
{
    const Real zero = (Real)(0.0f);
    LANES(LightSamples) nothing;
    nothing.wi = nothing.point = nothing.irradiance = LANES(vectors)(zero, zero, zero);
    nothing.distance = zero;
#if CASTOR_TRACES_PATHS
    nothing.density = zero;
#endif
    return nothing;
}

CASTOR_INLINE LANES(LightSamples)
    LANES(choose_light_samples)(const Mask is_a, const LANES(LightSamples) a, const LANES(LightSamples) b)
{
    LANES(LightSamples) sample = a;  // what follows is the same in both, or of no meaning in b
    sample.wi = LANES(choose_vectors)(is_a, a.wi, b.wi);
    sample.point = LANES(choose_vectors)(is_a, a.point, b.point);
    sample.irradiance = LANES(choose_vectors)(is_a, a.irradiance, b.irradiance);
    sample.distance = is_a ? a.distance : b.distance;
#if CASTOR_TRACES_PATHS
    sample.density = is_a ? a.density : b.density;
#endif
    return sample;
}

#if CASTOR_TRACES_PATHS
// Returns the densities by which rays that meet smooth meshes are weighed against points that are drawn there. A ray
// that meets one finds the shading normal, a point has the triangle's: the weights would not add up to 1. So neither
// is looked at. Any density that both sides agree on is without bias.
CASTOR_INLINE Real LANES(smooth_densities)(const Real area, const Real distance)
{
    const Real distance_squared = distance * distance;
    const Mask is_far = distance_squared >= FLT_MIN;
    const Real factor = LANES(divide)(CASTOR_SUPPOSED_COSINE * area, is_far ? distance_squared : (Real)(1.0f));
    return is_far ? LANES(inverse_or_zero)(factor) : (Real)(0.0f);
}
#endif

// Returns what arrives from points of meshes.
CASTOR_INLINE LANES(LightSamples)
    LANES(light_of_mesh_points)(const LANES(MeshLights) mesh, const global Emitter *restrict emitters,
                                const LANES(MeshPoints) drawn, const LANES(Vectors) position)
{
    LANES(LightSamples)
    sample = LANES(light_of_surface)(mesh.radiance, position, drawn.point, LANES(normalized_vectors)(drawn.across),
                                     mesh.area);
#if CASTOR_TRACES_PATHS
    if (LANES(mask_of)(mesh.is_smooth))
        sample.density = mesh.is_smooth ? LANES(smooth_densities)(mesh.area, sample.distance) : sample.density;
#endif
#if CASTOR_TRACES_PATHS && CASTOR_HAS_ATTRIBUTES
    if (LANES(mask_of)(mesh.has_texture)) {
        const global float4 *const rows = (const global float4 *)emitters;
        const LANES(Rows) uv = LANES(gather_rows)(rows, drawn.row + 3u),
                          uv_v = LANES(gather_rows)(rows, drawn.row + 4u);
        sample.u = fma(drawn.along_u, uv.z, fma(drawn.along_v, uv_v.x, uv.x));
        sample.v = fma(drawn.along_u, uv.w, fma(drawn.along_v, uv_v.y, uv.y));
        const Real in_picture = fabs(fma(uv.z, uv_v.y, -(uv.w * uv_v.x)));
        const Real in_world = LANES(square_root)(LANES(dot_products)(drawn.across, drawn.across));
        sample.uvs_per_length = LANES(square_root)(in_picture * LANES(inverse_or_zero)(in_world));
    }
#endif
    return sample;
}

// Draws points of meshes, and returns what arrives from there.
CASTOR_INLINE LANES(LightSamples)
    LANES(sample_meshes)(const LANES(MeshLights) mesh, const global Emitter *restrict emitters,
                         const LANES(Vectors) position, const LANES(Points) at)
{
    const Mask has_area = mesh.count > 0u;
    if (!LANES(mask_of)(has_area)) return LANES(no_light_samples)();
    const LANES(MeshPoints) drawn = LANES(draw_mesh_points)(mesh, emitters, at);
    return LANES(choose_light_samples)(has_area, LANES(light_of_mesh_points)(mesh, emitters, drawn, position),
                                       LANES(no_light_samples)());
}

// Tells which points are inside a sphere, by the square of their distance from its middle. A point on the sphere, where
// rounding decides, is outside.
CASTOR_INLINE Mask LANES(is_in_sphere)(const Light light, const Real distance_squared)
{
    return distance_squared < 0.9998f * (light.size * light.size);
}

// Returns 1 - the cosine of the half angle under which a sphere is seen; 2 within.
CASTOR_INLINE Real LANES(width_of_cone)(const Light light, const Real distance_squared)
{
    const Real one = (Real)(1.0f);
    const float radius_squared = light.size * light.size;
    const Mask is_inside = LANES(is_in_sphere)(light, distance_squared);
    const Real ratio = LANES(divide)((Real)(radius_squared), is_inside ? one : distance_squared);
    const Real sine_squared_of_cone = LANES(smaller)(ratio, one);
    const Real cosine_of_cone = LANES(square_root)(1.0f - sine_squared_of_cone);
    return is_inside ? (Real)(2.0f) : LANES(divide)(sine_squared_of_cone, 1.0f + cosine_of_cone);
}

// Draws a direction uniformly from those in which the sphere is seen: a cone, or all from within.
CASTOR_INLINE LANES(LightSamples)
    LANES(sample_sphere)(const Light light, const LANES(Vectors) position, const LANES(Points) at)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const LANES(Vectors) to_middle = LANES(difference_of_vectors)(LANES(same_vectors)(light.position), position);
    const Real distance_squared = LANES(dot_products)(to_middle, to_middle);
    const Real distance = LANES(square_root)(distance_squared);
    const float radius_squared = light.size * light.size;
    const Mask is_inside = LANES(is_in_sphere)(light, distance_squared);
    const Real width = LANES(width_of_cone)(light, distance_squared);
    const Real off_axis = at.x * width;  // 1 - the cosine of the direction
    const Real cos_angle = 1.0f - off_axis;
    const Real sine_squared = off_axis * (1.0f + cos_angle);
    const Mask is_middle = !(distance > 0.0f);
    const LANES(Vectors) up = LANES(vectors)(zero, zero, one);
    const LANES(Vectors) axis = LANES(choose_vectors)(is_middle, up, LANES(normalized_vectors)(to_middle));

    LANES(LightSamples) sample;
    sample.wi = LANES(directions_around)(axis, cos_angle, LANES(square_root)(sine_squared), at.y);
    const Real half_chord =
        LANES(square_root)(LANES(larger)(fma(-distance_squared, sine_squared, (Real)(radius_squared)), zero));
    const Real to_chord = distance * cos_angle;
    sample.distance = LANES(larger)(is_inside ? to_chord + half_chord : to_chord - half_chord, zero);
    sample.point = LANES(points_on_rays)(position, sample.distance, sample.wi);
    sample.irradiance = LANES(limited_light)(LANES(same_vectors)(light.intensity), 6.2831855f * width);
#if CASTOR_TRACES_PATHS
    sample.density = LANES(inverse_or_zero)(6.2831855f * width);
#endif
    return sample;
}

// Returns m (v, w), of a matrix with three rows of four.
CASTOR_INLINE LANES(Vectors) LANES(rows_times_vectors)(const float (*const m)[4], const LANES(Vectors) v, const float w)
{
    return LANES(vectors)(
        fma((Real)(m[0][0]), v.x, fma((Real)(m[0][1]), v.y, fma((Real)(m[0][2]), v.z, (Real)(m[0][3] * w)))),
        fma((Real)(m[1][0]), v.x, fma((Real)(m[1][1]), v.y, fma((Real)(m[1][2]), v.z, (Real)(m[1][3] * w)))),
        fma((Real)(m[2][0]), v.x, fma((Real)(m[2][1]), v.y, fma((Real)(m[2][2]), v.z, (Real)(m[2][3] * w)))));
}

// Returns by how much a matrix M, a part of to_world, takes up more solid angle about directions d: |det (M / |M d|)|,
// of which `wi` is M d, of some length.
CASTOR_INLINE Real LANES(widening)(const float (*const to_world)[4], const LANES(Vectors) wi)
{
    const Real length_of_wi = LANES(square_root)(LANES(dot_products)(wi, wi));
    const Mask has_length = length_of_wi > 0.0f;
    const Real inverse = LANES(divide)((Real)(1.0f), has_length ? length_of_wi : (Real)(1.0f));
    const LANES(Vectors) x = LANES(scaled_vectors)(LANES(same_vectors)(to_world[0]), inverse);
    const LANES(Vectors) y = LANES(scaled_vectors)(LANES(same_vectors)(to_world[1]), inverse);
    const LANES(Vectors) z = LANES(scaled_vectors)(LANES(same_vectors)(to_world[2]), inverse);
    const Real widened = fabs(LANES(dot_products)(x, LANES(cross_products)(y, z)));
    return has_length ? widened : (Real)(0.0f);
}

// Draws a direction to an ellipsoid as to the sphere that it is in its instance's space. A matrix M takes a solid angle
// about the unit direction d to |det M| / |M d|^3 times as much: |det (M / |M d|)|.
CASTOR_INLINE LANES(LightSamples) LANES(sample_ellipsoid)(const Light light, const Instance instance,
                                                          const LANES(Vectors) position, const LANES(Points) at)
{
    const float(*const to_world)[4] = instance.to_world;
    const LANES(Vectors) from = LANES(rows_times_vectors)(instance.to_object, position, 1.0f);
    LANES(LightSamples) sample = LANES(sample_sphere)(light, from, at);
    const LANES(Vectors) wi = LANES(rows_times_vectors)(to_world, sample.wi, 0.0f);
    const Real length_of_wi = LANES(square_root)(LANES(dot_products)(wi, wi));
    const Mask has_length = length_of_wi > 0.0f;
    const Real inverse = LANES(divide)((Real)(1.0f), has_length ? length_of_wi : (Real)(1.0f));
    const Real widened = LANES(widening)(to_world, wi);
#if CASTOR_TRACES_PATHS
    sample.density *= LANES(inverse_or_zero)(widened);
#endif
    sample.wi = LANES(scaled_vectors)(wi, inverse);
    sample.distance *= length_of_wi;
    sample.point = LANES(rows_times_vectors)(to_world, sample.point, 1.0f);
    sample.irradiance = LANES(scaled_vectors)(sample.irradiance, widened);
    sample.irradiance =
        LANES(vectors)(LANES(limited_irradiance)(sample.irradiance.x), LANES(limited_irradiance)(sample.irradiance.y),
                       LANES(limited_irradiance)(sample.irradiance.z));
    return sample;
}

// Returns what a mesh or sphere sends to points, at time 0.
CASTOR_INLINE LANES(LightSamples) LANES(sample_object)(const Light light, const global Emitter *restrict emitters,
                                                       const global Instance *restrict instances,
                                                       const LANES(Vectors) position, const LANES(Points) at)
{
    if (light.kind == CASTOR_LIGHT_MESH)
        return LANES(sample_meshes)(LANES(same_mesh_lights)(light), emitters, position, at);
    if (light.first != 0) return LANES(sample_ellipsoid)(light, instances[light.first], position, at);
    return LANES(sample_sphere)(light, position, at);
}

// Returns what a light with an extent sends to points at these times. `at`: of the unit square.
CASTOR_ONCE LANES(LightSamples)
    LANES(sample_extended_light)(const Light light, const global Emitter *restrict emitters,
                                 const global Instance *restrict instances, const LANES(Vectors) position,
                                 const Real time, const LANES(Points) at)
{
    if (light.kind == CASTOR_LIGHT_DIRECTIONAL) return LANES(sample_disk)(light, position, at);
    if (light.kind == CASTOR_LIGHT_AREA) {
        LANES(LightSamples) sample = LANES(sample_area)(light, position, at);
#if CASTOR_TRACES_PATHS
        sample.density = (Real)(0.0f);
#endif
        return sample;
    }
#if CASTOR_HAS_MOTION
    const LANES(Vectors) motion = LANES(same_vectors)(light.direction);
    const LANES(Vectors) from = LANES(points_on_rays)(position, -time, motion);
    LANES(LightSamples) sample = LANES(sample_object)(light, emitters, instances, from, at);
    sample.point = LANES(points_on_rays)(sample.point, time, motion);
    return sample;
#else
    return LANES(sample_object)(light, emitters, instances, position, at);
#endif
}

#if CASTOR_TRACES_PATHS
// Returns the density with which sample_extended_light draws the directions from `origin` to points of a light at these
// times, by solid angle; of a smooth mesh, smooth_densities. `normal`: of the light's surface there.
CASTOR_ONCE Real LANES(densities_of_light)(const Light light, const global Instance *restrict instances,
                                           const LANES(Vectors) origin, const Real time, const LANES(Vectors) point,
                                           const LANES(Vectors) normal)
{
    if (light.kind != CASTOR_LIGHT_SPHERE) {
        const LANES(LightSamples) sample =
            LANES(light_of_surface)(LANES(same_vectors)(light.intensity), origin, point, normal, (Real)(light.size));
        const int is_smooth = light.kind == CASTOR_LIGHT_MESH && light.sampling == CASTOR_MESH_SMOOTH;
        return is_smooth ? LANES(smooth_densities)((Real)(light.size), sample.distance) : sample.density;
    }
    LANES(Vectors) from = origin;
#if CASTOR_HAS_MOTION
    from = LANES(points_on_rays)(from, -time, LANES(same_vectors)(light.direction));
#endif
    Real widened = (Real)(1.0f);
    if (light.first != 0) {
        const Instance instance = instances[light.first];
        const LANES(Vectors) along =
            LANES(rows_times_vectors)(instance.to_object, LANES(difference_of_vectors)(point, origin), 0.0f);
        widened = LANES(widening)(instance.to_world,
                                  LANES(rows_times_vectors)(instance.to_world, LANES(normalized_vectors)(along), 0.0f));
        from = LANES(rows_times_vectors)(instance.to_object, from, 1.0f);
    }
    const LANES(Vectors) to_middle = LANES(difference_of_vectors)(LANES(same_vectors)(light.position), from);
    const Real width = LANES(width_of_cone)(light, LANES(dot_products)(to_middle, to_middle));
    return LANES(inverse_or_zero)(6.2831855f * width * widened);
}
#endif
