// What the planes "albedo" and "mean-albedo" hold.
#include "castor/shared/wave_columns.h"
#include "device/features.cl"

// Returns the diffuse reflectance of what the path at a place met, after textures; where a texture is all that the
// surface sends, what it sends. Of principled surfaces: the base colour. What a surface emits is added: where an edge
// of a lamp lies within a pixel, the mean shows how much of it the pixel sees.
CASTOR_INLINE float3 albedo_of_hit(const global Material *restrict materials, CASTOR_READ(surface_material),
                                   CASTOR_READ(surface_diffuse), const uint place)
{
    const global Material *const material = materials + surface_material[place];
    const float3 emission = vload3(0, material->emission);
#if CASTOR_HAS_TEXTURES || CASTOR_HAS_ATTRIBUTES
    return surface_diffuse[place].xyz + emission;
#else
    return vload3(0, material->diffuse) + emission;
#endif
}
