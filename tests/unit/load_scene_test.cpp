#include <fstream>
#include <string>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor {

namespace {

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const std::string kCameras =
    "<Cameras><Camera><Position>0 0 0</Position><Gaze>0 0 -1</Gaze><Up>0 1 0</Up><NearPlane>-1 1 -1 1</NearPlane>"
    "<NearDistance>1</NearDistance><ImageResolution>8 4</ImageResolution></Camera></Cameras>";
const std::string kObjects =
    "<Materials><Material id='1'/></Materials><VertexData>0 0 -2</VertexData>"
    "<Objects><Sphere><Material>1</Material><Center>1</Center><Radius>1</Radius></Sphere></Objects>";

std::string scene(const std::string& parts) {
    return "<Scene>" + parts + "</Scene>";
}

}  // namespace

TEST_CASE("a scene file is read by its extension, in any case", "[load_scene]") {
    const test::TemporaryDirectory folder;
    for (const char* name : {"a.xml", "a.XML", "a.b.Xml"}) {
        CAPTURE(name);
        const Scene xml = load_scene(folder.write(name, scene(kCameras + kObjects)));
        CHECK(xml.file == (folder.path() / name).string());
        CHECK(xml.spheres.size() == 1);
        CHECK(xml.cameras.at(0).width == 8);
        CHECK(xml.warnings.empty());
    }
    for (const char* name : {"a.ply", "a.PLY", "a.obj", "a.Obj"}) {
        CAPTURE(name);
        const Scene mesh = load_scene(folder.write(name, std::string(name).find_first_of("yY") == 4 ? kPly : kObj));
        CHECK(mesh.file == (folder.path() / name).string());
        REQUIRE(mesh.meshes.size() == 1);
        CHECK(mesh.meshes[0].triangles.size() == 1);
        CHECK(mesh.meshes[0].material < mesh.materials.size());
        CHECK(mesh.cameras.size() == 1);
        CHECK_FALSE(mesh.lights.empty());
    }
}

TEST_CASE("a PLY mesh alone is smooth", "[load_scene]") {
    const test::TemporaryDirectory folder;
    CHECK(load_scene(folder.write("a.ply", kPly)).meshes.at(0).normals.size() == 3);
}

TEST_CASE("XML and PLY are known by their content", "[load_scene]") {
    const test::TemporaryDirectory folder;
    CHECK(load_scene(folder.write("scene", scene(kCameras + kObjects))).spheres.size() == 1);
    CHECK(load_scene(folder.write("scene.txt", "\xef\xbb\xbf\n " + scene(kCameras + kObjects))).spheres.size() == 1);
    CHECK(load_scene(folder.write("scene.mesh", kPly)).meshes.size() == 1);
}

TEST_CASE("what is no scene file is refused", "[load_scene]") {
    const test::TemporaryDirectory folder;
    struct Case {
        std::filesystem::path file;
        std::string words;
    };
    std::filesystem::create_directory(folder.path() / "folder.xml");
    for (const Case& one :
         {Case{folder.path() / "none.xml", "none.xml: does not exist"},
          Case{folder.path() / "none", "none: does not exist"},
          Case{folder.path() / "none.ply", "none.ply: does not exist"},
          Case{folder.write("file", "x") / "below.xml", "below.xml: does not exist"}, Case{"", "is empty"},
          Case{folder.path() / "folder.xml", "is a directory"}, Case{folder.path(), "is a directory"},
          Case{folder.write("a.fbx", "{}"), "the unknown extension '.fbx'"},
          Case{folder.write("a.gltf", "{}"), "no member"}, Case{folder.write("b", kObj), "has no extension"},
          Case{folder.write("c", ""), ".xml, .json, .gltf, .glb, .ply, .obj or .stl was expected"},
          Case{folder.write("empty.xml", ""), "empty.xml: is empty"}, Case{folder.write("empty.ply", ""), "empty.ply"},
          Case{folder.write("empty.obj", ""), "empty.obj"}, Case{folder.write("mesh.xml", kPly), "begins with 'ply'"},
          Case{folder.write("nothing.xml", "<Scene/>"), "no <Camera> and no object"}}) {
        CAPTURE(one.file.string());
        CHECK_THROWS_AS(load_scene(one.file), SceneError);
        CHECK_THROWS_WITH(load_scene(one.file), Catch::Contains(one.words));
    }
}

TEST_CASE("the example in scenes/README.md is a scene", "[load_scene]") {
    std::ifstream stream(CASTOR_SOURCE_DIR "/scenes/README.md");
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    const std::size_t begin = text.find("    <Scene>"), end = text.find("    </Scene>");
    REQUIRE(begin != text.npos);
    REQUIRE(end != text.npos);
    const test::TemporaryDirectory folder;
    const Scene example = load_scene(folder.write("a.xml", text.substr(begin, end + 12 - begin)));
    CHECK(example.warnings.empty());
    CHECK(example.cameras.size() == 1);
    CHECK(example.lights.size() == 1);
    CHECK(example.spheres.size() == 1);
}

TEST_CASE("an XML scene without a camera gets one, and keeps its lights", "[load_scene]") {
    const test::TemporaryDirectory folder;
    const Scene lit = load_scene(folder.write(
        "a.xml", scene("<BackgroundColor>1 2 3</BackgroundColor><Lights><AmbientLight>4 5 6</AmbientLight></Lights>" +
                       kObjects)));
    CHECK(lit.cameras.size() == 1);
    CHECK(lit.background == glm::vec3(1, 2, 3));
    CHECK(lit.ambient_light == glm::vec3(4, 5, 6));
    CHECK(lit.lights.empty());
    CHECK(lit.materials.size() == 1);
    REQUIRE(lit.warnings.size() == 1);
    CHECK_THAT(lit.warnings[0].text, Catch::Contains("no <Camera>"));
    const Scene dark = load_scene(folder.write("b.xml", scene(kObjects)));
    CHECK_FALSE(dark.lights.empty());
}

}  // namespace castor
