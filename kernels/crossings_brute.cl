// Puts both queries for crossings into one program, as render.lanes.cl does with the stages.
#include "count_crossings_brute.cl"
#include "list_crossings_brute.cl"
