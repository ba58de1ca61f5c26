#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat3x2.hpp>
#include <glm/mat4x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "castor/api.h"
#include "castor/principled_material.h"

namespace castor {

// Conventions, stated here and nowhere else.
// World space is right-handed; the unit of length is the scene file's. A camera looks along `gaze`; image row 0
// is on top and column 0 on the left; pixel (i, j) covers [i, i+1) x [j, j+1). Triangles wind counter-clockwise
// seen from outside: the geometric normal is (p1-p0) x (p2-p0). Colours are linear RGB; 255 is white in an
// 8-bit image, and values are not limited. Indices count from 0.

// A Scene holds what a scene file says, as plain data. A program may fill one without any file. Nothing is checked
// here: `Renderer`, `Tracer` and `BuiltScene` check the whole scene once and throw SceneError.

/// Texels of a picture, row 0 on top, three values (R, G, B) each. Exactly one of the vectors has width * height * 3
/// elements; the other is empty.
struct Image {
    std::string file;  // for messages; empty: a program made it
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint8_t> bytes{};
    std::vector<float> floats{};        // linear, not limited
    std::vector<std::uint8_t> alpha{};  // one a texel, beside bytes; empty: 255 everywhere
};

enum class TextureKind { image, perlin, checkerboard };

/// What a texture changes, with the texel divided by `normalizer` where it is a colour.
enum class TextureTarget {
    replace_diffuse,
    blend_diffuse,  // the mean of the material's own and the texel
    replace_specular,
    replace_all,  // the surface sends the texel itself: no shading
    background,   // what eye rays that meet nothing see; for Scene::background_texture
    normal_map,   // texel / 127.5 - 1 in the frame of dp/du, dp/dv and the normal
    bump_map,     // heights
    principled,   // what a principled material says; for no Material::textures
};

enum class TextureFilter { nearest, bilinear, trilinear };
/// mirror: every other copy is reflected.
enum class TextureWrap { repeat, clamp, mirror };
/// How noise in [-1, 1] becomes a value in [0, 1]: (n + 1) / 2, or |n|.
enum class NoiseConversion { linear, absolute };

/// A function of the surface. Images are read at the surface's texture coordinates (u, v): x = u * width, y = v *
/// height. Noise and checkerboards are functions of the point in the object's own space.
struct Texture {
    TextureKind kind = TextureKind::image;
    TextureTarget target = TextureTarget::replace_diffuse;
    std::uint32_t image = 0;  // index in Scene::images
    TextureFilter filter = TextureFilter::nearest;
    TextureWrap wrap = TextureWrap::repeat;
    float normalizer = 255.0f;
    float bump_factor = 1.0f;
    float noise_scale = 1.0f;  // of the point
    std::uint32_t noise_octaves = 1;
    NoiseConversion noise_conversion = NoiseConversion::linear;
    glm::vec3 black{0.0f};  // of a checkerboard
    glm::vec3 white{1.0f};
    float checker_scale = 1.0f;
    float checker_offset = 0.0f;
    std::size_t line = 0;
    std::optional<TextureWrap> wrap_v{};  // along v, where it is not the same
    glm::mat3x2 transform{1.0f};          // of an image: (u, v) = transform (surface's u, surface's v, 1)
    std::uint32_t coordinate_set = 0;     // of a principled texture: 1 is Mesh::texture_coordinates_1
};

/// How a material reflects beside its ambient, diffuse and specular terms. The rule set decides which kinds mirror (see
/// RuleSet). A dielectric reflects and refracts.
enum class MaterialKind { plain, mirror, conductor, dielectric };

/// How diffuse and specular reflectance make the light that a lit surface sends. With l and h the cosines of the
/// normal with the light and with the half vector, r the cosine of the light's mirror direction with the viewer, p the
/// exponent, and E the irradiance of a surface that faces the light:
enum class BrdfModel {
    blinn_phong,           // E (kd l + ks h^p)
    modified_blinn_phong,  // E l (kd + ks h^p); normalised: E l (kd / pi + ks (p + 8) / (8 pi) h^p)
    phong,                 // E (kd l + ks r^p)
    modified_phong,        // E l (kd + ks r^p); normalised: E l (kd / pi + ks (p + 2) / (2 pi) r^p)
    torrance_sparrow,      // microfacets (Torrance, Sparrow 1967) with a Blinn distribution and Schlick's Fresnel term
};

/// Reflectances, all at least 0. `phong_exponent` is the sharpness of the highlight, p above.
struct Material {
    MaterialKind kind = MaterialKind::plain;
    glm::vec3 ambient{0.0f};
    glm::vec3 diffuse{0.0f};
    glm::vec3 specular{0.0f};
    glm::vec3 mirror{0.0f};
    float phong_exponent = 1.0f;
    float refraction_index = 1.0f;
    float absorption_index = 0.0f;  // of a conductor: k of n + ik
    glm::vec3 absorption{0.0f};     // of a dielectric: e^(-absorption * length) is left of light after a way inside
    // Mirrored and refracted directions d become normalize(d + roughness (x u + y v)), with u, v unit and
    // perpendicular to d, and x, y uniform in [-1/2, 1/2].
    float roughness = 0.0f;
    glm::vec3 emission{0.0f};  // radiance, to both sides; what emits does not reflect
    BrdfModel brdf = BrdfModel::blinn_phong;
    bool brdf_normalized = false;           // of the modified models
    bool diffuse_fresnel = false;           // of torrance_sparrow: kd is multiplied by 1 - F
    std::vector<std::uint32_t> textures{};  // indices in Scene::textures, applied in this order
    // Where it is set, it is the whole material, and the members above mean nothing. Path tracing alone shades it.
    std::optional<PrincipledMaterial> principled{};
    std::string name{};  // in a glTF file; lamps of this material have it too
};

/// An affine map from an object's own space to the world: four columns, the images of the axes and of the origin. The
/// default is the identity. The map must have an inverse, with ||M|| ||M^-1|| <= 2^20, where the norm is the largest
/// sum of magnitudes in a row of the linear part.
using Transform = glm::mat4x3;

/// Triangles with vertices of their own. `normals` is empty (flat shading), or has one unit normal a vertex, which the
/// barycentric coordinates interpolate (smooth shading).
struct Mesh {
    std::vector<glm::vec3> positions;
    std::vector<glm::vec3> normals;
    std::vector<glm::uvec3> triangles;
    std::uint32_t material = 0;
    std::size_t line = 0;  // the line of the scene file, for messages; 0: unknown
    Transform transform{1.0f};
    std::vector<glm::vec2> texture_coordinates{};  // one a vertex, or empty: (0, 0) everywhere
    glm::vec3 motion{0.0f};                        // how far it has moved, in world space, when the shutter closes
    // For principled materials, each one a vertex, or empty.
    std::vector<glm::vec2> texture_coordinates_1{};
    std::vector<glm::vec4> colors{};    // linear, 0 to 1, with alpha; multiply the base colour
    std::vector<glm::vec4> tangents{};  // unit, and the sign of the bitangent, sign * cross(normal, tangent)
    std::string name{};                 // what messages call it; empty: its number
};

/// A further placement of a mesh. The mesh's triangles and tree are stored once, however often it is placed.
struct MeshInstance {
    std::uint32_t mesh = 0;
    Transform transform{1.0f};  // from the mesh's own space to the world; replaces the mesh's own transform
    std::uint32_t material = 0;
    std::size_t line = 0;
    glm::vec3 motion{0.0f};  // as a mesh's; not the mesh's own
};

/// Texture coordinates, with (x, y, z) the point from the centre in the sphere's own space: u = (pi - atan2(z, x)) / (2
/// pi), v = acos(y / radius) / pi.
struct Sphere {
    glm::vec3 center{0.0f};
    float radius = 1.0f;
    std::uint32_t material = 0;
    std::size_t line = 0;
    Transform transform{1.0f};
    glm::vec3 motion{0.0f};
};

/// An infinite plane. The normal need not be normalised.
struct Plane {
    glm::vec3 point{0.0f};
    glm::vec3 normal{0.0f, 1.0f, 0.0f};
    std::uint32_t material = 0;
    std::size_t line = 0;
};

/// A light whose irradiance at distance r is intensity / r^2; with a range, that times 1 - (r / range)^4, and beyond it
/// nothing (KHR_lights_punctual).
struct PointLight {
    glm::vec3 position{0.0f};
    glm::vec3 intensity{0.0f};
    float range = std::numeric_limits<float>::infinity();
};

/// A light whose irradiance is `radiance` everywhere. It travels along `direction`, which need not be normalised. With
/// an angle it comes from all of a disk that is seen under so many radians (the sun's is 0.0093), at most pi, and
/// shadows have soft edges. Where paths are traced, rays that meet nothing see the disk, if the angle is at least
/// 0.0003.
struct DirectionalLight {
    glm::vec3 direction{0.0f, -1.0f, 0.0f};
    glm::vec3 radiance{0.0f};
    float angle_radians = 0.0f;
};

/// The exponent p of a spot light's falloff: 4 in the course's format, 2 in glTF.
enum class SpotFalloff { fourth_power, square };

/// A point light times f, which is 1 inside the falloff cone, 0 outside the coverage cone, and between them
/// ((cos theta - cos(coverage/2)) / (cos(falloff/2) - cos(coverage/2)))^p. The angles are full angles of the cones.
struct SpotLight {
    glm::vec3 position{0.0f};
    glm::vec3 direction{0.0f, -1.0f, 0.0f};
    glm::vec3 intensity{0.0f};
    float coverage_radians = 1.0f;
    float falloff_radians = 0.8f;
    SpotFalloff falloff = SpotFalloff::fourth_power;
    float range = std::numeric_limits<float>::infinity();  // as a point light's
};

/// A square that is no surface: no ray meets it. It lights both of its sides. Its edges are parallel to u and v: with
/// n' the normal n whose smallest component (the first, of equal ones) is replaced by 1, u = normalize(n' x n), v = n x
/// u.
struct AreaLight {
    glm::vec3 position{0.0f};             // of the centre
    glm::vec3 normal{0.0f, -1.0f, 0.0f};  // need not be normalised
    float size = 1.0f;                    // of an edge
    glm::vec3 radiance{0.0f};
};

/// A mesh or sphere of the scene that lights others: its material's emission is the radiance.
struct ObjectLight {
    std::uint32_t object = 0;  // index in Scene::meshes, Scene::spheres or Scene::instances
};

/// How directions become points of a picture of all of them. latlong: u = (1 + atan2(x, -z) / pi) / 2, v = acos(y) /
/// pi. probe (Debevec 1998): u = (1 + r x) / 2, v = (1 - r y) / 2 with r = acos(-z) / (pi sqrt(x^2 + y^2)).
enum class EnvironmentMapping { latlong, probe };
/// How directions to the environment are drawn: over the hemisphere above the surface, or as the picture's light is
/// distributed over all directions.
enum class EnvironmentSampling { uniform, cosine, picture };

/// Light from all directions, which rays that meet nothing see. Texels are radiance.
struct EnvironmentLight {
    std::uint32_t image = 0;  // index in Scene::images
    EnvironmentMapping mapping = EnvironmentMapping::latlong;
    EnvironmentSampling sampling = EnvironmentSampling::picture;
};

/// A light of any kind; only the member that `kind` names is used. Lights are summed in the order of the scene's list.
struct Light {
    enum class Kind { point, directional, spot, area, mesh, sphere, environment, instance } kind = Kind::point;
    PointLight point{};
    DirectionalLight directional{};
    SpotLight spot{};
    AreaLight area{};
    ObjectLight object{};  // of mesh, sphere and instance
    EnvironmentLight environment{};
    std::size_t line = 0;
    // By which `castor render --light-group` knows it: in glTF those of its node and of the light, or of a lamp's
    // material; in XML element and id, such as "PointLight-1". Several lights may have the same.
    std::vector<std::string> names{};
};

/// How linear values become those of an 8-bit image. Y is the luminance, 0.2126 R + 0.7152 G + 0.0722 B.
enum class ToneOperator {
    photographic,  // Reinhard and others 2002, "Photographic Tone Reproduction for Digital Images"
    aces,          // Narkowicz 2015, "ACES Filmic Tone Mapping Curve"
    filmic,        // Hable 2010, "Uncharted 2: HDR Lighting"
    linear,        // a channel C becomes key * C / 255, limited to [0, 1]; neither burns nor changes saturation
    agx,           // Wrensch 2023, "Minimal AgX Implementation", of Sobotka's AgX
};

/// L = key * Y / (log-average of Y); white is the luminance L that `burn_percent` of the pixels exceed. A channel C
/// becomes curve(L) * (C / Y)^saturation, limited to [0, 1], then the power 1 / gamma, or the curve of sRGB. AgX looks
/// at no other pixel: it takes a channel as C / 255 * key / 0.18, so that `key` is what middle grey is exposed to, has
/// no burn_percent, and gives values for a display of gamma 2.2, which are encoded as those of the others.
struct ToneMap {
    ToneOperator tone_operator = ToneOperator::photographic;
    float key = 0.18f;
    float burn_percent = 1.0f;
    float saturation = 1.0f;
    bool is_srgb = false;
    float gamma = 2.2f;     // where it is not sRGB
    std::string extension;  // of the picture's file name, such as "_phot.png"; empty: ".png"
};

/// How a path chooses the light to which it sends a ray: by what each may give at its surface, down a tree over all
/// lights, or each as probable as any other.
enum class LightChoice { tree, uniform };

/// How the light of a path-traced picture is found: by paths that go on from surface to surface, at random, until they
/// have bounced so often. All settings give the same picture but for noise, except that fewer bounces, or a limit of
/// samples, make it darker.
struct PathTracing {
    // Directions are drawn as surfaces scatter; else uniformly over the hemisphere. (Mirrors, glass and principled
    // materials know no other directions than theirs.)
    bool samples_brdf = true;
    // At each bounce a ray goes to a point of a light (next event estimation). Else lights that no ray can meet, such
    // as point lights, give nothing.
    bool samples_lights = true;
    // Light that rays meet by chance counts as well, each way by its weight (multiple importance sampling, balance
    // heuristic). Else it counts only where lights cannot be sampled: seen directly, in mirrors and behind glass.
    bool weighs = true;
    // After so many bounces paths end at random, the darker the sooner (Russian roulette); empty: they do not. Where
    // they may, light that would add little is not always looked for, from the first bounce on.
    std::optional<std::uint32_t> roulette_from = 3;
    std::optional<std::uint32_t> bounces = 12;                      // empty: only roulette ends paths
    float largest_sample = std::numeric_limits<float>::infinity();  // limits the channels of a sample
    LightChoice light_choice = LightChoice::tree;                   // where there are several lights
};

/// A camera with a pinhole, or with a lens where `aperture_size` is not 0. With w = -normalize(gaze), u = normalize(up
/// x w), v = w x u (u negated if left-handed), the eye ray of pixel (i, j) goes from `position` to position -
/// distance*w + (left + (i+0.5)(right-left)/width) u
/// + (top - (j+0.5)(top-bottom)/height) v.
struct Camera {
    std::string image_name;  // file name of the picture, as the scene file says it; empty: none
    glm::vec3 position{0.0f};
    glm::vec3 gaze{0.0f, 0.0f, -1.0f};  // a direction, not normalised
    glm::vec3 up{0.0f, 1.0f, 0.0f};     // not normalised, not necessarily perpendicular to gaze
    float left = -1.0f, right = 1.0f, bottom = -1.0f, top = 1.0f;  // the image plane's window
    float distance = 1.0f;                                         // from the eye to the image plane
    float t_min = 0.0f;  // a hit counts for t in [t_min, t_max]; t = 1 is on the image plane
    float t_max = std::numeric_limits<float>::infinity();
    std::uint32_t width = 512, height = 512;
    std::uint32_t samples_per_pixel = 1;
    bool left_handed = false;
    std::size_t line = 0;
    // The lens is a square of this edge around the eye, in the plane of u and v; what is `focus_distance` in front of
    // it, along the gaze, is sharp.
    float aperture_size = 0.0f;
    float focus_distance = 1.0f;
    // Eye rays are parallel to the gaze: that of pixel (i, j) begins at position + (left + ...) u + (top - ...) v.
    // There is no lens then.
    bool is_orthographic = false;
    std::vector<ToneMap> tone_maps{};           // pictures to make of the linear one; empty: it is quantised as it is
    std::optional<PathTracing> path_tracing{};  // whether the picture is path traced, where nothing else is asked for
};

/// A fault of the input that did not end the reading.
struct Warning {
    std::string file;
    std::size_t line = 0;  // 0: unknown
    std::string text;
};

/// A scene, and the numbers by which hits name its parts.
///
/// A hit's `instance` is
/// - 0 for everything that is placed once; `primitive` then counts the triangles of all these meshes, then the spheres,
///   then the planes;
/// - i + 1 for `instances[i]`; `primitive` then counts the mesh's triangles;
/// - after these, in the scene's order, one number for each mesh that has instances, moves, is mirrored by its
///   transform, or has a transform and a texture that is a function of points or changes normals;
/// - after these, one number for each sphere that moves, that its transform makes an ellipsoid, or that has a transform
///   and textures; `primitive` is then 0.
struct Scene {
    std::string file;  // empty if a program made the scene
    glm::vec3 background{0.0f};
    glm::vec3 ambient_light{0.0f};
    float shadow_ray_epsilon = 1e-3f;
    std::uint32_t max_recursion_depth = 6;
    std::vector<Camera> cameras;
    std::vector<Light> lights;
    std::vector<Material> materials;
    std::vector<Mesh> meshes;
    std::vector<Sphere> spheres;
    std::vector<Plane> planes;
    std::vector<MeshInstance> instances;
    std::vector<Warning> warnings;
    std::vector<Image> images;
    std::vector<Texture> textures;
    std::optional<std::uint32_t> background_texture{};  // in place of `background`
    /// Whether lights shade the side that is seen, by a normal turned to the viewer, as path tracing does. Else it is
    /// the outside alone that they shade, as the format's rules say.
    bool shades_both_sides = false;
    /// The names of what LoadOptions can choose of a glTF file; "": one without a name. A BuiltScene does not keep
    /// them.
    std::vector<std::string> animations{};
    std::vector<std::string> material_variants{};
};

/// Computes smooth normals for `mesh`. The normal of a vertex is the normalised sum of the unnormalised cross products
/// of the triangles that use it, which weights the triangles by area. A vertex without triangles, or only with
/// degenerate ones, gets (0,0,0), and a hit there is shaded with the triangle's own normal. Sums are taken in double
/// precision and in the order of triangles.
CASTOR_API void compute_smooth_normals(Mesh& mesh);

/// Changes the camera's resolution. Keeps the window's height and adapts its width, so that nothing is stretched. The
/// new width and height must not be 0.
CASTOR_API void resize(Camera& camera, std::uint32_t width, std::uint32_t height);

}  // namespace castor
