// The stages of a picture in one program: what a compiler does for each program, such as reading its built-in
// functions, it does once.
#include "accumulate.cl"
#include "add_samples.cl"
#include "compact_paths.cl"
#include "find_surface.cl"
#include "generate_rays.cl"
#include "generate_shadow_rays.cl"
#include "rank_paths.cl"
#include "resolve.cl"
#include "scatter.cl"
#include "shade.cl"
