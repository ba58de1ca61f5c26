#include "scene/obj_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <random>

#include "castor/error.h"
#include "support/catch.h"
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
    CHECK(contains(scene.warnings[1].text, "'wood': map_Kd"));
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

TEST_CASE("OBJ faces may come before their vertices", "[obj]") {
    CHECK(read("f 1 2 3\n" + kSquare).meshes.at(0).positions.size() == 3);
}

TEST_CASE("Wrong OBJ files are refused with line and reason", "[obj]") {
    struct Case {
        std::string text;
        const char* message;
    };
    const Case cases[] = {
        {"", "the file is empty"},
        {"hello\n", "the file has no face"},
        {kSquare, "the file has no face"},
        {kSquare + "f 1 2\n", "the file has no face"},
        {kSquare + "f 1 2 5\n", ":5: vertex index 5 where 1 to 4 was expected"},
        {kSquare + "f 1 2 3\nf 1 2 9\nf 1 2 7\n", ":6: vertex index 9 where 1 to 4 was expected"},
        {kSquare + "f 1 2 -5\n", ":5: vertex index -5 goes back past the first of 4"},
        {kSquare + "f 1 2 0\n", ":5: found '0' where the indices"},
        {kSquare + "f //1 //2 //3\n", ":5: found '//1' where a corner"},
        {kSquare + "f 1 2 x\n", ":5: found 'x' where the indices"},
        {kSquare + "f 1 2 3abc\n", ":5: found '3abc' where the indices"},
        {kSquare + "f 1 2 4294967297\n", ":5: vertex index 4294967297 is too large"},
        {kSquare + "f 1 2 3 \\\n4\n", ":5: found '\\' where the indices"},
        {kSquare + "f 1 2 99999999999999999999\n", ":5: found '99999999999999999999' where the indices"},
        {kSquare + "f 1 2 -9223372036854775808\n", ":5: vertex index -9223372036854775808 goes back"},
        {kSquare + "f 1/1/1/1 2 3\n", ":5: found '1/1/1/1' where a corner"},
        {kSquare + "f 1//1 2//1 3//1\n", ":5: normal index 1 where 1 to 0 was expected"},
        {kSquare + "f 1//-1 2//1 3//1\n", ":5: normal index -1 goes back"},
        {"v 0 0 0\r\nv 1 0\r\n", ":2: found 2 numbers where three"},
        {"v 0 0 0\nv 1 a 0\n", ":2: found 'a' where a finite number"},
        {"v 0 0 0\nv 1 nan 0\n", ":2: found 'nan' where a finite number"},
        {"v 0 0 1e39\n", ":1: found '1e39' where a finite number"},
        {"v 0 0 0\nvn 1 0 inf\n", ":2: found 'inf' where a finite number"},
        {std::string("v 0 0 0\0 1\n", 11), ":1: found '0"},
    };
    for (const Case& test : cases) {
        const std::string message = refusal(test.text);
        CAPTURE(test.text, message, test.message);
        CHECK(contains(message, test.message));
    }
    CHECK(contains(refusal("mtllib m.mtl\n" + kSquare + "f 1 2 3\n", "newmtl a\nKd -1 0 0\n"), "'a': Kd has -1"));
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
