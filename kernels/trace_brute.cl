// Both queries of the strategy in one program, as in render.cl.
#include "any_hit_brute.cl"
#include "closest_hit_brute.cl"
