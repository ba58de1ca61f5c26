/// Castor for C, and for languages that call C. The header is C99, C11 and C++; link libcastor_c (CMake:
/// castor::castor_c; pkg-config: castor_c). The words are those of the C++ headers beside this one.
///
/// Errors. A function that can fail returns a castor_status. After any status but CASTOR_STATUS_DONE,
/// castor_last_error_message() tells what was wrong, and castor_get_last_error() more of it, to the thread that called.
/// Results go where pointers say, and are written only where the status is CASTOR_STATUS_DONE, unless a function says
/// otherwise; a handle is NULL after a failure. NULL is a usage error wherever it is not said to be allowed, except
/// that an array of no elements may be NULL. No C++ exception leaves the library, and none may leave a callback.
///
/// Handles are opaque and counted. A function that makes one gives its caller one reference; X_retain adds one,
/// X_release takes one away, both from any thread; NULL is allowed for both and does nothing. A handle keeps whatever
/// it needs: those that it was made from may be released in any order.
///
/// Structs that begin with `size` grow in later versions. The caller sets `size` to sizeof of the struct; the library
/// reads or writes as much as both know. In structs for options, all other bytes being zero means all defaults, and so
/// does NULL for the struct. A larger struct of a later header is accepted if what this library does not know is zero.
///
/// Arrays and strings. Arrays that are passed in belong to the caller and are only used during the call. Strings are
/// UTF-8 and end with a zero byte. Strings and arrays that come out belong to the handle that they were asked of, stay
/// valid until it is destroyed, and may not be changed, unless a function says otherwise.
///
/// Threads. A castor_scene may be read by several threads, or changed by one. All other handles may be used by several
/// threads at once. A process that was made by fork() cannot use OpenCL drivers which its parent has used.
///
/// Flags of type uint32_t are 0 or 1. Enumerations are fixed integers: their constants keep their values.
#ifndef CASTOR_CASTOR_C_H
#define CASTOR_CASTOR_C_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define CASTOR_C_API __attribute__((visibility("default")))
#else
#define CASTOR_C_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---------------------------------------------------------------------------------------------------------------------
// Versions and errors

/// The version of this header: 10000 * major + 100 * minor + patch. Libraries with the same SONAME keep every function,
/// constant and struct of earlier ones; structs that begin with `size` may have grown.
#define CASTOR_C_VERSION 100

/// Returns the version of the library that runs, computed likewise.
CASTOR_C_API uint32_t castor_version(void);
/// Returns the library's version as "major.minor.patch". The string is static.
CASTOR_C_API const char* castor_version_string(void);

/// What came of a call.
typedef int32_t castor_status;
enum {
    CASTOR_STATUS_DONE = 0,
    CASTOR_STATUS_STOPPED = 1,        // a callback said not to go on
    CASTOR_STATUS_SCENE_ERROR = 2,    // the input is wrong: a scene, mesh or built scene, from a file or a program
    CASTOR_STATUS_USAGE_ERROR = 3,    // an argument is wrong, or what it names does not exist
    CASTOR_STATUS_DEVICE_ERROR = 4,   // a device or its driver refuses, or there is none
    CASTOR_STATUS_FILE_ERROR = 5,     // the file system refuses: a file cannot be written
    CASTOR_STATUS_OUT_OF_MEMORY = 6,  // the host has too little memory
    CASTOR_STATUS_INTERNAL_ERROR = 7  // the library is wrong
};

/// Returns "done", "stopped", "scene error", ...; "unknown status" for any other number. The string is static.
CASTOR_C_API const char* castor_status_string(castor_status status);

/// The last call of this thread that did not end with CASTOR_STATUS_DONE. Strings belong to the thread, and stay valid
/// until its next such call; they are never NULL.
typedef struct castor_error {
    size_t size;
    castor_status status;  // CASTOR_STATUS_DONE: there was none yet
    int32_t code;          // device error: the OpenCL status; 0: there is none
    const char* message;   // a complete sentence, with all of the below
    const char* device;    // device error: the device's name; else, or if unknown, ""
    const char* call;      // device error: the OpenCL call that failed; else, or if unknown, ""
    const char* file;      // scene or file error: the file; else, or if unknown, ""
    size_t line;           // scene error: the line in that file; 0: unknown
} castor_error;

/// Returns the message of this thread's last error, "" if there was none. It belongs to the thread, and stays valid
/// until its next error.
CASTOR_C_API const char* castor_last_error_message(void);
/// Tells this thread's last error.
CASTOR_C_API castor_status castor_get_last_error(castor_error* error);

/// Tells how many bytes the library's own struct of that name has ("castor_ray"), for languages that lay out structs by
/// themselves. Usage error: there is no such struct.
CASTOR_C_API castor_status castor_get_struct_size(const char* name, size_t* bytes);

/// A fault of the input, or of a device, that did not end the call. Strings belong to the handle that was asked; those
/// of a castor_scene stay valid until it is changed.
typedef struct castor_warning {
    size_t size;
    const char* text;
    const char* file;  // "": no file
    size_t line;       // 0: unknown
} castor_warning;

/// Called by a long operation up to about a thousand times with the fraction that is done, above 0, larger each time,
/// and 1 at the end. Returns 0 to stop: the operation then soon ends with CASTOR_STATUS_STOPPED. Calls may come from
/// any thread, but never from two at once. `user` is the pointer that the operation was given.
typedef int (*castor_progress_function)(double fraction, void* user);

// ---------------------------------------------------------------------------------------------------------------------
// Devices

/// OpenCL devices in a certain order.
typedef struct castor_devices castor_devices;

typedef uint32_t castor_device_type;
enum {
    CASTOR_DEVICE_TYPE_CPU = 0,
    CASTOR_DEVICE_TYPE_GPU = 1,
    CASTOR_DEVICE_TYPE_ACCELERATOR = 2,
    CASTOR_DEVICE_TYPE_OTHER = 3
};

// OpenCL's own types, without its header: cl_platform_id is struct _cl_platform_id*, and so on.
struct _cl_platform_id;
struct _cl_device_id;
struct _cl_context;
struct _cl_command_queue;
struct _cl_mem;
struct _cl_event;

/// A device as its driver describes it, or an equal part of one. Strings belong to the castor_devices.
typedef struct castor_device_info {
    size_t size;
    size_t index;  // its number among all devices, as castor_devices_list orders them
    const char* name;
    const char* vendor;
    const char* platform_name;
    const char* platform_version;
    const char* device_version;
    const char* driver_version;
    castor_device_type type;
    uint32_t compute_units;
    uint32_t part;        // of a device that was split: which part, from 1 on,
    uint32_t part_count;  // of how many; 1: it was not split
    uint64_t global_memory_bytes;
    uint64_t max_allocation_bytes;
    uint32_t unified_memory;                 // 1: it shares the host's memory
    uint32_t correctly_rounded_divide_sqrt;  // 1: the driver rounds as IEEE 754 does; Castor's bits do not need it
    struct _cl_platform_id* platform;        // valid as long as the process lives, as is `device`
    struct _cl_device_id* device;
} castor_device_info;

/// Lists all devices of all platforms, in the loader's order. No device is no error. Drivers that cannot be asked are
/// left out, with a warning. Device error: OpenCL cannot even list its platforms.
CASTOR_C_API castor_status castor_devices_list(castor_devices** devices);
/// Selects devices by a comma-separated list: "all", "cpu", "gpu", "accelerator", a device's index, or a part of its
/// name (any case). "/N" after one of these splits each such device into N parts. Each device comes once, in the order
/// of the list. NULL or "": the first GPU, else the first device. Device error: there is no device (the message says
/// what to install), or a driver does not split. Usage error: a word names no device (the message lists them).
CASTOR_C_API castor_status castor_devices_select(const char* selection, castor_devices** devices);
CASTOR_C_API void castor_devices_retain(castor_devices* devices);
CASTOR_C_API void castor_devices_release(castor_devices* devices);
CASTOR_C_API castor_status castor_devices_get_count(const castor_devices* devices, size_t* count);
/// Describes the i-th of these devices. Usage error: there is none.
CASTOR_C_API castor_status castor_devices_get_info(const castor_devices* devices, size_t i, castor_device_info* info);
/// What castor_devices_list left out.
CASTOR_C_API castor_status castor_devices_get_warning_count(const castor_devices* devices, size_t* count);
CASTOR_C_API castor_status castor_devices_get_warning(const castor_devices* devices, size_t i, castor_warning* warning);

