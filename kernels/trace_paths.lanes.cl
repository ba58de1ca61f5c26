// The stages of path tracing that others do not have, in one program, for CASTOR_LANES lanes (see lanes.cl). A bounce
// is: trace the rays, find surfaces, add_emission, sample_lights, trace the shadow rays, accumulate, scatter_paths.
#ifndef CASTOR_TRACES_PATHS
#define CASTOR_TRACES_PATHS 1
#endif
#include "add_emission.lanes.cl"
#include "limit_samples.cl"
#include "sample_lights.lanes.cl"
#include "scatter_paths.lanes.cl"
