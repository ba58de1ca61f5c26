#include "scene/ply_reader.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>

#include "castor/error.h"
#include "support/catch.h"
#include "support/ply_writer.h"
#include "support/temporary_directory.h"

namespace castor {
namespace {

using test::PlyWriter;
using test::TemporaryDirectory;

Mesh read(const std::string& bytes) {
    const TemporaryDirectory directory;
    return read_ply(directory.write("mesh.ply", bytes));
}

/// The message with which `bytes` is refused; empty where it is read.
std::string refusal(const std::string& bytes) {
    try {
        read(bytes);
    } catch (const SceneError& error) {
        return error.what();
    }
    return "";
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

/// A tetrahedron of plain vertices and triangles.
std::string tetrahedron(PlyWriter::Format format, const std::string& line_end = "\n") {
    PlyWriter writer(format, line_end);
    writer.line("comment a tetrahedron").line("obj_info num_cols 4");
    writer.line("element vertex 4").line("property float x").line("property float y").line("property float z");
    writer.line("element face 4").line("property list uchar int vertex_indices").line("end_header");
    for (const std::vector<double>& p : {std::vector<double>{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) {
        writer.put("float", p).end_line();
    }
    for (const std::vector<double>& t : {std::vector<double>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}) {
        writer.put("uchar", {3}).put("int", t).end_line();
    }
    return writer.bytes();
}

void check_tetrahedron(const Mesh& mesh) {
    REQUIRE(mesh.positions.size() == 4);
    REQUIRE(mesh.triangles.size() == 4);
    CHECK(mesh.normals.empty());
    CHECK(mesh.material == 0);
    CHECK(mesh.positions[0] == glm::vec3(0, 0, 0));
    CHECK(mesh.positions[3] == glm::vec3(0, 0, 1));
    CHECK(mesh.triangles[0] == glm::uvec3(0, 2, 1));
    CHECK(mesh.triangles[3] == glm::uvec3(2, 0, 3));
}

TEST_CASE("A PLY file is read in every format and with every line end", "[ply]") {
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        for (const std::string line_end : {"\n", "\r\n", "\r"}) {
            CAPTURE(PlyWriter::name(format), line_end);
            check_tetrahedron(read(tetrahedron(format, line_end)));
        }
    }
}

TEST_CASE("PLY properties of every type are read, extra ones and other elements skipped", "[ply]") {
    const std::vector<std::vector<std::string>> names = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                                         {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                                         {"float", "float32"}, {"double", "float64"}};
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        for (std::size_t i = 0; i < names.size(); ++i) {
            for (const std::string& type : names[i]) {
                CAPTURE(PlyWriter::name(format), type);
                const bool is_integer = i < 6;
                const std::string index_type = is_integer ? type : "int";
                PlyWriter writer(format);
                writer.line("element camera 2").line("property list " + index_type + " " + type + " data");
                writer.line("property double focus");
                writer.line("element vertex 3").line("property " + type + " z").line("property list uchar short tags");
                writer.line("property " + type + " x").line("property uchar red").line("property " + type + " y");
                writer.line("element empty 0").line("element nothing 1000000000000");
                writer.line("element face 1").line("property " + type + " quality");
                writer.line("property list " + index_type + " " + index_type + " vertex_index");
                writer.line("property list char " + type + " uv");
                writer.line("element edge 1").line("property int a").line("end_header");
                writer.put(index_type, {2}).put(type, {7, 8}).put("double", {1.5}).end_line();
                writer.put(index_type, {0}).put("double", {2.5}).end_line();
                for (int v = 0; v < 3; ++v) {
                    writer.put(type, {30.0 + v}).put("uchar", {double(v)});
                    writer.put("short", std::vector<double>(v, -300)).put(type, {10.0 + v}).put("uchar", {255});
                    writer.put(type, {20.0 + v}).end_line();
                }
                writer.put(type, {9}).put(index_type, {3, 2, 1, 0}).put("char", {2}).put(type, {1, 2}).end_line();
                writer.put("int", {5}).end_line();
                const Mesh mesh = read(writer.bytes());
                REQUIRE(mesh.positions.size() == 3);
                for (int v = 0; v < 3; ++v) CHECK(mesh.positions[v] == glm::vec3(10 + v, 20 + v, 30 + v));
                REQUIRE(mesh.triangles.size() == 1);
                CHECK(mesh.triangles[0] == glm::uvec3(2, 1, 0));
            }
        }
    }
}

TEST_CASE("PLY numbers keep sign, fraction and rounding", "[ply]") {
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty double y\nproperty int z\nelement face 1\n"
        "property list int int vertex_indices\nend_header\n";
    const Mesh mesh = read(header + "-1.5e+2 +0.1 -7\n0.1 1e-60 +3\n1e-50 -.5 0\n3 0 1 2\n");
    CHECK(mesh.positions[0] == glm::vec3(-150.0f, 0.1f, -7.0f));
    CHECK(mesh.positions[1] == glm::vec3(0.1f, 0.0f, 3.0f));
    CHECK(mesh.positions[2] == glm::vec3(0.0f, -0.5f, 0.0f));
}

TEST_CASE("PLY polygons become fans, and faces of fewer than three vertices are left out", "[ply]") {
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        CAPTURE(PlyWriter::name(format));
        PlyWriter writer(format);
        writer.line("element vertex 5").line("property float x").line("property float y").line("property float z");
        writer.line("element face 6").line("property list uchar ushort vertex_indices").line("end_header");
        for (int v = 0; v < 5; ++v) writer.put("float", {double(v), double(v * v), 0}).end_line();
        writer.put("uchar", {3}).put("ushort", {0, 1, 2}).end_line();
        writer.put("uchar", {0}).end_line();
        writer.put("uchar", {5}).put("ushort", {4, 3, 2, 1, 0}).end_line();
        writer.put("uchar", {2}).put("ushort", {0, 1}).end_line();
        writer.put("uchar", {1}).put("ushort", {3}).end_line();
        writer.put("uchar", {4}).put("ushort", {0, 1, 2, 3}).end_line();
        const Mesh mesh = read(writer.bytes());
        const std::vector<glm::uvec3> expected = {{0, 1, 2}, {4, 3, 2}, {4, 2, 1}, {4, 1, 0}, {0, 1, 2}, {0, 2, 3}};
        CHECK(mesh.triangles == expected);
    }
}

TEST_CASE("PLY normals become unit vectors, or zero where they say nothing", "[ply]") {
    const double infinity = std::numeric_limits<double>::infinity();
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        CAPTURE(PlyWriter::name(format));
        PlyWriter writer(format);
        writer.line("element vertex 4");
        for (const char* name : {"nx", "ny", "nz", "x", "y", "z"}) writer.line(fmt::format("property float {}", name));
        writer.line("element face 1").line("property list uchar int vertex_indices").line("end_header");
        writer.put("float", {0, 3, 4, 1, 2, 3}).end_line();
        writer.put("float", {0, 0, 0, 1, 2, 4}).end_line();
        writer.put("float", {std::nan(""), 0, 1, 1, 2, 5}).end_line();
        writer.put("float", {infinity, 0, 1, 1, 2, 6}).end_line();
        writer.put("uchar", {3}).put("int", {0, 1, 2}).end_line();
        const Mesh mesh = read(writer.bytes());
        REQUIRE(mesh.normals.size() == 4);
        CHECK(mesh.normals[0] == glm::vec3(0.0f, 0.6f, 0.8f));
        for (int v = 1; v < 4; ++v) CHECK(mesh.normals[v] == glm::vec3(0.0f));
        CHECK(mesh.positions[3] == glm::vec3(1, 2, 6));
    }
}

TEST_CASE("PLY triangle strips are wound alternately and restart at -1", "[ply]") {
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        CAPTURE(PlyWriter::name(format));
        PlyWriter writer(format);
        writer.line("element vertex 6").line("property float x").line("property float y").line("property float z");
        writer.line("element tristrips 1").line("property list int int vertex_indices").line("end_header");
        for (int v = 0; v < 6; ++v) writer.put("float", {double(v), 0, double(v)}).end_line();
        writer.put("int", {10}).put("int", {0, 1, 2, 3, 3, 4, -1, 5, 4, 3}).end_line();
        const std::vector<glm::uvec3> expected = {{0, 1, 2}, {2, 1, 3}, {5, 4, 3}};
        CHECK(read(writer.bytes()).triangles == expected);
    }
}

