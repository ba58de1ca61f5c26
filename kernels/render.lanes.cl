// The stages of a picture by the format's rules that are built for what the scene has (features.cl), in one program,
// for
// CASTOR_LANES lanes (see lanes.cl): what a compiler does for each program, such as reading its built-in functions, it
// does once. wave.lanes.cl has the others.
#include "generate_shadow_rays.lanes.cl"
#include "scatter.lanes.cl"
#include "shade.lanes.cl"
