// Codes and limits that host and device agree on.
#ifndef CASTOR_SHARED_CONSTANTS_H
#define CASTOR_SHARED_CONSTANTS_H

#define CASTOR_INVALID_INDEX 0xffffffffu

// Coordinates of geometry and ray origins lie in [-CASTOR_MAX_COORDINATE, CASTOR_MAX_COORDINATE]: then no
// slab, edge function or interpolation can overflow. `flatten` refuses larger geometry; a ray whose origin
// lies farther out is a miss.
#define CASTOR_MAX_COORDINATE 1e12f

// Levels of nodes of any tree, at most: `build_bvh` sees to it, and no wide tree is deeper than the binary one that it
// is made from.
#define CASTOR_MAX_STACK 64

// Levels of the tree over instances, at most: those of any tree, and a leaf of that one may hold eight instances at one
// place, which become levels too.
#define CASTOR_MAX_INSTANCE_STACK (CASTOR_MAX_STACK + 8)

// Children of the wide tree. A leaf child has the top bit set, then the kind of its blocks, then their number less one,
// then the first block.
#define CASTOR_WIDE_LEAF 0x80000000u
#define CASTOR_WIDE_SPHERES 0x40000000u
#define CASTOR_WIDE_COUNT_SHIFT 27
#define CASTOR_WIDE_COUNT_MASK 0x7u
#define CASTOR_WIDE_FIRST_MASK 0x07ffffffu

// Entries of the stack of a traversal of the wide tree: no deeper than the binary tree that it is made from, and seven
// children wait at each level.
#define CASTOR_MAX_WIDE_STACK (7 * CASTOR_MAX_STACK)

// Scenes of at most so many triangles and spheres are small: there all incoherent rays are faster sixteen together,
// where a CPU has registers for that (device/traverse_divergent.cl).
#define CASTOR_SMALL_SCENE 2048u

// What CASTOR_WIDE_LANES and CASTOR_WIDE_BATCH (device/traverse_wide.cl) are where nothing was tuned.
#define CASTOR_DEFAULT_WIDE_LANES 16
#define CASTOR_DEFAULT_WIDE_BATCH 128u

// What trace kernels count where they are built with CASTOR_COUNT_WORK: a counter each. Of the tree: a ray against the
// eight boxes of a compressed node, and of a wide node, a bundle of rays against these, and a bundle against one of
// them, ray by ray. Of primitives: a ray against one, a ray against a block of four, a bundle against the boxes of a
// block of triangles, and a bundle against one. Of the binary tree over instances: a ray at a node; those of the wide
// one count as wide nodes.
#define CASTOR_WORK_COMPRESSED_NODE 0
#define CASTOR_WORK_NODE 1
#define CASTOR_WORK_BUNDLE_NODE 2
#define CASTOR_WORK_BUNDLE_BOX 3
#define CASTOR_WORK_TRIANGLE 4
#define CASTOR_WORK_SPHERE 5
#define CASTOR_WORK_PLANE 6
#define CASTOR_WORK_TRIANGLE_BLOCK 7
#define CASTOR_WORK_SPHERE_BLOCK 8
#define CASTOR_WORK_BUNDLE_BLOCK 9
#define CASTOR_WORK_BUNDLE_TRIANGLE 10
#define CASTOR_WORK_BUNDLE_SPHERE 11
#define CASTOR_WORK_INSTANCE_NODE 12
#define CASTOR_WORK_KINDS 13

// CompressedNode.meta. Zero: no child. An inner child: CASTOR_COMPRESSED_INNER and its place, 0 to 7. A leaf: as many
// bits set as it has primitives, one to three, above where they begin among those of the node, 0 to 21. So the lower
// bits are places in a mask that has bits 0 to 23 for primitives and 24 to 31 for inner children.
#define CASTOR_COMPRESSED_COUNT_SHIFT 5
#define CASTOR_COMPRESSED_INNER (1u << CASTOR_COMPRESSED_COUNT_SHIFT | 24u)

