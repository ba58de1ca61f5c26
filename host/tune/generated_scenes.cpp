#include "castor/generated_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <iterator>
#include <span>

#include "base/atomic_file.h"
#include "castor/error.h"
#include "castor/scene_io.h"
#include "tune/random.h"

namespace castor {

namespace {

struct KindInfo {
    GeneratedKind kind;
    std::string_view name;
    std::uint32_t standard_count;
    std::uint32_t small_count;  // 0: the kind is in no set
};
constexpr KindInfo kKinds[] = {{GeneratedKind::scan, "scan", 500000, 5000},
                               {GeneratedKind::interior, "interior", 100000, 3000},
                               {GeneratedKind::objects, "objects", 200000, 4000},
                               {GeneratedKind::spheres, "spheres", 10000, 500},
                               {GeneratedKind::instances, "instances", 1000000, 0}};
constexpr std::uint32_t kLeastCount = 100, kMostCount = 100000000;
constexpr std::uint32_t kInstances = 1000, kMostInstances = 1000000;
constexpr double kPi = 3.14159265358979323846;

const KindInfo& info_of(GeneratedKind kind) {
    return *std::find_if(std::begin(kKinds), std::end(kKinds), [&](const KindInfo& info) { return info.kind == kind; });
}

void add_triangle(Mesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.emplace_back(a, b, c);
}

/// Returns the height of the surface: bumps of many sizes, small ones lower than large ones.
double bumpy_radius(const glm::dvec3& p) {
    double radius = 1.0;
    for (double frequency = 3.0; frequency < 100.0; frequency *= 2.1)
        radius +=
            0.25 / frequency *
            (std::sin(frequency * p.x + 1.3 * frequency * p.y) + std::cos(frequency * p.z - 0.7 * frequency * p.x));
    return radius;
}

/// Makes a cube of `n` x `n` squares a face, projected onto a sphere.
Mesh bumpy_sphere(std::uint32_t count) {
    const int n = std::max(1, static_cast<int>(std::lround(std::sqrt(count / 12.0))));
    Mesh mesh;
    for (int face = 0; face < 6; ++face) {
        const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
        const int axis = face / 2;
        for (int j = 0; j <= n; ++j)
            for (int i = 0; i <= n; ++i) {
                // The tangent evens out the squares' sizes. Both faces of an edge compute the same points.
                glm::dvec3 p;
                p[axis] = face % 2 ? 1.0 : -1.0;
                p[(axis + 1) % 3] = std::tan(kPi / 4.0 * (2.0 * i / n - 1.0));
                p[(axis + 2) % 3] = std::tan(kPi / 4.0 * (2.0 * j / n - 1.0));
                p = glm::normalize(p);
                mesh.positions.emplace_back(bumpy_radius(p) * p);
            }
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const std::uint32_t a = first + j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
                add_triangle(mesh, a, face % 2 ? b : c, face % 2 ? c : b);
                add_triangle(mesh, a, face % 2 ? c : d, face % 2 ? d : c);
            }
    }
    return mesh;
}

/// Adds a box of twelve triangles around `center`, spanned by half edges at right angles.
void add_box(Mesh& mesh, const glm::dvec3& center, const glm::dvec3& x, const glm::dvec3& y, const glm::dvec3& z) {
    const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int corner = 0; corner < 8; ++corner)
        mesh.positions.emplace_back(center + (corner & 1 ? x : -x) + (corner & 2 ? y : -y) + (corner & 4 ? z : -z));
    constexpr std::uint32_t kQuads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    for (const auto& quad : kQuads) {
        add_triangle(mesh, first + quad[0], first + quad[1], first + quad[2]);
        add_triangle(mesh, first + quad[0], first + quad[2], first + quad[3]);
    }
}

void add_column(Mesh& mesh, const glm::dvec3& foot, double radius, double height, int sides) {
    const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int i = 0; i < sides; ++i) {
        const glm::dvec3 rim(radius * std::cos(2.0 * kPi * i / sides), 0.0, -radius * std::sin(2.0 * kPi * i / sides));
        mesh.positions.emplace_back(foot + rim);
        mesh.positions.emplace_back(foot + rim + glm::dvec3(0.0, height, 0.0));
    }
    for (int i = 0; i < sides; ++i) {
        const std::uint32_t a = first + 2 * i, b = first + 2 * ((i + 1) % sides);
        add_triangle(mesh, a, b, b + 1);
        add_triangle(mesh, a, b + 1, a + 1);
    }
}

