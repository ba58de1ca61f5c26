#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "scene/material_variants.h"
#include "scene/obj_reader.h"
#include "scene/ply_reader.h"
#include "scene/xml_files.h"
#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"
#include "scene/xml_vertices.h"

namespace castor {

namespace {

class ObjectReader {
public:
    ObjectReader(XmlDocument& document, const XmlMaterialIds& ids, const XmlVertexData& vertices,
                 const XmlTransforms& transforms, XmlTextures& textures, Scene& scene)
        : document_(document),
          ids_(ids),
          vertices_(document, vertices),
          transforms_(transforms),
          textures_(textures),
          scene_(scene),
          variants_(scene.materials) {}

    /// Reads an object. An instance is put off until `read_instances`; an element that is no object is ignored.
    void read(pugi::xml_node element);
    /// Returns the size of the file that an object names; 0 if it names none. Called before any object is read.
    std::uintmax_t file_bytes(pugi::xml_node element) const;
    /// Reads the instances. Called after all objects are read, since an instance may precede its base.
    void read_instances();

private:
    /// The meshes that an instance places, with the transformation of its base.
    struct Base {
        std::size_t first_mesh = 0;
        std::size_t mesh_count = 0;
        glm::dmat4 matrix{1.0};
        std::optional<std::uint32_t> material;               // nullopt: each mesh has its own
        std::optional<std::vector<std::uint32_t>> textures;  // likewise
    };

    void read_mesh(pugi::xml_node element);
    void read_light_mesh(pugi::xml_node element);
    void read_light_sphere(pugi::xml_node element);
    void add_light(Light::Kind kind, std::size_t object, pugi::xml_node element);
    void read_faces(pugi::xml_node faces, Mesh& mesh);
    void read_ply_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth);
    void take_materials(Scene& object);
    void read_obj_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth);
    void read_triangle(pugi::xml_node element);
    Base read_instance(pugi::xml_node element);
    Base find_base(pugi::xml_node element);
    void place(pugi::xml_node element, std::size_t first_mesh);
    void keep_base(pugi::xml_node element, std::size_t first_mesh);
    void read_sphere(pugi::xml_node element);
    void read_plane(pugi::xml_node element);
    void read_cylinder(pugi::xml_node element);
    void move(Plane& plane, pugi::xml_node element);

    std::uint32_t read_material(pugi::xml_node element);
    std::uint32_t read_material_use(pugi::xml_node element);
    std::uint32_t find_variant(pugi::xml_node element, std::uint32_t material);
    void check_coordinates(pugi::xml_node element, Mesh& mesh, bool lacks_some);
    bool has_image(std::uint32_t material) const;
    glm::vec3 read_motion(pugi::xml_node element);
    std::int64_t read_offset(pugi::xml_node faces, const char* attribute);
    glm::vec3 read_vertex(pugi::xml_node element, const char* name);
    std::filesystem::path find_file(pugi::xml_node faces, const char* attribute);

    XmlDocument& document_;
    const XmlMaterialIds& ids_;
    XmlVertices vertices_;
    const XmlTransforms& transforms_;
    XmlTextures& textures_;
    Scene& scene_;
    MaterialVariants variants_;
    std::optional<std::uint32_t> black_;                // the material of lamps that name none
    std::map<std::int64_t, Base> meshes_;               // by id
    std::map<std::int64_t, pugi::xml_node> instances_;  // by id
    std::vector<pugi::xml_node> waiting_instances_;
    std::vector<pugi::xml_node> open_instances_;  // whose bases are being looked up
    bool last_mesh_is_triangles_ = false;         // then the next <Triangle> may join it
};