/// What one device did of work that several share. Strings belong to the handle that was asked.
typedef struct castor_device_share {
    size_t size;
    const char* device;    // its name
    const char* failure;   // why it was dropped; "": it was not
    uint64_t pieces;       // of the picture or batch, that it finished
    uint64_t samples;      // of a picture
    uint64_t rays;         // of all kinds, traced for these pieces
    uint64_t retries;      // pieces that it had when it was dropped: others did them again
    uint64_t left_busy;    // how often it was still busy when all was done, and was not waited for
    double busy_seconds;   // from taking pieces to having their results
    double setup_seconds;  // compiling programs, and uploading the scene
} castor_device_share;

// ---------------------------------------------------------------------------------------------------------------------
// Scenes
//
// World space is right-handed. Triangles wind counter-clockwise seen from outside: the geometric normal is
// (p1-p0) x (p2-p0). Colours are linear RGB; 255 is white in an 8-bit image, and values are not limited. Indices count
// from 0. A transform is 12 floats, the rows of an affine 3x4 matrix one after another:
// x' = m[0] x + m[1] y + m[2] z + m[3], y' = m[4] x + ..., z' = m[8] x + ... It must have an inverse.

/// What a scene file or a program describes. Nothing is checked while it is filled, but the sizes of arrays; what makes
/// a castor_built_scene, castor_tracer or castor_renderer of it checks it all and fails with a scene error.
typedef struct castor_scene castor_scene;

/// Makes an empty scene. Meshes, instances, spheres and planes name materials, also where nothing but rays is traced:
/// add some, or castor_scene_add_default_view at the end.
CASTOR_C_API castor_status castor_scene_create(castor_scene** scene);
/// Reads a scene file: XML (.xml), JSON (.json), glTF (.gltf, .glb), or a mesh alone (.ply, .obj, .stl), which gets a
/// camera, lights and a material. What the reader does not know becomes a warning. `progress` may be NULL. Scene error:
/// the file is missing, damaged or wrong.
CASTOR_C_API castor_status castor_scene_load(const char* path, castor_progress_function progress, void* user,
                                             castor_scene** scene);

/// What is added to a scene, or chosen, when its file is read.
typedef struct castor_load_options {
    size_t size;
    const char* environment;         // a picture of light from all directions, in which 1 is white; no other light is
                                     // added then; NULL or "": none
    const double* time_seconds;      // of a glTF file: when its animation is shown; NULL: the rest pose
    const char* animation;           // which one is shown then: a number from 1 on, a name, which means all that have
                                     // it, or "all"; NULL: the first
    const char* material_variant;    // of a glTF file: a number from 1 on or a name; NULL: what it shows without any
    const float* sun_angle_radians;  // under which the directional lights are seen, 0 to pi; NULL: as the file says
    castor_progress_function progress;  // NULL: none
    void* progress_user;
} castor_load_options;

/// Reads a scene file with options, which may be NULL. Usage error: the file has no time, no such animation, no such
/// variant or no directional light.
CASTOR_C_API castor_status castor_scene_load_with_options(const char* path, const castor_load_options* options,
                                                          castor_scene** scene);
CASTOR_C_API void castor_scene_retain(castor_scene* scene);
CASTOR_C_API void castor_scene_release(castor_scene* scene);

/// What holds for the whole scene. castor_scene_set_settings sets all of it: change what castor_scene_get_settings
/// gave. A new scene has the values in brackets.
typedef struct castor_scene_settings {
    size_t size;
    float background[3];           // (0,0,0)
    float ambient_light[3];        // (0,0,0)
    float shadow_ray_epsilon;      // how far the origins of shadow rays are moved off the surface (0.001)
    uint32_t max_recursion_depth;  // of mirror rays (6)
} castor_scene_settings;
CASTOR_C_API castor_status castor_scene_get_settings(const castor_scene* scene, castor_scene_settings* settings);
CASTOR_C_API castor_status castor_scene_set_settings(castor_scene* scene, const castor_scene_settings* settings);

typedef uint32_t castor_material_kind;
enum {
    CASTOR_MATERIAL_KIND_PLAIN = 0,
    CASTOR_MATERIAL_KIND_MIRROR = 1,
    CASTOR_MATERIAL_KIND_CONDUCTOR = 2,
    CASTOR_MATERIAL_KIND_DIELECTRIC = 3
};

/// How diffuse and specular reflectance make the light that a lit surface sends: see castor/scene.h.
typedef uint32_t castor_brdf;
enum {
    CASTOR_BRDF_KIND_BLINN_PHONG = 0,
    CASTOR_BRDF_KIND_MODIFIED_BLINN_PHONG = 1,
    CASTOR_BRDF_KIND_PHONG = 2,
    CASTOR_BRDF_KIND_MODIFIED_PHONG = 3,
    CASTOR_BRDF_KIND_TORRANCE_SPARROW = 4
};

/// Reflectances, all at least 0. The rules of a render decide which kinds mirror.
typedef struct castor_material {
    size_t size;
    castor_material_kind kind;
    float ambient[3];
    float diffuse[3];
    float specular[3];
    float mirror[3];
    float phong_exponent;    // the sharpness of the highlight; 0: 1
    float refraction_index;  // of a conductor or dielectric; 0: 1
    float absorption_index;  // of a conductor
    float absorption[3];     // of a dielectric: e^(-absorption * length) of light is left after a way inside
    float roughness;         // how far mirrored and refracted rays are scattered
    float emission[3];       // radiance, to both sides
    castor_brdf brdf;
    uint32_t brdf_normalized;  // 1: of the modified models
    uint32_t diffuse_fresnel;  // 1: of Torrance and Sparrow's, the diffuse part is multiplied by 1 - F
    const uint32_t* textures;  // their numbers, applied in this order; copied
    size_t texture_count;
} castor_material;
/// Adds a material. `index`, which may be NULL, receives its number; likewise in what follows.
CASTOR_C_API castor_status castor_scene_add_material(castor_scene* scene, const castor_material* material,
                                                     uint32_t* index);

/// The number of a texture where a principled material has none.
#define CASTOR_NO_TEXTURE 0xffffffffu

/// What alpha means: nothing, that a surface is there where alpha is at least `alpha_cutoff`, or its share that is
/// there.
typedef uint32_t castor_alpha_mode;
enum { CASTOR_ALPHA_MODE_OPAQUE = 0, CASTOR_ALPHA_MODE_MASK = 1, CASTOR_ALPHA_MODE_BLEND = 2 };

