// Draws directions to an environment, and looks up what is in them, for CASTOR_LANES lanes (see device/lanes.cl).
// `count` is a multiple of the lanes.
#define CASTOR_TRACES_PATHS 1
#include "device/environment.lanes.cl"

// Results are two rows: the direction and the density with which it was drawn; the red channels of what the sample
// gives and of the radiance from its direction, and the density that density_of_environment says.
kernel CASTOR_IN_LANES void LANES(draw_environment_test)(const uint count, const Light light, const uint is_joined,
                                                         const global TextureImage *restrict images,
                                                         const global uint *restrict texels,
                                                         const global uint *restrict environment_parts,
                                                         const global float4 *restrict points,
                                                         global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) row = LANES(load_rows)(points + i);
    const Real zero = (Real)(0.0f);
    LANES(Points) at;
    at.x = row.x;
    at.y = row.y;
    const LANES(Vectors) origin = LANES(vectors)(zero, zero, zero), up = LANES(vectors)(zero, (Real)(1.0f), zero);
    const LANES(LightSamples) sample =
        LANES(sample_environment)(light, images, texels, environment_parts, (int)is_joined, origin, up, at);
    const Real density =
        LANES(density_of_environment)(light, images, environment_parts, (int)is_joined, sample.wi, sample.wi.y);
    const LANES(Vectors) radiance = LANES(environment_light)(light, images, texels, sample.wi);
    const Whole number = (LANES(lane_numbers)() + i) * 2u;
    const Mask all = count > 0u ? (Mask)(-1) : (Mask)(0);
    LANES(scatter_rows)(sample.wi.x, sample.wi.y, sample.wi.z, sample.density, number, all, results);
    LANES(scatter_rows)(sample.irradiance.x, radiance.x, density, zero, number + 1u, all, results);
}

// Rows: directions. Results: the red channel of the radiance, and the density.
kernel CASTOR_IN_LANES void LANES(look_at_environment_test)(const uint count, const Light light, const uint is_joined,
                                                            const global TextureImage *restrict images,
                                                            const global uint *restrict texels,
                                                            const global uint *restrict environment_parts,
                                                            const global float4 *restrict directions,
                                                            global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Vectors) direction = LANES(load_vectors)(directions + i);
    const LANES(Vectors) radiance = LANES(environment_light)(light, images, texels, direction);
    const Real density =
        LANES(density_of_environment)(light, images, environment_parts, (int)is_joined, direction, direction.y);
    LANES(store_rows)(radiance.x, density, (Real)(0.0f), (Real)(0.0f), results + i);
}
