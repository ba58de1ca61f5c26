// Draws points of lights, and eye rays through a lens, for CASTOR_LANES lanes (see device/lanes.cl). `count` is a
// multiple of the lanes.
#define CASTOR_TRACES_PATHS 1
#define CASTOR_HAS_MOTION 1
#include "device/camera.lanes.cl"
#include "device/lights.lanes.cl"
#include "device/resampled_meshes.lanes.cl"

// Rows: sample points, and in z the time. Results are three rows: the direction and the density with which it was
// drawn; the point, and the red channel of what the sample gives; the density that densities_of_light says.
kernel CASTOR_IN_LANES void LANES(draw_lights_test)(const uint count, const Light light, const float4 origin,
                                                    const float4 normal, const global Emitter *restrict emitters,
                                                    const global Instance *restrict instances,
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
    const LANES(Vectors) from = LANES(vectors)((Real)(origin.x), (Real)(origin.y), (Real)(origin.z));
    const LANES(LightSamples) sample = LANES(sample_extended_light)(light, emitters, instances, from, row.z, at);
    const Real of_sun = LANES(lead_to_sun)(light, sample.wi) ? (Real)(density_of_sun(light)) : zero;
    const Real of_surface =
        LANES(densities_of_light)(light, instances, from, row.z, sample.point,
                                  LANES(vectors)((Real)(normal.x), (Real)(normal.y), (Real)(normal.z)));
    const Real density = light.kind == CASTOR_LIGHT_DIRECTIONAL ? of_sun : of_surface;
    const Whole number = (LANES(lane_numbers)() + i) * 3u;
    const Mask all = count > 0u ? (Mask)(-1) : (Mask)(0);
    LANES(scatter_rows)(sample.wi.x, sample.wi.y, sample.wi.z, sample.density, number, all, results);
    LANES(scatter_rows)(sample.point.x, sample.point.y, sample.point.z, sample.irradiance.x, number + 1u, all, results);
    LANES(scatter_rows)(density, zero, zero, zero, number + 2u, all, results);
}

// Rows: sample points, in z what chooses between candidates, and in w the time. Results are two rows: the point, and
// the red channel of what the sample gives; the density.
kernel CASTOR_IN_LANES void LANES(resample_meshes_test)(const uint count, const Light light, const float4 position,
                                                        const float4 normal, const uint has_both_sides,
                                                        const global Emitter *restrict emitters,
                                                        const global float4 *restrict points,
                                                        global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const LANES(Rows) row = LANES(load_rows)(points + i);
    const Real zero = (Real)(0.0f);
    LANES(MeshQueries) query;
    query.position = LANES(vectors)((Real)(position.x), (Real)(position.y), (Real)(position.z));
    query.normal = LANES(vectors)((Real)(normal.x), (Real)(normal.y), (Real)(normal.z));
    query.has_both_sides = (Whole)(has_both_sides) != 0u;
    query.time = row.w;
    query.at.x = row.x;
    query.at.y = row.y;
    query.choice = row.z;
    const LANES(LightSamples) sample = LANES(resample_meshes)(LANES(same_mesh_lights)(light), emitters, query);
    const Whole number = (LANES(lane_numbers)() + i) * 2u;
    const Mask all = count > 0u ? (Mask)(-1) : (Mask)(0);
    LANES(scatter_rows)(sample.point.x, sample.point.y, sample.point.z, sample.irradiance.x, number, all, results);
    LANES(scatter_rows)(sample.density, zero, zero, zero, number + 1u, all, results);
}

// Rows: pixels' numbers, as whole ones' bits. Results: the origins of the rays through their middles.
kernel CASTOR_IN_LANES void LANES(draw_lens_test)(const uint count, const Camera camera,
                                                  const global float4 *restrict pixels, global float4 *restrict results)
{
    const uint i = get_global_id(0) * CASTOR_LANES;
    if (i >= count) return;
    const Whole pixel = LANES(as_uint)(LANES(load_rows)(pixels + i).x);
    const LANES(Points) on_lens = LANES(sample_dimension)(pixel, (Whole)(0), 7u, (Whole)(CASTOR_DIMENSION_LENS));
    const LANES(EyeRays) ray = LANES(eye_rays)(camera, on_lens, on_lens);
    LANES(store_rows)(ray.origin.x, ray.origin.y, ray.origin.z, (Real)(0.0f), results + i);
}