void ObjectReader::read(pugi::xml_node element) {
    document_.reach(element.name());
    const std::string_view name = element.name();
    if (name == "Mesh") {
        const std::size_t first_mesh = scene_.meshes.size();
        read_mesh(element);
        place(element, first_mesh);
        keep_base(element, first_mesh);
    } else if (name == "MeshInstance") {
        waiting_instances_.push_back(element);
        instances_.emplace(read_integer_attribute(document_, element, "id", 0), element);
    } else if (name == "Triangle")
        read_triangle(element);
    else if (name == "LightMesh")
        read_light_mesh(element);
    else if (name == "LightSphere")
        read_light_sphere(element);
    else if (name == "Sphere")
        read_sphere(element);
    else if (name == "Plane")
        read_plane(element);
    else if (name == "Cylinder")
        read_cylinder(element);
}

bool is_lamp(pugi::xml_node element) {
    return element.name() == std::string_view("LightMesh") || element.name() == std::string_view("LightSphere");
}

std::uint32_t ObjectReader::read_material(pugi::xml_node element) {
    if (is_lamp(element) && !element.child("Material")) {  // it has no use of one
        if (!black_) {
            black_ = static_cast<std::uint32_t>(scene_.materials.size());
            scene_.materials.emplace_back();
        }
        return *black_;
    }
    const std::int64_t id = require_integer(document_, element, "Material");
    const auto found = ids_.find(id);
    if (found == ids_.end())
        document_.fail(element.child("Material"),
                       fmt::format("the material {} does not exist: {}", id, list_ids(ids_, "materials")));
    return found->second;
}

/// Returns a material as the object uses it.
std::uint32_t ObjectReader::find_variant(pugi::xml_node element, std::uint32_t material) {
    MaterialUse use{material, textures_.of(element)};
    if (is_lamp(element)) {
        use.emission = require_vec3(document_, element, "Radiance");
        check_child(document_, glm::all(glm::greaterThanEqual(use.emission, glm::vec3(0.0f))), element, "Radiance",
                    "three numbers of at least 0");
    }
    return variants_.find(use);
}

std::uint32_t ObjectReader::read_material_use(pugi::xml_node element) {
    return find_variant(element, read_material(element));
}

/// Returns how far an object moves while the shutter is open.
glm::vec3 ObjectReader::read_motion(pugi::xml_node element) {
    return read_vec3(document_, element, "MotionBlur", glm::vec3(0.0f));
}

bool ObjectReader::has_image(std::uint32_t material) const {
    const std::vector<std::uint32_t>& textures = scene_.materials[material].textures;
    return std::any_of(textures.begin(), textures.end(),
                       [&](std::uint32_t t) { return scene_.textures[t].kind == TextureKind::image; });
}

/// Warns if vertices of a mesh with a picture have no place in it.
void ObjectReader::check_coordinates(pugi::xml_node element, Mesh& mesh, bool lacks_some) {
    if (lacks_some && has_image(mesh.material))
        document_.warn(element, fmt::format("<{}> has a texture with an image, but vertices without texture "
                                            "coordinates: (0, 0) is used",
                                            element.name()));
}

glm::vec3 ObjectReader::read_vertex(pugi::xml_node element, const char* name) {
    const std::int64_t number = require_integer(document_, element, name);
    return vertices_.position(vertices_.find(number, 0, element.child(name).name()));
}

void ObjectReader::read_mesh(pugi::xml_node element) {
    document_.expect_attributes(element, {"shadingMode"});
    document_.expect_children(element, {"Material", "Faces", "Transformations", "MotionBlur", "Textures", "Texture",
                                        element.name() == std::string_view("LightMesh") ? "Radiance" : "Material"});
    const bool smooth =
        read_word_attribute(document_, element, "shadingMode", false, {{"flat", false}, {"smooth", true}});
    const pugi::xml_node faces = require_child(document_, element, "Faces");
    last_mesh_is_triangles_ = false;
    if (faces.attribute("plyFile")) return read_ply_mesh(element, faces, smooth);
    if (faces.attribute("objFile")) return read_obj_mesh(element, faces, smooth);

    Mesh mesh;
    mesh.line = document_.line(element);
    mesh.material = read_material_use(element);
    read_faces(faces, mesh);
    check_coordinates(element, mesh, vertices_.lacks_coordinates());
    if (mesh.triangles.empty()) document_.warn(faces, "<Faces> is empty: the mesh has no triangle");
    if (smooth) compute_smooth_normals(mesh);
    scene_.meshes.push_back(std::move(mesh));
}

