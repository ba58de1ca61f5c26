// Points of emitting meshes that are worth a ray, for CASTOR_LANES lanes (see lanes.cl): of several points one is
// chosen by what it may give (Talbot, Cline, Egbert 2005, "Importance Resampling for Global Illumination").
//
// Of few triangles each has a point; of many, points are drawn by area. They are one point of the unit square, shifted:
// each by itself is spread over its part of the area as that is, so that the estimate is without bias, and together
// they do not clump. Of a mesh that is closed, none is chosen that the mesh hides itself.
#include "device/lights.lanes.cl"

#define CASTOR_LIGHT_CANDIDATES 4u
// Of meshes of at most so many triangles, each triangle has a candidate.
#define CASTOR_FEW_EMITTERS 16u
// A point that is chosen of several is worth more than one drawn by area. Where rays meet the light, too, it counts as
// if drawn with so many times the density. Any number is without bias; of 1, 2, 3, 4 and 6, this one has the least
// variance over diffuse surfaces, which like more, and polished ones, which like less.
#define CASTOR_CANDIDATES_WEIGHT 3.0f
// No surface that may reflect light is passed over, where the normal is rounded or a coat has one of its own.
#define CASTOR_LEAST_FACING 0.01f
// What points may give is kept within these: sums stay finite.
#define CASTOR_LEAST_CANDIDATE 0x1p-40f
#define CASTOR_LARGEST_CANDIDATE 0x1p40f

// Tells which points of closed meshes are hidden by the mesh: seen from outside the box around it, those whose normals
// point away. `to`: from the position to the point.
CASTOR_INLINE Mask LANES(are_hidden)(const LANES(MeshLights) mesh, const LANES(Vectors) position,
                                     const LANES(Vectors) across, const LANES(Vectors) to)
{
    const LANES(Vectors) from_middle = LANES(difference_of_vectors)(position, mesh.middle);
    const Mask is_outside = (fabs(from_middle.x) > mesh.half_edges.x) | (fabs(from_middle.y) > mesh.half_edges.y) |
                            (fabs(from_middle.z) > mesh.half_edges.z);
    const Real along = LANES(dot_products)(across, to);
    return is_outside & (((mesh.hull == CASTOR_MESH_CLOSED) & (along > 0.0f)) |
                         ((mesh.hull == CASTOR_MESH_CLOSED_INWARD) & (along < 0.0f)));
}

// Where light of meshes is wanted.
typedef struct LANES(MeshQueries) {
    LANES(Vectors) position;
    LANES(Vectors) normal;  // unit
    Mask has_both_sides;    // light from below counts, too
    Real time;
    LANES(Points) at;  // the unit square
    Real choice;       // [0, 1)
} LANES(MeshQueries);

// Returns what meshes may give from points, where all lengths are multiplied by `scale`: not 0, unless they give
// nothing.
CASTOR_INLINE Real LANES(worth_of_points)(const LANES(MeshLights) mesh, const LANES(MeshQueries) query,
                                          const LANES(MeshPoints) drawn, const Real scale)
{
    const LANES(Vectors) to = LANES(difference_of_vectors)(drawn.point, query.position);
    const LANES(Vectors) scaled = LANES(scaled_vectors)(to, scale);
    const Real squared = LANES(larger)(LANES(dot_products)(scaled, scaled), (Real)(CASTOR_LEAST_CANDIDATE));
    const Real above = LANES(dot_products)(query.normal, scaled);
    const Real least = CASTOR_LEAST_FACING * (fabs(scaled.x) + fabs(scaled.y) + fabs(scaled.z));
    const Real received = LANES(larger)(query.has_both_sides ? fabs(above) : above, least);
    const Real sent = fabs(LANES(dot_products)(LANES(scaled_vectors)(drawn.across, drawn.per_across), scaled));
    const Real worth = LANES(divide)(sent * received, squared * squared);  // cosines / distance^2
    return LANES(are_hidden)(mesh, query.position, drawn.across, to)
               ? (Real)(0.0f)
               : clamp(worth, (Real)(CASTOR_LEAST_CANDIDATE), (Real)(CASTOR_LARGEST_CANDIDATE));
}

CASTOR_INLINE Real LANES(fraction)(const Real x) { return x >= 1.0f ? x - 1.0f : x; }

typedef struct LANES(Candidates) {
    LANES(MeshPoints) drawn;
    Real worth;
    Real weight;  // worth, by the part of the mesh's area for which the point stands
} LANES(Candidates);