TEST_CASE("ASCII PLY needs no particular lines", "[ply]") {
    std::string text = tetrahedron(PlyWriter::Format::ascii);
    const std::size_t body = text.find("end_header\n") + 11;
    SECTION("all in one") {
        std::replace(text.begin() + static_cast<std::ptrdiff_t>(body), text.end(), '\n', ' ');
        check_tetrahedron(read(text));
    }
    SECTION("one word each") {
        std::replace(text.begin() + static_cast<std::ptrdiff_t>(body), text.end(), ' ', '\n');
        check_tetrahedron(read(text));
    }
    SECTION("blank lines and tabs") {
        text.insert(body, "\n \t\n");
        text.insert(text.find("1 0 0"), "\n\t");
        text.insert(text.find("3 1 2 3"), "\r\n\n");
        check_tetrahedron(read(text));
    }
    SECTION("no end of the last line") {
        check_tetrahedron(read(text.substr(0, text.size() - 2)));
    }
}

/// A strip of `count` triangles, one vertex more for each, with a quad in the end where asked.
std::string long_strip(PlyWriter::Format format, int count, bool quad, const std::string& blank = "") {
    PlyWriter writer(format);
    writer.line(fmt::format("element vertex {}", count + 2)).line("property float x").line("property float y");
    writer.line("property float z").line(fmt::format("element face {}", count + (quad ? 1 : 0)));
    writer.line("property list uchar int vertex_indices").line("end_header");
    for (int v = 0; v < count + 2; ++v) writer.put("float", {double(v / 2), double(v % 2), 0.5}).end_line();
    for (int t = 0; t < count; ++t)
        writer.put("uchar", {3}).put("int", {double(t), double(t + 1), double(t + 2)}).end_line();
    if (quad) writer.put("uchar", {4}).put("int", {0, 1, 3, 2}).end_line();
    return writer.bytes() + blank;
}