constexpr glm::dvec3 kHall{40.0, 10.0, 24.0};  // extents of the hall, from the origin
constexpr glm::dvec3 kX{1.0, 0.0, 0.0}, kY{0.0, 1.0, 0.0}, kZ{0.0, 0.0, 1.0};

/// Makes a hall. A third of the triangles each goes to round columns in rows, to beams under the ceiling, most of them
/// slanting, and to tilted slats before the windows.
Mesh hall(std::uint32_t count) {
    Mesh mesh;
    Random random(1);
    // The negative sign turns the box inside out: the walls are seen from within.
    add_box(mesh, 0.5 * kHall, -0.5 * kHall.x * kX, 0.5 * kHall.y * kY, 0.5 * kHall.z * kZ);
    const int rows = count < 5000 ? 2 : 4, columns_in_row = rows * 3 / 2;
    const int sides = std::max(8, static_cast<int>(count / 3 / (2 * rows * columns_in_row)));
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns_in_row; ++i)
            add_column(mesh, {kHall.x * (i + 0.5) / columns_in_row, 0.0, kHall.z * (j + 0.5) / rows}, 0.35, kHall.y,
                       sides);
    const int boxes = static_cast<int>(count / 3 / 12);
    for (int i = 0; i < boxes; ++i) {
        const double angle = random.between(-0.4, 0.4);
        const glm::dvec3 along(std::sin(angle), 0.0, std::cos(angle)), aside(along.z, 0.0, -along.x);
        // Braces, because the order of evaluation of arguments in parentheses is not defined.
        const glm::dvec3 center{kHall.x * (i + 0.5) / boxes, random.between(8.5, 9.8), random.between(4.0, 20.0)};
        add_box(mesh, center, 0.04 * aside, 0.06 * kY, random.between(1.0, 6.0) * along);
    }
    constexpr int kSlatsInBlind = 100;
    const int blinds = std::max(1, boxes / kSlatsInBlind);
    for (int i = 0; i < boxes; ++i) {
        const double angle = 0.6 + 0.5 * std::sin(i / kSlatsInBlind);
        const glm::dvec3 across(0.0, std::sin(angle), std::cos(angle)), up(0.0, across.z, -across.y);
        const int blind = std::min(i / kSlatsInBlind, blinds - 1);
        const glm::dvec3 center(kHall.x * (blind + 0.5) / blinds, 1.0 + 7.0 * (i % kSlatsInBlind + 0.5) / kSlatsInBlind,
                                0.4);
        add_box(mesh, center, 0.45 * kHall.x / blinds * kX, 0.001 * up, 0.03 * across);
    }
    return mesh;
}

void look_into_hall(Scene& scene) {
    Camera camera;
    camera.position = {1.0f, 4.5f, 23.0f};
    camera.gaze = {38.0f, 0.5f, -22.0f};
    camera.left = camera.bottom = -0.7f;
    camera.right = camera.top = 0.7f;
    scene.cameras = {camera};
    Light lamp;
    lamp.point = {{20.0f, 6.0f, 12.0f}, glm::vec3(40000.0f)};
    scene.lights = {lamp};
}

