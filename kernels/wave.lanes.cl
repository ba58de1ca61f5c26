// The stages of a picture that are the same for all scenes, in one program, those in lanes for CASTOR_LANES of them
// (see lanes.cl). It is built with CASTOR_HAS_SLOT_SUMS and CASTOR_HAS_LIGHT_GROUPS (features.cl) alone, so that what
// was compiled for one scene serves the next.
#include "accumulate.lanes.cl"
#include "add_branches.cl"
#include "add_samples.cl"
#include "compact_paths.cl"
#include "draw_times.lanes.cl"
#include "find_surface.lanes.cl"
#include "generate_rays.lanes.cl"
#include "limit_samples.cl"
#include "list_branches.cl"
#include "move_rays.cl"
#include "move_surfaces.cl"
#include "rank_paths.cl"
#include "resolve.cl"
#include "select_rays_inside.cl"
#include "take_branches.cl"
#include "take_hits_inside.cl"