void ObjectReader::add_light(Light::Kind kind, std::size_t object, pugi::xml_node element) {
    Light light;
    light.kind = kind;
    light.object.object = static_cast<std::uint32_t>(object);
    light.line = document_.line(element);
    light.names = names_of_light(element);
    scene_.lights.push_back(std::move(light));
}

void ObjectReader::read_light_mesh(pugi::xml_node element) {
    const std::size_t first_mesh = scene_.meshes.size();
    read_mesh(element);
    place(element, first_mesh);
    for (std::size_t i = first_mesh; i < scene_.meshes.size(); ++i)
        if (!scene_.meshes[i].triangles.empty()) add_light(Light::Kind::mesh, i, element);
}

void ObjectReader::read_light_sphere(pugi::xml_node element) {
    read_sphere(element);
    add_light(Light::Kind::sphere, scene_.spheres.size() - 1, element);
}

/// Returns what is added to the indices of faces.
std::int64_t ObjectReader::read_offset(pugi::xml_node faces, const char* attribute) {
    const std::int64_t offset = read_integer_attribute(document_, faces, attribute, 0);
    constexpr std::int64_t kMostOffset = std::numeric_limits<std::uint32_t>::max();
    if (offset < -kMostOffset || offset > kMostOffset)
        document_.fail(
            faces, fmt::format("the {} {} is out of range: at most {} was expected", attribute, offset, kMostOffset));
    return offset;
}

void ObjectReader::read_faces(pugi::xml_node faces, Mesh& mesh) {
    document_.expect_attributes(faces, {"type", "vertexOffset", "textureOffset", "binaryFile"});
    document_.expect_text(faces);
    if (faces.attribute("binaryFile"))
        document_.fail(faces, "binaryFile of <Faces> is not supported: use plyFile, or vertex ids as text");
    read_word_attribute(document_, faces, "type", 0, {{"triangle", 0}});
    const std::int64_t offset = read_offset(faces, "vertexOffset");
    vertices_.begin_mesh(read_offset(faces, "textureOffset") - offset);

    XmlNumbers numbers(document_, faces);
    std::int64_t number = 0;
    while (numbers.next(number)) {
        glm::uvec3 triangle;
        for (int corner = 0; corner < 3; ++corner) {
            if (corner > 0 && !numbers.next(number))
                document_.fail(numbers.where(), fmt::format("<Faces> ends within a triangle, after {} whole ones: "
                                                            "three vertex ids a triangle were expected",
                                                            mesh.triangles.size()));
            triangle[corner] = vertices_.add(mesh, vertices_.find(number, offset, numbers.where()));
        }
        mesh.triangles.push_back(triangle);
    }
}

/// Returns the path that an attribute names, with a warning if it leads out of the scene's folder.
std::filesystem::path ObjectReader::find_file(pugi::xml_node faces, const char* attribute) {
    const pugi::xml_attribute name = faces.attribute(attribute);
    const std::filesystem::path file = path_beside(document_, name.value());
    std::error_code ignored;
    if (*name.value() == '\0' || !std::filesystem::exists(file, ignored))
        document_.fail(name.name(),
                       fmt::format("the file '{}' that {} names does not exist", file.string(), attribute));
    warn_if_outside(document_, name.name(), file, attribute);
    return file;
}

std::uintmax_t ObjectReader::file_bytes(pugi::xml_node element) const {
    const pugi::xml_node faces = element.child("Faces");
    for (const char* attribute : {"plyFile", "objFile"})
        if (const pugi::xml_attribute name = faces.attribute(attribute))
            return size_or_zero(path_beside(document_, name.value()));
    return 0;
}

