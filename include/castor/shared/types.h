// The structs that cross the border between host and device, written once and read by both compilers.
// Every row of 16 bytes is filled by scalars and float[3]; per-ray and per-primitive data are columns,
// listed in scene_columns.h and wave_columns.h.
#ifndef CASTOR_SHARED_TYPES_H
#define CASTOR_SHARED_TYPES_H

#include "castor/shared/constants.h"
#include "castor/shared/layout.h"
#include "castor/shared/principled_material.h"

CASTOR_SHARED_BEGIN

/// r(t) = origin + t * direction for t in [t_min, t_max]. The direction need not be normalised, and t is in
/// units of its length. A ray with NaN anywhere, with an infinite or too distant origin (beyond
/// CASTOR_MAX_COORDINATE), or with an infinite, zero or denormal direction hits nothing.
typedef struct Ray {
    float origin[3];
    float t_min;
    float direction[3];
    float t_max;
} Ray;
CASTOR_ASSERT_SIZE(Ray, 32);

/// The nearest hit of a ray. A triangle's point is (1-u-v)*p0 + u*p1 + v*p2; spheres and planes have u = v = 0.
/// `primitive` counts triangles in file order, then spheres, then planes, within the instance. `instance` is 0 for what
/// stands in the scene once, i + 1 for Scene::instances[i]; scene.h says what the numbers after these are. A miss has t
/// = +infinity, u = v = 0 and primitive = instance = CASTOR_INVALID_INDEX.
typedef struct Hit {
    float t;
    float u;
    float v;
    uint primitive;
    uint instance;
} Hit;
CASTOR_ASSERT_SIZE(Hit, 20);

/// A node of the wide tree: the boxes of up to eight children side by side, [lower, upper] by axis. A place without a
/// child has lower = +infinity, upper = -infinity. Children are coded as constants.h says (CASTOR_WIDE_LEAF): else the
/// number of a node.
typedef struct WideNode {
    float planes[3][2][8];
    uint child[8];
    uint reserved[8];
} WideNode;
CASTOR_ASSERT_SIZE(WideNode, 256);

/// A node of the compressed 8-wide tree. Plane q of axis a is fma(q, 2^(exponent[a] - 127), origin[a]), rounded once;
/// `lower` and `upper` say which planes bound each child, and contain its box. Inner children are nodes from
/// `first_child` on, in order of their places; primitives of leaves are compressed_primitives from `first_primitive`
/// on. `meta` is coded as constants.h says (CASTOR_COMPRESSED_...).
typedef struct CompressedNode {
    float origin[3];
    uchar exponent[3];
    uchar inner_mask;  // places of inner children
    uint first_child;
    uint first_primitive;
    uchar meta[8];
    uchar lower[3][8];
    uchar upper[3][8];
} CompressedNode;
CASTOR_ASSERT_SIZE(CompressedNode, 80);

/// Four triangles of a leaf: vertex, axis, lane. A lane without a triangle has NaN vertices and primitive =
/// CASTOR_INVALID_INDEX.
typedef struct TriangleBlock {
    float vertex[3][3][4];
    uint primitive[4];
} TriangleBlock;
CASTOR_ASSERT_SIZE(TriangleBlock, 160);

/// Four spheres of a leaf: centre x, y, z and radius, lane. A lane without a sphere has NaN values and primitive =
/// CASTOR_INVALID_INDEX.
typedef struct SphereBlock {
    float center_radius[4][4];
    uint primitive[4];
} SphereBlock;
CASTOR_ASSERT_SIZE(SphereBlock, 80);

/// What the triangles of one mesh share. Triangles [first_triangle, next range's first_triangle) belong to it.
/// The normal of vertex i is vertex_normal[first_normal + i - first_vertex], and its texture coordinates are those of
/// vertex_uv from first_uv on, and so for its attributes.
typedef struct MeshRange {
    uint first_triangle;
    uint first_vertex;
    uint first_normal;  // CASTOR_INVALID_INDEX: flat
    uint material;
    uint first_uv;          // CASTOR_INVALID_INDEX: (0, 0) everywhere
    uint first_attributes;  // CASTOR_INVALID_INDEX: none
    uint reserved[2];
} MeshRange;
CASTOR_ASSERT_SIZE(MeshRange, 32);

