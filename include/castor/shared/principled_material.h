// The parameters of physically based surfaces, read by both compilers.
#ifndef CASTOR_SHARED_PRINCIPLED_MATERIAL_H
#define CASTOR_SHARED_PRINCIPLED_MATERIAL_H

#include "castor/shared/layout.h"

// PrincipledMaterial.flags
#define CASTOR_PRINCIPLED_THIN 1u         // what transmits is a thin wall: light goes on in its direction
#define CASTOR_PRINCIPLED_UNLIT 2u        // sends its base colour, and scatters nothing
#define CASTOR_PRINCIPLED_ALPHA_MASK 4u   // the surface is there where alpha is at least alpha_cutoff
#define CASTOR_PRINCIPLED_ALPHA_BLEND 8u  // alpha is the share of the surface that is there
#define CASTOR_PRINCIPLED_MATCHED 16u     // a solid of index 1 that transmits: light goes on in its direction

// Of GGX: what has less is a mirror, since the lobe is narrower than rounding lets a direction be told.
#define CASTOR_LEAST_ALPHA 1e-4f

// PrincipledMaterial.texture: what each multiplies
#define CASTOR_SLOT_BASE_COLOR 0u  // and alpha
#define CASTOR_SLOT_METALLIC_ROUGHNESS 1u
#define CASTOR_SLOT_NORMAL 2u
#define CASTOR_SLOT_EMISSION 3u
#define CASTOR_SLOT_SPECULAR 4u
#define CASTOR_SLOT_SPECULAR_COLOR 5u
#define CASTOR_SLOT_TRANSMISSION 6u
#define CASTOR_SLOT_DIFFUSE_TRANSMISSION 7u
#define CASTOR_SLOT_DIFFUSE_TRANSMISSION_COLOR 8u
#define CASTOR_SLOT_CLEARCOAT 9u
#define CASTOR_SLOT_CLEARCOAT_ROUGHNESS 10u
#define CASTOR_SLOT_SHEEN_COLOR 11u
#define CASTOR_SLOT_SHEEN_ROUGHNESS 12u
#define CASTOR_SLOT_ANISOTROPY 13u
#define CASTOR_SLOT_CLEARCOAT_NORMAL 14u
#define CASTOR_SLOT_IRIDESCENCE 15u
#define CASTOR_SLOT_IRIDESCENCE_THICKNESS 16u
#define CASTOR_SLOT_DIFFUSE_ROUGHNESS 17u
#define CASTOR_TEXTURE_SLOTS 18u

CASTOR_SHARED_BEGIN

/// A physically based surface, with the parameters of glTF 2.0 and of its extensions. Colours and shares are in [0, 1].
/// kernels/device/principled_bsdf.lanes.cl says what is made of them; castor::PrincipledMaterial, which channels of the
/// textures multiply them.
typedef struct PrincipledMaterial {
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
    uint flags;  // CASTOR_PRINCIPLED_...
    float alpha;
    float alpha_cutoff;
    float normal_scale;
    float anisotropy_cosine;  // of the angle from the tangent to x of the frame
    float anisotropy_sine;
    float clearcoat_normal_scale;
    float dispersion;  // 20 / Abbe number
    float iridescence;
    float iridescence_index;              // of refraction, of the film
    float iridescence_thickness_minimum;  // nanometres, where the texture is 0
    float iridescence_thickness_maximum;  // where it is 1, or there is none
    uint texture[CASTOR_TEXTURE_SLOTS];   // indices of textures; CASTOR_INVALID_INDEX: none
    float scattering_anisotropy;          // within a solid: the mean cosine of the angle by which light is turned
    uint reserved;
} PrincipledMaterial;
CASTOR_ASSERT_SIZE(PrincipledMaterial, 224);

CASTOR_SHARED_END

#endif