/// A physically based material, with the parameters of glTF 2.0 and of its extensions: castor/principled_material.h
/// says what each is, and which channel of a texture it is multiplied by. Colours are from 0 to 1, but specular_color
/// and emissive may be more. Zeros are no defaults here: begin with what castor_principled_material_get_default gives.
/// Textures are numbers of textures whose target is CASTOR_TEXTURE_TARGET_PRINCIPLED, or CASTOR_NO_TEXTURE.
typedef struct castor_principled_material {
    size_t size;
    float base_color[3];
    float alpha;
    castor_alpha_mode alpha_mode;
    float alpha_cutoff;
    uint32_t double_sided;
    uint32_t unlit;  // 1: the surface sends its base colour, and reflects nothing
    float metallic;
    float roughness;
    float normal_scale;
    float emissive[3];  // radiance, 1 is white
    float emissive_strength;
    float ior;  // 0: all light is reflected
    float specular;
    float specular_color[3];
    float transmission;
    float thickness;             // 0: the surface is a thin wall
    float attenuation_distance;  // at which attenuation_color is left
    float attenuation_color[3];
    float dispersion;  // 20 / Abbe number
    float diffuse_transmission;
    float diffuse_transmission_color[3];
    float clearcoat;
    float clearcoat_roughness;
    float clearcoat_normal_scale;
    float sheen_color[3];
    float sheen_roughness;
    float anisotropy;
    float anisotropy_rotation_radians;
    float iridescence;
    float iridescence_ior;
    float iridescence_thickness_minimum;  // nanometres
    float iridescence_thickness_maximum;
    uint32_t base_color_texture;
    uint32_t metallic_roughness_texture;
    uint32_t normal_texture;
    uint32_t emissive_texture;
    uint32_t specular_texture;
    uint32_t specular_color_texture;
    uint32_t transmission_texture;
    uint32_t thickness_texture;
    uint32_t diffuse_transmission_texture;
    uint32_t diffuse_transmission_color_texture;
    uint32_t clearcoat_texture;
    uint32_t clearcoat_roughness_texture;
    uint32_t clearcoat_normal_texture;
    uint32_t sheen_color_texture;
    uint32_t sheen_roughness_texture;
    uint32_t anisotropy_texture;
    uint32_t iridescence_texture;
    uint32_t iridescence_thickness_texture;
    float diffuse_roughness;
    uint32_t diffuse_roughness_texture;
    float multiscatter_color[3];  // of what is inside of a solid; black: it scatters nothing
    float scattering_anisotropy;  // the mean cosine of the angle by which light is turned there
} castor_principled_material;
/// Tells what glTF says of a material where a file says nothing: a white, rough metal.
CASTOR_C_API castor_status castor_principled_material_get_default(castor_principled_material* material);
/// Adds a principled material, with a number among all materials. What a struct of an older header has not is the
/// default. Only path tracing knows these materials: see castor_integrator.
CASTOR_C_API castor_status castor_scene_add_principled_material(castor_scene* scene,
                                                                const castor_principled_material* material,
                                                                uint32_t* index);

/// Texels of a picture, row 0 on top, three values (R, G, B) each, of one of the two types. They are copied.
typedef struct castor_image {
    size_t size;
    const char* name;  // for messages; NULL: none
    uint32_t width, height;
    const uint8_t* bytes;  // 3 * width * height; NULL: there are floats
    const float* floats;   // likewise; linear, not limited
    const uint8_t* alpha;  // width * height, beside bytes, for principled materials; NULL: 255
} castor_image;
CASTOR_C_API castor_status castor_scene_add_image(castor_scene* scene, const castor_image* image, uint32_t* index);
/// Reads a picture: PNG, JPEG, WebP, BMP, TGA, Radiance HDR or OpenEXR. Scene error: the file is missing or damaged.
CASTOR_C_API castor_status castor_scene_add_image_file(castor_scene* scene, const char* path, uint32_t* index);

typedef uint32_t castor_texture_kind;
enum { CASTOR_TEXTURE_KIND_IMAGE = 0, CASTOR_TEXTURE_KIND_PERLIN = 1, CASTOR_TEXTURE_KIND_CHECKERBOARD = 2 };
/// What a texture changes.
typedef uint32_t castor_texture_target;
enum {
    CASTOR_TEXTURE_TARGET_REPLACE_DIFFUSE = 0,
    CASTOR_TEXTURE_TARGET_BLEND_DIFFUSE = 1,  // the mean of the material's own and the texel
    CASTOR_TEXTURE_TARGET_REPLACE_SPECULAR = 2,
    CASTOR_TEXTURE_TARGET_REPLACE_ALL = 3,  // the surface sends the texel itself: no shading
    CASTOR_TEXTURE_TARGET_BACKGROUND = 4,   // for castor_scene_set_background_texture
    CASTOR_TEXTURE_TARGET_NORMAL_MAP = 5,
    CASTOR_TEXTURE_TARGET_BUMP_MAP = 6,
    CASTOR_TEXTURE_TARGET_PRINCIPLED = 7  // of principled materials; the image is one of bytes
};
typedef uint32_t castor_texture_filter;
enum { CASTOR_TEXTURE_FILTER_NEAREST = 0, CASTOR_TEXTURE_FILTER_BILINEAR = 1, CASTOR_TEXTURE_FILTER_TRILINEAR = 2 };

/// A function of the surface: see castor/scene.h.
typedef struct castor_texture {
    size_t size;
    castor_texture_kind kind;
    castor_texture_target target;
    uint32_t image;  // its number
    castor_texture_filter filter;
    uint32_t clamp;           // 1: coordinates end at the edges of the image; 0: it is repeated
    float normalizer;         // texels that are reflectances are divided by it; 0: 255
    float bump_factor;        // 0: 1
    float noise_scale;        // of the point; 0: 1
    uint32_t noise_octaves;   // 0: 1
    uint32_t noise_absolute;  // 1: |n|; 0: (n + 1) / 2
    float black[3];           // of a checkerboard
    float white[3];           // (0,0,0): (1,1,1)
    float checker_scale;      // 0: 1
    float checker_offset;
    uint32_t mirror;          // 1: each second repetition of the image is mirrored; `clamp` must then be 0
    uint32_t coordinate_set;  // of principled materials; 1: texture_coordinates_1 of meshes
    const float* transform;   // of an image: 6 floats, u' = m[0] u + m[1] v + m[2], v' = m[3] u + ...; NULL: identity
} castor_texture;
CASTOR_C_API castor_status castor_scene_add_texture(castor_scene* scene, const castor_texture* texture,
                                                    uint32_t* index);
/// Makes a texture what eye rays see that meet nothing, in place of the background's colour.
CASTOR_C_API castor_status castor_scene_set_background_texture(castor_scene* scene, uint32_t texture);

typedef uint32_t castor_light_kind;
enum {
    CASTOR_LIGHT_KIND_POINT = 0,        // irradiance at distance r: intensity / r^2
    CASTOR_LIGHT_KIND_DIRECTIONAL = 1,  // irradiance everywhere: intensity
    CASTOR_LIGHT_KIND_SPOT = 2,         // a point light times a falloff between two cones, see castor/scene.h
    CASTOR_LIGHT_KIND_AREA = 3,         // a square of radiance `intensity` around `position`, lighting both sides
    CASTOR_LIGHT_KIND_MESH = 4,         // a mesh whose material has the emission
    CASTOR_LIGHT_KIND_SPHERE = 5,       // a sphere likewise
    CASTOR_LIGHT_KIND_ENVIRONMENT = 6,  // an image of all directions, of radiances from 0 on
    CASTOR_LIGHT_KIND_INSTANCE = 7      // an instance of a mesh whose material has the emission
};
typedef uint32_t castor_environment_mapping;
enum { CASTOR_ENVIRONMENT_MAPPING_LATLONG = 0, CASTOR_ENVIRONMENT_MAPPING_PROBE = 1 };

typedef struct castor_light {
    size_t size;
    castor_light_kind kind;
    float position[3];       // not of a directional light
    float direction[3];      // of travel; an area light's normal; need not be normalised; (0,0,0): (0,-1,0)
    float intensity[3];      // RGB
    float coverage_radians;  // spot: full angle of the cone outside of which there is no light; 0: 1, and falloff 0.8
    float falloff_radians;   // spot: full angle of the cone inside of which there is all light
    float edge;              // area: length of an edge; 0: 1
    uint32_t object;         // mesh, sphere, instance: its number
    uint32_t image;          // environment: its number
    castor_environment_mapping mapping;
    uint32_t cosine_sampling;  // environment: 1: directions to it are drawn by the cosine; 0: by the image
    uint32_t reserved;         // 0
    uint32_t square_falloff;   // spot: 1: between the cones light falls as a square, as in glTF; 0: as a fourth power
    float angle_radians;       // directional: of the disk from which it comes, see castor/scene.h
    float range;               // point, spot: at which distance light ends, see castor/scene.h; 0: it does not
    uint32_t reserved_2;       // 0
} castor_light;
CASTOR_C_API castor_status castor_scene_add_light(castor_scene* scene, const castor_light* light, uint32_t* index);
/// Finds the lights that answer to a word: the number of one, or a name, as files give and castor info lists it, of one
/// or several. Tells how many there are, and the numbers of the first `capacity`; `lights` may be NULL if that is 0.
/// Usage error: the word is neither; the message lists ten names at most.
CASTOR_C_API castor_status castor_scene_find_lights(const castor_scene* scene, const char* word, uint32_t* lights,
                                                    size_t capacity, size_t* count);