// Side of the square blocks of pixels of which a wave has a list, so that neighbours on a line of work-items are
// neighbours in the picture. A block is named by its left upper pixel, x in the lower 16 bits and y in the upper ones;
// its pixels are numbered row by row, CASTOR_BLOCK_SLOTS a block, also where they lie outside the picture.
#define CASTOR_PIXEL_BLOCK 8

// Slots of a wave, one after another, that are counted together: those of a pixel block.
#define CASTOR_BLOCK_SLOTS (CASTOR_PIXEL_BLOCK * CASTOR_PIXEL_BLOCK)

// next_rank of a path that ended; smaller ranks are places among those of a block that go on.
#define CASTOR_PATH_ENDED 0xffu

// passed: whether a ray passes the surface that it met. 0: it met none. At a pane: the surface is a thin wall that
// transmits light: pass_panes knows how much.
#define CASTOR_PASSED 1u
#define CASTOR_STOPPED 2u
#define CASTOR_AT_PANE 3u

// Beyond a surface that a ray passes at t, it goes on so many floats after t: at an edge that two triangles share, the
// other one may be met a few floats later.
#define CASTOR_FLOATS_BEYOND 16u

// In shadow_medium: the ray is to a light that other rays can meet, and passes no solids.
#define CASTOR_STOPPED_BY_SOLIDS 0xfffffffeu

// Dimensions (device/random.lanes.cl) in which it is drawn whether surfaces are there, for paths and for shadow rays,
// and which texels of panes shadow rays meet.
#define CASTOR_DIMENSION_OPACITY 10u
#define CASTOR_DIMENSION_SHADOW_OPACITY 11u
#define CASTOR_DIMENSION_PANE_TEXEL 12u
// Within solids: how far paths go until they are scattered, and where they go on.
#define CASTOR_DIMENSION_FREE_PATH 13u
#define CASTOR_DIMENSION_TURN 14u
// With a number, x: which light is seen there, y: whether it is kept. Without: the point of an area light.
#define CASTOR_DIMENSION_LIGHT_WITHIN 15u

// Material.kind
#define CASTOR_MATERIAL_PLAIN 0u
#define CASTOR_MATERIAL_MIRROR 1u
#define CASTOR_MATERIAL_CONDUCTOR 2u
#define CASTOR_MATERIAL_DIELECTRIC 3u
#define CASTOR_MATERIAL_PRINCIPLED 4u

// Material.brdf: a model of BrdfModel (scene.h), and what it does differently
#define CASTOR_BRDF_BLINN_PHONG 0u
#define CASTOR_BRDF_MODIFIED_BLINN_PHONG 1u
#define CASTOR_BRDF_PHONG 2u
#define CASTOR_BRDF_MODIFIED_PHONG 3u
#define CASTOR_BRDF_TORRANCE_SPARROW 4u
#define CASTOR_BRDF_MODEL_MASK 7u
#define CASTOR_BRDF_NORMALIZED 8u
#define CASTOR_BRDF_DIFFUSE_FRESNEL 16u

// Texture.kind, .target, .filter, .wrap and .noise_conversion: the numbers of TextureKind and the others (scene.h)
#define CASTOR_TEXTURE_IMAGE 0u
#define CASTOR_TEXTURE_PERLIN 1u
#define CASTOR_TEXTURE_CHECKERBOARD 2u
#define CASTOR_TARGET_REPLACE_DIFFUSE 0u
#define CASTOR_TARGET_BLEND_DIFFUSE 1u
#define CASTOR_TARGET_REPLACE_SPECULAR 2u
#define CASTOR_TARGET_REPLACE_ALL 3u
#define CASTOR_TARGET_BACKGROUND 4u
#define CASTOR_TARGET_NORMAL_MAP 5u
#define CASTOR_TARGET_BUMP_MAP 6u
#define CASTOR_TARGET_PRINCIPLED 7u
#define CASTOR_TEXTURE_NEAREST 0u
#define CASTOR_TEXTURE_BILINEAR 1u
#define CASTOR_TEXTURE_TRILINEAR 2u
#define CASTOR_WRAP_REPEAT 0u
#define CASTOR_WRAP_CLAMP 1u
#define CASTOR_WRAP_MIRROR 2u
// Texture::wrap holds that of u, and above it, shifted by so many bits, that of v.
#define CASTOR_WRAP_BITS 2u
#define CASTOR_WRAP_MASK 3u
#define CASTOR_NOISE_LINEAR 0u
#define CASTOR_NOISE_ABSOLUTE 1u

