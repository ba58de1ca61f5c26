#include "scene/gltf_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "castor/error.h"
#include "scene/gltf_accessor.h"
#include "scene/gltf_choice.h"
#include "scene/gltf_lights.h"
#include "scene/gltf_materials.h"
#include "scene/gltf_meshes.h"
#include "scene/gltf_nodes.h"
#include "scene/placement.h"
#include "scene/tangents.h"

namespace castor {

namespace {

// The share of the time after which meshes are read. The rest is for pictures.
constexpr double kMeshes = 0.6;

/// Reads the meshes of the nodes that are shown. A primitive that several nodes, or materials, share becomes a mesh and
/// its instances.
class MeshReader {
public:
    MeshReader(GltfDocument& document, const GltfNodes& nodes, GltfMaterials& materials, Scene& scene)
        : document_(document), nodes_(nodes), materials_(materials), scene_(scene) {}

    void read(std::size_t node) {
        const GltfValue value = document_.element("nodes", node);
        const auto index = value.find("mesh");
        if (!index) return;
        const GltfValue mesh = document_.element("meshes", index->index_of("meshes"));
        GltfBend bend;
        bend.weights = weights_of(node, mesh);
        budget_.charge(mesh, bend.weights.size());
        std::vector<glm::dmat4> places{nodes_.world[node]};
        std::string skin_key;
        if (const auto skin = value.find("skin")) {
            skin_key = fmt::format("skin {}\n", skin->index_of("skins"));
            bend.joints = joints_of(document_.element("skins", skin->index_of("skins")));
            places = {glm::dmat4(1.0)};
        } else if (const auto instancing = value.find_extension("EXT_mesh_gpu_instancing")) {
            places = instances_of(*instancing, nodes_.world[node]);
        }
        const GltfValue primitives = mesh.require("primitives");
        for (std::size_t i = 0; i < primitives.size(); ++i) read(primitives.at(i), bend, skin_key, places);
    }

private:
    static constexpr std::uint32_t kNotDrawn = CASTOR_INVALID_INDEX;

    std::vector<float> weights_of(std::size_t node, const GltfValue& mesh) const {
        if (nodes_.poses[node].weights) return *nodes_.poses[node].weights;
        std::vector<float> weights;
        if (const auto list = mesh.find("weights"))
            for (std::size_t i = 0; i < list->size(); ++i) weights.push_back(list->at(i).number());
        return weights;
    }

    std::vector<glm::dmat4> joints_of(const GltfValue& skin) {
        const GltfValue joints = skin.require("joints");
        if (joints.size() == 0) joints.reject("has no joint");
        budget_.charge(joints, joints.size());
        std::optional<GltfAccessor> inverse;
        if (const auto value = skin.find("inverseBindMatrices")) {
            inverse.emplace(document_, *value);
            if (inverse->component_count() != 16 || inverse->count() < joints.size())
                value->reject(fmt::format("{} elements of {} components, expected a matrix of 16 for each of {} joints",
                                          inverse->count(), inverse->component_count(), joints.size()));
        }
        std::vector<glm::dmat4> matrices;
        for (std::size_t i = 0; i < joints.size(); ++i) {
            glm::dmat4 matrix = nodes_.world[joints.at(i).index_of("nodes")];
            if (inverse) {
                const auto m = inverse->get(i);
                glm::dmat4 bind(1.0);
                for (int column = 0; column < 4; ++column)
                    for (int row = 0; row < 4; ++row) bind[column][row] = m[static_cast<std::size_t>(4 * column + row)];
                matrix = matrix * bind;
            }
            matrices.push_back(matrix);
        }
        return matrices;
    }

    /// EXT_mesh_gpu_instancing.
    std::vector<glm::dmat4> instances_of(const GltfValue& extension, const glm::dmat4& world) {
        const GltfValue attributes = extension.require("attributes");
        attributes.for_each_member([&](const std::string& name, const GltfValue& value) {
            if (name != "TRANSLATION" && name != "ROTATION" && name != "SCALE")
                document_.warn_at(value.path(), "attributes of instances, other than their places, are not read");
        });
        std::optional<GltfAccessor> translations, rotations, scales;
        std::optional<GltfAccessor::Requirement> required;
        const auto read = [&](bool reads_views, const char* name, std::size_t components,
                              std::optional<GltfAccessor>& accessor) {
            const auto value = attributes.find(name);
            if (!value || GltfAccessor::has_view(document_, *value) != reads_views) return;
            accessor.emplace(document_, *value, required);
            accessor->require_components(components, components);
            required = {accessor->count(), "as the other attributes"};
        };
        for (const bool reads_views : {true, false}) {  // first those whose bytes require so many of the others
            read(reads_views, "TRANSLATION", 3, translations);
            read(reads_views, "ROTATION", 4, rotations);
            read(reads_views, "SCALE", 3, scales);
        }
        const std::size_t count = required ? required->count : 0;
        budget_.charge(extension, count);
        std::vector<glm::dmat4> places;
        for (std::size_t i = 0; i < count; ++i) {
            const glm::dvec3 translation = translations ? glm::dvec3(translations->get_vec3(i)) : glm::dvec3(0.0);
            const glm::dvec3 scale = scales ? glm::dvec3(scales->get_vec3(i)) : glm::dvec3(1.0);
            glm::dvec4 rotation = rotations ? glm::dvec4(rotations->get_vec4(i, 1.0f)) : glm::dvec4(0, 0, 0, 1);
            const double length = std::sqrt(rotation.x * rotation.x + rotation.y * rotation.y +
                                            rotation.z * rotation.z + rotation.w * rotation.w);
            if (!(length > 0.0)) rotations->reject(fmt::format("element {} is (0, 0, 0, 0), which is no rotation", i));
            places.push_back(world * gltf_matrix(translation, rotation / length, scale));
        }
        return places;
    }

