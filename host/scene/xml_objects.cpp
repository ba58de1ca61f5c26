#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "scene/obj_reader.h"
#include "scene/ply_reader.h"
#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"
#include "scene/xml_vertices.h"

namespace castor {

namespace {

class ObjectReader {
public:
    ObjectReader(XmlDocument& document, const XmlMaterialIds& ids, const std::vector<glm::vec3>& vertices,
                 const XmlTransforms& transforms, Scene& scene)
        : document_(document), ids_(ids), vertices_(document, vertices), transforms_(transforms), scene_(scene) {}

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
        std::optional<std::uint32_t> material;  // nullopt: each mesh has its own
    };

    void read_mesh(pugi::xml_node element);
    void read_faces(pugi::xml_node faces, Mesh& mesh);
    void read_ply_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth);
    void read_obj_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth);
    void read_triangle(pugi::xml_node element);
    Base read_instance(pugi::xml_node element);
    Base find_base(pugi::xml_node element);
    void keep_base(pugi::xml_node element, std::size_t first_mesh);
    void read_sphere(pugi::xml_node element);
    void read_plane(pugi::xml_node element);
    void move(Plane& plane, pugi::xml_node element);

    std::uint32_t read_material(pugi::xml_node element);
    glm::vec3 read_vertex(pugi::xml_node element, const char* name);
    std::filesystem::path find_file(pugi::xml_node faces, const char* attribute);
    std::filesystem::path path_of(const char* name) const;
    std::uintmax_t size_of(const std::filesystem::path& file) const;

    XmlDocument& document_;
    const XmlMaterialIds& ids_;
    XmlVertices vertices_;
    const XmlTransforms& transforms_;
    Scene& scene_;
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
        keep_base(element, first_mesh);
    } else if (name == "MeshInstance") {
        waiting_instances_.push_back(element);
        instances_.emplace(read_integer_attribute(document_, element, "id", 0), element);
    } else if (name == "Triangle")
        read_triangle(element);
    else if (name == "Sphere")
        read_sphere(element);
    else if (name == "Plane")
        read_plane(element);
}

std::string list_ids(const XmlMaterialIds& ids) {
    constexpr std::size_t kMost = 10;
    std::string list;
    std::size_t count = 0;
    for (const auto& [id, place] : ids) {
        if (count++ == kMost) return fmt::format("the ids of the {} materials begin with {}", ids.size(), list);
        list += fmt::format("{}{}", list.empty() ? "" : ", ", id);
    }
    return ids.empty() ? "the scene has no materials" : fmt::format("the scene has {}", list);
}

std::uint32_t ObjectReader::read_material(pugi::xml_node element) {
    const std::int64_t id = require_integer(document_, element, "Material");
    const auto found = ids_.find(id);
    if (found == ids_.end())
        document_.fail(element.child("Material"),
                       fmt::format("the material {} does not exist: {}", id, list_ids(ids_)));
    return found->second;
}

glm::vec3 ObjectReader::read_vertex(pugi::xml_node element, const char* name) {
    const std::int64_t number = require_integer(document_, element, name);
    return vertices_.position(vertices_.find(number, 0, element.child(name).name()));
}

void ObjectReader::read_mesh(pugi::xml_node element) {
    document_.expect_attributes(element, {"shadingMode"});
    document_.expect_children(element, {"Material", "Faces", "Transformations"});
    const bool smooth =
        read_word_attribute(document_, element, "shadingMode", false, {{"flat", false}, {"smooth", true}});
    const pugi::xml_node faces = require_child(document_, element, "Faces");
    last_mesh_is_triangles_ = false;
    if (faces.attribute("plyFile")) return read_ply_mesh(element, faces, smooth);
    if (faces.attribute("objFile")) return read_obj_mesh(element, faces, smooth);

    Mesh mesh;
    mesh.line = document_.line(element);
    mesh.material = read_material(element);
    vertices_.begin_mesh();
    read_faces(faces, mesh);
    if (mesh.triangles.empty()) document_.warn(faces, "<Faces> is empty: the mesh has no triangle");
    if (smooth) compute_smooth_normals(mesh);
    scene_.meshes.push_back(std::move(mesh));
}