TEST_CASE("PLY files of many blocks are read whole", "[ply]") {
    constexpr int kCount = 70000;
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        for (const bool quad : {false, true}) {
            CAPTURE(PlyWriter::name(format), quad);
            const Mesh mesh = read(long_strip(format, kCount, quad));
            REQUIRE(mesh.positions.size() == kCount + 2);
            REQUIRE(mesh.triangles.size() == kCount + (quad ? 2 : 0));
            std::size_t wrong = 0;
            for (std::uint32_t v = 0; v < kCount + 2; ++v) {
                wrong += mesh.positions[v] != glm::vec3(static_cast<float>(v / 2), static_cast<float>(v % 2), 0.5f);
            }
            for (std::uint32_t t = 0; t < kCount; ++t) wrong += mesh.triangles[t] != glm::uvec3(t, t + 1, t + 2);
            CHECK(wrong == 0);
            if (quad) CHECK(mesh.triangles.back() == glm::uvec3(0, 3, 2));
        }
    }
}

/// A grid of `columns` squares a row, row upon row, as quads, with one triangle after `before_triangle` of them.
std::string long_grid(PlyWriter::Format format, int columns, int rows, int before_triangle = -1) {
    PlyWriter writer(format);
    const int width = columns + 1, quads = columns * rows;
    writer.line(fmt::format("element vertex {}", width * (rows + 1))).line("property float x");
    writer.line("property float y").line("property float z");
    writer.line(fmt::format("element face {}", quads + (before_triangle < 0 ? 0 : 1)));
    writer.line("property list uchar int vertex_indices").line("end_header");
    for (int v = 0; v < width * (rows + 1); ++v)
        writer.put("float", {double(v % width), double(v / width), 0}).end_line();
    for (int q = 0; q < quads; ++q) {
        if (q == before_triangle) writer.put("uchar", {3}).put("int", {2, 1, 0}).end_line();
        const double v = q / columns * width + q % columns;
        writer.put("uchar", {4}).put("int", {v, v + 1, v + width + 1, v + width}).end_line();
    }
    return writer.bytes();
}

