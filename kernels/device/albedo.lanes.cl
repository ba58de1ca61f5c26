// What lobes reflect of uniform light from all sides, for CASTOR_LANES lanes (see lanes.cl): looked up in tables of
// integrals (scripts/make_albedo_tables), with linear interpolation.
#include "device/albedo_tables.cl"
#include "device/simd.lanes.cl"

// Gathers entries of a table.
CASTOR_INLINE Whole LANES(gather_entries)(constant uint *table, const Whole entry)
{
#if CASTOR_LANES == 1
    return table[entry];
#else
    return (Whole)(table[entry.s0], table[entry.s1], table[entry.s2], table[entry.s3], table[entry.s4], table[entry.s5],
                   table[entry.s6], table[entry.s7], table[entry.s8], table[entry.s9], table[entry.sa], table[entry.sb],
                   table[entry.sc], table[entry.sd], table[entry.se], table[entry.sf]);
#endif
}

// Where something lies along an axis of a table: between which entries, and how far from the first of both.
typedef struct LANES(AxisPlaces) {
    Whole entry;
    Real beyond;
} LANES(AxisPlaces);

// `share`: of the axis, from 0 to 1; `size`: its entries.
CASTOR_INLINE LANES(AxisPlaces) LANES(axis_places)(const Real share, const float size)
{
    const Real x = share * (size - 1.0f);
    LANES(AxisPlaces) place;
    place.entry = LANES(convert_uint)(LANES(smaller)(x, (Real)(size - 2.0f)));
    place.beyond = x - LANES(convert_float)(place.entry);
    return place;
}

CASTOR_INLINE Real LANES(clamped_share)(const Real x) { return clamp(x, (Real)(0.0f), (Real)(1.0f)); }

// Where a cosine and something else lie in a table: a cell, and how far from its first entry.
typedef struct LANES(AlbedoPlaces) {
    Whole entry;
    Real along, across;
} LANES(AlbedoPlaces);

// `other`: from 0 to 1, such as a roughness; `columns`, `rows`: the table's entries along the cosine and along it.
CASTOR_INLINE LANES(AlbedoPlaces)
    LANES(albedo_places)(const Real cosine, const Real other, const float columns, const float rows)
{
    const LANES(AxisPlaces) x = LANES(axis_places)(LANES(square_root)(LANES(clamped_share)(cosine)), columns);
    const LANES(AxisPlaces) y = LANES(axis_places)(LANES(clamped_share)(other), rows);
    LANES(AlbedoPlaces) place;
    place.entry = y.entry * (uint)columns + x.entry;
    place.along = x.beyond;
    place.across = y.beyond;
    return place;
}

CASTOR_INLINE Real LANES(between_entries)(const LANES(AlbedoPlaces) place, const Whole a, const Whole b, const Whole c,
                                          const Whole d)
{
    const Real at_a = LANES(convert_float)(a), at_c = LANES(convert_float)(c);
    const Real first = fma(place.along, LANES(convert_float)(b) - at_a, at_a);
    const Real second = fma(place.along, LANES(convert_float)(d) - at_c, at_c);
    return fma(place.across, second - first, first);
}

// The directional albedo of GGX: `all` without a Fresnel term; `grazing`, its part with Schlick's weight.
typedef struct LANES(MicrofacetAlbedos) {
    Real all, grazing;
} LANES(MicrofacetAlbedos);

CASTOR_ONCE LANES(MicrofacetAlbedos) LANES(microfacet_albedo)(const Real cosine, const Real roughness)
{
    const LANES(AlbedoPlaces) place = LANES(albedo_places)(cosine, roughness, CASTOR_ALBEDO_SIZE, CASTOR_ALBEDO_SIZE);
    const Whole a = LANES(gather_entries)(microfacet_albedos, place.entry);
    const Whole b = LANES(gather_entries)(microfacet_albedos, place.entry + 1u);
    const Whole c = LANES(gather_entries)(microfacet_albedos, place.entry + (uint)CASTOR_ALBEDO_SIZE);
    const Whole d = LANES(gather_entries)(microfacet_albedos, place.entry + (CASTOR_ALBEDO_SIZE + 1u));
    LANES(MicrofacetAlbedos) albedo;
    albedo.all = LANES(between_entries)(place, a & 0xffffu, b & 0xffffu, c & 0xffffu, d & 0xffffu) * (1.0f / 65535.0f);
    albedo.grazing = LANES(between_entries)(place, a >> 16u, b >> 16u, c >> 16u, d >> 16u) * (1.0f / 65535.0f);
    return albedo;
}

// Returns the directional albedo of stretched facets without a Fresnel term. `along_x`: the magnitude of the cosine,
// along the surface, of the direction with the axis of the larger alpha; `anisotropy`: the root of how far that alpha
// is from the one that roughness says to 1.
CASTOR_ONCE Real LANES(stretched_albedo)(const Real cosine, const Real along_x, const Real roughness,
                                         const Real anisotropy)
{
    const LANES(AlbedoPlaces) place =
        LANES(albedo_places)(cosine, along_x, CASTOR_STRETCHED_COSINES, CASTOR_STRETCHED_TURNS + 1.0f);
    const LANES(AxisPlaces) grade = LANES(axis_places)(LANES(clamped_share)(roughness), CASTOR_STRETCHED_GRADES);
    const LANES(AxisPlaces) strength = LANES(axis_places)(LANES(clamped_share)(anisotropy), CASTOR_STRETCHED_STRENGTHS);
    const uint per_grade = CASTOR_STRETCHED_TURNS * CASTOR_STRETCHED_COSINES;
    const uint per_strength = CASTOR_STRETCHED_GRADES * per_grade;
    const Whole first = place.entry + strength.entry * per_strength + grade.entry * per_grade;
    Real of_strength[2];
    for (uint l = 0; l < 2; ++l) {
        Real of_grade[2];
        for (uint k = 0; k < 2; ++k) {
            const Whole entry = first + (l * per_strength + k * per_grade);
            const Whole a = LANES(gather_entries)(stretched_albedos, entry);
            const Whole b = LANES(gather_entries)(stretched_albedos, entry + 1u);
            of_grade[k] = LANES(between_entries)(place, a & 0xffffu, b & 0xffffu, a >> 16u, b >> 16u);
        }
        of_strength[l] = fma(grade.beyond, of_grade[1] - of_grade[0], of_grade[0]);
    }
    return fma(strength.beyond, of_strength[1] - of_strength[0], of_strength[0]) * (1.0f / 65535.0f);
}

