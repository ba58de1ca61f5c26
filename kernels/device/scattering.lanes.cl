// The rays that go on from surfaces, for CASTOR_LANES lanes (see lanes.cl).
#include "device/path_states.lanes.cl"
#include "device/pixels.lanes.cl"
#include "device/refraction.lanes.cl"
#include "device/shading.lanes.cl"

// Where rays met surfaces.
typedef struct LANES(Incidences) {
    LANES(Vectors) position, normal, wo;  // as the columns have them
    Real cos_wo;                          // of normal and wo
    LANES(Materials) material;
    LANES(Vectors) throughput;  // of the path so far
    Whole slot, node;           // see PathStates
    // Of scenes with dielectrics:
    LANES(Media) media;
    Whole material_number;
    Mask is_inside;  // the ray is inside the dielectric that it met
} LANES(Incidences);

CASTOR_INLINE LANES(Vectors)
    LANES(roughened)(const RenderParams params, const global uint *restrict pixel_blocks, const LANES(Incidences) at,
                     const LANES(Vectors) direction, const uint dimension)
{
#if CASTOR_HAS_ROUGHNESS
    if (LANES(mask_of)(at.material.roughness > 0.0f))
        return LANES(rough_directions)(
            direction, at.material.roughness,
            LANES(points_of_slots)(params, pixel_blocks, at.slot, LANES(dimension_of_node)(at.node, dimension)));
#endif
    return direction;
}

// Returns the origins of rays that leave surfaces to the side of the normal, or where `is_below` to the other.
CASTOR_INLINE LANES(Vectors) LANES(origins)(const RenderParams params, const LANES(Incidences) at,
                                            const LANES(Vectors) direction, const Mask is_below)
{
    LANES(Vectors) offset = at.normal;
#if CASTOR_HAS_DIELECTRICS
    offset = LANES(scaled_vectors)(offset, is_below ? (Real)(-1.0f) : (Real)(1.0f));
#endif
    if (params.flags & CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY) offset = direction;
    return LANES(points_on_rays)(at.position, (Real)(params.shadow_epsilon), offset);
}

// Returns the mirrored rays where `counts`. `factor`: what their surfaces multiply by.
CASTOR_INLINE LANES(Branches)
    LANES(reflected_branches)(const RenderParams params, const global uint *restrict pixel_blocks,
                              const LANES(Incidences) at, const LANES(Vectors) factor, const Mask counts)
{
    LANES(Branches) branch = LANES(no_branches)();
    branch.throughput = LANES(product_of_vectors)(at.throughput, factor);
    branch.exists =
        counts & ((branch.throughput.x != 0.0f) | (branch.throughput.y != 0.0f) | (branch.throughput.z != 0.0f));
    if (!LANES(mask_of)(branch.exists)) return branch;
    const LANES(Vectors) mirrored =
        LANES(difference_of_vectors)(LANES(scaled_vectors)(at.normal, 2.0f * at.cos_wo), at.wo);
    branch.direction = LANES(roughened)(params, pixel_blocks, at, mirrored, CASTOR_DIMENSION_REFLECTION);
    branch.origin = LANES(origins)(params, at, branch.direction, at.is_inside);
    branch.node = LANES(next_node)(at.node, CASTOR_NODE_REFLECTION);
    branch.media = LANES(media_here)(at.media, at.material_number, at.is_inside);
    return branch;
}

// Tells which paths are bright enough to follow both of their branches. What is left out has less than 2^-20 of the
// brightness that an eye ray has: without a limit, a deep recursion between panes of glass would have no end.
CASTOR_INLINE Mask LANES(are_bright)(const LANES(Branches) branch)
{
    return LANES(larger)(branch.throughput.x, LANES(larger)(branch.throughput.y, branch.throughput.z)) >= 0x1p-20f;
}

// Returns the refracted rays where `counts`.
CASTOR_INLINE LANES(Branches)
    LANES(refracted_branches)(const RenderParams params, const global uint *restrict pixel_blocks,
                              const LANES(Incidences) at, const LANES(Refractions) refraction, const Mask counts)
{
    LANES(Branches) branch;
    branch.throughput = LANES(scaled_vectors)(at.throughput, 1.0f - refraction.reflectance);
    branch.exists = counts & LANES(are_bright)(branch);
    branch.direction = LANES(roughened)(params, pixel_blocks, at, refraction.direction, CASTOR_DIMENSION_REFRACTION);
    branch.origin = LANES(origins)(params, at, branch.direction, !at.is_inside);
    branch.node = LANES(next_node)(at.node, CASTOR_NODE_REFRACTION);
    branch.media = LANES(media_beyond)(at.media, at.material_number, at.is_inside);
    return branch;
}
