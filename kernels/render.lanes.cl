// The stages of a picture in one program, those in lanes for CASTOR_LANES of them (see lanes.cl): what a compiler does
// for each program, such as reading its built-in functions, it does once.
#include "accumulate.lanes.cl"
#include "add_samples.cl"
#include "compact_paths.cl"
#include "find_surface.lanes.cl"
#include "generate_rays.lanes.cl"
#include "generate_shadow_rays.lanes.cl"
#include "rank_paths.cl"
#include "resolve.cl"
#include "scatter.lanes.cl"
#include "shade.lanes.cl"
