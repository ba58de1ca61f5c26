// The stages of surfaces that rays pass, in one program: see Wave::pass_surfaces.
#include "find_passed.cl"
#include "go_on_beyond.cl"
