// What a material of any model reflects of a point light: one row a case.
#define CASTOR_HAS_BRDFS 1
#include "device/shading.x1.cl"

kernel void brdf_test(const uint count, const global Light *restrict lights, const global Material *restrict materials,
                      const global float4 *restrict normals, const global float4 *restrict wos,
                      global float4 *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    const float zero = 0.0f;
    const Vectors reflected =
        reflected_light(load_materials(materials, i), 0, load_vectors(normals + i), load_vectors(wos + i),
                        sample_light(lights[i], vectors(zero, zero, zero)));
    store_vectors(reflected, results + i);
}