TEST_CASE("PLY files of many quads are read whole, also with another polygon among them", "[ply]") {
    constexpr int kColumns = 250, kRows = 200;
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        for (const int before_triangle : {-1, 0, 16384, 40000}) {
            CAPTURE(PlyWriter::name(format), before_triangle);
            const Mesh mesh = read(long_grid(format, kColumns, kRows, before_triangle));
            std::vector<glm::uvec3> expected;
            for (std::uint32_t q = 0; q < kColumns * kRows; ++q) {
                if (static_cast<int>(q) == before_triangle) expected.emplace_back(2, 1, 0);
                const std::uint32_t v = q / kColumns * (kColumns + 1) + q % kColumns;
                expected.emplace_back(v, v + 1, v + kColumns + 2);
                expected.emplace_back(v, v + kColumns + 2, v + kColumns + 1);
            }
            REQUIRE(mesh.triangles.size() == expected.size());
            CHECK(std::equal(expected.begin(), expected.end(), mesh.triangles.begin()));
        }
    }
}

TEST_CASE("A long PLY file of quads that is cut says where it ends", "[ply]") {
    const std::string whole = long_grid(PlyWriter::Format::little, 250, 200);
    const std::size_t kQuadBytes = 17;
    for (const std::size_t missing : {std::size_t{1}, kQuadBytes, 20000 * kQuadBytes + 5}) {
        const std::string message = refusal(whole.substr(0, whole.size() - missing));
        CAPTURE(missing, message);
        const std::size_t face = (50000 * kQuadBytes - missing) / kQuadBytes;
        CHECK(contains(message, fmt::format("the file ends within face {} of 50000", face)));
    }
}

// Sanitizers keep memory of their own.
#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

/// Bytes of this process in memory: "VmRSS" now, "VmHWM" most since `forget_most_resident`.
std::size_t resident(const std::string& which) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with(which + ":")) return 1024 * std::stoul(line.substr(which.size() + 1));
    }
    return 0;
}

bool forget_most_resident() {
    std::ofstream file("/proc/self/clear_refs");
    file << "5" << std::flush;
    return file.good();
}

// Of a scan that fills half the memory there must be no second copy.
TEST_CASE("The PLY reader holds the arrays and little more", "[ply]") {
    constexpr int kCount = 1000000;
    constexpr std::size_t kLittle = 8 << 20;
    const TemporaryDirectory directory;
    for (const PlyWriter::Format format : {PlyWriter::Format::little, PlyWriter::Format::ascii}) {
        CAPTURE(PlyWriter::name(format));
        const std::filesystem::path file = directory.write("mesh.ply", long_strip(format, kCount, false));
        REQUIRE(std::filesystem::file_size(file) > 2 * kLittle);
        read_ply(directory.write("short.ply", long_strip(format, 10, false)));  // brings code into memory
        if (!forget_most_resident()) {
            WARN("not tested: /proc/self/clear_refs cannot be written");
            return;
        }
        const std::size_t before = resident("VmRSS");
        const Mesh mesh = read_ply(file);
        const std::size_t most = resident("VmHWM");
        const std::size_t arrays =
            mesh.positions.size() * sizeof(glm::vec3) + mesh.triangles.size() * sizeof(glm::uvec3);
        CAPTURE(before, most, arrays);
        CHECK(arrays >= std::size_t{24} * kCount);
        CHECK(most < before + arrays + kLittle);
    }
}

#endif

