// Puts both queries for crossings into one program, as render.lanes.cl does with the stages.
#include "count_crossings_simt.cl"
#include "list_crossings_simt.cl"