/// What a vertex has for principled materials alone: see Mesh (scene.h).
typedef struct VertexAttributes {
    float tangent[4];  // (0, 0, 0, 0): that of the texture coordinates
    float color[4];    // linear, with alpha
    float uv_1[2];
    uint reserved[2];
} VertexAttributes;
CASTOR_ASSERT_SIZE(VertexAttributes, 48);

/// Triangles and spheres that have one tree: those that stand in the scene once, or what instances place. Triangles are
/// numbered over all geometries, and so are spheres.
typedef struct Geometry {
    uint first_triangle;
    uint triangle_count;
    uint first_sphere;
    uint sphere_count;
    float largest_coordinate;  // of all boxes, in magnitude: scales the enlargement of boxes
    uint reserved[3];
} Geometry;
CASTOR_ASSERT_SIZE(Geometry, 32);

/// A geometry as it stands in the world. Rows of affine matrices: x' = m[0][0] x + m[0][1] y + m[0][2] z + m[0][3], ...
typedef struct Instance {
    float to_object[3][4];  // rays go this way: a hit is defined by this matrix alone
    float to_world[3][4];   // points on surfaces go this way
    float motion[3];        // in the world, while the shutter is open: at time t all of it is t * motion farther
    uint geometry;
    uint material;
    uint reserved[3];
} Instance;
CASTOR_ASSERT_SIZE(Instance, 128);

/// A node of the binary tree over instances, with a box in the world. Inner (is_leaf = 0): children are nodes `first`
/// and `first + 1`. Leaf: instance `first`. The box counts as enlarged by `slope` times the largest coordinate of a
/// ray's origin. The wide tree over instances (WideNode) has the same boxes, and for all of them the slope of the first
/// InstanceNode, the greatest.
typedef struct InstanceNode {
    float lower[3];
    uint first;
    float upper[3];
    uint is_leaf;
    float slope;
    uint reserved[3];
} InstanceNode;
CASTOR_ASSERT_SIZE(InstanceNode, 48);

/// Arguments of every trace kernel, beside the columns, which are those of one chunk of the scene.
typedef struct TraceParams {
    uint ray_count;
    uint first_ray;         // rays [first_ray, first_ray + ray_count) are traced
    uint ray_stride;        // 1: two columns; 2: interleaved Ray records (both column arguments the same buffer)
    uint direction_offset;  // 0: two columns; 1: interleaved
    uint triangle_count;
    uint sphere_count;
    uint plane_count;
    uint mesh_count;
    uint node_count;  // of the compressed trees; instance 0's root is node 0 unless it has no bounded primitive
    uint flags;       // CASTOR_TRACE_...
    float largest_coordinate;  // of all boxes, in magnitude: scales the enlargement of boxes
    uint wide_root;            // number of a node; CASTOR_INVALID_INDEX: no bounded primitive
    uint instance_count;       // with instance 0; 0: there is no other
    uint instance_node_count;
    uint number_count;  // of primitive_numbers; 0: the chunk is the whole scene
    uint pass;          // of brute force over primitives, see CASTOR_BRUTE_PASS
} TraceParams;
CASTOR_ASSERT_SIZE(TraceParams, 64);

/// Reflectances as in the scene format; `mirror` applies where the rule set says so. A principled material has its
/// absorption, scattering albedo and emission here, and all else in principled_materials.
typedef struct Material {
    float ambient[3];
    float phong_exponent;
    float diffuse[3];
    float refraction_index;
    float specular[3];
    float absorption_index;
    float mirror[3];
    uint kind;            // CASTOR_MATERIAL_...
    float absorption[3];  // of what is inside; where it scatters, what absorbing and scattering take together
    float roughness;
    float emission[3];
    uint brdf;           // CASTOR_BRDF_...
    uint first_texture;  // of texture_uses
    uint texture_count;
    uint light;                  // whose surface has this material, and no other; CASTOR_INVALID_INDEX: none
    uint number;                 // in Scene::materials
    uint principled;             // of principled_materials; CASTOR_INVALID_INDEX: none
    float scattering_albedo[3];  // of what `absorption` takes, the share that goes on in another direction
} Material;
CASTOR_ASSERT_SIZE(Material, 128);

