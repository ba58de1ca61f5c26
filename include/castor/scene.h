#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "castor/api.h"

namespace castor {

// Conventions, stated here and nowhere else.
// World space is right-handed; the unit of length is the scene file's. A camera looks along `gaze`; image row 0
// is on top and column 0 on the left; pixel (i, j) covers [i, i+1) x [j, j+1). Triangles wind counter-clockwise
// seen from outside: the geometric normal is (p1-p0) x (p2-p0). Colours are linear RGB; 255 is white in an
// 8-bit image, and values are not limited. Indices count from 0.

// A Scene holds what a scene file says, as plain data. A program may fill one without any file. Nothing is checked
// here: `Renderer`, `Tracer` and `BuiltScene` check the whole scene once and throw SceneError.

/// How a material reflects beside its ambient, diffuse and specular terms. The rule set decides which kinds mirror (see
/// RuleSet); a dielectric does not refract.
enum class MaterialKind { plain, mirror, conductor, dielectric };

/// Reflectances, all at least 0. `phong_exponent` is the sharpness of the highlight; the indices are those of a
/// conductor.
struct Material {
    MaterialKind kind = MaterialKind::plain;
    glm::vec3 ambient{0.0f};
    glm::vec3 diffuse{0.0f};
    glm::vec3 specular{0.0f};
    glm::vec3 mirror{0.0f};
    float phong_exponent = 1.0f;
    float refraction_index = 1.0f;
    float absorption_index = 0.0f;
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
};

/// A further placement of a mesh. The mesh's triangles and tree are stored once, however often it is placed.
struct MeshInstance {
    std::uint32_t mesh = 0;
    Transform transform{1.0f};  // from the mesh's own space to the world; replaces the mesh's own transform
    std::uint32_t material = 0;
    std::size_t line = 0;
};

struct Sphere {
    glm::vec3 center{0.0f};
    float radius = 1.0f;
    std::uint32_t material = 0;
    std::size_t line = 0;
    Transform transform{1.0f};
};

/// An infinite plane. The normal need not be normalised.
struct Plane {
    glm::vec3 point{0.0f};
    glm::vec3 normal{0.0f, 1.0f, 0.0f};
    std::uint32_t material = 0;
    std::size_t line = 0;
};

/// A light whose irradiance at distance r is intensity / r^2.
struct PointLight {
    glm::vec3 position{0.0f};
    glm::vec3 intensity{0.0f};
};

/// A light whose irradiance is `radiance` everywhere. It travels along `direction`, which need not be normalised.
struct DirectionalLight {
    glm::vec3 direction{0.0f, -1.0f, 0.0f};
    glm::vec3 radiance{0.0f};
};

/// A point light times f, which is 1 inside the falloff cone, 0 outside the coverage cone, and between them
/// ((cos theta - cos(coverage/2)) / (cos(falloff/2) - cos(coverage/2)))^4. The angles are full angles of the cones.
struct SpotLight {
    glm::vec3 position{0.0f};
    glm::vec3 direction{0.0f, -1.0f, 0.0f};
    glm::vec3 intensity{0.0f};
    float coverage_radians = 1.0f;
    float falloff_radians = 0.8f;
};

/// A light of any kind; only the member that `kind` names is used. Lights are summed in the order of the scene's list.
struct Light {
    enum class Kind { point, directional, spot } kind = Kind::point;
    PointLight point{};
    DirectionalLight directional{};
    SpotLight spot{};
    std::size_t line = 0;
};

/// A pinhole camera. With w = -normalize(gaze), u = normalize(up x w), v = w x u (u negated if left-handed), the eye
/// ray of pixel (i, j) goes from `position` to position - distance*w + (left + (i+0.5)(right-left)/width) u
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
/// - after these, in the scene's order, one number for each mesh that has instances, or is mirrored by its transform;
/// - after these, one number for each sphere that its transform makes an ellipsoid; `primitive` is then 0.
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