void ObjectReader::read_faces(pugi::xml_node faces, Mesh& mesh) {
    document_.expect_attributes(faces, {"type", "vertexOffset", "binaryFile"});
    document_.expect_text(faces);
    if (faces.attribute("binaryFile"))
        document_.fail(faces, "binaryFile of <Faces> is not supported: use plyFile, or vertex ids as text");
    read_word_attribute(document_, faces, "type", 0, {{"triangle", 0}});
    const std::int64_t offset = read_integer_attribute(document_, faces, "vertexOffset", 0);
    constexpr std::int64_t kMostOffset = std::numeric_limits<std::uint32_t>::max();
    if (offset < -kMostOffset || offset > kMostOffset)
        document_.fail(
            faces, fmt::format("the vertexOffset {} is out of range: at most {} was expected", offset, kMostOffset));

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

/// Returns the path of a file that the scene names relative to its own folder.
std::filesystem::path ObjectReader::path_of(const char* name) const {
    return document_.file().parent_path() / name;
}

/// Returns whether a path leads out of a folder by its text; links are not followed.
bool leaves(const std::filesystem::path& path, const std::filesystem::path& folder) {
    std::error_code error;
    const std::filesystem::path base =
        std::filesystem::absolute(folder.empty() ? "." : folder, error).lexically_normal();
    const std::filesystem::path relative =
        std::filesystem::absolute(path, error).lexically_normal().lexically_relative(base);
    return error || relative.empty() || *relative.begin() == "..";
}

/// Returns the path that an attribute names. Warns if it leads out of the scene's folder: a scene from elsewhere should
/// not make Castor read other files unnoticed.
std::filesystem::path ObjectReader::find_file(pugi::xml_node faces, const char* attribute) {
    const pugi::xml_attribute name = faces.attribute(attribute);
    const std::filesystem::path file = path_of(name.value());
    std::error_code ignored;
    if (*name.value() == '\0' || !std::filesystem::exists(file, ignored))
        document_.fail(name.name(),
                       fmt::format("the file '{}' that {} names does not exist", file.string(), attribute));
    if (leaves(file, document_.file().parent_path()))
        document_.warn(name.name(), fmt::format("the file '{}' that {} names is not in the scene's folder",
                                                file.string(), attribute));
    return file;
}

/// Returns the size of a file; 0 if it is not known, and then the reader of the file reports the reason.
std::uintmax_t ObjectReader::size_of(const std::filesystem::path& file) const {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    return error ? 0 : size;
}

std::uintmax_t ObjectReader::file_bytes(pugi::xml_node element) const {
    const pugi::xml_node faces = element.child("Faces");
    for (const char* attribute : {"plyFile", "objFile"})
        if (const pugi::xml_attribute name = faces.attribute(attribute)) return size_of(path_of(name.value()));
    return 0;
}

void ObjectReader::read_ply_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth) {
    document_.expect_attributes(faces, {"plyFile"});
    document_.expect_children(faces, {});
    const std::uint32_t material = read_material(element);
    const std::filesystem::path file = find_file(faces, "plyFile");
    Mesh mesh = read_ply(file, document_.next_file(size_of(file)));
    mesh.line = document_.line(element);
    mesh.material = material;
    mesh.normals.clear();  // the XML format ignores nx ny nz
    if (smooth) compute_smooth_normals(mesh);
    scene_.meshes.push_back(std::move(mesh));
}

void ObjectReader::read_obj_mesh(pugi::xml_node element, pugi::xml_node faces, bool smooth) {
    document_.expect_attributes(faces, {"objFile"});
    document_.expect_children(faces, {});
    std::optional<std::uint32_t> material;
    if (element.child("Material")) material = read_material(element);
    const std::filesystem::path file = find_file(faces, "objFile");
    Scene object = read_obj(file, document_.next_file(size_of(file)));
    const auto first_material = static_cast<std::uint32_t>(scene_.materials.size());
    if (!material) scene_.materials.insert(scene_.materials.end(), object.materials.begin(), object.materials.end());
    scene_.warnings.insert(scene_.warnings.end(), object.warnings.begin(), object.warnings.end());
    for (Mesh& mesh : object.meshes) {
        mesh.line = document_.line(element);
        mesh.material = material ? *material : first_material + mesh.material;
        if (!smooth) mesh.normals.clear();
        if (smooth && mesh.normals.empty()) compute_smooth_normals(mesh);
        scene_.meshes.push_back(std::move(mesh));
    }
}