void ObjectReader::read_ply_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth) {
    document_.expect_attributes(faces, {"plyFile"});
    document_.expect_children(faces, {});
    const std::uint32_t material = read_material_use(element);
    const std::filesystem::path file = find_file(faces, "plyFile");
    Mesh mesh = read_ply(file, document_.next_file(size_or_zero(file)));
    mesh.line = document_.line(element);
    mesh.material = material;
    mesh.normals.clear();  // the XML format ignores nx ny nz
    check_coordinates(element, mesh, mesh.texture_coordinates.empty());
    if (smooth) compute_smooth_normals(mesh);
    scene_.meshes.push_back(std::move(mesh));
}

/// Appends the materials of an OBJ file, with their textures and images.
void ObjectReader::take_materials(Scene& object) {
    const auto first_image = static_cast<std::uint32_t>(scene_.images.size());
    const auto first_texture = static_cast<std::uint32_t>(scene_.textures.size());
    std::move(object.images.begin(), object.images.end(), std::back_inserter(scene_.images));
    for (Texture& texture : object.textures) {
        texture.image += first_image;
        scene_.textures.push_back(texture);
    }
    for (Material& material : object.materials) {
        for (std::uint32_t& texture : material.textures) texture += first_texture;
        scene_.materials.push_back(std::move(material));
    }
}

void ObjectReader::read_obj_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth) {
    document_.expect_attributes(faces, {"objFile"});
    document_.expect_children(faces, {});
    std::optional<std::uint32_t> material;
    if (element.child("Material")) material = read_material(element);
    const std::filesystem::path file = find_file(faces, "objFile");
    Scene object = read_obj(file, document_.next_file(size_or_zero(file)), smooth);
    const auto first_material = static_cast<std::uint32_t>(scene_.materials.size());
    if (!material) take_materials(object);
    scene_.warnings.insert(scene_.warnings.end(), object.warnings.begin(), object.warnings.end());
    for (Mesh& mesh : object.meshes) {
        mesh.line = document_.line(element);
        mesh.material = find_variant(element, material ? *material : first_material + mesh.material);
        check_coordinates(element, mesh, mesh.texture_coordinates.empty());
        if (!smooth) mesh.normals.clear();
        scene_.meshes.push_back(std::move(mesh));
    }
}

/// Gives the meshes of an object its transformations and motion.
void ObjectReader::place(pugi::xml_node element, std::size_t first_mesh) {
    const Transform transform = to_transform(transforms_.of(element));
    const glm::vec3 motion = read_motion(element);
    for (std::size_t i = first_mesh; i < scene_.meshes.size(); ++i) {
        scene_.meshes[i].transform = transform;
        scene_.meshes[i].motion = motion;
    }
}

/// Keeps the meshes of an object for instances. Of several objects with one id, the first is kept.
void ObjectReader::keep_base(pugi::xml_node element, std::size_t first_mesh) {
    const Base base{first_mesh, scene_.meshes.size() - first_mesh, transforms_.of(element), {}, {}};
    if (element.attribute("id")) meshes_.emplace(read_integer_attribute(document_, element, "id", 0), base);
}

/// Finds the base of an instance, among the meshes first: instances may have the ids of meshes.
ObjectReader::Base ObjectReader::find_base(pugi::xml_node element) {
    if (!element.attribute("baseMeshId")) document_.fail(element, "<MeshInstance> has no baseMeshId");
    const std::int64_t id = read_integer_attribute(document_, element, "baseMeshId", 0);
    if (const auto mesh = meshes_.find(id); mesh != meshes_.end()) return mesh->second;
    const auto instance = instances_.find(id);
    if (instance == instances_.end())
        document_.fail(element, fmt::format("the baseMeshId {} is neither a mesh nor an instance of the scene", id));
    if (std::find(open_instances_.begin(), open_instances_.end(), instance->second) != open_instances_.end())
        document_.fail(element, fmt::format("the baseMeshId {} leads back to this instance itself", id));
    return read_instance(instance->second);
}