// Camera.projection: how eye rays are made.
#define CASTOR_PROJECTION_PINHOLE 0u
#define CASTOR_PROJECTION_LENS 1u
#define CASTOR_PROJECTION_PARALLEL 2u

// TextureImage.format
#define CASTOR_TEXELS_BYTES 0u
#define CASTOR_TEXELS_FLOATS 1u

// Octaves of noise, at most: each counts half as much as the one before.
#define CASTOR_MAX_NOISE_OCTAVES 32u

// Light.kind
#define CASTOR_LIGHT_POINT 0u
#define CASTOR_LIGHT_DIRECTIONAL 1u
#define CASTOR_LIGHT_SPOT 2u
#define CASTOR_LIGHT_AREA 3u
#define CASTOR_LIGHT_MESH 4u
#define CASTOR_LIGHT_SPHERE 5u
#define CASTOR_LIGHT_ENVIRONMENT 6u
// 1 less the cosine of the half angle, 0.008 degrees, of the smallest sun: rounding of directions is a thousandth of
// it.
#define CASTOR_LEAST_SUN 1e-8f

// Parts into which the area of a light is cut: as many as unit_float (kernels/device/random.lanes.cl) has numbers.
#define CASTOR_EMITTER_PARTS 0x1000000u

// Light.mapping of spot lights: the power of the falloff between the cones
#define CASTOR_SPOT_FOURTH_POWER 0u
#define CASTOR_SPOT_SQUARE 1u

// Light.mapping of meshes: whether they hide all their points whose normals point away (towards the viewer) from who is
// outside the box around them
#define CASTOR_MESH_OPEN 0u
#define CASTOR_MESH_CLOSED 1u
#define CASTOR_MESH_CLOSED_INWARD 2u

// Light.sampling of meshes: whether surfaces have the normals of their triangles
#define CASTOR_MESH_FLAT 0u
#define CASTOR_MESH_SMOOTH 1u

// Light.mapping and Light.sampling of environments
#define CASTOR_ENVIRONMENT_LATLONG 0u
#define CASTOR_ENVIRONMENT_PROBE 1u
#define CASTOR_ENVIRONMENT_UNIFORM 0u
#define CASTOR_ENVIRONMENT_COSINE 1u
#define CASTOR_ENVIRONMENT_PICTURE 2u

// Words before the trees of a table of environment_parts: see environment_table.h.
#define CASTOR_ENVIRONMENT_HEADER 4u

// TraceParams.flags. A scene of several chunks is traced chunk after chunk, in any order, with the same rays and
// answers; brute force in passes over the primitives.
#define CASTOR_TRACE_CULL_BACK_FACES 1u  // flat triangles seen from behind are not hit
#define CASTOR_TRACE_GOES_ON 2u          // the answers hold what earlier chunks or passes gave
#define CASTOR_TRACE_MORE_FOLLOWS 4u     // t of hits stays in the rays' scaled units, for the next chunk or pass
#define CASTOR_TRACE_BENDS_NORMALS 8u    // smooth normals mirror no ray to the other side of its triangle

