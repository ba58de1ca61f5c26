// What the scene has, beside what every scene may have: the kernels of a wave are built with 1 for what is there, so
// that a scene without pays nothing. See RenderFeatures (host/render/render_features.h).
#ifndef CASTOR_RENDER_FEATURES
#define CASTOR_RENDER_FEATURES
#ifndef CASTOR_HAS_TEXTURES
#define CASTOR_HAS_TEXTURES 0
#endif
#ifndef CASTOR_HAS_OTHER_TEXTURES  // that give more than diffuse reflectances and normals; 1 where nobody says
#define CASTOR_HAS_OTHER_TEXTURES 1
#endif
#ifndef CASTOR_HAS_TEXTURES_WITH_AXES  // trilinear ones, and those that change normals; 1 where nobody says
#define CASTOR_HAS_TEXTURES_WITH_AXES 1
#endif
#ifndef CASTOR_HAS_DIELECTRICS
#define CASTOR_HAS_DIELECTRICS 0
#endif
#ifndef CASTOR_HAS_ROUGHNESS
#define CASTOR_HAS_ROUGHNESS 0
#endif
#ifndef CASTOR_HAS_BRDFS  // models other than blinn_phong
#define CASTOR_HAS_BRDFS 0
#endif
#ifndef CASTOR_HAS_EMISSION
#define CASTOR_HAS_EMISSION 0
#endif
#ifndef CASTOR_HAS_SAMPLED_LIGHTS  // whose rays go to random points of them
#define CASTOR_HAS_SAMPLED_LIGHTS 0
#endif
#ifndef CASTOR_HAS_MOTION  // of instances
#define CASTOR_HAS_MOTION 0
#endif
#ifndef CASTOR_HAS_LIGHT_GROUPS  // a picture has planes of the light of groups of lights
#define CASTOR_HAS_LIGHT_GROUPS 0
#endif
#ifndef CASTOR_HAS_ENVIRONMENT
#define CASTOR_HAS_ENVIRONMENT 0
#endif
#ifndef CASTOR_HAS_LIGHT_SHAPES  // sampled lights other than environments; 1 where nobody says
#define CASTOR_HAS_LIGHT_SHAPES 1
#endif
#ifndef CASTOR_HAS_LIGHT_TREE  // several lights, among which a tree chooses; 1 where nobody says
#define CASTOR_HAS_LIGHT_TREE 1
#endif
#ifndef CASTOR_HAS_LIGHT_RANGES  // of point and spot lights
#define CASTOR_HAS_LIGHT_RANGES 0
#endif
#ifndef CASTOR_HAS_SUNS  // directional lights whose disk is seen
#define CASTOR_HAS_SUNS 0
#endif
#ifndef CASTOR_HAS_CLASSIC  // materials that are not principled; 1 where nobody says
#define CASTOR_HAS_CLASSIC 1
#endif
#ifndef CASTOR_HAS_PRINCIPLED
#define CASTOR_HAS_PRINCIPLED 0
#endif
#ifndef CASTOR_HAS_ATTRIBUTES  // principled materials have textures, or colours of vertices
#define CASTOR_HAS_ATTRIBUTES 0
#endif
// Principled: thin films, dispersion, coats with their own normals, glass with anisotropy or a specular
// colour; 1 where nobody says.
#ifndef CASTOR_HAS_OPTICS
#define CASTOR_HAS_OPTICS 1
#endif
#ifndef CASTOR_HAS_PANES  // principled: smooth thin walls that transmit light
#define CASTOR_HAS_PANES 0
#endif
#ifndef CASTOR_HAS_MATCHED_SOLIDS  // principled: solids of index 1, and lights that no ray meets
#define CASTOR_HAS_MATCHED_SOLIDS 0
#endif
#ifndef CASTOR_HAS_SCATTERING  // principled: solids whose insides scatter light
#define CASTOR_HAS_SCATTERING 0
#endif
// Not of the scene: the picture is path traced.
#ifndef CASTOR_TRACES_PATHS
#define CASTOR_TRACES_PATHS 0
#endif
// Whether each slot has one sum, to which what its sample finds is added as it comes: see film.lanes.cl.
#ifndef CASTOR_HAS_SLOT_SUMS
#define CASTOR_HAS_SLOT_SUMS (CASTOR_HAS_DIELECTRICS || CASTOR_TRACES_PATHS)
#endif
#endif
