#include "scene/obj_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "castor/error.h"
#include "support/catch.h"
#include "support/picture_bytes.h"
#include "support/temporary_directory.h"

namespace castor {
namespace {

using test::TemporaryDirectory;

Scene read(const std::string& text, const std::string& mtl = "") {
    const TemporaryDirectory directory;
    if (!mtl.empty()) directory.write("m.mtl", mtl);
    return read_obj(directory.write("mesh.obj", text));
}

/// The message with which the file is refused; empty where it is read.
std::string refusal(const std::string& text, const std::string& mtl = "") {
    try {
        read(text, mtl);
    } catch (const SceneError& error) {
        return error.what();
    }
    return "";
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST_CASE("An OBJ file of plain faces is one flat grey mesh", "[obj]") {
    const Scene scene = read("# a comment\n" + kSquare + "f 1 2 3 4\nf -4 -3 -2\n");
    REQUIRE(scene.meshes.size() == 1);
    const Mesh& mesh = scene.meshes[0];
    CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    CHECK(mesh.triangles == std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}});
    CHECK(mesh.normals.empty());
    CHECK(mesh.line == 6);
    REQUIRE(scene.materials.size() == 1);
    CHECK(scene.materials[mesh.material].diffuse == glm::vec3(0.7f));
    CHECK(scene.cameras.empty());
    CHECK(scene.lights.empty());
    CHECK(scene.warnings.empty());
}

TEST_CASE("OBJ lines may end in any way, and corners be written in any way", "[obj]") {
    for (const std::string line_end : {"\n", "\r\n", "\r"}) {
        std::string text;
        for (const char* line : {"v +0 0. 0", "  v\t1e0  0 -0", "v 1 1 0 0.5 0.5 0.5", "vt 0 0", "g a b", "o thing",
                                 "s 1", "f 1/1 2/1 3/1", "f\t1 2/1/ 3// ", "usemtl"}) {
            text += line + line_end;
        }
        CAPTURE(text);
        const Scene scene = read(text);
        REQUIRE(scene.meshes.size() == 1);
        CHECK(scene.meshes[0].triangles.size() == 2);
        CHECK(scene.meshes[0].positions[2] == glm::vec3(1, 1, 0));
    }
}

TEST_CASE("An OBJ polygon of 300 vertices is a fan of 298 triangles", "[obj]") {
    std::string text, face = "f";
    for (int i = 0; i < 300; ++i) {
        text += fmt::format("v {} {} 0\n", i, i * i);
        face += fmt::format(" {}", i + 1);
    }
    const Scene scene = read(text + face + "\n");
    REQUIRE(scene.meshes.at(0).triangles.size() == 298);
    CHECK(scene.meshes[0].triangles[0] == glm::uvec3(0, 1, 2));
    CHECK(scene.meshes[0].triangles[297] == glm::uvec3(0, 298, 299));
}

TEST_CASE("Runs of OBJ faces of one material are meshes in file order, with vertices of their own", "[obj]") {
    const Scene scene = read("mtllib m.mtl\n" + kSquare +
                                 "v 9 9 9\nusemtl red\nf 3 4 1\nusemtl blue\nf 1 2 3\ng other\nusemtl blue\nf 2 3 4\n"
                                 "usemtl red\nf 1 2 4\n",
                             "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n");
    REQUIRE(scene.meshes.size() == 3);
    CHECK(scene.meshes[0].positions == std::vector<glm::vec3>{{1, 1, 0}, {0, 1, 0}, {0, 0, 0}});
    CHECK(scene.meshes[0].triangles == std::vector<glm::uvec3>{{0, 1, 2}});
    CHECK(scene.meshes[1].triangles == std::vector<glm::uvec3>{{0, 1, 2}, {1, 2, 3}});
    CHECK(scene.meshes[2].positions.size() == 3);
    REQUIRE(scene.materials.size() == 2);
    CHECK(scene.meshes[0].material == scene.meshes[2].material);
    CHECK(scene.materials[scene.meshes[0].material].diffuse == glm::vec3(1, 0, 0));
    CHECK(scene.materials[scene.meshes[1].material].diffuse == glm::vec3(0, 0, 1));
    CHECK(scene.warnings.empty());
}

TEST_CASE("OBJ normals make a run smooth where each corner has one", "[obj]") {
    const std::string normals = "vn 0 0 2\nvn 0 3 4\nvn 0 0 0\n";
    SECTION("split by pairs of vertex and normal") {
        const Mesh mesh =
            read(kSquare + normals + "f 1//1 2//2 3//3\nf 1//1 3//-1 4//2\nf 1//2 2//2 3//1\n").meshes.at(0);
        CHECK(mesh.triangles == std::vector<glm::uvec3>{{0, 1, 2}, {0, 2, 3}, {4, 1, 5}});
        REQUIRE(mesh.normals.size() == 6);
        REQUIRE(mesh.positions.size() == 6);
        CHECK(mesh.normals[0] == glm::vec3(0, 0, 1));
        CHECK(mesh.normals[1] == glm::vec3(0.0f, 0.6f, 0.8f));
        CHECK(mesh.normals[2] == glm::vec3(0, 0, 0));
        CHECK(mesh.positions[4] == mesh.positions[0]);
        CHECK(mesh.normals[4] == mesh.normals[1]);
    }
    SECTION("flat where one is missing") {
        const Mesh mesh = read(kSquare + normals + "f 1//1 2//2 3//3\nf 1//2 3//1 4\n").meshes.at(0);
        CHECK(mesh.normals.empty());
        CHECK(mesh.positions.size() == 4);
    }
}

TEST_CASE("MTL terms become a material's", "[obj]") {
    const Scene scene = read("mtllib m.mtl\n" + kSquare + "usemtl glow\nf 1 2 3\n",
                             "newmtl plain\nKa .1 .2 .3\nKd .4 .5 .6\nKs .7 .8 .9\nNs 20\n\n"
                             "newmtl dim\nKd 0.5 0.5 0.5\nNs 0\n"
                             "newmtl glow\nKd 0 0 0\nKe 20 10 0\n"
                             "newmtl chrome\nKs .9 .8 2\nillum 3\n"
                             "newmtl glass\nKs .3 .3 .3\nillum 7\n"
                             "newmtl wood\nmap_Kd wood.png\n");
    REQUIRE(scene.materials.size() == 6);
    CHECK(scene.materials[0].ambient == glm::vec3(0.1f, 0.2f, 0.3f));
    CHECK(scene.materials[0].diffuse == glm::vec3(0.4f, 0.5f, 0.6f));
    CHECK(scene.materials[0].specular == glm::vec3(0.7f, 0.8f, 0.9f));
    CHECK(scene.materials[0].phong_exponent == 20.0f);
    CHECK(scene.materials[0].kind == MaterialKind::plain);
    CHECK(scene.materials[1].ambient == glm::vec3(0.5f));
    CHECK(scene.materials[1].phong_exponent == 1.0f);
    CHECK(scene.materials[2].ambient == glm::vec3(10.0f, 5.0f, 0.0f));
    CHECK(scene.materials[3].kind == MaterialKind::mirror);
    CHECK(scene.materials[3].mirror == glm::vec3(0.9f, 0.8f, 1.0f));
    CHECK(scene.meshes.at(0).material == 2);
    REQUIRE(scene.warnings.size() == 2);
    CHECK(contains(scene.warnings[0].text, "'glass' is transparent"));
    CHECK(contains(scene.warnings[1].text, "'wood': "));
    CHECK(contains(scene.warnings[1].text, "wood.png: "));
    CHECK(contains(scene.warnings[1].text, "a checkerboard of magenta"));
}

TEST_CASE("What is missing for an OBJ file is a warning, with its line, and grey", "[obj]") {
    const Scene scene = read(kSquare + "mtllib gone.mtl\nusemtl red\nf 1 2 3\nusemtl red\nf 2 3 4\n");
    REQUIRE(scene.warnings.size() == 2);
    CHECK(scene.warnings[0].line == 5);
    CHECK(contains(scene.warnings[0].text, "'gone.mtl'"));
    CHECK(scene.warnings[1].line == 6);
    CHECK(contains(scene.warnings[1].text, "'red'"));
    REQUIRE(scene.meshes.size() == 1);
    CHECK(scene.materials.at(scene.meshes[0].material).diffuse == glm::vec3(0.7f));
}

TEST_CASE("MTL names may have spaces, and the MTL file be empty", "[obj]") {
    const TemporaryDirectory directory;
    directory.write("my materials.mtl", "newmtl light oak\nKd 1 0 0\n");
    const Scene scene =
        read_obj(directory.write("a.obj", "mtllib my materials.mtl\n" + kSquare + "usemtl light oak \nf 1 2 3\n"));
    CHECK(scene.warnings.empty());
    CHECK(scene.materials.at(scene.meshes.at(0).material).diffuse == glm::vec3(1, 0, 0));
    CHECK(read("mtllib m.mtl\n" + kSquare + "f 1 2 3\n", "\n").meshes.size() == 1);
}

TEST_CASE("MTL paths may have separators of Windows, and lead where the files no longer are", "[obj]") {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory.path() / "some folder");
    directory.write("some folder/red ones.mtl", "newmtl red\nKd 1 0 0\n");
    directory.write("blue.mtl", "\xef\xbb\xbfnewmtl blue\\grey\nKd 0 0 1\n");
    directory.write("green.mtl", "newmtl green\nKd 0 1 0\n");
    const Scene scene =
        read_obj(directory.write("a.obj",
                                 "mtllib some folder\\red ones.mtl\nmtllib C:\\work\\blue.mtl\n"
                                 "mtllib gone.mtl .\\green.mtl\nmtllib gone.mtl\nmtllib \"green.mtl\"\n" +
                                     kSquare + "usemtl blue\\grey\nf 1 2 3\n"));
    REQUIRE(scene.materials.size() == 3);
    CHECK(scene.materials[0].diffuse == glm::vec3(1, 0, 0));
    CHECK(scene.materials[2].diffuse == glm::vec3(0, 1, 0));
    CHECK(scene.meshes.at(0).material == 1);
    REQUIRE(scene.warnings.size() == 1);
    CHECK(scene.warnings[0].line == 3);
    CHECK(contains(scene.warnings[0].text, "'gone.mtl'"));
}