/// How a camera's picture is path traced: what `path_tracing` of castor_camera is the sum of. 0: it is not.
enum {
    CASTOR_PATH_TRACING_ON = 1,
    CASTOR_PATH_TRACING_SAMPLES_BRDF = 2,    // directions are drawn as surfaces scatter; else uniformly
    CASTOR_PATH_TRACING_SAMPLES_LIGHTS = 4,  // at each bounce a ray goes to a light
    CASTOR_PATH_TRACING_WEIGHS = 8,          // light that rays meet by chance counts as well, by weight
    CASTOR_PATH_TRACING_ROULETTE = 16,       // paths end at random, after `roulette_from` bounces
    CASTOR_PATH_TRACING_BOUNCES = 32,        // paths have `bounces` at most; else only roulette ends them
    CASTOR_PATH_TRACING_UNIFORM_LIGHTS = 64  // any light is as probable; else by what each may give
};

/// A camera with a pinhole or a lens. With w = -normalize(gaze), u = normalize(up x w), v = w x u (u negated if
/// left-handed), the eye ray of pixel (i, j) goes from `position` to position - distance*w + (left +
/// (i+0.5)(right-left)/width) u
/// + (top - (j+0.5)(top-bottom)/height) v.
typedef struct castor_camera {
    size_t size;
    const char* image_name;  // the picture's file name in a scene file; NULL or "": none
    float position[3];
    float gaze[3];                   // a direction, not normalised; (0,0,0): (0,0,-1)
    float up[3];                     // not normalised, not necessarily perpendicular to gaze; (0,0,0): (0,1,0)
    float left, right, bottom, top;  // the image plane's window; all 0: -1, 1, -1, 1
    float distance;                  // from the eye to the image plane; 0: 1
    float t_min, t_max;              // a hit counts for t in [t_min, t_max]; 1 is on the image plane; t_max 0: infinity
    uint32_t width, height;          // 0: 512
    uint32_t samples_per_pixel;      // 0: 1
    uint32_t left_handed;
    float aperture_size;    // edge of the square lens around the eye; 0: a pinhole
    float focus_distance;   // along the gaze, at which the picture is sharp; 0: 1
    uint32_t orthographic;  // 1: rays are parallel to the gaze, and begin in the window, moved to `position`
    uint32_t path_tracing;
    uint32_t roulette_from;
    uint32_t bounces;
    float largest_sample;  // limits the channels of a path-traced sample; 0: no limit
    uint32_t reserved;
} castor_camera;
CASTOR_C_API castor_status castor_scene_add_camera(castor_scene* scene, const castor_camera* camera, uint32_t* index);
/// Describes a camera of the scene. `image_name` belongs to the scene, and stays valid until it is changed. Usage
/// error: there is no such camera.
CASTOR_C_API castor_status castor_scene_get_camera(const castor_scene* scene, size_t i, castor_camera* camera);
/// Gives a camera another size in pixels. Pixels keep their shape: the window becomes wider or narrower about its
/// middle.
CASTOR_C_API castor_status castor_camera_resize(castor_camera* camera, uint32_t width, uint32_t height);

/// How linear values become 8 bits: Reinhard's photographic operator, the curves of ACES and of Uncharted 2, `key`
/// times the value alone, 255 being white, or AgX.
typedef uint32_t castor_tone_operator;
enum {
    CASTOR_TONE_OPERATOR_PHOTOGRAPHIC = 0,
    CASTOR_TONE_OPERATOR_ACES = 1,
    CASTOR_TONE_OPERATOR_FILMIC = 2,
    CASTOR_TONE_OPERATOR_LINEAR = 3,
    CASTOR_TONE_OPERATOR_AGX = 4
};
typedef struct castor_tone_map {
    size_t size;
    castor_tone_operator tone_operator;
    uint32_t srgb;       // 1: the curve of sRGB in place of `gamma`
    float key;           // the luminance that the average becomes, and that of AgX's middle grey; 0: 0.18
    float burn_percent;  // of the pixels are brighter than white, but by AgX; 0: none
    float saturation;    // 1: colours stay; 0: grey
    float gamma;         // 0: 2.2
} castor_tone_map;
/// Adds a tone map to a camera of the scene. `extension`: the end of its picture's file name, such as "_aces.png"; NULL
/// means ".png". Usage error: there is no such camera.
CASTOR_C_API castor_status castor_scene_add_tone_map(castor_scene* scene, size_t camera,
                                                     const castor_tone_map* tone_map, const char* extension);
CASTOR_C_API castor_status castor_scene_get_tone_map_count(const castor_scene* scene, size_t camera, size_t* count);
/// Describes a tone map of a camera. `extension`, which may be NULL, receives what belongs to the scene and stays valid
/// until it is changed; "" where ".png" is meant.
CASTOR_C_API castor_status castor_scene_get_tone_map(const castor_scene* scene, size_t camera, size_t i,
                                                     castor_tone_map* tone_map, const char** extension);

/// Adds a camera and lights to a scene of bare geometry, and a material if it has none.
CASTOR_C_API castor_status castor_scene_add_default_view(castor_scene* scene);

/// Triangles with vertices of their own. Arrays are copied.
typedef struct castor_mesh {
    size_t size;
    const float* vertices;  // 3 * vertex_count: x, y, z of each vertex
    size_t vertex_count;
    const uint32_t* triangles;  // 3 * triangle_count: three vertices each
    size_t triangle_count;
    const float* normals;    // 3 * vertex_count: unit normals of vertices for smooth shading; NULL: flat
    const float* transform;  // from the mesh's own space to the world; NULL: identity
    uint32_t material;
    uint32_t smooth;                   // 1: normals are computed; `normals` must then be NULL
    const float* texture_coordinates;  // 2 * vertex_count: u, v of each vertex; NULL: (0, 0)
    float motion[3];                   // how far the mesh has moved, in the world, when the shutter closes
    uint32_t reserved;                 // 0
    // For principled materials:
    const float* texture_coordinates_1;  // 2 * vertex_count, the second set; NULL: (0, 0)
    const float* colors;                 // 4 * vertex_count: 0 to 1, linear, alpha last; times the base colour; NULL: 1
    const float* tangents;  // 4 * vertex_count: unit, and the sign of the bitangent, sign * cross(normal, tangent)
} castor_mesh;
/// Adds a mesh, which stands in the world once unless instances of it are added. `index` receives its number.
CASTOR_C_API castor_status castor_scene_add_mesh(castor_scene* scene, const castor_mesh* mesh, uint32_t* index);
/// Adds `count` further placements of meshes, which are stored once. `meshes`: their numbers. `materials`: NULL means
/// material 0 for all. `transforms`: 12 floats each, from the mesh's own space to the world (the mesh's own transform
/// does not apply). `first`, which may be NULL, receives the number of the first one; the others follow; likewise in
/// what follows.
CASTOR_C_API castor_status castor_scene_add_instances(castor_scene* scene, size_t count, const uint32_t* meshes,
                                                      const uint32_t* materials, const float* transforms,
                                                      uint32_t* first);
/// Adds spheres. `centers_radii`: 4 floats each: x, y, z, radius. `materials`: NULL means material 0 for all.
/// `transforms`: 12 floats each, which may make ellipsoids of them; NULL: identity.
CASTOR_C_API castor_status castor_scene_add_spheres(castor_scene* scene, size_t count, const float* centers_radii,
                                                    const uint32_t* materials, const float* transforms,
                                                    uint32_t* first);
