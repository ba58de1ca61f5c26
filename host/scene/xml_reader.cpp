#include "scene/xml_reader.h"

#include "scene/scene_limits.h"
#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

void read_settings(XmlDocument& document, Scene& scene) {
    const pugi::xml_node root = document.root();
    scene.background = read_vec3(document, root, "BackgroundColor", scene.background);
    scene.shadow_ray_epsilon = read_float(document, root, "ShadowRayEpsilon", scene.shadow_ray_epsilon);
    check_child(document, scene.shadow_ray_epsilon >= 0.0f, root, "ShadowRayEpsilon", "a number of at least 0");
    // Checked, but not used: hits are exact without it.
    read_float(document, root, "IntersectionTestEpsilon", 0.0f);
    const std::int64_t depth = read_integer(document, root, "MaxRecursionDepth", scene.max_recursion_depth);
    check_child(document, depth >= 0 && depth <= kMaxRecursionDepth, root, "MaxRecursionDepth",
                "a number of 0 to 65535 bounces");
    scene.max_recursion_depth = static_cast<std::uint32_t>(depth);
}

/// Frees texture coordinates that no texture can use.
void drop_unused_texture_coordinates(Scene& scene) {
    if (!scene.textures.empty()) return;
    for (Mesh& mesh : scene.meshes) mesh.texture_coordinates = {};
}

}  // namespace

Scene read_xml_scene(const std::filesystem::path& file, const Progress& progress) {
    XmlDocument document(file, progress);
    document.expect_attributes(document.root());
    document.expect_children(document.root(),
                             {"BackgroundColor", "ShadowRayEpsilon", "IntersectionTestEpsilon", "MaxRecursionDepth",
                              "VertexData", "TexCoordData"},
                             {"Cameras", "Lights", "Materials", "BRDFs", "Textures", "Transformations", "Objects"});
    Scene scene;
    scene.file = file.string();
    read_settings(document, scene);
    // What others name by an id comes first, since it may follow them in the file.
    const XmlTransforms transforms(document);
    XmlTextures textures(document, scene);
    read_cameras(document, transforms, scene);
    read_lights(document, transforms, textures, scene);
    const XmlMaterialIds ids = read_materials(document, read_brdfs(document), scene);
    const XmlVertexData vertices = read_vertex_data(document);
    read_objects(document, ids, vertices, transforms, textures, scene);
    drop_unused_texture_coordinates(scene);
    const std::vector<Warning> warnings = document.warnings();
    scene.warnings.insert(scene.warnings.begin(), warnings.begin(), warnings.end());
    return scene;
}

}  // namespace castor
