// How surfaces of all materials scatter the light of traced paths, for CASTOR_LANES lanes (see lanes.cl): those of the
// scene format (classic_bsdf.lanes.cl) and principled ones (principled_bsdf.lanes.cl), side by side.
#include "device/classic_bsdf.lanes.cl"
#include "device/features.cl"
#include "device/principled_surface.lanes.cl"

typedef struct LANES(Scatterers) {
    LANES(Vectors) normal;  // on the viewer's side; shadow rays and the next rays begin along it
    Mask is_solid;          // light that passes goes on within a solid, or leaves it
    Mask is_inside;         // a solid is seen from within
    Mask is_rough;          // light is scattered to other directions than one
    Mask is_principled;
#if CASTOR_HAS_CLASSIC
    LANES(ClassicBsdfs) classic;
#endif
#if CASTOR_HAS_PRINCIPLED
    LANES(Bsdfs) principled;
    LANES(Frames) frame;  // z: on the viewer's side
    LANES(Vectors) wo_in_frame;
#endif
} LANES(Scatterers);

typedef struct LANES(ScatteredLight) {
    LANES(Vectors) value;  // of the BSDF, times the cosine of wi
    Real density;          // with which sample_scattering draws wi, by solid angle, single directions apart
} LANES(ScatteredLight);

typedef struct LANES(ScatteredRays) {
    LANES(Vectors) direction;  // unit
    LANES(Vectors) weight;     // value, cosine included, divided by the density; (0,0,0): the path ends
    Real density;              // as ScatteredLight's; 0 of single directions
    Mask is_transmitted;       // to the other side
    Mask is_passed;            // the ray goes on as it was, through a pane
} LANES(ScatteredRays);

#if CASTOR_HAS_PRINCIPLED
// Tells which directions lie on the other side of the surface than the normal map of its base says: no light of the
// base goes there.
CASTOR_INLINE Mask LANES(changes_side)(const LANES(Scatterers) * of, const LANES(Vectors) direction,
                                       const LANES(Vectors) in_frame)
{
    return LANES(dot_products)(of->normal, direction) * in_frame.z <= 0.0f;
}

// Tells which materials have a volume that light enters.
CASTOR_INLINE Mask LANES(are_solid)(const LANES(PrincipledMaterials) material)
{
    return ((material.transmission > 0.0f) | (material.diffuse_transmission > 0.0f)) & !material.is_thin;
}

// Returns the probability of drawing a lobe that is no single direction.
CASTOR_INLINE Real LANES(rough_probability)(const LANES(Bsdfs) * bsdf)
{
    const Real zero = (Real)(0.0f);
    return bsdf->diffuse_probability + bsdf->passed_probability + bsdf->sheen_probability +
           (bsdf->is_smooth ? zero : bsdf->base_probability) +
           (bsdf->is_smooth_glass ? zero : bsdf->glass_probability) +
           (bsdf->is_smooth_coat ? zero : bsdf->coat_probability);
}
#endif

#if CASTOR_HAS_CLASSIC
// Sets how surfaces of classic materials scatter, where they do: all but principled ones. `normal`: outward.
CASTOR_INLINE void LANES(set_classic)(LANES(Scatterers) * of, const RenderParams params, const PathParams path,
                                      const LANES(Materials) material, const LANES(Vectors) normal,
                                      const LANES(Vectors) wo)
{
    of->classic = LANES(classic_bsdfs)(params, path, material, normal, wo);
    of->normal = of->classic.normal;
    of->is_solid = of->classic.is_dielectric;
    of->is_inside = of->classic.is_inside;
    of->is_rough = LANES(are_matt)(of->classic);
}
#endif

#if CASTOR_HAS_PRINCIPLED
// Sets how principled surfaces scatter, where `counts`. `normal`: outward, before normal maps. `carried`: the path's
// throughput. The material of `surface` gets what is known where it is met.
CASTOR_INLINE void LANES(set_principled)(LANES(Scatterers) * of, LANES(PrincipledSurfaces) * surface, const Mask counts,
                                         const LANES(Vectors) normal, const LANES(Vectors) wo,
                                         const LANES(Vectors) carried)
{
    const Mask is_behind = !(LANES(dot_products)(normal, wo) > 0.0f);
    const LANES(Vectors) behind = LANES(scaled_vectors)(normal, (Real)(-1.0f));
    const Mask is_solid = LANES(are_solid)(surface->material);
    const Mask is_inside = is_behind & is_solid;
    of->frame = surface->frame;
    // Turned around x, so that the direction of anisotropy stays where it is.
    of->frame.y = LANES(scaled_vectors)(surface->frame.y, is_behind ? (Real)(-1.0f) : (Real)(1.0f));
    of->frame.z = LANES(scaled_vectors)(surface->frame.z, is_behind ? (Real)(-1.0f) : (Real)(1.0f));
    of->wo_in_frame = LANES(normalized_vectors)(LANES(in_frame)(of->frame, wo));
    surface->material.carried = carried;
    surface->material.coat_normal = LANES(normalized_vectors)(LANES(in_frame)(
        of->frame, LANES(scaled_vectors)(surface->coat_normal, is_behind ? (Real)(-1.0f) : (Real)(1.0f))));
    LANES(prepare_bsdf)(&surface->material, of->wo_in_frame, is_inside, &of->principled);
    of->is_principled = counts;
    of->normal = LANES(choose_vectors)(counts, LANES(choose_vectors)(is_behind, behind, normal), of->normal);
    of->is_solid = counts ? is_solid : of->is_solid;
    of->is_inside = counts ? is_inside : of->is_inside;
    const Mask is_rough = (LANES(rough_probability)(&of->principled) > 0.0f) & !surface->is_unlit;
    of->is_rough = counts ? is_rough : of->is_rough;
}
#endif