// Returns the directional albedo of rough glass: of what is reflected and refracted together. `eta`: the index of
// refraction beyond it over that on the side of the direction.
CASTOR_ONCE Real LANES(glass_albedo)(const Real cosine, const Real roughness, const Real eta)
{
    const float size = CASTOR_GLASS_ALBEDO_SIZE;
    const LANES(AlbedoPlaces) place = LANES(albedo_places)(cosine, roughness, size, size);
    const Real ratio = LANES(smaller)(LANES(divide)(fabs(eta - 1.0f), eta + 1.0f), (Real)(1.0f));
    const LANES(AxisPlaces) layer = LANES(axis_places)(LANES(square_root)(ratio), size);
    const uint rows = CASTOR_GLASS_ALBEDO_SIZE, layers = CASTOR_GLASS_ALBEDO_SIZE * CASTOR_GLASS_ALBEDO_SIZE;
    const Whole shift = eta < 1.0f ? (Whole)(16u) : (Whole)(0u);
    Real of_layer[2];
    for (uint i = 0; i < 2; ++i) {
        const Whole entry = (layer.entry + i) * layers + place.entry;
        of_layer[i] =
            LANES(between_entries)(place, (LANES(gather_entries)(glass_albedos, entry) >> shift) & 0xffffu,
                                   (LANES(gather_entries)(glass_albedos, entry + 1u) >> shift) & 0xffffu,
                                   (LANES(gather_entries)(glass_albedos, entry + rows) >> shift) & 0xffffu,
                                   (LANES(gather_entries)(glass_albedos, entry + (rows + 1u)) >> shift) & 0xffffu);
    }
    return fma(layer.beyond, of_layer[1] - of_layer[0], of_layer[0]) * (1.0f / 65535.0f);
}

// Returns the directional albedo of sheen of colour 1; it may be above 1 for a small roughness.
CASTOR_ONCE Real LANES(sheen_albedo)(const Real cosine, const Real roughness)
{
    const LANES(AlbedoPlaces) place = LANES(albedo_places)(cosine, roughness, CASTOR_ALBEDO_SIZE, CASTOR_ALBEDO_SIZE);
    const Whole a = LANES(gather_entries)(sheen_albedos, place.entry);
    const Whole b = LANES(gather_entries)(sheen_albedos, place.entry + 1u);
    const Whole c = LANES(gather_entries)(sheen_albedos, place.entry + (uint)CASTOR_ALBEDO_SIZE);
    const Whole d = LANES(gather_entries)(sheen_albedos, place.entry + (CASTOR_ALBEDO_SIZE + 1u));
    return LANES(between_entries)(place, a, b, c, d) * (1.0f / 32768.0f);
}

// Returns by what microfacets that reflect f0 head-on are scaled, so that light that meets several of them is not lost:
// 1 + f0 (1 - E) / E (Turquin 2019, "Practical multiple scattering compensation for microfacet models").
CASTOR_INLINE Real LANES(energy_scale)(const Real f0, const Real lost) { return fma(f0, lost, (Real)(1.0f)); }

// Returns (1 - E) / E.
CASTOR_INLINE Real LANES(lost_energy)(const LANES(MicrofacetAlbedos) albedo)
{
    return LANES(divide)(1.0f - albedo.all, albedo.all);
}

// Returns what microfacets with Schlick's Fresnel term reflect, energy scale included.
CASTOR_INLINE Real LANES(fresnel_albedo)(const LANES(MicrofacetAlbedos) albedo, const Real f0, const Real f90,
                                         const Real lost)
{
    const Real single = fma(f0, albedo.all - albedo.grazing, f90 * albedo.grazing);
    return LANES(smaller)(single * LANES(energy_scale)(f0, lost), (Real)(1.0f));
}

CASTOR_INLINE Real LANES(mean_albedo_part)(const uint part, const Real roughness)
{
    Real sum = (Real)(mean_albedo_coefficients[part][CASTOR_ALBEDO_DEGREE]);
    for (uint i = CASTOR_ALBEDO_DEGREE; i > 0; --i)
        sum = fma(sum, roughness, (Real)(mean_albedo_coefficients[part][i - 1]));
    return sum;
}

// Returns the average of fresnel_albedo over directions, weighted by their cosine.
CASTOR_INLINE Real LANES(mean_fresnel_albedo)(const Real roughness, const Real f0, const Real f90)
{
    const Real single = fma(f0, LANES(mean_albedo_part)(0, roughness), f90 * LANES(mean_albedo_part)(1, roughness));
    const Real gained = fma(f0, LANES(mean_albedo_part)(2, roughness), f90 * LANES(mean_albedo_part)(3, roughness));
    return LANES(smaller)(fma(f0, gained, single), (Real)(1.0f));
}