/// A function of the surface: see castor::Texture (scene.h). A material applies the textures that texture_uses names in
/// [first_texture, first_texture + texture_count), in this order.
typedef struct Texture {
    uint kind;    // CASTOR_TEXTURE_...
    uint target;  // CASTOR_TARGET_...
    uint image;   // of texture_images
    uint filter;  // CASTOR_TEXTURE_NEAREST ...
    uint wrap;    // CASTOR_WRAP_... of u and of v
    float normalizer;
    float bump_factor;
    float noise_scale;
    uint noise_octaves;
    uint noise_conversion;  // CASTOR_NOISE_...
    float checker_scale;
    float checker_offset;
    float black[3];
    uint reserved_black;
    float white[3];
    uint reserved_white;
    // Of an image: its u is the product of transform_u with (u, v, 1) of the surface, and so for v.
    float transform_u[3];
    uint coordinate_set;
    float transform_v[3];
    uint reserved_transform;
} Texture;
CASTOR_ASSERT_SIZE(Texture, 112);

/// A picture in the column `texels`, row 0 on top. Bytes: a texel is R + 256 G + 65536 B. Floats: a texel is the bits
/// of R, G and B. Levels follow one another, each half as wide and high as the one before, rounded down, and at least
/// 1; level 0 is the picture itself. The upper 8 bits of bytes are alpha, except in smaller levels.
typedef struct TextureImage {
    uint width;
    uint height;
    uint format;       // CASTOR_TEXELS_...
    uint level_count;  // at least 1
    uint first_texel;  // of level 0
    uint reserved[3];
} TextureImage;
CASTOR_ASSERT_SIZE(TextureImage, 32);

/// Point: irradiance intensity / r^2; where `size` is not 0 it is 1 / range, see PointLight. Directional: irradiance
/// intensity, `direction` is that of travel, unit; light comes from directions around it up to an angle of cosine 1 -
/// `size`. Spot: as point, times a falloff between the cosines of the two half angles, of the power that `mapping`
/// says. Area: a square of edge `size` around `position`, with the normal `direction`, unit, and edges along `tangent`,
/// unit, and their cross product; `intensity` is the radiance. Sphere: `position` and `size` are the centre and the
/// radius, in the space of the instance `first` if that is not 0: it becomes an ellipsoid; `intensity` is the radiance.
/// Mesh: triangles [first, first + count) of emitters, with the area `size`, within the box around `position` with half
/// edges `tangent`; `intensity` is the radiance. Where these two are at time 0; `direction` is their motion, as an
/// instance's. Environment: the image `first`; where it is sampled by its picture, a table in environment_parts from
/// the word `count` on, a multiple of 4. `trail` leads to the light in the tree of lights, if there is one: bit i says
/// whether it is in the second child of the node at level i, the root's being 0; bits from its own level on are 0.
typedef struct Light {
    float position[3];
    uint kind;  // CASTOR_LIGHT_...
    float intensity[3];
    float cos_coverage;
    float direction[3];
    float cos_falloff;
    float tangent[3];
    float size;
    uint first;
    uint count;
    uint mapping;  // of an environment CASTOR_ENVIRONMENT_LATLONG or _PROBE, of a spot light CASTOR_SPOT_..., of a mesh
                   // CASTOR_MESH_...
    uint sampling;  // of an environment CASTOR_ENVIRONMENT_UNIFORM, _COSINE or _PICTURE, of a mesh CASTOR_MESH_FLAT or
                    // CASTOR_MESH_SMOOTH
    uint trail;
    uint principled;  // of principled_materials, whose texture of emission dims a mesh; CASTOR_INVALID_INDEX: none does
    uint reserved[2];
} Light;
CASTOR_ASSERT_SIZE(Light, 96);

/// Whether a light is more than a point: surfaces are lit by random points of it.
#define CASTOR_IS_SAMPLED_LIGHT(light) \
    ((light).kind >= CASTOR_LIGHT_AREA || ((light).kind == CASTOR_LIGHT_DIRECTIONAL && (light).size > 0.0f))

/// Whether a light is a disk that is infinitely far away, and seen where paths are traced.
#define CASTOR_IS_SUN(light) ((light).kind == CASTOR_LIGHT_DIRECTIONAL && (light).size >= CASTOR_LEAST_SUN)

