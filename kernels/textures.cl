// The stages of scenes with textures in one program: see render.lanes.cl.
#include "apply_textures.cl"
#include "texture_background.cl"
