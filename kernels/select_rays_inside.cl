// One work-item a path. Writes the rays that are inside dielectrics; rays that hit nothing in the place of others.
#include "castor/shared/wave_columns.h"
#include "device/path_states.x1.cl"

kernel void select_rays_inside(const RenderParams params, CASTOR_READ(path_slot), CASTOR_READ(path_state),
                               CASTOR_READ(ray_origin_tmin), CASTOR_READ(ray_direction_tmax),
                               CASTOR_WRITE(shadow_origin_tmin), CASTOR_WRITE(shadow_direction_tmax))
{
    const uint place = get_global_id(0);
    if (place >= params.path_count) return;
    const int is_inside = path_state[path_slot[place]].z != CASTOR_INVALID_INDEX;
    store_path_rays(dead_rays(), shadow_origin_tmin + place, shadow_direction_tmax + place);
    if (!is_inside) return;
    shadow_origin_tmin[place] = ray_origin_tmin[place];
    shadow_direction_tmax[place] = ray_direction_tmax[place];
}
