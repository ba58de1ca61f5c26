#include "scene/stl_reader.h"

#include <cstring>
#include <limits>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "support/catch.h"
#include "support/temporary_directory.h"

namespace castor {
namespace {

using test::TemporaryDirectory;

std::string text_of(const std::string& last_vertex = "0 1 0") {
    return "solid a cube or so\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1e0 0 0\n   vertex " +
           last_vertex +
           "\n  endloop\n endfacet\nFACET NORMAL nan nan nan\r\nouter loop vertex 1 0 0 vertex 1 1 0 "
           "vertex 0 1 -0 endloop endfacet endsolid a cube or so\n";
}

std::string binary_of(const std::vector<float>& coordinates, const std::string& header = "solid, all the same") {
    std::string bytes = header;
    bytes.resize(80);
    const auto count = static_cast<std::uint32_t>(coordinates.size() / 9);
    bytes.append(reinterpret_cast<const char*>(&count), 4);
    for (std::uint32_t i = 0; i < count; ++i) {
        bytes.append(12, '\0');
        bytes.append(reinterpret_cast<const char*>(coordinates.data() + 9 * i), 36);
        bytes.append(2, '\x55');
    }
    return bytes;
}

std::string refusal(const std::string& bytes) {
    const TemporaryDirectory directory;
    try {
        read_stl(directory.write("a.stl", bytes));
    } catch (const SceneError& error) {
        return std::to_string(error.line()) + ": " + error.reason();
    }
    return "";
}

TEST_CASE("STL files, ASCII and binary, are a mesh whose equal points are one vertex", "[stl]") {
    const TemporaryDirectory directory;
    for (const std::string& bytes :
         {text_of(), binary_of({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 1, -0.0f})}) {
        const Mesh mesh = read_stl(directory.write("a.stl", bytes));
        CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
        CHECK(mesh.triangles == std::vector<glm::uvec3>{{0, 1, 2}, {1, 3, 2}});
        CHECK(mesh.normals.empty());
        for (const char* name : {"b.stl", "b.STL", "b.part"})
            CHECK(load_scene(directory.write(name, bytes)).meshes.at(0).triangles.size() == 2);
    }
}

TEST_CASE("ASCII STL files may have a byte-order mark, capitals and the line ends of any system", "[stl]") {
    const TemporaryDirectory directory;
    const std::string text = text_of();
    std::string with_carriage_returns = text;
    for (char& c : with_carriage_returns)
        if (c == '\n') c = '\r';
    for (const std::string& bytes :
         {"\xef\xbb\xbf" + text, "\r\n " + text, "SOLID" + text.substr(5), with_carriage_returns})
        CHECK(read_stl(directory.write("a.stl", bytes)).triangles.size() == 2);
    with_carriage_returns.replace(with_carriage_returns.rfind("vertex 0 1"), 10, "vertex 0 x");
    CHECK_THAT(refusal(with_carriage_returns), Catch::StartsWith("11: \"x\" where a number"));
}

TEST_CASE("What is wrong in an STL file is refused by its line or byte", "[stl]") {
    CHECK_THAT(refusal(text_of("0 x 0")), Catch::StartsWith("6: \"x\" where a number"));
    CHECK_THAT(refusal(text_of("0 nan 0")), Catch::StartsWith("6: the coordinate nan"));
    CHECK_THAT(refusal(text_of("0 1e30 0")), Catch::StartsWith("6: the coordinate 1e+30"));
    CHECK_THAT(refusal(text_of().substr(0, text_of().find("vertex"))), Catch::Contains("the file ends where"));
    CHECK_THAT(refusal("solid\nendsolid\n"), Catch::Contains("no triangle"));
    CHECK_THAT(refusal(""), Catch::Contains("no STL file"));
    const std::string binary = binary_of({0, 0, 0, 1, 0, 0, 0, 1, 0}, "header");
    CHECK_THAT(refusal(binary.substr(0, 100)),
               Catch::Contains("byte 80: 1 triangles need 134 bytes, but the file has 100"));
    for (const std::string& solid :
         {binary_of({0, 0, 0, 1, 0, 0, 0, 1, 0}), binary_of({}, std::string(80, ' ').replace(0, 5, "solid"))})
        CHECK_THAT(refusal(solid + "more"), Catch::StartsWith("0: byte 80: ") && Catch::Contains("triangles need"));
    CHECK_THAT(refusal(binary_of({}, "header")), Catch::Contains("no triangle"));
    CHECK_THAT(refusal(binary_of({0, 0, 0, 1, 0, 0, 0, std::numeric_limits<float>::infinity(), 0}, "header")),
               Catch::Contains("byte 124: the coordinate inf"));
}

}  // namespace
}  // namespace castor