ObjectReader::Base ObjectReader::read_instance(pugi::xml_node element) {
    constexpr std::size_t kMostNested = 1000;
    if (open_instances_.size() == kMostNested)
        document_.fail(element, fmt::format("instances of instances are nested more than {} deep", kMostNested));
    open_instances_.push_back(element);
    Base base = find_base(element);
    open_instances_.pop_back();
    const bool resets =
        read_word_attribute(document_, element, "resetTransform", false, {{"false", false}, {"true", true}});
    const glm::dmat4 own = transforms_.of(element);
    base.matrix = resets ? own : own * base.matrix;
    if (element.child("Material")) base.material = read_material(element);
    if (element.child("Textures") || element.child("Texture")) base.textures = textures_.of(element);
    return base;
}

void ObjectReader::read_instances() {
    for (const pugi::xml_node element : waiting_instances_) {
        document_.expect_attributes(element, {"baseMeshId", "resetTransform"});
        document_.expect_children(element, {"Material", "Transformations", "MotionBlur", "Textures", "Texture"});
        const Base base = read_instance(element);
        const glm::vec3 motion = read_motion(element);
        for (std::size_t i = base.first_mesh; i < base.first_mesh + base.mesh_count; ++i) {
            MaterialUse use = variants_.use_of(scene_.meshes[i].material);
            if (base.material) use.material = *base.material;
            if (base.textures) use.textures = *base.textures;
            scene_.instances.push_back({static_cast<std::uint32_t>(i), to_transform(base.matrix), variants_.find(use),
                                        document_.line(element), motion});
        }
    }
}

void ObjectReader::read_triangle(pugi::xml_node element) {
    document_.expect_attributes(element);
    document_.expect_children(element, {"Material", "Indices", "Transformations", "MotionBlur", "Textures", "Texture"});
    const std::uint32_t material = read_material_use(element);
    const glm::vec3 motion = read_motion(element);
    const Transform transform = to_transform(transforms_.of(element));
    const pugi::xml_node indices = require_child(document_, element, "Indices");
    const auto numbers = read_numbers<std::int64_t, 3>(document_, indices);
    if (!last_mesh_is_triangles_ || scene_.meshes.back().material != material ||
        scene_.meshes.back().transform != transform || scene_.meshes.back().motion != motion) {
        vertices_.begin_mesh();
        Mesh& mesh = scene_.meshes.emplace_back();
        mesh.material = material;
        mesh.line = document_.line(element);
        mesh.transform = transform;
        mesh.motion = motion;
        last_mesh_is_triangles_ = true;
    }
    Mesh& mesh = scene_.meshes.back();
    glm::uvec3 triangle;
    for (int corner = 0; corner < 3; ++corner)
        triangle[corner] =
            vertices_.add(mesh, vertices_.find(numbers[static_cast<std::size_t>(corner)], 0, indices.name()));
    mesh.triangles.push_back(triangle);
    check_coordinates(element, mesh, vertices_.lacks_coordinates());
}

void ObjectReader::read_sphere(pugi::xml_node element) {
    document_.expect_attributes(element);
    document_.expect_children(element,
                              {"Material", "Center", "Radius", "Transformations", "MotionBlur", "Textures", "Texture",
                               element.name() == std::string_view("LightSphere") ? "Radiance" : "Material"});
    Sphere sphere;
    sphere.transform = to_transform(transforms_.of(element));
    sphere.line = document_.line(element);
    sphere.material = read_material_use(element);
    sphere.motion = read_motion(element);
    sphere.center = read_vertex(element, "Center");
    sphere.radius = require_float(document_, element, "Radius");
    check_child(document_, sphere.radius > 0.0f, element, "Radius", "a positive number");
    scene_.spheres.push_back(sphere);
}

void ObjectReader::move(Plane& plane, pugi::xml_node element) {
    const glm::dmat4 matrix = transforms_.of(element);
    if (matrix == glm::dmat4(1.0)) return;
    if (glm::determinant(matrix) == 0.0)
        document_.fail(element.child("Transformations"), "the transformations of <Plane> have no inverse");
    plane.point = glm::vec3(matrix * glm::dvec4(plane.point, 1.0));
    plane.normal =
        glm::vec3(glm::normalize(glm::transpose(glm::inverse(glm::dmat3(matrix))) * glm::dvec3(plane.normal)));
}

