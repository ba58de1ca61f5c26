// The texture coordinates of spheres, and how they change. For CASTOR_LANES lanes (see lanes.cl).
#include "device/elementary.lanes.cl"
#include "device/surface.lanes.cl"

#define CASTOR_PI 3.1415927f

// u = (pi - phi) / (2 pi), v = theta / pi with phi = atan2(z, x) and theta = acos(y / radius). `n`: the normal.
CASTOR_ONCE LANES(Twos) LANES(uvs_of_spheres)(const LANES(Vectors) n)
{
    const Real one = (Real)(1.0f);
    LANES(Twos) uv;
    uv.x = (CASTOR_PI - LANES(arc_tangent2)(n.z, n.x)) * 0.15915494f;  // 1 / (2 pi)
    uv.y = LANES(arc_cosine)(clamp(n.y, -one, one)) * 0.31830987f;     // 1 / pi
    return uv;
}

#if CASTOR_SURFACES_HAVE_AXES
// Returns the axes dp/du and dp/dv as edges.
CASTOR_ONCE LANES(Edges) LANES(edges_of_spheres)(const LANES(Vectors) n, const Real radius)
{
    const Real zero = (Real)(0.0f), one = (Real)(1.0f);
    const Real around = LANES(square_root)(fma(n.x, n.x, n.z * n.z));
    const Mask is_off_axis = around > 0.0f;
    const Real inverse = is_off_axis ? LANES(divide)(one, is_off_axis ? around : one) : zero;
    const Real cos_phi = is_off_axis ? n.x * inverse : one, sin_phi = n.z * inverse;
    const Real around_once = 2.0f * CASTOR_PI * radius, half_around = CASTOR_PI * radius;
    LANES(Edges) edge;
    edge.e1 = LANES(vectors)(around_once * n.z, zero, around_once * -n.x);
    edge.e2 = LANES(vectors)(half_around * (n.y * cos_phi), half_around * -around, half_around * (n.y * sin_phi));
    edge.du1 = edge.dv2 = one;
    edge.dv1 = edge.du2 = zero;
    return edge;
}
#endif

// Gives surfaces of spheres their texture coordinates, where `counts`. `primitive`: what primitive_of_hit says of the
// hits; `surface`: in the object's space.
CASTOR_INLINE void LANES(add_coordinates_of_spheres)(LANES(Surfaces) * surface, const SurfaceColumns columns,
                                                     const Mask counts, const Whole primitive)
{
    const Whole sphere = primitive - columns.params.triangle_count;
    const Mask is_triangle = primitive < columns.params.triangle_count;
    const Mask is_sphere = counts & !is_triangle & (sphere < columns.params.sphere_count);
    if (!LANES(mask_of)(is_sphere)) return;
    surface->uv = LANES(choose_twos)(is_sphere, LANES(uvs_of_spheres)(surface->normal), surface->uv);
#if CASTOR_SURFACES_HAVE_AXES
    const Real radius =
        LANES(gather_reals)((const global float *)columns.sphere_center_radius + 3, is_sphere ? sphere : (Whole)(0), 4);
    surface->edge = LANES(choose_edges)(is_sphere, LANES(edges_of_spheres)(surface->normal, radius), surface->edge);
#endif
}