TEST_CASE("The first fault of a long PLY file is the one reported", "[ply]") {
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        CAPTURE(PlyWriter::name(format));
        PlyWriter writer(format);
        constexpr int kCount = 60000;
        writer.line(fmt::format("element vertex {}", kCount)).line("property float x").line("property float y");
        writer.line("property float z").line(fmt::format("element face {}", kCount));
        writer.line("property list uchar int vertex_indices").line("end_header");
        for (int v = 0; v < kCount; ++v) writer.put("float", {0, 0, 0}).end_line();
        for (int t = 0; t < kCount; ++t) {
            writer.put("uchar", {3}).put("int", {0, t == 33333 || t == 50001 ? kCount : 1.0, 2}).end_line();
        }
        const std::string message = refusal(writer.bytes());
        INFO(message);
        CHECK(contains(message, "face 33333 of 60000"));
        CHECK(contains(message, "vertex index 60000 where 0 to 59999 was expected"));
    }
}

TEST_CASE("A PLY file cut anywhere is refused, and says where it ends", "[ply]") {
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        const std::string whole = tetrahedron(format);
        // Text may lack the white space after its last digit.
        const std::size_t needed = format == PlyWriter::Format::ascii ? whole.size() - 2 : whole.size();
        const std::size_t body = whole.find("end_header\n") + 11;
        for (std::size_t length = 0; length < needed; ++length) {
            CAPTURE(PlyWriter::name(format), length);
            const std::string message = refusal(whole.substr(0, length));
            INFO(message);
            CHECK(!message.empty());
            if (length >= body) CHECK(contains(message, "the file ends within "));
        }
        CHECK(refusal(whole).empty());
        const std::string message = refusal(whole.substr(0, needed - 1));
        CHECK(contains(message, "the file ends within face 3 of 4"));
        CHECK(contains(refusal(whole.substr(0, body + 2)), "the file ends within vertex 0 of 4"));
    }
}

TEST_CASE("A PLY header's count is not believed", "[ply]") {
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        for (const char* element : {"vertex", "face"}) {
            for (const char* count : {"1000000000000000000", "18446744073709551615", "4294967294", "8", "3"}) {
                std::string bytes = tetrahedron(format);
                const std::string line = fmt::format("element {} 4", element);
                bytes.replace(bytes.find(line), line.size(), fmt::format("element {} {}", element, count));
                CAPTURE(PlyWriter::name(format), element, count);
                CHECK(refusal(bytes) != "");
            }
        }
    }
    std::string bytes = tetrahedron(PlyWriter::Format::little);
    bytes.replace(bytes.find("face 4"), 6, "face 1000000000000000000");
    CHECK(contains(refusal(bytes), "the file ends within face 4 of 1000000000000000000"));
}

