// CASTOR_LANES paths a work-item (see lanes.cl). Writes the times of their rays, which are those of their samples: all
// rays of a path see the scene at the same time.
#include "castor/shared/wave_columns.h"
#include "device/path_states.lanes.cl"
#include "device/pixels.lanes.cl"

kernel CASTOR_IN_LANES void LANES(draw_times)(const RenderParams params, CASTOR_READ(pixel_blocks),
                                              CASTOR_READ(path_slot), CASTOR_READ(path_state), CASTOR_WRITE(ray_time))
{
    const uint place = get_global_id(0) * CASTOR_LANES;
    if (place >= params.path_count) return;
    const Mask is_path = LANES(is_place)(place, params.path_count);
    const Whole slot =
        LANES(slots_of_samples)(params, path_state, LANES(slots)(params, path_slot, place, is_path), is_path);
    const LANES(Points) at = LANES(points_of_slots)(params, pixel_blocks, slot, (Whole)(CASTOR_DIMENSION_TIME));
    LANES(store_real_column)(at.x, ray_time + place);
}