    void read(const GltfValue& primitive, const GltfBend& bend, const std::string& skin_key,
              const std::vector<glm::dmat4>& places) {
        // What the mesh is made of, without its material.
        std::string key = fmt::format("{}\n", primitive.whole("mode", 4));
        for (const char* name : {"attributes", "indices", "targets", "extensions"})
            if (const auto part = primitive.find(name)) key += fmt::format("{} {}\n", name, part->dump());
        key += skin_key;
        for (const float weight : bend.weights) key += fmt::format("{} ", weight);
        const std::uint32_t material = materials_.material_of(primitive);
        const std::optional<std::uint32_t> tangent_set = materials_.tangent_set(material);
        if (tangent_set) key += fmt::format("tangents {}", *tangent_set);
        std::uint32_t& known = meshes_.emplace(key, kNotDrawn).first->second;
        budget_.charge(primitive, places.size());
        for (const glm::dmat4& world : places) {
            const Transform transform(world);
            if (!can_be_drawn(primitive, transform)) continue;
            if (known == kNotDrawn) {
                auto mesh = read_gltf_primitive(document_, primitive, bend, budget_);
                if (!mesh || mesh->triangles.empty()) return;
                if (tangent_set && mesh->tangents.empty()) {
                    const auto& coordinates =
                        *tangent_set == 0 ? mesh->texture_coordinates : mesh->texture_coordinates_1;
                    if (!coordinates.empty()) add_tangents(*mesh, *tangent_set);
                }
                mesh->material = material;
                mesh->transform = transform;
                mesh->name = primitive.path();
                known = static_cast<std::uint32_t>(scene_.meshes.size());
                scene_.meshes.push_back(std::move(*mesh));
            } else {
                MeshInstance instance;
                instance.mesh = known;
                instance.transform = transform;
                instance.material = material;
                scene_.instances.push_back(instance);
            }
        }
    }

    /// Nodes are often scaled to nothing, to hide what they have.
    bool can_be_drawn(const GltfValue& primitive, const Transform& transform) {
        constexpr double kMostCondition = 0x1p20, kMostScale = 0x1p28, kFarthest = 1e15;
        for (int axis = 0; axis < 3; ++axis)
            if (!(std::abs(transform[3][axis]) <= kFarthest)) primitive.reject("its node is too far away");
        const TransformNorms size = norms(transform);
        const bool is_good =
            size.forth * size.back <= kMostCondition && size.forth <= kMostScale && size.back <= kMostScale;
        if (!is_good) document_.warn("nodes that are scaled to nothing, or nearly so in one direction, are not drawn");
        return is_good;
    }

    GltfDocument& document_;
    const GltfNodes& nodes_;
    GltfMaterials& materials_;
    Scene& scene_;
    std::map<std::string, std::uint32_t> meshes_;
    GltfBudget budget_;
};

}  // namespace

Scene read_gltf(const std::filesystem::path& file, const Progress& progress, const LoadOptions& options) {
    Scene scene;
    scene.file = file.string();
    GltfDocument document(file);
    const GltfNodes nodes = read_gltf_nodes(document, options);
    GltfMaterials materials(document, scene, options.material_variant);
    materials.read();
    MeshReader meshes(document, nodes, materials, scene);
    for (std::size_t i = 0; i < nodes.shown.size(); ++i) {
        meshes.read(nodes.shown[i]);
        progress.reach(kMeshes * static_cast<double>(i + 1) / static_cast<double>(nodes.shown.size()));
    }
    read_gltf_cameras(document, nodes, scene);
    read_gltf_lights(document, nodes, scene);
    scene.animations = names_of_gltf_elements(document.root().find("animations"));
    scene.material_variants = names_of_gltf_elements(gltf_material_variants(document));
    if (scene.meshes.empty()) {
        std::string reason = "the file's scene has no triangle";
        for (const Warning& warning : document.take_warnings()) reason += "; " + warning.text;
        throw SceneError(scene.file, 0, reason);
    }
    materials.read_images();
    scene.warnings = document.take_warnings();
    progress.reach(1.0);
    return scene;
}

}  // namespace castor