/// Sets how far `count` instances, or spheres, from `first` on have moved, in the world, when the shutter closes.
/// `motions`: 3 floats each. Usage error: there are not so many.
CASTOR_C_API castor_status castor_scene_set_instance_motions(castor_scene* scene, uint32_t first, size_t count,
                                                             const float* motions);
CASTOR_C_API castor_status castor_scene_set_sphere_motions(castor_scene* scene, uint32_t first, size_t count,
                                                           const float* motions);
/// Adds infinite planes. `points`, `normals`: 3 floats each; normals need not be normalised. `materials`: NULL means
/// material 0 for all.
CASTOR_C_API castor_status castor_scene_add_planes(castor_scene* scene, size_t count, const float* points,
                                                   const float* normals, const uint32_t* materials, uint32_t* first);

/// How many things of each kind a scene has.
typedef struct castor_scene_counts {
    size_t size;
    uint64_t vertices, triangles;  // of all meshes, each counted once
    uint64_t meshes, instances, spheres, planes;
    uint64_t materials, lights, cameras;
    uint64_t images, textures;  // not of a built scene
} castor_scene_counts;
CASTOR_C_API castor_status castor_scene_get_counts(const castor_scene* scene, castor_scene_counts* counts);
/// What the reader of the file noticed.
CASTOR_C_API castor_status castor_scene_get_warning_count(const castor_scene* scene, size_t* count);
CASTOR_C_API castor_status castor_scene_get_warning(const castor_scene* scene, size_t i, castor_warning* warning);

// ---------------------------------------------------------------------------------------------------------------------
// Built scenes

/// A scene made ready for devices: columns and trees, which a file can keep.
typedef struct castor_built_scene castor_built_scene;

/// How rays find their hits. Hits do not depend on it.
typedef uint32_t castor_strategy;
enum {
    CASTOR_STRATEGY_AUTOMATIC = 0,  // by device and kind of ray
    CASTOR_STRATEGY_BRUTE = 1,      // every ray against every primitive: the reference
    CASTOR_STRATEGY_SIMT = 2,       // for GPUs
    CASTOR_STRATEGY_WIDE = 3,       // for CPUs
    CASTOR_STRATEGY_PACKET = 4      // for CPUs, and rays that are coherent
};

/// How much work goes into building trees. Hits do not depend on it.
typedef uint32_t castor_tree_quality;
enum {
    CASTOR_TREE_QUALITY_MEDIUM = 0,  // quick to build; splits triangles only where many are long
    CASTOR_TREE_QUALITY_HIGH = 1     // faster rays, above all where triangles are long and thin
};

typedef struct castor_build_options {
    size_t size;
    castor_strategy strategy;
    castor_tree_quality quality;
    uint32_t ignore_profiles;  // 1: what `castor tune` stored for the devices does not choose the trees
    uint32_t take_geometry;    // 1: saves memory; `scene` is left without meshes, spheres, planes and instances
    castor_progress_function progress;  // NULL: none
    void* progress_user;
} castor_build_options;

/// Checks the scene and builds the trees that these devices traverse; `devices` NULL: castor_devices_select(""). The
/// scene is not changed, except by `take_geometry` (also if the call then fails), and not kept. `options` may be NULL.
CASTOR_C_API castor_status castor_built_scene_create(castor_scene* scene, const castor_devices* devices,
                                                     const castor_build_options* options, castor_built_scene** built);
/// Opens a file of castor_built_scene_save. The file must not be written to while it is used; replacing it by
/// castor_built_scene_save is safe. `progress` may be NULL. Scene error: the file is missing, damaged, or of another
/// version.
CASTOR_C_API castor_status castor_built_scene_load(const char* path, castor_progress_function progress, void* user,
                                                   castor_built_scene** built);
/// Writes a file, in one step: if that fails or is stopped, an old file stays as it was. `progress` may be NULL.
CASTOR_C_API castor_status castor_built_scene_save(const castor_built_scene* built, const char* path,
                                                   castor_progress_function progress, void* user);
/// Whether the file begins as one of castor_built_scene_save: 1, or 0, also for what cannot be read.
CASTOR_C_API castor_status castor_is_built_scene(const char* path, uint32_t* is_built_scene);
CASTOR_C_API void castor_built_scene_retain(castor_built_scene* built);
CASTOR_C_API void castor_built_scene_release(castor_built_scene* built);
/// Counts what was built: meshes without triangles are left out, and `instances` also counts what hits give instance
/// numbers to beside the scene's instances (see castor_hit).
CASTOR_C_API castor_status castor_built_scene_get_counts(const castor_built_scene* built, castor_scene_counts* counts);
/// As castor_scene_find_lights.
CASTOR_C_API castor_status castor_built_scene_find_lights(const castor_built_scene* built, const char* word,
                                                          uint32_t* lights, size_t capacity, size_t* count);
/// As castor_scene_get_camera.
CASTOR_C_API castor_status castor_built_scene_get_camera(const castor_built_scene* built, size_t i,
                                                         castor_camera* camera);
/// As castor_scene_get_tone_map_count and castor_scene_get_tone_map.
CASTOR_C_API castor_status castor_built_scene_get_tone_map_count(const castor_built_scene* built, size_t camera,
                                                                 size_t* count);
CASTOR_C_API castor_status castor_built_scene_get_tone_map(const castor_built_scene* built, size_t camera, size_t i,
                                                           castor_tone_map* tone_map, const char** extension);
/// What the reader of the scene's file noticed.
CASTOR_C_API castor_status castor_built_scene_get_warning_count(const castor_built_scene* built, size_t* count);
CASTOR_C_API castor_status castor_built_scene_get_warning(const castor_built_scene* built, size_t i,
                                                          castor_warning* warning);

// ---------------------------------------------------------------------------------------------------------------------
// Rays

/// r(t) = origin + t * direction for t in [t_min, t_max]. The direction need not be normalised, and t is in units of
/// its length. A ray with NaN anywhere, with an infinite or too distant origin (beyond 1e12), or with an infinite, zero
/// or denormal direction hits nothing. 32 bytes, in this version and all later ones.
typedef struct castor_ray {
    float origin[3];
    float t_min;
    float direction[3];
    float t_max;
} castor_ray;

/// A primitive that a ray meets. A triangle's point is (1-u-v)*p0 + u*p1 + v*p2; spheres and planes have u = v = 0.
///
/// `instance` is
/// - 0 for everything that is placed once; `primitive` then counts the triangles of all these meshes, then the spheres,
///   then the planes;
/// - i + 1 for the scene's i-th instance; `primitive` then counts the mesh's triangles;
/// - after these, in the scene's order, one number for each mesh that has instances, or is mirrored by its transform;
/// - after these, one number for each sphere that its transform makes an ellipsoid; `primitive` is then 0.
///
/// A miss has t = +infinity, u = v = 0 and primitive = instance = CASTOR_MISS. 20 bytes, in this version and all later
/// ones.
typedef struct castor_hit {
    float t;
    float u;
    float v;
    uint32_t primitive;
    uint32_t instance;
} castor_hit;
#define CASTOR_MISS 0xffffffffu

/// Finds hits of batches of rays in one scene. Answers are a function of ray and scene alone: the same bits on every
/// device and with every strategy. A batch is divided among all devices; one that fails is dropped, and the others do
/// its work. Only where none is left does a call fail with a device error. Batches of several threads take turns.
typedef struct castor_tracer castor_tracer;

typedef struct castor_tracer_options {
    size_t size;
    castor_strategy strategy;
    castor_tree_quality quality;
    uint32_t ignore_profiles;      // 1: what `castor tune` stored for the devices is not used
    uint32_t cull_back_faces;      // 1: flat triangles seen from behind are not hit
    double deadline_seconds;       // a device that does not answer for so long is dropped; 0: 300
    double stop_deadline_seconds;  // likewise once all is done or stopped: it is not waited for; 0: 300
} castor_tracer_options;