/// A node of the binary tree over lights: what it says holds for all lights below it. They are within `radius` of
/// `center`; their surfaces have normals, or their beams directions, within an angle of cosine `cos_normals` of `axis`,
/// and they send light to directions within a further angle of cosine `cos_emission` of these (or of the opposite ones,
/// CASTOR_LIGHT_NODE_BOTH_SIDES). Lights without a place (CASTOR_LIGHT_NODE_FAR) have all directions in which their
/// light travels within the angle of cosine `cos_normals` of `axis`, and no centre. `flux` is the irradiance at a
/// distance of 1, or that of lights without a place, as a share of the sum of all lights'. Inner: children are nodes
/// `first` and `first` + 1. Leaf (CASTOR_LIGHT_NODE_LEAF): light `first`.
typedef struct LightNode {
    float center[3];
    float radius;
    float axis[3];
    float cos_normals;
    float flux;
    float cos_emission;
    uint first;
    uint flags;  // CASTOR_LIGHT_NODE_...
} LightNode;
CASTOR_ASSERT_SIZE(LightNode, 48);

/// A triangle of a light in the world. Of the light's area cut into CASTOR_EMITTER_PARTS equal parts, in the order of
/// its triangles, it has [begin, end): a random part chooses the triangle.
typedef struct Emitter {
    float corner[3];
    uint begin;
    float edge_u[3];  // to the second corner
    uint end;
    float edge_v[3];            // to the third
    float inverse_double_area;  // of 2^-100 ... 2^100
    // Coordinates in the texture of emission, and how they change along the edges; 0 where the light has none.
    float uv[2];
    float uv_u[2];
    float uv_v[2];
    uint reserved_end[2];
} Emitter;
CASTOR_ASSERT_SIZE(Emitter, 80);

/// The eye ray through the point (x, y) of the image, x to the right and y down in pixels from the top left corner:
/// origin `position`, direction corner + x * step_x - y * step_y (world space, not normalised: t = 1 is on
/// the image plane). With a lens, the origin is moved by a vector a * lens_x + b * lens_y, with a and b in [-1/2, 1/2],
/// and the direction by -sharpness times this vector: what is 1 / sharpness image planes away stays where it is.
typedef struct Camera {
    float position[3];
    float t_min;
    float corner[3];
    float t_max;
    float step_x[3];
    uint width;
    float step_y[3];
    uint height;
    float lens_x[3];  // its edges; of parallel rays: their direction
    uint projection;  // CASTOR_PROJECTION_...
    float lens_y[3];
    float sharpness;
} Camera;
CASTOR_ASSERT_SIZE(Camera, 96);

/// Arguments of the kernels of a wave, beside the columns (see wave_columns.h): some samples, side by side, of every
/// pixel of some pixel blocks.
typedef struct RenderParams {
    uint path_count;    // in the queue
    uint first_pixel;   // of those that are traced now, a multiple of CASTOR_BLOCK_SLOTS
    uint pixel_count;   // of these, likewise
    uint sample_shift;  // each pixel has 2^sample_shift slots, one a sample
    uint sample;        // the first
    float background[3];
    uint flags;  // CASTOR_RULE_..., CASTOR_RENDER_...
    float ambient[3];
    float shadow_epsilon;
    uint light_count;
    uint seed;
    uint filter;  // CASTOR_FILTER_...
} RenderParams;
CASTOR_ASSERT_SIZE(RenderParams, 64);

/// Arguments of the kernels that trace paths (kernels/trace_paths.lanes.cl), beside RenderParams: those of one bounce.
typedef struct PathParams {
    uint depth;  // bounces before this one
    uint node;   // see CASTOR_NODE_EYE
    uint flags;  // CASTOR_PATH_...
    float largest_sample;
    float pixel_spread;     // see TextureParams
    uint light_node_count;  // of the tree by which lights are chosen; 0: all are as probable
    uint first_far;         // environments and suns are among the lights [first_far, far_end)
    uint far_end;
    uint eye_medium;   // material of the solid in which eye rays begin; CASTOR_INVALID_INDEX: in none
    uint eye_outer;    // of the solid around that, likewise
    uint first_unmet;  // lights that no ray meets are among the lights [first_unmet, unmet_end)
    uint unmet_end;
} PathParams;
CASTOR_ASSERT_SIZE(PathParams, 48);

/// Arguments of the kernels of textures.
typedef struct TextureParams {
    uint path_count;
    uint background;     // of textures
    float pixel_spread;  // the width of a pixel's cone of directions, at distance 1
    uint reserved;
} TextureParams;
CASTOR_ASSERT_SIZE(TextureParams, 16);

CASTOR_SHARED_END

#endif