void ObjectReader::read_plane(pugi::xml_node element) {
    const char* const point = element.child("Center") && !element.child("Point") ? "Center" : "Point";
    document_.expect_attributes(element);
    document_.expect_children(element, {"Material", point, "Normal", "Transformations", "Textures", "Texture"});
    Plane plane;
    plane.line = document_.line(element);
    plane.material = read_material_use(element);
    plane.point = read_vertex(element, point);
    plane.normal = require_direction(document_, element, "Normal");
    move(plane, element);
    scene_.planes.push_back(plane);
}

/// Makes a cylinder of triangles: a side with the normals of the cylinder, and two flat caps.
void ObjectReader::read_cylinder(pugi::xml_node element) {
    constexpr std::uint32_t kSides = 512;  // the surface is at most 2e-5 radii off
    document_.expect_attributes(element);
    document_.expect_children(element, {"Material", "Center", "Axis", "Radius", "Height", "Transformations",
                                        "MotionBlur", "Textures", "Texture"});
    const glm::dvec3 centre = read_vertex(element, "Center");
    const glm::dvec3 axis = glm::normalize(glm::dvec3(require_direction(document_, element, "Axis")));
    const float radius = require_float(document_, element, "Radius"),
                height = require_float(document_, element, "Height");
    check_child(document_, radius > 0.0f, element, "Radius", "a positive number");
    check_child(document_, height > 0.0f, element, "Height", "a positive number");
    const glm::dvec3 across =
        glm::normalize(glm::cross(axis, std::abs(axis.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0)));
    const glm::dvec3 up = 0.5 * double{height} * axis, other = glm::cross(axis, across);

    Mesh side, caps;
    caps.positions = {glm::vec3(centre - up), glm::vec3(centre + up)};
    for (std::uint32_t i = 0; i < kSides; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / kSides;
        const glm::dvec3 outward = std::cos(angle) * across + std::sin(angle) * other;
        const std::uint32_t lower = 2 * i, next = 2 * ((i + 1) % kSides);
        for (const glm::dvec3& end : {centre - up, centre + up}) {
            side.positions.push_back(glm::vec3(end + double{radius} * outward));
            side.normals.push_back(glm::vec3(outward));
            caps.positions.push_back(side.positions.back());
        }
        side.triangles.insert(side.triangles.end(), {{lower, next, next + 1}, {lower, next + 1, lower + 1}});
        caps.triangles.insert(caps.triangles.end(), {{0, next + 2, lower + 2}, {1, lower + 3, next + 3}});
    }
    const std::size_t first_mesh = scene_.meshes.size();
    side.material = caps.material = read_material_use(element);
    side.line = caps.line = document_.line(element);
    check_coordinates(element, side, true);
    scene_.meshes.push_back(std::move(side));
    scene_.meshes.push_back(std::move(caps));
    place(element, first_mesh);
    last_mesh_is_triangles_ = false;
}

}  // namespace

void read_objects(XmlDocument& document, const XmlMaterialIds& ids, const XmlVertexData& vertices,
                  const XmlTransforms& transforms, XmlTextures& textures, Scene& scene) {
    ObjectReader reader(document, ids, vertices, transforms, textures, scene);
    std::uintmax_t file_bytes = 0;
    for (const pugi::xml_node container : document.root().children("Objects"))
        for (const pugi::xml_node element : container.children()) file_bytes += reader.file_bytes(element);
    document.expect_file_bytes(file_bytes);
    for (const pugi::xml_node container : document.root().children("Objects")) {
        document.expect_attributes(container);
        document.expect_children(
            container, {},
            {"Mesh", "MeshInstance", "Triangle", "Sphere", "Plane", "Cylinder", "LightMesh", "LightSphere"});
        for (const pugi::xml_node element : container.children()) reader.read(element);
    }
    reader.read_instances();
}

}  // namespace castor
