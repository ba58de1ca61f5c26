// Puts both queries of the strategy into one program, as render.lanes.cl does with the stages.
#include "any_hit_wide.cl"
#include "closest_hit_wide.cl"
