// The stages of surfaces that are there in part, in one program: see Wave::pass_surfaces.
#include "find_passed.cl"
#include "go_on_beyond.cl"
#include "take_hits_beyond.cl"