// Returns candidates i of meshes: of few triangles a point of each, of many CASTOR_LIGHT_CANDIDATES points.
CASTOR_INLINE LANES(Candidates)
    LANES(candidates)(const LANES(MeshLights) mesh, const global Emitter *restrict emitters,
                      const LANES(MeshQueries) query, const Real scale, const Mask is_few, const Whole i)
{
    LANES(Points) at;  // shifted by halves and quarters: points of a lattice
    at.x = LANES(fraction)(query.at.x + 0.25f * LANES(convert_float)(i & 3u));
    at.y = LANES(fraction)(query.at.y + 0.25f * LANES(convert_float)(((i & 1u) << 1u) | ((i >> 1u) & 1u)));
    Whole number = mesh.first + (i < mesh.count ? i : (Whole)(0));
    const Mask is_many = !is_few & (mesh.count > 0u);
    if (LANES(mask_of)(is_many)) {
        const Whole part = LANES(convert_uint)(at.x * (float)CASTOR_EMITTER_PARTS);
        number = is_few ? number : LANES(emitters_of_parts)(mesh, emitters, part);
    }
    const LANES(Emitters) emitter = LANES(load_emitters)(emitters, number);
    const Real parts = LANES(convert_float)(emitter.end - emitter.begin);
    if (LANES(mask_of)(is_many)) {
        const Real within = at.x * (float)CASTOR_EMITTER_PARTS - LANES(convert_float)(emitter.begin);
        at.x = is_few ? at.x : LANES(divide)(within, parts);
    }
    LANES(Candidates) candidate;
    candidate.drawn = LANES(points_of_emitters)(emitter, number, at.x, at.y);
    const Mask exists = i < (is_few ? mesh.count : (Whole)(CASTOR_LIGHT_CANDIDATES));
    const Real worth = LANES(worth_of_points)(mesh, query, candidate.drawn, scale);
    candidate.worth = exists ? worth : (Real)(0.0f);
    candidate.weight =
        candidate.worth * (is_few ? parts * (1.0f / CASTOR_EMITTER_PARTS) : (Real)(1.0f / CASTOR_LIGHT_CANDIDATES));
    return candidate;
}

// Returns what meshes send to positions from points that are worth it; `density` is that by which light that rays meet
// is weighed against it.
CASTOR_ONCE LANES(LightSamples)
    LANES(resample_meshes)(const LANES(MeshLights) mesh, const global Emitter *restrict emitters,
                           const LANES(MeshQueries) in_world)
{
    const Mask has_area = mesh.count > 0u;
    if (!LANES(mask_of)(has_area)) return LANES(no_light_samples)();
    LANES(MeshQueries) query = in_world;
#if CASTOR_HAS_MOTION
    query.position = LANES(points_on_rays)(query.position, -query.time, mesh.motion);
#endif
    const LANES(Vectors) away = LANES(difference_of_vectors)(query.position, mesh.middle);
    const Real length =
        fabs(away.x) + fabs(away.y) + fabs(away.z) + mesh.half_edges.x + mesh.half_edges.y + mesh.half_edges.z;
    const Real scale = LANES(divide)((Real)(1.0f), clamp(length, (Real)(0x1p-100f), (Real)(0x1p100f)));
    const Mask is_few = mesh.count <= CASTOR_FEW_EMITTERS;
    const Whole count = is_few ? mesh.count : (Whole)(CASTOR_LIGHT_CANDIDATES);
    const uint most = LANES(largest_of_lanes)(count);
    Real sums[CASTOR_FEW_EMITTERS];
    Real sum = (Real)(0.0f);
    for (uint i = 0; i < most; ++i) {
        sum += LANES(candidates)(mesh, emitters, query, scale, is_few, (Whole)(i)).weight;
        sums[i] = sum;
    }
    // Chosen is the first with which the sum is more than the threshold, so that its weight is not 0.
    const Real threshold = query.choice * sum;
    Whole chosen = (Whole)(0);
    for (uint i = 0; i + 1u < most; ++i) chosen += sums[i] <= threshold ? (Whole)(1) : (Whole)(0);
    const LANES(Candidates) candidate = LANES(candidates)(mesh, emitters, query, scale, is_few, chosen);
    const Mask is_lit = has_area & (candidate.worth > 0.0f);
    LANES(LightSamples) sample = LANES(light_of_mesh_points)(mesh, emitters, candidate.drawn, query.position);
    const Real rarity = LANES(divide)(sum, is_lit ? candidate.worth : (Real)(1.0f));
    sample.irradiance = LANES(limited_light)(sample.irradiance, rarity);
    sample.density *= CASTOR_CANDIDATES_WEIGHT;
#if CASTOR_HAS_MOTION
    sample.point = LANES(points_on_rays)(sample.point, query.time, mesh.motion);
#endif
    return LANES(choose_light_samples)(is_lit, sample, LANES(no_light_samples)());
}