/// Makes icosahedra of different sizes, rotated at random.
Mesh many_objects(std::uint32_t count) {
    constexpr double kGolden = 1.6180339887498949;
    constexpr glm::dvec3 kCorners[12] = {{-1, kGolden, 0}, {1, kGolden, 0}, {-1, -kGolden, 0}, {1, -kGolden, 0},
                                         {0, -1, kGolden}, {0, 1, kGolden}, {0, -1, -kGolden}, {0, 1, -kGolden},
                                         {kGolden, 0, -1}, {kGolden, 0, 1}, {-kGolden, 0, -1}, {-kGolden, 0, 1}};
    constexpr std::uint32_t kFaces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                             {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                             {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                             {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const std::uint32_t objects = std::max(1u, count / 20);
    const double spacing = std::cbrt(1.0 / objects);
    Mesh mesh;
    Random random(1);
    for (std::uint32_t i = 0; i < objects; ++i) {
        const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
        const glm::dvec3 center = random.in_box(glm::dvec3(0.0), glm::dvec3(1.0));
        const double size = spacing * random.between(0.05, 0.25), angle = random.between(0.0, 2.0 * kPi);
        const double c = std::cos(angle), s = std::sin(angle);
        for (const glm::dvec3& p : kCorners)
            mesh.positions.emplace_back(center + size * glm::dvec3(c * p.x - s * p.y, s * p.x + c * p.y, p.z));
        for (const auto& face : kFaces) add_triangle(mesh, first + face[0], first + face[1], first + face[2]);
    }
    return mesh;
}

std::vector<Sphere> many_spheres(std::uint32_t count) {
    const double spacing = std::cbrt(1.0 / count);
    std::vector<Sphere> spheres(count);
    Random random(1);
    for (Sphere& sphere : spheres) {
        sphere.center = random.in_box(glm::dvec3(0.0), glm::dvec3(1.0));
        sphere.radius = static_cast<float>(spacing * random.between(0.1, 0.5));
    }
    return spheres;
}

/// Places a unit sphere's content in a cell of a cubic grid, rotated at random and scaled by 1/2 to 1. Cells are so
/// wide that neighbours do not meet.
Transform place_on_grid(std::uint32_t number, std::uint32_t side, Random& random) {
    constexpr double kSpacing = 2.6;
    const glm::dvec3 cell(number % side, number / side % side, number / (side * side));
    const double z = random.between(-1.0, 1.0), around = random.between(0.0, 2.0 * kPi),
                 scale = random.between(0.5, 1.0);
    const double r = std::sqrt(1.0 - z * z);
    const glm::dvec3 a(r * std::cos(around), r * std::sin(around), z);
    const glm::dvec3 b = glm::normalize(glm::cross(a, std::abs(z) < 0.5 ? kZ : kX)), c = glm::cross(a, b);
    return Transform(glm::vec3(scale * a), glm::vec3(scale * b), glm::vec3(scale * c), glm::vec3(kSpacing * cell));
}

/// Adds instances of the first mesh: `count` placements with the mesh itself.
void place_often(Scene& scene, std::uint32_t count) {
    const auto side = static_cast<std::uint32_t>(std::ceil(std::cbrt(count) - 1e-9));
    Random random(1);
    for (std::uint32_t i = 1; i < count; ++i) scene.instances.push_back({0, place_on_grid(i, side, random), 0});
}

template <class T>
void append(std::vector<std::byte>& bytes, const T& value) {
    const auto* begin = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), begin, begin + sizeof value);
}

std::vector<std::byte> ply(const Mesh& mesh) {
    static_assert(std::endian::native == std::endian::little && sizeof(glm::vec3) == 12 && sizeof(glm::uvec3) == 12);
    const std::string header = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
        "z\n"
        "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.size(), mesh.triangles.size());
    std::vector<std::byte> bytes(header.size());
    std::memcpy(bytes.data(), header.data(), header.size());
    bytes.reserve(header.size() + 12 * mesh.positions.size() + 13 * mesh.triangles.size());
    for (const glm::vec3& position : mesh.positions) append(bytes, position);
    for (const glm::uvec3& triangle : mesh.triangles) {
        append(bytes, std::uint8_t{3});
        append(bytes, triangle);
    }
    return bytes;
}

/// Returns the material and the camera as XML. Nine digits tell every float from its neighbours.
std::string camera_xml(const Scene& scene) {
    std::string text =
        "<Scene>\n<Materials><Material id=\"1\"><DiffuseReflectance>1 1 "
        "1</DiffuseReflectance></Material></Materials>\n";
    const Camera& camera = scene.cameras[0];
    text += fmt::format(
        "<Cameras><Camera><Position>{:.9g} {:.9g} {:.9g}</Position><Gaze>{:.9g} {:.9g} {:.9g}</Gaze><Up>{:.9g} {:.9g} "
        "{:.9g}</Up>"
        "<NearPlane>{:.9g} {:.9g} {:.9g} {:.9g}</NearPlane><NearDistance>{:.9g}</NearDistance>"
        "<ImageResolution>{} {}</ImageResolution><ImageName>scene.png</ImageName></Camera></Cameras>\n",
        camera.position.x, camera.position.y, camera.position.z, camera.gaze.x, camera.gaze.y, camera.gaze.z,
        camera.up.x, camera.up.y, camera.up.z, camera.left, camera.right, camera.bottom, camera.top, camera.distance,
        camera.width, camera.height);
    return text;
}

std::string instances_xml(const Scene& scene, const std::string& mesh_file) {
    std::string transforms, objects;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        std::string rows;
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column)
                rows += fmt::format("{:.9g} ", scene.instances[i].transform[column][row]);
        transforms += fmt::format("<Composite id=\"{}\">{}0 0 0 1</Composite>\n", i + 1, rows);
        objects += fmt::format(
            "<MeshInstance id=\"{}\" baseMeshId=\"1\"><Transformations>c{}</Transformations></MeshInstance>\n", i + 2,
            i + 1);
    }
    return camera_xml(scene) + "<Transformations>\n" + transforms + "</Transformations>\n<Objects>\n" +
           fmt::format("<Mesh id=\"1\"><Material>1</Material><Faces plyFile=\"{}\"/></Mesh>\n", mesh_file) + objects +
           "</Objects>\n</Scene>\n";
}

