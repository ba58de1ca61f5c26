// wave.lanes.cl for scenes with textures, and the stages that apply these, in one program: see render.lanes.cl.
#include "device/features.cl"
#define CASTOR_SURFACES_HAVE_UVS 1
#define CASTOR_SURFACES_HAVE_AXES CASTOR_HAS_TEXTURES_WITH_AXES
#include "find_textured_surface.lanes.cl"
#include "texture_background.lanes.cl"
#include "wave.lanes.cl"
