// Finds the surfaces that rays met, if the chunk has them, for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/wave_columns.h"
#include "device/hits.lanes.cl"
#include "device/queue.lanes.cl"
#include "device/surface.lanes.cl"
#include "device/surface_of_hit.cl"

typedef struct LANES(FoundSurfaces) {
    Mask is_found;  // in this chunk
    int is_usual;   // all are triangles in no instance but 0
    LANES(Hits) hit;
    Whole primitive;  // what primitive_of_hit says
    LANES(Surfaces) surface;
} LANES(FoundSurfaces);

CASTOR_INLINE void LANES(store_surfaces)(const LANES(FoundSurfaces) found, CASTOR_WRITE(surface_position),
                                         CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material))
{
    const Whole none = (Whole)(CASTOR_INVALID_INDEX);
    LANES(store_vectors)(found.surface.position, surface_position);
    LANES(store_vectors)(found.surface.normal, surface_normal);
    LANES(store_whole_column)(found.is_found ? found.surface.material : none, surface_material);
}

#if CASTOR_LANES > 1
// Returns what is known without looking at surfaces. `primitive`: of a scene that is not cut, in no instance but 0.
CASTOR_INLINE LANES(FoundSurfaces)
    LANES(found_hits)(const SurfaceColumns columns, const uint first, const uint path_count, CASTOR_READ(hits))
{
    LANES(FoundSurfaces) found;
    found.hit = LANES(load_hits)(hits + first);
    found.is_found = LANES(is_place)(first, path_count) & (found.hit.primitive != CASTOR_INVALID_INDEX);
    found.primitive = LANES(primitives_in_place)(columns, columns.geometries[0], found.hit.primitive);
    const Mask is_triangle = (found.hit.instance == 0u) & (found.primitive < columns.params.triangle_count);
    found.is_usual = columns.params.number_count == 0 && !LANES(mask_of)(found.is_found & !is_triangle);
    found.surface = LANES(no_surfaces)();
    return found;
}

// find_surfaces of hits that are not usual.
CASTOR_ONCE LANES(FoundSurfaces)
    LANES(find_other_surfaces)(const SurfaceColumns columns, const uint first, const uint path_count,
                               CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits),
                               CASTOR_WRITE(surface_position), CASTOR_WRITE(surface_normal),
                               CASTOR_WRITE(surface_material))
{
    LANES(FoundSurfaces) found = LANES(found_hits)(columns, first, path_count, hits);
    if (columns.params.number_count == 0 && !LANES(mask_of)(found.is_found & (found.hit.instance != 0u))) {
        found.surface = LANES(surfaces_in_place)(columns, found.is_found, found.primitive, found.hit.t, found.hit.u,
                                                 found.hit.v, LANES(load_vectors)(ray_origin_tmin + first),
                                                 LANES(load_vectors)(ray_direction_tmax + first));
        LANES(store_surfaces)(found, surface_position + first, surface_normal + first, surface_material + first);
        return found;
    }
    // Hits of instances and in chunks differ too much to be found side by side.
    uint primitives[CASTOR_LANES];
    LANES(store_wholes)((Whole)(CASTOR_INVALID_INDEX), primitives);
#if CASTOR_SURFACES_HAVE_UVS
    float u[CASTOR_LANES], v[CASTOR_LANES];
    LANES(store_reals)((Real)(0.0f), u);
    LANES(store_reals)((Real)(0.0f), v);
#endif
    for (uint place = first; place < min(first + CASTOR_LANES, path_count); ++place) {
        const Hit hit = hits[place];
        if (hit.primitive == CASTOR_INVALID_INDEX) {
            surface_material[place] = CASTOR_INVALID_INDEX;
            continue;
        }
        const uint primitive = primitive_of_hit(columns, hit);
        primitives[place - first] = primitive;
        if (primitive == CASTOR_INVALID_INDEX) continue;
        const Surfaces surface =
            surface_of_hit(columns, primitive, hit, ray_origin_tmin[place].xyz, ray_direction_tmax[place].xyz);
        store_vectors(surface.position, surface_position + place);
        store_vectors(surface.normal, surface_normal + place);
        surface_material[place] = surface.material;
#if CASTOR_SURFACES_HAVE_UVS
        u[place - first] = surface.uv.x;
        v[place - first] = surface.uv.y;
#endif
    }
    found.primitive = LANES(vload)(0, primitives);
    found.is_found &= found.primitive != CASTOR_INVALID_INDEX;
    found.surface.position = LANES(load_vectors)(surface_position + first);
    found.surface.normal = LANES(load_vectors)(surface_normal + first);
    found.surface.material = LANES(load_whole_column)(surface_material + first);
#if CASTOR_SURFACES_HAVE_UVS
    found.surface.uv.x = LANES(vload)(0, u);
    found.surface.uv.y = LANES(vload)(0, v);
#endif
    return found;
}
#endif

// Stores the surfaces at places from `first` on, if the chunk has them, and returns them; material
// CASTOR_INVALID_INDEX: the ray met nothing.
CASTOR_INLINE LANES(FoundSurfaces)
    LANES(find_surfaces)(const SurfaceColumns columns, const uint first, const uint path_count,
                         CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax), CASTOR_READ(hits),
                         CASTOR_WRITE(surface_position), CASTOR_WRITE(surface_normal), CASTOR_WRITE(surface_material))
{
#if CASTOR_LANES == 1
    FoundSurfaces found;
    found.hit = load_hits(hits + first);
    found.is_found = is_place(first, path_count) & (found.hit.primitive != CASTOR_INVALID_INDEX);
    found.primitive = CASTOR_INVALID_INDEX;
    if (found.is_found)
        found.primitive = primitive_of_hit(columns, hits[first]);
    else
        surface_material[first] = CASTOR_INVALID_INDEX;
    found.is_found = found.primitive != CASTOR_INVALID_INDEX;
    found.is_usual = found.hit.instance == 0 && found.primitive < columns.params.triangle_count;
    if (found.is_found) {
        found.surface = surface_of_hit(columns, found.primitive, hits[first], ray_origin_tmin[first].xyz,
                                       ray_direction_tmax[first].xyz);
        store_vectors(found.surface.position, surface_position + first);
        store_vectors(found.surface.normal, surface_normal + first);
        surface_material[first] = found.surface.material;
    }
#else
    LANES(FoundSurfaces) found = LANES(found_hits)(columns, first, path_count, hits);
    if (!found.is_usual)
        return LANES(find_other_surfaces)(columns, first, path_count, ray_origin_tmin, ray_direction_tmax, hits,
                                          surface_position, surface_normal, surface_material);
    if (LANES(mask_of)(found.is_found))
        found.surface = LANES(triangle_surfaces)(columns, found.is_found, found.primitive, found.hit.u, found.hit.v,
                                                 LANES(load_vectors)(ray_direction_tmax + first));
    LANES(store_surfaces)(found, surface_position + first, surface_normal + first, surface_material + first);
#endif
    return found;
}
