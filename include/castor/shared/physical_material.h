// The parameters of physically based surfaces, read by both compilers.
#ifndef CASTOR_SHARED_PHYSICAL_MATERIAL_H
#define CASTOR_SHARED_PHYSICAL_MATERIAL_H

#include "castor/shared/layout.h"

// PhysicalMaterial.flags
#define CASTOR_PHYSICAL_THIN 1u  // what transmits is a thin wall: light goes on in its direction

CASTOR_SHARED_BEGIN

/// A physically based surface, with the parameters of glTF 2.0 and of its extensions. Colours and shares are in [0, 1].
/// kernels/device/physical_bsdf.lanes.cl says what is made of them.
typedef struct PhysicalMaterial {
    float base_color[3];
    float metallic;
    float specular_color[3];  // KHR_materials_specular; 1 where nothing is said
    float specular;           // its factor, likewise
    float sheen_color[3];
    float sheen_roughness;
    float diffuse_transmission_color[3];
    float diffuse_transmission;  // of what is not reflected by facets nor transmitted by them, the share that passes
    float roughness;             // perceptual: its square is GGX's alpha. Less than 0.01 is smooth.
    float anisotropy;            // its strength, along x of the frame
    float diffuse_roughness;     // of the model EON; 0: Lambert's
    float transmission;
    float refraction_index;  // of dielectrics; with a positive absorption_index that of the metal, n + ik
    float absorption_index;  // 0: base_color is what the metal reflects head-on; else it multiplies what n + ik does
    float clearcoat;
    float clearcoat_roughness;
    uint flags;  // CASTOR_PHYSICAL_...
    uint reserved[3];
} PhysicalMaterial;
CASTOR_ASSERT_SIZE(PhysicalMaterial, 112);

CASTOR_SHARED_END

#endif