TEST_CASE("OBJ faces may come before their vertices", "[obj]") {
    CHECK(read("f 1 2 3\n" + kSquare).meshes.at(0).positions.size() == 3);
    CHECK(read("f 1//1 2//1 3//1\n" + kSquare + "vn 0 0 2\n").meshes.at(0).normals.size() == 3);
}

TEST_CASE("OBJ and MTL files may begin with a byte-order mark, in UTF-8 and UTF-16", "[obj]") {
    const auto utf16 = [](const std::u16string& text, bool big_endian) {
        std::string bytes;
        for (const char16_t unit : u'\ufeff' + text) {
            const char low = static_cast<char>(unit), high = static_cast<char>(unit >> 8);
            bytes += big_endian ? std::string{high, low} : std::string{low, high};
        }
        return bytes;
    };
    const std::u16string obj =
        u"mtllib m.mtl\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nusemtl Stra\u00dfe \u2603 \U0001f600\r\nf 1 2 3\r\n";
    const std::u16string mtl = u"newmtl Stra\u00dfe \u2603 \U0001f600\nKd 1 0 0\n";
    const std::string utf8_obj =
        "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl Stra\xc3\x9f"
        "e \xe2\x98\x83 \xf0\x9f\x98\x80\nf 1 2 3\n";
    const std::string utf8_mtl =
        "newmtl Stra\xc3\x9f"
        "e \xe2\x98\x83 \xf0\x9f\x98\x80\nKd 1 0 0\n";
    const std::string mark = "\xef\xbb\xbf";
    for (const std::string& text : {utf8_obj, mark + utf8_obj, utf16(obj, false), utf16(obj, true)})
        for (const std::string& materials : {utf8_mtl, mark + utf8_mtl, utf16(mtl, false), utf16(mtl, true)}) {
            const Scene scene = read(text, materials);
            CHECK(scene.warnings.empty());
            REQUIRE(scene.meshes.size() == 1);
            CHECK(scene.meshes[0].positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
            CHECK(scene.materials.at(scene.meshes[0].material).diffuse == glm::vec3(1, 0, 0));
        }
    // Half a pair of surrogates, and half a unit, are no characters; what is around them is read.
    const std::u16string broken = u"# \xd83d \xde00\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n#\xd83d";
    CHECK(read(utf16(broken, false)).meshes.size() == 1);
    CHECK(read(utf16(broken, true) + 'x').meshes.size() == 1);
    CHECK(contains(refusal(utf16(u"v 0 0 0\nv 1 x 0\n", true)), ":2: found 'x'"));
}

TEST_CASE("OBJ and MTL lines are continued after a backslash, comments are not", "[obj]") {
    for (const std::string line_end : {"\n", "\r\n", "\r"}) {
        std::string text;
        for (const char* line : {"# a folder C:\\", "v 0 \\", "0 \\", "0", "v 1 0\\", "0", "v 0 1 0", "v 1 1 0",
                                 "mtllib \\", "m.mtl", "usemtl \\", "red", "f 1 2 3\\", "4 \\"})
            text += line + line_end;
        CAPTURE(text);
        const Scene scene = read(text, "newmtl red\nKd 1 \\" + line_end + "0 0\n");
        CHECK(scene.warnings.empty());
        REQUIRE(scene.meshes.size() == 1);
        CHECK(scene.meshes[0].positions.at(1) == glm::vec3(1, 0, 0));
        CHECK(scene.meshes[0].triangles.size() == 2);
        CHECK(scene.meshes[0].line == 13);
        CHECK(scene.materials.at(scene.meshes[0].material).diffuse == glm::vec3(1, 0, 0));
    }
}

TEST_CASE("OBJ faces that name normals that are not there are flat, with a warning", "[obj]") {
    const std::string normals = "vn 0 0 1\nvn 0 0 1\n";
    struct Case {
        std::string faces;
        const char* text;
        std::size_t line;
    };
    const Case cases[] = {
        {"f 1//1 2//1 3//3\n", "normal index 3, but the file has 2 normals", 7},
        {"f 1//1 2//1 3//2\nf 1//1 3//7 4//9\nf 1//4 2//1 3//1\n", "normal index 9, but the file has 2 normals", 8},
        {"f 1//1 2//1 3//2\nf 1//-3 3//1 4//1\n", "normal index -3, but the file has 2 normals", 8},
        {"f 1//1 2//1 3//0\nf 1//5 2//1 3//1\n", "normal index 0, but the file has 2 normals", 7},
        {"f 1//4294967297 2//1 3//1\n", "normal index 4294967297, but the file has 2 normals", 7},
        {"f 1//-9223372036854775808 2//1 3//1\n", "normal index -9223372036854775808, but", 7},
    };
    for (const Case& test : cases) {
        CAPTURE(test.faces);
        const Scene scene = read(kSquare + normals + test.faces);
        REQUIRE(scene.warnings.size() == 1);
        CHECK(contains(scene.warnings[0].text, test.text));
        CHECK(scene.warnings[0].line == test.line);
        CHECK(scene.meshes.at(0).normals.empty());
    }
    // The faces of another material keep theirs.
    const Scene scene =
        read("mtllib m.mtl\n" + kSquare + normals + "f 1//1 2//1 3//9\nusemtl red\nf 1//1 2//1 3//1\n", "newmtl red\n");
    REQUIRE(scene.meshes.size() == 2);
    CHECK(scene.meshes[0].normals.empty());
    CHECK(scene.meshes[1].normals.size() == 3);
}

TEST_CASE("OBJ faces that name texture coordinates that are not there are read with a warning", "[obj]") {
    for (const char* index : {"2", "-2", "0", "99999999999"}) {
        const Scene scene =
            read(kSquare + "vn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/-1/1\n" + fmt::format("f 1/1/1 2/{}/1 3/1/1\n", index));
        CAPTURE(index);
        REQUIRE(scene.warnings.size() == 1);
        CHECK(contains(scene.warnings[0].text,
                       fmt::format("texture coordinate index {}, but the file has 1 texture coordinate:", index)));
        CHECK(scene.warnings[0].line == 8);
        CHECK(scene.meshes.at(0).normals.size() == 4);  // a vertex with texture coordinates, and without
        CHECK(scene.meshes.at(0).triangles.size() == 2);
    }
}

TEST_CASE("OBJ texture coordinates have v from below, and split vertices that have several", "[obj]") {
    // Two triangles with a seam: vertices 1 and 3 have other coordinates in the second. The last corner has none.
    const std::string text = kSquare + "vt 0 0\nvt 1 0 0.5\nvt 1 1\nvt 0.25\nf 1/1 2/2 3/3\nf 1/4 3/1 4\n";
    const Scene scene = read(text);
    CHECK(scene.warnings.empty());
    const Mesh& mesh = scene.meshes.at(0);
    CHECK(mesh.triangles == std::vector<glm::uvec3>{{0, 1, 2}, {3, 4, 5}});
    CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    CHECK(mesh.texture_coordinates == std::vector<glm::vec2>{{0, 1}, {1, 1}, {1, 0}, {0.25f, 1}, {0, 1}, {0, 0}});
    CHECK(mesh.normals.empty());
    CHECK(read(kSquare + "vt 0 0\nf 1 2 3\n").meshes.at(0).texture_coordinates.empty());
}

TEST_CASE("computed normals of an OBJ file do not depend on texture coordinates", "[obj]") {
    const TemporaryDirectory directory;
    const std::string vertices = "v 0 0 0\nv 1 0 0.5\nv 1 1 0\nv 0 1 1\nv 2 1 -1\n";
    std::string coordinates;
    for (int i = 0; i < 9; ++i) coordinates += fmt::format("vt {} {}\n", i, 0.5 * i);
    const auto with =
        directory.write("with.obj", vertices + coordinates + "f 1/1 2/2 3/3\nf 1/4 3/5 4/6\nf 2/7 5/8 3/9\n");
    const auto without = directory.write("without.obj", vertices + "f 1 2 3\nf 1 3 4\nf 2 5 3\n");
    const Mesh split = read_obj(with, {}, true).meshes.at(0), whole = read_obj(without, {}, true).meshes.at(0);
    CHECK(split.positions.size() == 9);
    CHECK(whole.positions.size() == 5);
    REQUIRE(split.normals.size() == split.positions.size());
    REQUIRE(whole.normals.size() == whole.positions.size());
    for (std::size_t triangle = 0; triangle < 3; ++triangle)
        for (int corner = 0; corner < 3; ++corner)
            CHECK(split.normals[split.triangles[triangle][corner]] == whole.normals[whole.triangles[triangle][corner]]);
    Mesh expected = whole;
    compute_smooth_normals(expected);
    CHECK(whole.normals == expected.normals);
    CHECK(read_obj(with).meshes.at(0).normals.empty());
}

TEST_CASE("map_Kd of an MTL file is a texture in place of Kd", "[obj]") {
    const TemporaryDirectory directory;
    std::filesystem::create_directory(directory.path() / "maps");
    directory.write("maps/red.png", test::png_bytes(2, 1, 3, {255, 0, 0, 128, 0, 0}));
    directory.write("blue.bmp", test::bmp_bytes(1, 1, 3, {0, 0, 255}));
    directory.write("broken.png", "no picture");
    directory.write("m.mtl",
                    "newmtl a\nKd 0.2 0.3 0.4\nmap_Kd maps\\red.png\nmap_Bump b.png\nnorm n.png\n"
                    "newmtl b\nmap_Kd -clamp on -s 2 2 1 maps/red.png\nbump b.png\n"
                    "newmtl c\nmap_Kd C:\\work\\blue.bmp\n"
                    "newmtl d\nmap_Kd broken.png\nnewmtl e\nmap_Kd ../gone.png\n");
    const Scene scene = read_obj(directory.write("a.obj", "mtllib m.mtl\n" + kSquare + "usemtl c\nf 1 2 3\n"));
    REQUIRE(scene.materials.size() == 5);
    REQUIRE(scene.textures.size() == 5);
    for (std::uint32_t i = 0; i < 5; ++i) {
        CAPTURE(i);
        CHECK(scene.materials[i].textures == std::vector<std::uint32_t>{i});
        CHECK(scene.textures[i].kind == TextureKind::image);
        CHECK(scene.textures[i].target == TextureTarget::replace_diffuse);
        CHECK(scene.textures[i].filter == TextureFilter::bilinear);
        CHECK(scene.textures[i].normalizer == 255.0f);
        CHECK((scene.textures[i].wrap == TextureWrap::clamp) == (i == 1));
    }
    CHECK(scene.materials[0].diffuse == glm::vec3(0.2f, 0.3f, 0.4f));
    REQUIRE(scene.images.size() == 4);
    CHECK(scene.textures[1].image == 0);
    CHECK(scene.images[0].bytes == std::vector<std::uint8_t>{255, 0, 0, 128, 0, 0});
    CHECK(scene.images[1].bytes == std::vector<std::uint8_t>{0, 0, 255});
    CHECK(scene.images[2].bytes.size() == 12);
    CHECK(scene.images[3].bytes == scene.images[2].bytes);
    std::vector<std::string> texts;
    for (const Warning& warning : scene.warnings) texts.push_back(warning.text);
    CAPTURE(texts);
    REQUIRE(texts.size() == 6);
    CHECK(contains(texts[0], "material 'a': map_Bump is not read"));
    CHECK(contains(texts[1], "material 'a': norm is not read"));
    CHECK(contains(texts[2], "material 'b': -s and -o of map_Kd"));
    CHECK(contains(texts[3], "material 'd': "));
    CHECK(contains(texts[3], "broken.png"));
    CHECK(contains(texts[4], "gone.png' of material 'e' is not in the MTL file's folder"));
    CHECK(contains(texts[5], "a checkerboard of magenta and black"));
    CHECK(scene.warnings[2].line == 6);
}

TEST_CASE("Wrong OBJ files are refused with line and reason", "[obj]") {
    struct Case {
        std::string text;
        const char* message;
    };
    const Case cases[] = {
        {"", "the file is empty"},
        {"hello\n", "the file has no triangle"},
        {kSquare, "the file has no triangle"},
        {kSquare + "f 1 2\n", "the file has no triangle"},
        {"\xef\xbb\xbf", "the file has no triangle"},
        {kSquare + "l 1 2 3\np 1\nl 3 4\n",
         "the file has no triangle, that is no face of three vertices or more: it has 4 points and 2 lines"},
        {kSquare + "f 1 2 5\n", ":5: vertex index 5 where 1 to 4 was expected"},
        {kSquare + "f 1 2 3\nf 1 2 9\nf 1 2 7\n", ":6: vertex index 9 where 1 to 4 was expected"},
        {kSquare + "f 1 2 -5\n", ":5: vertex index -5 goes back past the first of 4"},
        {kSquare + "f 1 2 0\n", ":5: found '0' where the indices"},
        {kSquare + "f //1 //2 //3\n", ":5: found '//1' where a corner"},
        {kSquare + "f 1 2 x\n", ":5: found 'x' where the indices"},
        {kSquare + "f 1 2 3abc\n", ":5: found '3abc' where the indices"},
        {kSquare + "f 1 2 4294967297\n", ":5: vertex index 4294967297 is too large"},
        {kSquare + "f 1 2 3 \\ \n4\n", ":5: found '\\' where the indices"},
        {kSquare + "f 1 2 \\\n3 \\\r\nx\n", ":5: found 'x' where the indices"},
        {kSquare + "f 1 2 \\\n3 \\\n4\nf 1 2 9\n", ":8: vertex index 9"},
        {kSquare + "f 1 2 99999999999999999999\n", ":5: found '99999999999999999999' where the indices"},
        {kSquare + "f 1 2 -9223372036854775808\n", ":5: vertex index -9223372036854775808 goes back"},
        {kSquare + "f 1/1/1/1 2 3\n", ":5: found '1/1/1/1' where a corner"},
        {"v 0 0 0\r\nv 1 0\r\n", ":2: found 2 numbers where three"},
        {"v 0 0 0\nv 1 a 0\n", ":2: found 'a' where a finite number"},
        {"v 0 0 0\nv 1 nan 0\n", ":2: found 'nan' where a finite number"},
        {"v 0 0 1e39\n", ":1: found '1e39' where a finite number"},
        {"v 0 0 0\nvn 1 0 inf\n", ":2: found 'inf' where a finite number"},
        {"v 0 0 0\nvt\n", ":2: found no number where texture coordinates"},
        {"v 0 0 0\nvt 0 nan\n", ":2: found 'nan' where a finite number"},
        {std::string("v 0 0 0\0 1\n", 11), ":1: found '0"},
    };
    for (const Case& test : cases) {
        const std::string message = refusal(test.text);
        CAPTURE(test.text, message, test.message);
        CHECK(contains(message, test.message));
    }
    CHECK(contains(refusal("mtllib m.mtl\n" + kSquare + "f 1 2 3\n", "Kd 7 7 7\nnewmtl b\nnewmtl a\nKd -1 0 0\n"),
                   "m.mtl:3: material 'a': Kd has -1"));
    const TemporaryDirectory directory;
    CHECK_THROWS_AS(read_obj(directory.path() / "none.obj"), SceneError);
    CHECK_THROWS_AS(read_obj(directory.path()), SceneError);
}

TEST_CASE("An OBJ file of a hundred thousand runs is read at once", "[obj]") {
    std::string text = "mtllib m.mtl\n" + kSquare;
    for (int i = 0; i < 50000; ++i) text += "usemtl red\nf 1 2 3\nusemtl blue\nf 2 3 4\n";
    CHECK(read(text, "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n").meshes.size() == 100000);
}

TEST_CASE("Damaged OBJ files never crash the reader", "[obj]") {
    const TemporaryDirectory directory;
    const std::string mtl =
        "newmtl red\nKa 0 0 0\nKd 1 0 0\nKs 1 1 1\nNs 30\nKe 1 1 1\nillum 2\nmap_Kd -s 1 1 1 a.png\n";
    const std::string obj =
        "mtllib m.mtl\n" + kSquare + "vn 0 0 1\nvt 0 0\ng a b\no c\nusemtl red\nf 1/1/1 2//1 3//1 -1//-1\nf 1 2 3\n";
    for (unsigned seed = 0; seed < 300; ++seed) {
        std::mt19937 random(seed);
        std::string texts[2] = {obj, mtl};
        std::string& text = texts[seed % 4 == 0];
        for (unsigned change = 0; change <= seed % 5; ++change) {
            const std::size_t at = random() % text.size();
            switch (random() % 4) {
                case 0:
                    text[at] = static_cast<char>(random());
                    break;
                case 1:
                    text.erase(at, 1 + random() % 8);
                    break;
                case 2:
                    text.insert(at, text.substr(random() % text.size(), random() % 16));
                    break;
                default:
                    text[at] = static_cast<char>('0' + random() % 10);
                    break;
            }
        }
        CAPTURE(seed, texts[0], texts[1]);
        directory.write("m.mtl", texts[1]);
        try {
            const Scene scene = read_obj(directory.write("mesh.obj", texts[0]));
            CHECK(!scene.meshes.empty());
            for (const Mesh& mesh : scene.meshes) {
                CHECK(mesh.material < scene.materials.size());
                CHECK((mesh.normals.empty() || mesh.normals.size() == mesh.positions.size()));
                for (const glm::uvec3& triangle : mesh.triangles) {
                    for (int i = 0; i < 3; ++i) CHECK(triangle[i] < mesh.positions.size());
                }
            }
        } catch (const SceneError& error) {
            CHECK(!error.reason().empty());
        }
    }
}

}  // namespace
}  // namespace castor
