// Lookups in a picture at points (u, v, level), with a texture's filter, for CASTOR_LANES lanes (see device/lanes.cl).
// The number of points is a multiple of the lanes.
#include "device/texture_lookup.lanes.cl"

kernel CASTOR_IN_LANES void LANES(texture_lookups)(const uint count, const Texture texture,
                                                   const global TextureImage *restrict images,
                                                   const global uint *restrict texels,
                                                   const global float4 *restrict points, global float4 *restrict found)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Vectors) point = LANES(load_vectors)(points + i);
    LANES(store_vectors)
    (LANES(filtered_texels)(texels, images + texture.image, texture.filter, texture.wrap, point.x, point.y, point.z),
     found + i);
}