TEST_CASE("Malformed PLY headers are refused with line and reason", "[ply]") {
    struct Case {
        const char* header;
        const char* message;
    };
    const std::string vertex = "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    const Case cases[] = {
        {"", "the file is empty"},
        {"p", "not a PLY file"},
        {"PLY\n", "found 'PLY'"},
        {"plywood\n", "found 'plywood'"},
        {"ply", "not a PLY file"},
        {"ply\n", "the file ends within the header"},
        {"ply\nend_header\n", ":2: the header ends without a format line"},
        {"ply\nformat ascii 1.0\nformat ascii 1.0\n", ":3: a second format line"},
        {"ply\nformat ascii\n", ":2: a format line has two words"},
        {"ply\nformat text 1.0\n", "found format 'text'"},
        {"ply\nformat ascii 2.0\n", "found version '2.0' where 1.0"},
        {"ply\nformat ascii 1.0\nelement vertex\n", ":3: an element line has two words"},
        {"ply\nformat ascii 1.0\nelement vertex -1\n", "found '-1' where the number of elements"},
        {"ply\nformat ascii 1.0\nelement vertex 1e3\n", "found '1e3'"},
        {"ply\nformat ascii 1.0\nelement vertex 18446744073709551616\n", "found '18446744073709551616'"},
        {"ply\nformat ascii 1.0\nelement a 1\nelement a 1\n", ":4: a second element 'a'"},
        {"ply\nformat ascii 1.0\nproperty float x\n", "a property before the first element"},
        {"ply\nformat ascii 1.0\nelement a 1\nproperty float\n", "a property line is"},
        {"ply\nformat ascii 1.0\nelement a 1\nproperty list int x\n", "a property line is"},
        {"ply\nformat ascii 1.0\nelement a 1\nproperty half x\n", "found 'half' where a type"},
        {"ply\nformat ascii 1.0\nelement a 1\nproperty list float int x\n", "integer type for the length"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int x\n", ":5: a second property 'x'"},
        {"ply\nformat ascii 1.0\nhello\n", ":3: found 'hello'"},
        {"ply\nformat ascii 1.0\n\x01\x02\n", "found '?\?'"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n0 0\n",
         ":3: the vertices have no number named 'z'"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty list int float x\nend_header\n", "no number named 'x'"},
        {"ply\nformat ascii 1.0\nelement face 1\nproperty int vertex_indices\nend_header\n3\n", "no list of integers"},
        {"ply\nformat ascii 1.0\nelement face 1\nproperty list int float vertex_indices\nend_header\n3\n",
         "no list of integers"},
        {"ply\nformat ascii 1.0\nelement vertex 4294967295\nend_header\n", "4294967295 vertices"},
        {"ply\nformat ascii 1.0\nend_header\n", "the file has no triangle"},
    };
    for (const Case& test : cases) {
        const std::string message = refusal(test.header);
        CAPTURE(test.header, message, test.message);
        CHECK(contains(message, test.message));
    }
}

TEST_CASE("A PLY file without triangles is refused with the number of points and lines", "[ply]") {
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element edge 2\nproperty int vertex1\nproperty int vertex2\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 1\n1 2\n";
    CHECK(contains(refusal(text),
                   "the file has no triangle, that is no face of three vertices or more: it has 3 points "
                   "and 2 lines"));
}

TEST_CASE("PLY properties that are not read may have the same name", "[ply]") {
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        PlyWriter writer(format);
        writer.line("element vertex 3").line("property float x").line("property uchar pad").line("property short pad");
        writer.line("property float y").line("property float z").line("property uchar pad");
        writer.line("element face 1").line("property list uchar int vertex_indices").line("property uchar pad");
        writer.line("property uchar pad").line("end_header");
        for (int v = 0; v < 3; ++v)
            writer.put("float", {double(v)})
                .put("uchar", {1})
                .put("short", {2})
                .put("float", {3, 4})
                .put("uchar", {5})
                .end_line();
        writer.put("uchar", {3}).put("int", {2, 1, 0}).put("uchar", {6, 7}).end_line();
        const Mesh mesh = read(writer.bytes());
        CHECK(mesh.positions == std::vector<glm::vec3>{{0, 3, 4}, {1, 3, 4}, {2, 3, 4}});
        CHECK(mesh.triangles == std::vector<glm::uvec3>{{2, 1, 0}});
    }
}

TEST_CASE("Wrong values in a PLY file are refused with what was found", "[ply]") {
    const std::string header =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty double z\n"
        "element face 2\nproperty list int int vertex_indices\nend_header\n";
    struct Case {
        const char* body;
        const char* message;
    };
    const Case cases[] = {
        {"0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", ":11: vertex 1 of 3 (counted from 0): y is not a finite"},
        {"0 0 0\n1 0 0\n-inf 1 0\n3 0 1 2\n3 0 1 2\n", "vertex 2 of 3 (counted from 0): x is not a finite"},
        {"0 0 1e39\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", "z is not a finite number of single precision"},
        {"0 1e99 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", "y is not a finite number"},
        {"0 0 0\n1 x7 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", ":11: vertex 1 of 3 (counted from 0): found 'x7'"},
        {"0 0 0\n1 0,5 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", "found '0,5' where a number for y"},
        {"0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 3\n", ":14: face 1 of 2 (counted from 0): vertex index 3 where 0 to 2"},
        {"0 0 0\n1 0 0\n0 1 0\n3 0 -1 2\n3 0 1 2\n", "face 0 of 2 (counted from 0): vertex index -1"},
        {"0 0 0\n1 0 0\n0 1 0\n3 0 1.5 2\n3 0 1 2\n", "found '1.5' where a number for vertex_indices"},
        {"0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n3 0 1 2\n", "the list vertex_indices has length -3"},
        {"0 0 0\n1 0 0\n0 1 0\nthree 0 1 2\n3 0 1 2\n", "found 'three'"},
        {"0 0 0\n1 0 0\n0 1 0\n2 0 1\n0\n", "the file has no triangle"},
    };
    for (const Case& test : cases) {
        const std::string message = refusal(header + test.body);
        CAPTURE(test.body, message, test.message);
        CHECK(contains(message, test.message));
    }
    std::string binary = tetrahedron(PlyWriter::Format::little);
    binary[binary.size() - 1] = '\x7f';
    CHECK(contains(refusal(binary), "face 3 of 4 (counted from 0): vertex index 2130706435 where 0 to 3 was expected"));
}

