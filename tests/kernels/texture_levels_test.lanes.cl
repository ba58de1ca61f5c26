// Levels of a trilinear picture, for CASTOR_LANES lanes (see device/lanes.cl). `count` is a multiple of the lanes.
#define CASTOR_SURFACES_HAVE_UVS 1
#define CASTOR_SURFACES_HAVE_AXES 1
#include "device/textures.lanes.cl"

// Rows: two edges, and t as w of the first one; du and dv of both; normals; directions.
kernel CASTOR_IN_LANES void LANES(texture_levels_test)(
    const uint count, const TextureImage image, const float pixel_spread, const global float4 *restrict e1_t,
    const global float4 *restrict e2, const global float4 *restrict duv, const global float4 *restrict normals,
    const global float4 *restrict directions, global float *restrict levels)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) first = LANES(load_rows)(e1_t + i), coordinates = LANES(load_rows)(duv + i);
    LANES(Surfaces) surface = LANES(no_surfaces)();
    surface.normal = LANES(load_vectors)(normals + i);
    surface.edge.e1 = LANES(vectors_of_rows)(first);
    surface.edge.e2 = LANES(load_vectors)(e2 + i);
    surface.edge.du1 = coordinates.x;
    surface.edge.dv1 = coordinates.y;
    surface.edge.du2 = coordinates.z;
    surface.edge.dv2 = coordinates.w;
    LANES(store_real_column)
    (LANES(levels_of_cones)(image, surface, first.w, LANES(load_vectors)(directions + i), pixel_spread), levels + i);
}