std::string spheres_xml(const Scene& scene) {
    std::string text = camera_xml(scene) + "<VertexData>\n";
    for (const Sphere& sphere : scene.spheres)
        text += fmt::format("{:.9g} {:.9g} {:.9g}\n", sphere.center.x, sphere.center.y, sphere.center.z);
    text += "</VertexData>\n<Objects>\n";
    for (std::size_t i = 0; i < scene.spheres.size(); ++i)
        text += fmt::format(
            "<Sphere id=\"{0}\"><Material>1</Material><Center>{0}</Center><Radius>{1:.9g}</Radius></Sphere>\n", i + 1,
            scene.spheres[i].radius);
    return text + "</Objects>\n</Scene>\n";
}

}  // namespace

std::optional<GeneratedScene> generated_scene_from_string(std::string_view word) {
    const std::string_view name = word.substr(0, word.find(':'));
    const auto* info =
        std::find_if(std::begin(kKinds), std::end(kKinds), [&](const KindInfo& k) { return k.name == name; });
    if (info == std::end(kKinds)) return std::nullopt;
    if (name.size() == word.size()) return GeneratedScene{info->kind, info->standard_count, 0};
    const auto number_of = [&](const char* what, std::string_view digits, std::uint32_t least, std::uint32_t most) {
        std::uint32_t count = 0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
        if (error != std::errc() || end != digits.data() + digits.size() || count < least || count > most)
            throw UsageError(fmt::format("\"{}\": the number of {} is \"{}\"; it must be from {} to {}", word, what,
                                         digits, least, most));
        return count;
    };
    std::string_view counts = word.substr(name.size() + 1);
    GeneratedScene generated{info->kind, info->standard_count, 0};
    if (info->kind == GeneratedKind::instances) {
        const std::string_view instances = counts.substr(0, counts.find('x'));
        generated.instance_count = number_of("instances", instances, 1, kMostInstances);
        if (instances.size() == counts.size()) return generated;
        counts.remove_prefix(instances.size() + 1);
    }
    generated.primitive_count = number_of("primitives", counts, kLeastCount, kMostCount);
    return generated;
}

std::vector<std::string> scene_set(std::string_view word) {
    if (word != "standard" && word != "small")
        throw UsageError(fmt::format("there is no set of scenes \"{}\"; there are standard and small", word));
    std::vector<std::string> words;
    for (const KindInfo& info : kKinds)
        if (info.small_count > 0)
            words.push_back(fmt::format("{}:{}", info.name, word == "small" ? info.small_count : info.standard_count));
    return words;
}

Scene generate_scene(const GeneratedScene& generated) {
    const std::uint32_t count =
        generated.primitive_count ? generated.primitive_count : info_of(generated.kind).standard_count;
    Scene scene;
    switch (generated.kind) {
        case GeneratedKind::scan:
            scene.meshes = {bumpy_sphere(count)};
            break;
        case GeneratedKind::interior:
            scene.meshes = {hall(count)};
            break;
        case GeneratedKind::objects:
            scene.meshes = {many_objects(count)};
            break;
        case GeneratedKind::spheres:
            scene.spheres = many_spheres(count);
            break;
        case GeneratedKind::instances:
            scene.meshes = {bumpy_sphere(count)};
            place_often(scene, generated.instance_count ? generated.instance_count : kInstances);
            break;
    }
    add_default_view(scene);
    if (generated.kind == GeneratedKind::interior) look_into_hall(scene);
    return scene;
}

std::filesystem::path save_generated_scene(const std::filesystem::path& stem, const Scene& scene) {
    std::filesystem::path file = stem;
    if (scene.meshes.empty()) {
        file += ".xml";
        const std::string text = spheres_xml(scene);
        write_file_atomically(file, std::as_bytes(std::span(text)));
    } else {
        file += ".ply";
        write_file_atomically(file, ply(scene.meshes[0]));
        if (scene.instances.empty()) return file;
        const std::string text = instances_xml(scene, file.filename().string());
        file.replace_extension(".xml");
        write_file_atomically(file, std::as_bytes(std::span(text)));
    }
    return file;
}

}  // namespace castor