TEST_CASE("Wrong values in binary PLY files are refused with what was found", "[ply]") {
    for (const PlyWriter::Format format : {PlyWriter::Format::little, PlyWriter::Format::big}) {
        for (const std::string index_type : {"int", "uint"}) {
            const auto file = [&](double y, double index) {
                PlyWriter writer(format);
                writer.line("element vertex 3").line("property uchar red").line("property float y");
                writer.line("property float x").line("property double weight").line("property float z");
                writer.line("element face 2").line("property list uchar " + index_type + " vertex_indices");
                writer.line("end_header");
                for (const double x : {0.0, 1.0, 2.0})
                    writer.put("uchar", {7}).put("float", {x == 1.0 ? y : 3.0, x}).put("double", {9}).put("float", {4});
                writer.put("uchar", {3}).put(index_type, {0, 1, 2}).put("uchar", {3}).put(index_type, {2, index, 0});
                return writer.bytes();
            };
            CAPTURE(PlyWriter::name(format), index_type);
            const Mesh mesh = read(file(5, 1));
            CHECK(mesh.positions == std::vector<glm::vec3>{{0, 3, 4}, {1, 5, 4}, {2, 3, 4}});
            CHECK(mesh.triangles == std::vector<glm::uvec3>{{0, 1, 2}, {2, 1, 0}});
            const std::string not_finite = "vertex 1 of 3 (counted from 0): y is not a finite number";
            CHECK(contains(refusal(file(std::nan(""), 1)), not_finite));
            CHECK(contains(refusal(file(-std::numeric_limits<double>::infinity(), 1)), not_finite));
            CHECK(contains(refusal(file(5, 3)),
                           "face 1 of 2 (counted from 0): vertex index 3 where 0 to 2 was expected"));
            if (index_type == "int") CHECK(contains(refusal(file(5, -1)), "vertex index -1 where 0 to 2 was expected"));
        }
    }
}

TEST_CASE("A PLY file that is missing or no file is refused", "[ply]") {
    const TemporaryDirectory directory;
    CHECK_THROWS_AS(read_ply(directory.path() / "none.ply"), SceneError);
    CHECK_THROWS_AS(read_ply(directory.path()), SceneError);
}

TEST_CASE("Damaged PLY files never crash the reader", "[ply]") {
    const TemporaryDirectory directory;
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        const std::string whole = tetrahedron(format);
        for (unsigned seed = 0; seed < 150; ++seed) {
            std::mt19937 random(seed);
            std::string bytes = whole;
            for (unsigned change = 0; change <= seed % 4; ++change) {
                const std::size_t at = random() % bytes.size();
                switch (random() % 4) {
                    case 0:
                        bytes[at] = static_cast<char>(random());
                        break;
                    case 1:
                        bytes.erase(at, 1 + random() % 8);
                        break;
                    case 2:
                        bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 16));
                        break;
                    default:
                        bytes[at] = static_cast<char>('0' + random() % 10);
                        break;
                }
            }
            CAPTURE(PlyWriter::name(format), seed);
            try {
                const Mesh mesh = read_ply(directory.write("mesh.ply", bytes));
                CHECK(!mesh.triangles.empty());
                for (const glm::uvec3& triangle : mesh.triangles) {
                    for (int i = 0; i < 3; ++i) CHECK(triangle[i] < mesh.positions.size());
                }
            } catch (const SceneError& error) {
                CHECK(!error.reason().empty());
            }
        }
    }
}

}  // namespace
}  // namespace castor