/// Keeps the meshes of an object for instances. Of several objects with one id, the first is kept.
void ObjectReader::keep_base(pugi::xml_node element, std::size_t first_mesh) {
    Base base{first_mesh, scene_.meshes.size() - first_mesh, transforms_.of(element), std::nullopt};
    for (std::size_t i = first_mesh; i < scene_.meshes.size(); ++i)
        scene_.meshes[i].transform = to_transform(base.matrix);
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
    return base;
}

void ObjectReader::read_instances() {
    for (const pugi::xml_node element : waiting_instances_) {
        document_.expect_attributes(element, {"baseMeshId", "resetTransform"});
        document_.expect_children(element, {"Material", "Transformations"});
        const Base base = read_instance(element);
        for (std::size_t i = base.first_mesh; i < base.first_mesh + base.mesh_count; ++i)
            scene_.instances.push_back({static_cast<std::uint32_t>(i), to_transform(base.matrix),
                                        base.material.value_or(scene_.meshes[i].material), document_.line(element)});
    }
}

void ObjectReader::read_triangle(pugi::xml_node element) {
    document_.expect_attributes(element);
    document_.expect_children(element, {"Material", "Indices", "Transformations"});
    const std::uint32_t material = read_material(element);
    const Transform transform = to_transform(transforms_.of(element));
    const pugi::xml_node indices = require_child(document_, element, "Indices");
    const auto numbers = read_numbers<std::int64_t, 3>(document_, indices);
    if (!last_mesh_is_triangles_ || scene_.meshes.back().material != material ||
        scene_.meshes.back().transform != transform) {
        vertices_.begin_mesh();
        Mesh& mesh = scene_.meshes.emplace_back();
        mesh.material = material;
        mesh.line = document_.line(element);
        mesh.transform = transform;
        last_mesh_is_triangles_ = true;
    }
    Mesh& mesh = scene_.meshes.back();
    glm::uvec3 triangle;
    for (int corner = 0; corner < 3; ++corner)
        triangle[corner] =
            vertices_.add(mesh, vertices_.find(numbers[static_cast<std::size_t>(corner)], 0, indices.name()));
    mesh.triangles.push_back(triangle);
}

void ObjectReader::read_sphere(pugi::xml_node element) {
    document_.expect_attributes(element);
    document_.expect_children(element, {"Material", "Center", "Radius", "Transformations"});
    Sphere sphere;
    sphere.transform = to_transform(transforms_.of(element));
    sphere.line = document_.line(element);
    sphere.material = read_material(element);
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
    document_.expect_children(element, {"Material", point, "Normal", "Transformations"});
    Plane plane;
    plane.line = document_.line(element);
    plane.material = read_material(element);
    plane.point = read_vertex(element, point);
    plane.normal = require_direction(document_, element, "Normal");
    move(plane, element);
    scene_.planes.push_back(plane);
}

}  // namespace

void read_objects(XmlDocument& document, const XmlMaterialIds& ids, const std::vector<glm::vec3>& vertices,
                  const XmlTransforms& transforms, Scene& scene) {
    ObjectReader reader(document, ids, vertices, transforms, scene);
    std::uintmax_t file_bytes = 0;
    for (const pugi::xml_node container : document.root().children("Objects"))
        for (const pugi::xml_node element : container.children()) file_bytes += reader.file_bytes(element);
    document.expect_file_bytes(file_bytes);
    for (const pugi::xml_node container : document.root().children("Objects")) {
        document.expect_attributes(container);
        document.expect_children(container, {}, {"Mesh", "MeshInstance", "Triangle", "Sphere", "Plane"});
        for (const pugi::xml_node element : container.children()) reader.read(element);
    }
    reader.read_instances();
}

}  // namespace castor