/// Makes a tracer. The scene is not kept. `devices` NULL: castor_devices_select(""). `options` may be NULL. Building
/// cannot be stopped here: castor_built_scene_create can.
CASTOR_C_API castor_status castor_tracer_create(const castor_scene* scene, const castor_devices* devices,
                                                const castor_tracer_options* options, castor_tracer** tracer);
/// The same of a built scene, which is kept. A tree that it lacks is built, with a warning.
CASTOR_C_API castor_status castor_tracer_create_from_built(const castor_built_scene* built,
                                                           const castor_devices* devices,
                                                           const castor_tracer_options* options,
                                                           castor_tracer** tracer);
CASTOR_C_API void castor_tracer_retain(castor_tracer* tracer);
CASTOR_C_API void castor_tracer_release(castor_tracer* tracer);

/// What the caller knows of a batch's rays. It may make them faster; it does not change their answers.
typedef uint32_t castor_coherence;
enum {
    CASTOR_COHERENCE_INCOHERENT = 0,  // neighbours have nothing in common
    CASTOR_COHERENCE_COHERENT = 1     // 16 neighbours lie close and run alike, as in small blocks of pixels
};

/// Called every 20 ms or so by the thread that waits for a batch, once it is the batch's turn. Returns 0 to stop: the
/// call then soon ends with CASTOR_STATUS_STOPPED. It must not use the tracer. `user` is batch options' `user`.
typedef int (*castor_go_on_function)(void* user);

typedef struct castor_batch_options {
    size_t size;
    castor_go_on_function go_on;  // NULL: the batch is not stopped
    void* user;
    castor_coherence coherence;
    uint32_t reserved;  // 0
} castor_batch_options;

/// Writes the nearest hit of rays[i] to hits[i], for i < count. `options` may be NULL, as in all queries. After any
/// status but CASTOR_STATUS_DONE, some answers are missing: their memory is as it was. Likewise in what follows.
CASTOR_C_API castor_status castor_tracer_closest_hit(castor_tracer* tracer, const castor_ray* rays, size_t count,
                                                     castor_hit* hits, const castor_batch_options* options);
/// Writes 1 to occluded[i] where rays[i] hits anything, else 0.
CASTOR_C_API castor_status castor_tracer_any_hit(castor_tracer* tracer, const castor_ray* rays, size_t count,
                                                 uint8_t* occluded, const castor_batch_options* options);
/// Writes to counts[i] how many crossings rays[i] has in [t_min, t_max]: points where it passes through a surface. Of
/// triangles that share an edge one is crossed where the ray passes through the edge, so that a ray which reaches
/// beyond a closed surface crosses it evenly from outside and oddly from inside, without exception, unless it begins or
/// ends on the surface. Triangles seen edge-on are never crossed. A sphere is crossed where the ray enters it and where
/// it leaves it, a plane once, neither where it is only touched. Back faces that are culled are not crossed.
CASTOR_C_API castor_status castor_tracer_count_crossings(castor_tracer* tracer, const castor_ray* rays, size_t count,
                                                         uint32_t* counts, const castor_batch_options* options);
/// Writes the first `limit` crossings of rays[i], sorted by (t, instance, primitive), to crossings[i * limit] and
/// after, and misses where it has fewer; `crossings` has count * limit elements. counts[i] receives how many crossings
/// the ray has in all: more than `limit` where some are not listed. Usage error: `limit` crossings do not fit into the
/// largest buffer of a device.
CASTOR_C_API castor_status castor_tracer_list_crossings(castor_tracer* tracer, const castor_ray* rays, size_t count,
                                                        size_t limit, castor_hit* crossings, uint32_t* counts,
                                                        const castor_batch_options* options);

/// All crossings of a batch.
typedef struct castor_crossings castor_crossings;
/// Finds all crossings of all rays, which are counted first and then listed.
CASTOR_C_API castor_status castor_tracer_list_all_crossings(castor_tracer* tracer, const castor_ray* rays, size_t count,
                                                            const castor_batch_options* options,
                                                            castor_crossings** crossings);
CASTOR_C_API void castor_crossings_retain(castor_crossings* crossings);
CASTOR_C_API void castor_crossings_release(castor_crossings* crossings);
/// The arrays of a castor_crossings, which owns them: those of ray i are hits[first[i]] to hits[first[i + 1] - 1],
/// sorted by (t, instance, primitive). `first` has ray_count + 1 elements, `hits` has first[ray_count].
typedef struct castor_crossings_arrays {
    size_t size;
    size_t ray_count;
    const uint64_t* first;
    const castor_hit* hits;
} castor_crossings_arrays;
CASTOR_C_API castor_status castor_crossings_get_arrays(const castor_crossings* crossings,
                                                       castor_crossings_arrays* arrays);

/// Computes where rays[i] meets hits[i], in world space and on the host: `points`, `normals_geometric` and
/// `normals_shading` have 3 * count elements each, `materials` count; each may be NULL if it is not wanted.
///
/// Normals are unit vectors that point outward: for triangles to the side from which they wind counter-clockwise in
/// their mesh's own space, also where a transform mirrors it; a plane has its own. The shading normal is the
/// interpolated one where a mesh has normals, else the geometric one. Normals are not turned towards the ray. Points
/// lie on the surface, which for planes means on the ray. Computed in double precision and rounded once. A miss has
/// points and normals (0,0,0) and material CASTOR_MISS. Usage error: a hit names what the scene has not, and is not a
/// miss.
CASTOR_C_API castor_status castor_tracer_find_surfaces(castor_tracer* tracer, const castor_ray* rays,
                                                       const castor_hit* hits, size_t count, float* points,
                                                       float* normals_geometric, float* normals_shading,
                                                       uint32_t* materials, const castor_batch_options* options);

/// Finds nearest hits on the caller's own OpenCL queue and buffers, which must belong to a context of
/// castor_tracer_get_context: `rays` holds castor_ray records, `hits` castor_hit records, of at most 2^31 rays; those
/// of [first, first + count) are traced. Enqueues all at once and returns; `event`, if not NULL, receives an event that
/// is complete when all answers are, which the caller releases. The queue may run commands in any order: the caller
/// then sees to it that the rays are there first. The pointers are cl_command_queue, cl_mem and cl_event*.
CASTOR_C_API castor_status castor_tracer_enqueue_closest_hit(castor_tracer* tracer, struct _cl_command_queue* queue,
                                                             struct _cl_mem* rays, struct _cl_mem* hits, size_t first,
                                                             size_t count, castor_coherence coherence,
                                                             struct _cl_event** event);
/// The same for any hits: `occluded` holds a byte for each ray.
CASTOR_C_API castor_status castor_tracer_enqueue_any_hit(castor_tracer* tracer, struct _cl_command_queue* queue,
                                                         struct _cl_mem* rays, struct _cl_mem* occluded, size_t first,
                                                         size_t count, castor_coherence coherence,
                                                         struct _cl_event** event);
/// The same for crossings: `counts` holds a uint32_t for each ray, `crossings` `limit` castor_hit records for each ray;
/// limit 0: they are counted alone.
CASTOR_C_API castor_status castor_tracer_enqueue_count_crossings(castor_tracer* tracer, struct _cl_command_queue* queue,
                                                                 struct _cl_mem* rays, struct _cl_mem* counts,
                                                                 size_t first, size_t count, castor_coherence coherence,
                                                                 struct _cl_event** event);
CASTOR_C_API castor_status castor_tracer_enqueue_list_crossings(castor_tracer* tracer, struct _cl_command_queue* queue,
                                                                struct _cl_mem* rays, uint32_t limit,
                                                                struct _cl_mem* crossings, struct _cl_mem* counts,
                                                                size_t first, size_t count, castor_coherence coherence,
                                                                struct _cl_event** event);
