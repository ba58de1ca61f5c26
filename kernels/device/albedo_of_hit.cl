// What the planes "albedo" and "mean-albedo" hold.
#include "castor/shared/wave_columns.h"
#include "device/features.cl"

// Returns the diffuse reflectance of what the path at a place met, after textures; where a texture is all that the
// surface sends, what it sends. Of principled surfaces: the base colour.
CASTOR_INLINE float3 albedo_of_hit(const global Material *restrict materials, CASTOR_READ(surface_material),
                                   CASTOR_READ(surface_diffuse), const uint place)
{
#if CASTOR_HAS_TEXTURES || CASTOR_HAS_ATTRIBUTES
    return surface_diffuse[place].xyz;
#else
    return vload3(0, materials[surface_material[place]].diffuse);
#endif
}
