// Saved scenes with right checksums and wrong values: each is refused, and the message names the place.
#include "trace/check_built_scene.h"

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "castor/error.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "support/catch.h"
#include "support/reference.h"
#include "support/temporary_directory.h"
#include "trace/saved_scene.h"

namespace castor::test {
namespace {

const std::vector<StrategyChoice> kAllTrees{StrategyChoice::all(Strategy::wide), StrategyChoice::all(Strategy::simt)};
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A flat and a smooth mesh, spheres, a plane, and instances of a third mesh.
Scene scene_of_everything() {
    RandomSource random(61);
    Mesh smooth = bumpy_sphere(2);
    compute_smooth_normals(smooth);
    Scene scene = scene_of({random_triangles(random, 300, 0.2f), smooth, cube_grid(2)});
    for (int i = 0; i < 20; ++i) scene.spheres.push_back({random.in_box(-1, 1), 0.1f, 0, 0});
    scene.planes.push_back({{0, -1, 0}, {0, 1, 0}, 0, 0});
    for (int i = 0; i < 12; ++i) {
        Transform transform(1.0f);
        transform[3] = random.in_box(-3, 3);
        scene.instances.push_back({2, transform, 0, 0});
    }
    scene.lights.resize(3);
    scene.lights[1].kind = Light::Kind::directional;
    scene.lights[2].kind = Light::Kind::spot;
    return scene;
}

SceneContents whole() {
    return build_scene(scene_of_everything(), kAllTrees);
}

SceneContents in_chunks() {
    const SceneContents contents = whole();
    const SceneSizes sizes = sizes_of(contents.chunks.front(), {true, true}, TreeQuality::medium);
    return build_scene(scene_of_everything(), kAllTrees, TreeQuality::medium, {sizes.largest_column / 3});
}

/// Why the scene is refused once it was saved; empty: it is not.
std::string refusal_of(const SceneContents& contents) {
    const TemporaryDirectory directory;
    const std::filesystem::path file = directory.path() / "s.castor";
    save_scene(file, contents);
    try {
        map_saved_scene(file);
    } catch (const SceneError& error) {
        CHECK(error.file() == file.string());
        return error.reason();
    }
    return "";
}

struct Lie {
    std::string refusal;  // what its message must contain
    std::function<void(Chunk&)> tell;
};

void check_lies(const std::function<SceneContents()>& make, std::size_t chunk, const std::vector<Lie>& lies) {
    REQUIRE(refusal_of(make()).empty());
    for (const Lie& lie : lies) {
        SceneContents contents = make();
        lie.tell(contents.chunks.at(chunk));
        const std::string refusal = refusal_of(contents);
        CAPTURE(lie.refusal, refusal);
        CHECK(refusal.find(lie.refusal) != std::string::npos);
    }
}

/// The first inner child of a wide node, or the first leaf.
std::uint32_t& wide_child(Chunk& chunk, std::size_t node, bool is_leaf) {
    for (std::uint32_t& child : chunk.wide_nodes.at(node).child)
        if (child != CASTOR_INVALID_INDEX && bool(child & CASTOR_WIDE_LEAF) == is_leaf) return child;
    throw std::runtime_error("there is no such child");
}

std::size_t wide_node_with_leaf(const Chunk& chunk) {
    for (std::size_t i = 0; i < chunk.wide_nodes.size(); ++i)
        for (const std::uint32_t child : chunk.wide_nodes[i].child)
            if (child != CASTOR_INVALID_INDEX && child & CASTOR_WIDE_LEAF) return i;
    throw std::runtime_error("there is no leaf");
}

std::size_t compressed_node(const Chunk& chunk, bool has_children) {
    for (std::size_t i = 0; i < chunk.compressed_nodes.size(); ++i)
        if ((chunk.compressed_nodes[i].inner_mask != 0) == has_children) return i;
    throw std::runtime_error("there is no such node");
}

}  // namespace

TEST_CASE("columns that do not belong together are refused", "[saved][lies]") {
    check_lies(
        whole, 0,
        {
            {"its section sphere_material has 19 elements, expected 20, one a sphere",
             [](Chunk& c) { c.arrays.sphere_material.pop_back(); }},
            {"its section plane_normal has 2 elements, expected 1, one a plane",
             [](Chunk& c) {
                 c.arrays.plane_normal.push_back({0, 1, 0, 0});
             }},
            {"its section plane_material has 0 elements", [](Chunk& c) { c.arrays.plane_material.clear(); }},
            {"its section geometries has no element", [](Chunk& c) { c.arrays.geometries.clear(); }},
            {"its section geometries has 2 elements, expected 1, since there are no instances",
             [](Chunk& c) { c.arrays.instances.clear(); }},
            {"its section geometries has in element 1 the first triangle",
             [](Chunk& c) { --c.arrays.geometries[1].first_triangle; }},
            {"triangles and 0 spheres, more than there are",
             [](Chunk& c) { c.arrays.geometries[1].triangle_count = 0xffffffffu; }},
            {"triangles and 20 spheres in all, expected", [](Chunk& c) { --c.arrays.geometries[1].triangle_count; }},
            {"has in element 1 the largest coordinate inf",
             [](Chunk& c) { c.arrays.geometries[1].largest_coordinate = kInfinity; }},
            {"its section mesh_ranges has 0 elements", [](Chunk& c) { c.arrays.mesh_ranges.clear(); }},
            {"its section mesh_ranges has in element 0 the first triangle 1",
             [](Chunk& c) { c.arrays.mesh_ranges[0].first_triangle = 1; }},
            {"its section mesh_ranges has in element 2 the first triangle 300",
             [](Chunk& c) { c.arrays.mesh_ranges[2].first_triangle = 300; }},
            {"its section mesh_ranges has in element 1 the first triangle",
             [](Chunk& c) { c.arrays.mesh_ranges[1].first_vertex = 0xffffffffu; }},
            {"its section wide_roots has 1 elements, expected 2, one a geometry",
             [](Chunk& c) { c.wide_roots.pop_back(); }},
            {"its section compressed_roots has 2 elements, expected 0, since these trees are not built",
             [](Chunk& c) { c.has_compressed = false, c.compressed_primitives.clear(); }},
            {"its section primitive_numbers has 1 elements", [](Chunk& c) { c.primitive_numbers.push_back(0); }},
        });
}

TEST_CASE("indices of primitives out of range are refused", "[saved][lies]") {
    check_lies(whole, 0,
               {
                   {"its section triangle_vertices has in element 3 the vertices",
                    [](Chunk& c) { c.arrays.triangle_vertices[3].y = 0x7fffffffu; }},
                   // A vertex of another mesh.
                   {"its section triangle_vertices has in element 300 the vertices 0",
                    [](Chunk& c) { c.arrays.triangle_vertices[300].x = 0; }},
                   {"whose normal is", [](Chunk& c) { c.arrays.mesh_ranges[1].first_normal = 100; }},
                   {"its section mesh_ranges has in element 2 the material 1, expected one of 1",
                    [](Chunk& c) { c.arrays.mesh_ranges[2].material = 1; }},
                   {"its section sphere_material has in element 7 the material 9",
                    [](Chunk& c) { c.arrays.sphere_material[7] = 9; }},
                   {"its section plane_material has in element 0 the material 1",
                    [](Chunk& c) { c.arrays.plane_material[0] = 1; }},
                   {"its section instances has in element 2 the material 1",
                    [](Chunk& c) { c.arrays.instances[2].material = 1; }},
                   {"its section instances has in element 2 the geometry 2 of 2",
                    [](Chunk& c) { c.arrays.instances[2].geometry = 2; }},
                   {"its section instances has in element 0 the geometry 1 of 2",
                    [](Chunk& c) { c.arrays.instances[0].geometry = 1; }},
               });
}

TEST_CASE("values outside their domains are refused", "[saved][lies]") {
    check_lies(
        whole, 0,
        {
            {"its section vertex_position has in element 5 the position",
             [](Chunk& c) { c.arrays.vertex_position[5].z = kNaN; }},
            {"its section vertex_position has in element 5 the position",
             [](Chunk& c) { c.arrays.vertex_position[5].z = 2e12f; }},
            {"its section vertex_normal has in element 5 the normal",
             [](Chunk& c) { c.arrays.vertex_normal[5].x = kInfinity; }},
            {"its section sphere_center_radius has in element 1 the center",
             [](Chunk& c) { c.arrays.sphere_center_radius[1].w = 0.0f; }},
            {"its section plane_normal has in element 0 the normal (0, 2, 0)",
             [](Chunk& c) { c.arrays.plane_normal[0].y = 2.0f; }},
            {"its section plane_point has in element 0 the point", [](Chunk& c) { c.arrays.plane_point[0].y = kNaN; }},
            {"its section materials has in element 0 the kind 5, expected 0 to 4",
             [](Chunk& c) { c.arrays.materials[0].kind = 5; }},
            {"its section materials has in element 0 the kind 4 and the principled material 4294967295 of 0",
             [](Chunk& c) { c.arrays.materials[0].kind = CASTOR_MATERIAL_PRINCIPLED; }},
            {"its section materials has in element 0 the kind 0 and the principled material 0 of 0",
             [](Chunk& c) { c.arrays.materials[0].principled = 0; }},
            {"its section materials has in element 0 a reflectance",
             [](Chunk& c) { c.arrays.materials[0].mirror[2] = kNaN; }},
            {"its section lights has in element 2 the kind 7", [](Chunk& c) { c.arrays.lights[2].kind = 7; }},
            {"its section lights has in element 1 the direction (0, -1, 3)",
             [](Chunk& c) { c.arrays.lights[1].direction[2] = 3.0f; }},
            {"its section lights has in element 1 the size 1.5, expected 0 to 1",
             [](Chunk& c) { c.arrays.lights[1].size = 1.5f; }},
            {"its section lights has in element 0 the instance 999, expected numbers below",
             [](Chunk& c) {
                 c.arrays.lights[0].kind = CASTOR_LIGHT_SPHERE;
                 c.arrays.lights[0].first = 999;
             }},
            {"its section lights has in element 0 the motion (0, inf, 0)",
             [](Chunk& c) {
                 c.arrays.lights[0].kind = CASTOR_LIGHT_MESH;
                 c.arrays.lights[0].direction[1] = std::numeric_limits<float>::infinity();
             }},
            {"its section lights has in element 0 the hull 3",
             [](Chunk& c) {
                 c.arrays.lights[0].kind = CASTOR_LIGHT_MESH;
                 c.arrays.lights[0].mapping = 3;
             }},
            {"its section lights has in element 0 the sampling 2 of a mesh",
             [](Chunk& c) {
                 c.arrays.lights[0].kind = CASTOR_LIGHT_MESH;
                 c.arrays.lights[0].sampling = 2;
             }},
            {"its section lights has in element 1 the principled material 999",
             [](Chunk& c) { c.arrays.lights[1].principled = 999; }},
            {"its section light_nodes has in element 1 the flux nan",
             [](Chunk& c) { c.arrays.light_nodes[1].flux = std::numeric_limits<float>::quiet_NaN(); }},
            {"its section light_nodes has the light 1 at the end of another trail",
             [](Chunk& c) { c.arrays.lights[1].trail ^= 1; }},
            {"its section light_nodes has", [](Chunk& c) { c.arrays.light_nodes.pop_back(); }},
            {"its section lights has in element 2 the cosines",
             [](Chunk& c) { c.arrays.lights[2].cos_falloff = -2.0f; }},
            {"its section instances has in element 1 a matrix of norm",
             [](Chunk& c) { c.arrays.instances[1].to_object[0][0] = 0.0f; }},
            {"its section instances has in element 1 a matrix with values",
             [](Chunk& c) { c.arrays.instances[1].to_world[0][0] = kNaN; }},
            {"its section settings has the bounds", [](Chunk& c) { c.bounds.upper[1] = kInfinity; }},
            {"its section settings has the background", [](Chunk& c) { c.arrays.background.x = kNaN; }},
            {"its section settings has the shadow ray epsilon -1",
             [](Chunk& c) { c.arrays.shadow_ray_epsilon = -1.0f; }},
        });
}

TEST_CASE("wide trees that are none are refused", "[saved][lies]") {
    check_lies(
        whole, 0,
        {
            {"its section settings has the root 0x1 of the wide tree", [](Chunk& c) { c.wide_root = 1; }},
            {"its section wide_roots has in element 0 the node 1", [](Chunk& c) { c.wide_roots[0] = 1; }},
            {"its section wide_roots has in element 1 the node",
             [](Chunk& c) { c.wide_roots[1] = static_cast<std::uint32_t>(c.wide_nodes.size()); }},
            {"but the geometry has some bounded primitives", [](Chunk& c) { c.wide_roots[1] = CASTOR_INVALID_INDEX; }},
            // A cycle.
            {"its section wide_nodes has in element 0 at place", [](Chunk& c) { wide_child(c, 0, false) = 0; }},
            // A node of another tree.
            {"its section wide_nodes has in element 0 at place",
             [](Chunk& c) { wide_child(c, 0, false) = c.wide_roots[1]; }},
            {"its section wide_nodes has two nodes whose child is element",
             [](Chunk& c) {
                 auto& children = c.wide_nodes[0].child;
                 const std::uint32_t child = wide_child(c, 0, false);
                 for (std::uint32_t& other : children)
                     if (other != child && !(other & CASTOR_WIDE_LEAF)) other = child;
             }},
            {"expected inf and -inf, since there is none",
             [](Chunk& c) { wide_child(c, 0, false) = CASTOR_INVALID_INDEX; }},
            {"expected coordinates, the lower one first", [](Chunk& c) { c.wide_nodes[0].planes[1][0][0] = kNaN; }},
            {"triangle blocks from 134217727 on, expected numbers below",
             [](Chunk& c) {
                 wide_child(c, wide_node_with_leaf(c), true) =
                     CASTOR_WIDE_LEAF | CASTOR_WIDE_FIRST_MASK | 1u << CASTOR_WIDE_COUNT_SHIFT;
             }},
            {"in lane 0, which is none of geometry",
             [](Chunk& c) { c.triangle_blocks[0].primitive[0] = CASTOR_INVALID_INDEX; }},
            // A triangle of another geometry.
            {"in lane 0, which is none of geometry 0",
             [](Chunk& c) { c.triangle_blocks[0].primitive[0] = c.arrays.geometries[1].first_triangle; }},
            {"whose sphere block 0 has the primitive 0x0 in lane 0",
             [](Chunk& c) { c.sphere_blocks[0].primitive[0] = 0; }},
        });
}

TEST_CASE("a chain of nodes that is deeper than the stacks is refused", "[saved][lies]") {
    SceneContents contents = whole();
    Chunk& chunk = contents.chunks.front();
    chunk.has_compressed = false;
    chunk.compressed_nodes.clear();
    chunk.compressed_primitives.clear();
    chunk.compressed_roots.clear();
    chunk.compressed_levels = 0;
    const std::size_t most = CASTOR_MAX_STACK;
    const auto chain = [&](std::size_t length) {
        shared::WideNode node = chunk.wide_nodes.front();
        for (std::uint32_t place = 0; place < 8; ++place) {
            for (auto& axis : node.planes) axis[0][place] = kInfinity, axis[1][place] = -kInfinity;
            node.child[place] = CASTOR_INVALID_INDEX;
        }
        chunk.wide_nodes.assign(length + 1, node);
        for (std::size_t i = 0; i + 1 < length; ++i) {
            chunk.wide_nodes[i].child[0] = static_cast<std::uint32_t>(i + 1);
            for (auto& axis : chunk.wide_nodes[i].planes) axis[0][0] = axis[1][0] = 0.0f;
        }
        chunk.wide_roots[1] = static_cast<std::uint32_t>(length);
        return refusal_of(contents);
    };
    CHECK(chain(most).empty());
    CHECK(chain(most + 1).find("its section wide_nodes has the element 64 on level 65, expected at most 64") !=
          std::string::npos);
}

TEST_CASE("compressed trees that are none are refused", "[saved][lies]") {
    check_lies(
        whole, 0,
        {
            {"levels of the compressed trees, expected", [](Chunk& c) { ++c.compressed_levels; }},
            {"levels of the compressed trees, expected", [](Chunk& c) { c.compressed_levels = 0; }},
            {"its section compressed_nodes has in element 0", [](Chunk& c) { c.compressed_nodes[0].first_child = 0; }},
            {"children from 4294967295 on", [](Chunk& c) { c.compressed_nodes[0].first_child = 0xffffffffu; }},
            {"its section compressed_nodes has two nodes whose child is element",
             [](Chunk& c) {
                 auto& nodes = c.compressed_nodes;
                 for (std::size_t i = 1; i < nodes.size(); ++i)
                     if (nodes[i].inner_mask != 0 && nodes[i].first_child > i + 1) return void(--nodes[i].first_child);
             }},
            {"for a leaf, which is none",
             [](Chunk& c) { c.compressed_nodes[compressed_node(c, false)].meta[0] = 0x3f; }},
            {"for an inner child, which is none",
             [](Chunk& c) { c.compressed_nodes[0].inner_mask = 0xff, c.compressed_nodes[0].meta[3] = 0; }},
            {"primitives from",
             [](Chunk& c) { c.compressed_nodes[compressed_node(c, false)].first_primitive = 0x7fffffffu; }},
            {"a leaf whose primitive 0xffffffff (element 3 of compressed_primitives) is none of geometry 0",
             [](Chunk& c) { c.compressed_primitives[3] = CASTOR_INVALID_INDEX; }},
            {"the origin nan", [](Chunk& c) { c.compressed_nodes[1].origin[0] = kNaN; }},
            {"exponent 255", [](Chunk& c) { c.compressed_nodes[1].exponent[0] = 255; }},
        });
}

TEST_CASE("a tree over instances that is none is refused", "[saved][lies]") {
    const auto leaf = [](Chunk& c) -> shared::InstanceNode& {
        for (shared::InstanceNode& node : c.instance_nodes)
            if (node.is_leaf) return node;
        throw std::runtime_error("there is no leaf");
    };
    check_lies(
        whole, 0,
        {
            {"its section instance_nodes has in element 0 the children 0",
             [](Chunk& c) { c.instance_nodes[0].first = 0; }},
            {"its section instance_nodes has in element 0 the children",
             [](Chunk& c) { c.instance_nodes[0].first = static_cast<std::uint32_t>(c.instance_nodes.size() - 1); }},
            {"is_leaf 2, expected 0 or 1", [](Chunk& c) { c.instance_nodes[0].is_leaf = 2; }},
            {"the instance 14, expected 1 or more, and less than 14", [&](Chunk& c) { leaf(c).first = 14; }},
            {"the instance 0, expected 1 or more", [&](Chunk& c) { leaf(c).first = 0; }},
            {"the slope nan", [](Chunk& c) { c.instance_nodes[0].slope = kNaN; }},
            {"the planes nan", [](Chunk& c) { c.instance_nodes[0].lower[1] = kNaN; }},
            {"its section instance_nodes has the element", [&](Chunk& c) { c.instance_nodes.push_back(leaf(c)); }},
            {"its section wide_instance_nodes has in element 0 another node",
             [](Chunk& c) { c.wide_instance_nodes[0].child[0] ^= 1; }},
            {"its section wide_instance_nodes has", [](Chunk& c) { c.wide_instance_nodes.pop_back(); }},
        });
}

TEST_CASE("chunks that contradict each other are refused", "[saved][lies]") {
    const std::size_t chunk_count = in_chunks().chunks.size();
    REQUIRE(chunk_count > 2);
    check_lies(
        in_chunks, 1,
        {
            {"its section materials@1 has 1 elements, expected 0", [](Chunk& c) { c.arrays.materials.resize(1); }},
            {"its section lights@1 has 1 elements, expected 0", [](Chunk& c) { c.arrays.lights.resize(1); }},
            {"its section geometries@1 has 3 elements, expected 2, as many as in the first chunk",
             [](Chunk& c) { c.arrays.geometries.push_back(c.arrays.geometries.back()); }},
            {"its section primitive_numbers@1 has 0 elements", [](Chunk& c) { c.primitive_numbers.clear(); }},
            {"its section primitive_numbers@1 has in element 2 the number 0, expected more than",
             [](Chunk& c) { c.primitive_numbers[2] = 0; }},
        });
    // Kernels that do not know of chunks would count otherwise.
    SceneContents one = in_chunks();
    one.chunks.resize(1);
    CHECK_FALSE(refusal_of(one).empty());
    one.chunks.clear();
    CHECK(refusal_of(one).find("its section settings says that it has no chunk") != std::string::npos);
}

TEST_CASE("what is said of a scene is checked as when it was flattened", "[saved][lies]") {
    const auto refusal_with = [](const std::function<void(SceneContents&)>& tell) {
        SceneContents contents = whole();
        tell(contents);
        return refusal_of(contents);
    };
    CHECK(refusal_with([](SceneContents& p) {
              p.description.materials.at(0).kind = static_cast<MaterialKind>(7);
          }).find("its section settings says material 0: the kind is 7") != std::string::npos);
    CHECK(refusal_with([](SceneContents& p) {
              p.description.lights.at(0).kind = static_cast<Light::Kind>(8);
          }).find("its section settings says light 0: its kind is none of") != std::string::npos);
    CHECK(refusal_with([](SceneContents& p) {
              p.description.ambient_light.x = kNaN;
          }).find("its section settings says scene: ambient light is (nan") != std::string::npos);
    CHECK(refusal_with([](SceneContents& p) { ++p.counts.triangles; }).find("triangles, expected") !=
          std::string::npos);
}

TEST_CASE("a scene of one primitive and degenerate triangles is not cut", "[saved][lies]") {
    Mesh mesh = cube_grid(1);
    for (std::size_t i = 0; i + 1 < mesh.triangles.size(); ++i) mesh.triangles[i] = glm::uvec3(i % 8);
    const SceneContents contents = build_scene(scene_of({mesh}), kAllTrees, TreeQuality::medium, {64});
    REQUIRE(contents.chunks.size() == 1);
    CHECK(contents.chunks.front().primitive_numbers.empty());  // so hits have the numbers of the whole scene
    CHECK(contents.arrays().triangle_count() == mesh.triangles.size());
    CHECK(refusal_of(contents).empty());
}

TEST_CASE("the table of an environment leads to its texels", "[saved]") {
    // 5 x 3 texels: 8 x 4 cells, of which the picture has 15. Trees of 4 + 8 + 32 + 4 words.
    const auto make = [] {
        Scene scene = scene_of_everything();
        Image image;
        image.width = 5;
        image.height = 3;
        for (int i = 0; i < 45; ++i) image.floats.push_back(float(i % 7) + 0.5f);
        scene.images = {image};
        Light light;
        light.kind = Light::Kind::environment;
        scene.lights.push_back(light);
        return build_scene(scene, kAllTrees);
    };
    const auto parts = [](Chunk& chunk, std::size_t word) -> std::uint32_t& {
        return chunk.arrays.environment_parts.at(word);
    };
    constexpr std::size_t kTree = 4, kCells = kTree + 4 + 8, kSecond = 4 + 48;
    const SceneContents right = make();
    REQUIRE(right.chunks[0].arrays.environment_parts.size() == 4 + 2 * 48);
    check_lies(make, 0,
               {{"a table from word 1 of 100 on", [](Chunk& c) { c.arrays.lights[3].count = 1; }},
                {"a table from word 104 of 100 on", [](Chunk& c) { c.arrays.lights[3].count = 104; }},
                {"a table of 96 words, expected 100", [](Chunk& c) { c.arrays.lights[3].count = 4; }},
                {"a table of 99 words", [](Chunk& c) { c.arrays.environment_parts.pop_back(); }},
                {"2^30 x 2^2 cells", [&](Chunk& c) { parts(c, 0) = 30; }},
                {"cells of 2^9 texels", [&](Chunk& c) { parts(c, 2) = 9; }},
                {"a table for", [&](Chunk& c) { parts(c, 3) = 4000000000u; }},
                {"and sampling 3", [](Chunk& c) { c.arrays.lights[3].sampling = 3; }},
                {"first part is not 0", [&](Chunk& c) { parts(c, kCells) = 1; }},
                {"cell 2 has the parts", [&](Chunk& c) { parts(c, kCells + 3) = 0x1000001u; }},
                {"cell 4 has the parts", [&](Chunk& c) { parts(c, kCells + 4) = parts(c, kCells + 5) + 1; }},
                // The cell of column 4 in row 3, which is below the picture, takes the parts of another.
                {"cell 26 has the parts",
                 [&](Chunk& c) { parts(c, kCells + 25) = parts(c, kCells + 26) = parts(c, kCells + 24); }},
                {"does not lead to its cells", [&](Chunk& c) { parts(c, kTree + 1) -= 1; }},
                {"does not lead to its cells", [&](Chunk& c) { parts(c, kTree + 3) = 5; }},
                {"does not lead to its cells", [&](Chunk& c) { parts(c, kSecond - 1) = 0; }},
                {"first part is not 0", [&](Chunk& c) { parts(c, kSecond + 4 + 8) = 7; }}});
}

}  // namespace castor::test