/// The cl_context, and the in-order cl_command_queue, of the i-th of the devices that the tracer was given. They belong
/// to the tracer. Usage error: there is no such device. Device error: it was dropped.
CASTOR_C_API castor_status castor_tracer_get_context(const castor_tracer* tracer, size_t i,
                                                     struct _cl_context** context);
CASTOR_C_API castor_status castor_tracer_get_queue(const castor_tracer* tracer, size_t i,
                                                   struct _cl_command_queue** queue);

/// What is asked of a ray.
typedef uint32_t castor_query;
enum { CASTOR_QUERY_CLOSEST = 0, CASTOR_QUERY_ANY = 1, CASTOR_QUERY_COUNT = 2, CASTOR_QUERY_LIST = 3 };

/// The strategy that the i-th device uses for such rays, never CASTOR_STRATEGY_AUTOMATIC. Usage error: there is no such
/// device.
CASTOR_C_API castor_status castor_tracer_get_strategy(const castor_tracer* tracer, size_t i, castor_query query,
                                                      castor_coherence coherence, castor_strategy* strategy);
typedef struct castor_tracer_info {
    size_t size;
    size_t device_count;
    double build_seconds;  // of the trees
    double setup_seconds;  // of compiling programs, and uploading
} castor_tracer_info;
CASTOR_C_API castor_status castor_tracer_get_info(const castor_tracer* tracer, castor_tracer_info* info);
/// What the i-th device did for batches so far. Usage error: there is no such device.
CASTOR_C_API castor_status castor_tracer_get_share(const castor_tracer* tracer, size_t i, castor_device_share* share);
/// What was noticed when the tracer was made, beside the scene's warnings.
CASTOR_C_API castor_status castor_tracer_get_warning_count(const castor_tracer* tracer, size_t* count);
CASTOR_C_API castor_status castor_tracer_get_warning(const castor_tracer* tracer, size_t i, castor_warning* warning);

// ---------------------------------------------------------------------------------------------------------------------
// Pictures

/// A picture as linear, unlimited floats, with its planes.
typedef struct castor_film castor_film;
/// Renders pictures of one scene on all of its devices. A device that fails is dropped, and the others do its work;
/// only where none is left does a render fail with a device error. Renders of several threads take turns.
typedef struct castor_renderer castor_renderer;

typedef struct castor_renderer_options {
    size_t size;
    castor_strategy strategy;
    castor_tree_quality quality;
    uint32_t ignore_profiles;      // 1: what `castor tune` stored for the devices is not used
    uint32_t reserved;             // 0
    double deadline_seconds;       // a device that does not answer for so long is dropped; 0: 300
    double stop_deadline_seconds;  // likewise once all is done or stopped: it is not waited for; 0: 300
} castor_renderer_options;

/// Makes a renderer, as castor_tracer_create makes a tracer.
CASTOR_C_API castor_status castor_renderer_create(const castor_scene* scene, const castor_devices* devices,
                                                  const castor_renderer_options* options, castor_renderer** renderer);
CASTOR_C_API castor_status castor_renderer_create_from_built(const castor_built_scene* built,
                                                             const castor_devices* devices,
                                                             const castor_renderer_options* options,
                                                             castor_renderer** renderer);
CASTOR_C_API void castor_renderer_retain(castor_renderer* renderer);
CASTOR_C_API void castor_renderer_release(castor_renderer* renderer);

/// How far a render is. Belongs to the library; valid while the callback runs.
typedef struct castor_render_progress {
    size_t size;  // set by the library
    uint64_t samples_done;
    uint64_t samples_total;
    uint64_t samples_resumed;    // of those that are done: they were when the render began
    uint64_t rays;               // of all kinds, traced for finished pieces so far
    double seconds;              // since the render began
    const char* const* notices;  // since the last call: devices that were dropped, checkpoints that cannot be written
    size_t notice_count;
    const void* render;  // the library's own
} castor_render_progress;
/// Called some fifty times a second by the thread that renders. Returns 0 to stop: the render then soon ends with
/// CASTOR_STATUS_STOPPED.
typedef int (*castor_render_progress_function)(const castor_render_progress* progress, void* user);
/// Copies the film as it is now, with the means of the samples that devices have given back, for looking on. Only
/// while the callback that got `progress` runs.
CASTOR_C_API castor_status castor_render_progress_get_film(const castor_render_progress* progress, castor_film** film);

/// The weight of a sample by its distance from the pixel's centre.
typedef uint32_t castor_reconstruction_filter;
enum {
    CASTOR_RECONSTRUCTION_FILTER_AUTOMATIC = 0,  // gaussian; but box where the number of samples is the camera's
    CASTOR_RECONSTRUCTION_FILTER_BOX = 1,        // 1 pixel wide
    CASTOR_RECONSTRUCTION_FILTER_TENT = 2,       // 2 pixels wide
    CASTOR_RECONSTRUCTION_FILTER_GAUSSIAN = 3    // sigma 0.5 pixels, cut at 2
};

/// The shading rules of the scene format's eras: see scenes/README.md.
typedef uint32_t castor_rule_set;
enum { CASTOR_RULE_SET_R2022 = 0, CASTOR_RULE_SET_R795 = 1, CASTOR_RULE_SET_R2020 = 2, CASTOR_RULE_SET_R2018 = 3 };

/// In which order the samples of a picture are taken. The finished picture is the same.
typedef uint32_t castor_render_order;
enum {
    CASTOR_RENDER_ORDER_PIECES = 0,      // piece after piece: the fastest
    CASTOR_RENDER_ORDER_PROGRESSIVE = 1  // one sample of each pixel, then the next ...: for looking on
};

/// How the light that comes back along eye rays is found.
typedef uint32_t castor_integrator;
enum {
    CASTOR_INTEGRATOR_AUTOMATIC = 0,  // path where the camera says so, or a material is principled; else whitted
    CASTOR_INTEGRATOR_WHITTED = 1,  // from lights, mirrors and glass alone, by the format's rules; usage error where a
                                    // material is principled
    CASTOR_INTEGRATOR_PATH = 2      // from everywhere, by path tracing
};

/// By which points the samples of a pixel are taken.
typedef uint32_t castor_sample_order;
enum {
    CASTOR_SAMPLE_ORDER_PIXEL = 0,  // each pixel has a sequence of its own
    CASTOR_SAMPLE_ORDER_Z = 1       // pixels share one along a Z curve: noise whose sum over some pixels is small
};

/// What removes noise from a complete picture; the plane "noisy" is what it was.
typedef uint32_t castor_denoiser;
enum {
    CASTOR_DENOISER_NONE = 0,
    CASTOR_DENOISER_CASTOR = 1,  // Castor's own: the same bits on every device
    // Open Image Denoise, where it is installed: the file that the environment variable CASTOR_OIDN_LIBRARY names, or
    // what the system finds as libOpenImageDenoise.so.2, .so.1 or .so, of version 1.4 or later. Its bits may differ
    // between machines. Usage error, before the render begins: there is none, or it cannot be used. Device error, with
    // the noisy film: it failed.
    CASTOR_DENOISER_OIDN = 2
};

/// Lights whose share of a path-traced picture becomes the plane "group-NAME".
typedef struct castor_light_group {
    const char* name;        // of letters, digits, '-' and '_'
    const uint32_t* lights;  // numbers of the scene's lights (castor_scene_find_lights), each in one group at most
    size_t light_count;
} castor_light_group;