// RenderParams.flags: what the rule sets do differently (see RuleSet in renderer.h)
#define CASTOR_RULE_SHADOW_ORIGIN_ALONG_RAY 1u    // else along the normal
#define CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY 2u    // else along the normal
#define CASTOR_RULE_MIRROR_ANY_MATERIAL 4u        // any non-zero mirror reflectance reflects, else by kind
#define CASTOR_RULE_MIRROR_CONDUCTOR 8u           // conductors (with Fresnel) reflect as mirrors do
#define CASTOR_RULE_HIGHLIGHT_BEHIND 16u          // a highlight is added although n.l <= 0
#define CASTOR_RULE_TEXEL_IS_DIFFUSE_TERM 65536u  // a sent texel replaces the diffuse term, else all
#define CASTOR_RULE_LAMP_AT_PIXEL_POINT 131072u   // an eye ray is lit from where it lies in its pixel
#define CASTOR_RENDER_CULL_BACK_FACES 32u         // camera and mirror rays pass back faces of flat triangles
#define CASTOR_RENDER_PIXEL_CENTRES 64u           // one sample a pixel, through its centre
#define CASTOR_RENDER_FIRST_BOUNCE 128u           // each path is at the place of its slot, with throughput 1
#define CASTOR_RENDER_BACKGROUND_TEXTURE 256u     // eye rays that meet nothing see what surface_diffuse says
#define CASTOR_RENDER_LIGHTS_ALONE 512u           // nothing counts but what surfaces reflect of lights
#define CASTOR_RENDER_DEVIATIONS 1024u            // w of film_sum sums squared deviations of samples (add_samples)
#define CASTOR_RENDER_BRANCHES 2048u              // path_slot has numbers of branches (path_states.lanes.cl)
#define CASTOR_RENDER_BOTH_SIDES 4096u            // surfaces are shaded on the side that is seen
#define CASTOR_RENDER_RECORDS 8192u               // paths have records at the first bounce, too (path_records)

// The rows of film_features: sums over samples of what their eye rays met.
#define CASTOR_FEATURE_ALBEDO 0u
#define CASTOR_FEATURE_NORMAL 1u
#define CASTOR_FEATURE_POSITION 2u
#define CASTOR_FEATURES 3u

// PathParams.flags: see PathTracing in scene.h
#define CASTOR_PATH_BY_BRDF 1u          // directions are drawn as surfaces scatter, else uniformly
#define CASTOR_PATH_LIGHTS 2u           // lights that rays meet are sampled, too
#define CASTOR_PATH_WEIGHS 4u           // and what rays meet by chance counts, by weight
#define CASTOR_PATH_ROULETTE 8u         // paths may end after this bounce
#define CASTOR_PATH_LAST 16u            // no light is sampled after this bounce
#define CASTOR_PATH_ENDS 32u            // nothing but the light that rays met is looked for
#define CASTOR_PATH_LIGHT_ROULETTE 64u  // rays to lights that give little may be left out

// LightNode.flags
#define CASTOR_LIGHT_NODE_LEAF 1u
#define CASTOR_LIGHT_NODE_BOTH_SIDES 2u  // light goes to opposite directions alike
#define CASTOR_LIGHT_NODE_FAR 4u         // lights without a place

// Levels of the tree over lights below its root, at most: Light.trail has a bit for each.
#define CASTOR_LIGHT_LEVELS 32u

// Bounces of paths that have no other limit, which roulette ends before. It has to be a number for which a sum of as
// many terms is still a good one: the float of a slot's sum has 24 bits.
#define CASTOR_MOST_BOUNCES 1024u

// The node of the tree of a sample's rays where eye rays meet something, and the kinds of rays that go on from a node:
// see next_node in device/random.lanes.cl.
#define CASTOR_NODE_EYE 1u
#define CASTOR_NODE_REFLECTION 1u
#define CASTOR_NODE_REFRACTION 2u

// RenderParams.filter (see ReconstructionFilter in renderer.h)
#define CASTOR_FILTER_BOX 0u
#define CASTOR_FILTER_TENT 1u
#define CASTOR_FILTER_GAUSSIAN 2u

#endif
