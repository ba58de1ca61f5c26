// The stages of scenes with textures in one program: see render.lanes.cl.
#define CASTOR_SURFACES_HAVE_UVS 1
#include "find_textured_surface.lanes.cl"
#include "texture_background.lanes.cl"
