// The stages of path tracing that others do not have, in one program, for CASTOR_LANES lanes (see lanes.cl). A bounce
// is: trace the rays, with scatter_within where solids scatter light, find surfaces and their attributes, shade_paths,
// trace the shadow rays, with pass_panes where they meet panes, accumulate.
#ifndef CASTOR_TRACES_PATHS
#define CASTOR_TRACES_PATHS 1
#endif
#include "device/features.cl"
#include "find_base_colors.lanes.cl"
#include "shade_paths.lanes.cl"
#if CASTOR_HAS_SCATTERING
#include "light_within.lanes.cl"
#include "scatter_within.lanes.cl"
#endif
#if CASTOR_HAS_PANES
#include "pass_panes.lanes.cl"
#endif