// Tells which surfaces scatter light from both sides to other directions than one.
CASTOR_INLINE Mask LANES(has_both_sides)(const LANES(Scatterers) * of)
{
#if CASTOR_HAS_PRINCIPLED
    return of->is_principled & (of->principled.passed_probability + of->principled.glass_probability > 0.0f);
#else
    return (Whole)(0) != 0u;
#endif
}

// Evaluates light from `wi`, unit, where `counts`.
CASTOR_INLINE LANES(ScatteredLight)
    LANES(scattered_light)(const LANES(Scatterers) * of, const LANES(Vectors) wi, const Mask counts)
{
    LANES(ScatteredLight) light;
    const Real zero = (Real)(0.0f);
    light.value = LANES(vectors)(zero, zero, zero);
    light.density = zero;
#if CASTOR_HAS_CLASSIC
    const Mask is_classic = counts & !of->is_principled;
    if (LANES(mask_of)(is_classic)) {
        light.value = LANES(choose_vectors)(is_classic, LANES(classic_values)(of->classic, wi), light.value);
        light.density = is_classic ? LANES(classic_densities)(of->classic, wi) : light.density;
    }
#endif
#if CASTOR_HAS_PRINCIPLED
    const Mask is_principled = counts & of->is_principled;
    if (LANES(mask_of)(is_principled)) {
        const LANES(Vectors) wi_in_frame = LANES(in_frame)(of->frame, wi);
        const LANES(BsdfValues) found = LANES(evaluate_bsdf)(&of->principled, of->wo_in_frame, wi_in_frame);
        light.value =
            LANES(choose_vectors)(is_principled, LANES(scaled_vectors)(found.value, fabs(wi_in_frame.z)), light.value);
        light.density = is_principled ? found.pdf : light.density;
        const Mask is_false = is_principled & LANES(changes_side)(of, wi, wi_in_frame);
        light.value = LANES(choose_vectors)(is_false, LANES(vectors)(zero, zero, zero), light.value);
        const Mask is_coated = is_principled & (found.coat > 0.0f) & (LANES(dot_products)(of->normal, wi) > 0.0f);
        const Real coat = is_coated ? found.coat : zero;
        light.value = LANES(sum_of_vectors)(light.value, LANES(vectors)(coat, coat, coat));
    }
#endif
    return light;
}

// Draws the directions in which paths go on, where `counts`. `choice`: of [0, 1), which lobe; `at`: of the unit square.
CASTOR_INLINE LANES(ScatteredRays)
    LANES(sample_scattering)(const LANES(Scatterers) * of, const Real choice, const LANES(Points) at, const Mask counts)
{
    const Real zero = (Real)(0.0f);
    LANES(ScatteredRays) ray;
    ray.direction = of->normal;
    ray.weight = LANES(vectors)(zero, zero, zero);
    ray.density = zero;
    ray.is_transmitted = ray.is_passed = (Whole)(0) != 0u;
#if CASTOR_HAS_CLASSIC
    const Mask is_classic = counts & !of->is_principled;
    if (LANES(mask_of)(is_classic)) {
        const LANES(ClassicSamples) sample = LANES(sample_classic)(of->classic, choice, at);
        ray.direction = LANES(choose_vectors)(is_classic, sample.direction, ray.direction);
        ray.weight = LANES(choose_vectors)(is_classic, sample.weight, ray.weight);
        ray.density = is_classic ? sample.density : ray.density;
        ray.is_transmitted = is_classic & sample.is_refracted;
    }
#endif
#if CASTOR_HAS_PRINCIPLED
    const Mask is_principled = counts & of->is_principled;
    if (LANES(mask_of)(is_principled)) {
        const LANES(BsdfSamples) sample = LANES(sample_bsdf)(&of->principled, of->wo_in_frame, choice, at);
        const LANES(Vectors) direction = LANES(normalized_vectors)(LANES(out_of_frame)(of->frame, sample.wi));
        const Mask is_false = LANES(changes_side)(of, direction, sample.wi);
        const Real along_normal = LANES(dot_products)(of->normal, direction);
        const Real coat = along_normal > 0.0f ? sample.coat : zero;
        const Mask is_drawn = is_principled & (sample.pdf > 0.0f) & (!is_false | (coat > 0.0f));
        const LANES(Vectors) of_base = LANES(choose_vectors)(is_false, LANES(vectors)(zero, zero, zero), sample.weight);
        ray.direction = LANES(choose_vectors)(is_drawn, direction, ray.direction);
        ray.weight = LANES(choose_vectors)(is_drawn, LANES(sum_of_vectors)(of_base, LANES(vectors)(coat, coat, coat)),
                                           ray.weight);
        ray.density = is_drawn ? (sample.is_delta ? zero : sample.pdf) : ray.density;
        const Mask is_through = is_drawn & (along_normal < 0.0f);
        ray.is_transmitted = ray.is_transmitted | is_through;
        ray.is_passed = is_drawn & sample.is_passed;
    }
#endif
    return ray;
}