typedef struct castor_render_options {
    size_t size;
    uint32_t samples_per_pixel;  // 0: the camera's own number
    castor_reconstruction_filter filter;
    castor_rule_set rules;
    castor_render_order order;
    uint32_t cull_back_faces;  // 1: for camera and mirror rays, flat triangles only; r795 does so in any case
    uint32_t tile_size;        // pixels at a time on a device: a square of this edge, a multiple of 8; 0: any
    uint32_t seed;
    uint32_t part_number;                      // only a share of the picture is rendered: number 1 ... part_count
    uint32_t part_count;                       // 0: all of it
    uint32_t reserved;                         // 0
    const uint32_t* max_recursion_depth;       // NULL: the scene's
    const char* planes;                        // names with commas between, such as "depth,normal"; NULL or "": none
    const char* checkpoint_file;               // what is done is kept in this file; NULL: nowhere
    double checkpoint_seconds;                 // how often; 0: 60
    const char* resume_file;                   // a checkpoint of this picture to go on from; NULL: none
    double verify_share;                       // the share of the picture that is made twice, to compare the bits
    castor_render_progress_function progress;  // NULL: none
    void* progress_user;
    castor_integrator integrator;
    float largest_sample;     // limits the samples of path tracing; 0: no limit
    const uint32_t* bounces;  // of path tracing, 1024 at most; NULL: 12
    castor_denoiser denoise;
    uint32_t reserved_end;  // 0
    // Blocks of 8x8 pixels stop where their estimated error, relative to their mean luminance, is this or less; the
    // plane "samples" tells when. Takes more than 16 samples a pixel. 0: none stops.
    double noise;
    // The picture is complete after the first pass over it that ends so many seconds or more after the render's begin,
    // in progressive order. 0: all samples are taken.
    double stop_after_seconds;
    const castor_light_group* light_groups;  // all other light is the plane "group-rest"
    size_t light_group_count;                // at most 31
    castor_sample_order sample_order;
    uint32_t reserved_more;  // 0
} castor_render_options;

/// Returns the names of the planes that a render can make, with commas between: "depth,position,...". The string is
/// static. "lights" makes several, after the others: "light-0-point" ..., by the number of a light and its kind, what
/// the picture would be by this light alone; and "light-none", what no light makes. Their sum is the picture but for
/// rounding. With "lights", parts, checkpoints, resume_file and verify_share are usage errors.
CASTOR_C_API const char* castor_plane_names(void);

/// Renders what the camera sees; another size than the scene's is castor_camera_resize. `options` may be NULL. Where
/// the render was stopped (CASTOR_STATUS_STOPPED), or the last device failed (CASTOR_STATUS_DEVICE_ERROR), `film`
/// receives what is done, if anything can be: release it, too. Scene error: the camera is wrong, or `resume_file` is.
/// Usage error: an unknown plane or a bad option.
CASTOR_C_API castor_status castor_renderer_render(castor_renderer* renderer, const castor_camera* camera,
                                                  const castor_render_options* options, castor_film** film);

/// Of the renderer's making and of its last render.
typedef struct castor_render_statistics {
    size_t size;
    double flatten_seconds;
    double build_seconds;  // of the trees
    double setup_seconds;  // of compiling programs, and uploading
    double render_seconds;
    uint64_t rays;             // of all kinds: eye, shadow and mirror
    uint64_t samples_done;     // of all pixels, those that are in the film
    uint64_t samples_resumed;  // of them, those that `resume_file` had
    uint64_t triangles, spheres, planes, nodes;
    uint64_t verified_pixels;   // made twice
    uint64_t differing_pixels;  // of them, with different bits
    uint32_t part_complete;     // 1: all samples of the part are done
    uint32_t reserved;
    size_t device_count;
    double denoise_seconds;  // 0: noise was not removed
    uint32_t oidn_version;   // of the Open Image Denoise that removed it: 10403 is 1.4.3; 0: none did
    uint32_t reserved_end;
} castor_render_statistics;
CASTOR_C_API castor_status castor_renderer_get_statistics(const castor_renderer* renderer,
                                                          castor_render_statistics* statistics);
/// As castor_tracer_get_strategy; a renderer asks for CASTOR_QUERY_CLOSEST and CASTOR_QUERY_ANY.
CASTOR_C_API castor_status castor_renderer_get_strategy(const castor_renderer* renderer, size_t i, castor_query query,
                                                        castor_coherence coherence, castor_strategy* strategy);
/// What the i-th device did for the last render. Usage error: there is no such device.
CASTOR_C_API castor_status castor_renderer_get_share(const castor_renderer* renderer, size_t i,
                                                     castor_device_share* share);
/// What was noticed when the renderer was made, beside the scene's warnings.
CASTOR_C_API castor_status castor_renderer_get_warning_count(const castor_renderer* renderer, size_t* count);
CASTOR_C_API castor_status castor_renderer_get_warning(const castor_renderer* renderer, size_t i,
                                                       castor_warning* warning);

CASTOR_C_API void castor_film_retain(castor_film* film);
CASTOR_C_API void castor_film_release(castor_film* film);

/// Arrays are row-major with row 0 on top, and belong to the film.
typedef struct castor_film_info {
    size_t size;
    uint32_t width, height;
    uint32_t samples_per_pixel;
    uint32_t complete;    // 1: every pixel is done
    const float* pixels;  // 3 * width * height: RGB, the mean of the samples taken; (0,0,0) without any
    const uint8_t* done;  // width * height: 1 where all samples were taken
    size_t plane_count;
} castor_film_info;
CASTOR_C_API castor_status castor_film_get_info(const castor_film* film, castor_film_info* info);

/// A further layer of a film, such as depth: what the eye ray through each pixel's centre meets. Strings and arrays
/// belong to the film.
typedef struct castor_film_plane {
    size_t size;
    const char* name;         // "depth", "normal", "primitive", ...
    const char* channels;     // with commas between: "X,Y,Z"
    size_t channel_count;     // values a pixel
    const float* values;      // channel_count * width * height, as `pixels`; NULL if the plane holds integers
    const uint32_t* indices;  // likewise; NULL if the plane holds floats
} castor_film_plane;
/// Describes the i-th plane. Usage error: there is none.
CASTOR_C_API castor_status castor_film_get_plane(const castor_film* film, size_t i, castor_film_plane* plane);
/// Describes the plane of this name. Usage error: there is none; the message lists what there is.
CASTOR_C_API castor_status castor_film_find_plane(const castor_film* film, const char* name, castor_film_plane* plane);

/// How a value becomes one of 256 integers.
typedef uint32_t castor_quantization;
enum { CASTOR_QUANTIZATION_ROUND = 0, CASTOR_QUANTIZATION_TRUNCATE = 1 };
typedef struct castor_image_options {
    size_t size;
    castor_quantization quantization;
    uint32_t reserved;  // 0
} castor_image_options;
/// Writes the pixels in the format of the path's extension: .png and .ppm with 8 bits, .pfm, .hdr and .exr with the
/// linear values. Only a complete file replaces an old one. `options` may be NULL. Usage error: another extension.
CASTOR_C_API castor_status castor_film_write_image(const castor_film* film, const char* path,
                                                   const castor_image_options* options);
/// Makes 8 bits of the film's linear values. `tone_map`: NULL means photographic, with key 0.18, burn_percent 1,
/// saturation 1 and gamma 2.2. `rgb` receives 3 * width * height bytes, row 0 on top. Usage error: a film without
/// pixels, or a wrong number.
CASTOR_C_API castor_status castor_film_apply_tone_map(const castor_film* film, const castor_tone_map* tone_map,
                                                      uint8_t* rgb);
/// Writes what castor_film_apply_tone_map makes, as .png or .ppm. Usage error: the same, or another extension.
CASTOR_C_API castor_status castor_film_write_tone_mapped(const castor_film* film, const char* path,
                                                         const castor_tone_map* tone_map);
/// Writes a plane: .exr, or .pfm if it has one or three channels. Usage error: another extension, or no such plane.
CASTOR_C_API castor_status castor_film_write_plane(const castor_film* film, const char* name, const char* path);
/// Writes the linear values and all planes into one .exr, as layers: R, G and B, and each plane's channels after its
/// name and a dot, such as normal.X. Usage error: another extension.
CASTOR_C_API castor_status castor_film_write_layers(const castor_film* film, const char* path);
/// Usage error, listing the extensions, unless castor_film_write_image knows the extension: to ask before rendering.
CASTOR_C_API castor_status castor_check_image_extension(const char* path);

#ifdef __cplusplus
}
#endif

#endif
