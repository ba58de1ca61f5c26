// Targets for the readers of scene files: PLY, OBJ with MTL, XML. What they read also goes through the checks and the
// flattening, as on the way to a device.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "fuzz/targets.h"
#include "scene/ply_reader.h"
#include "scene/scene_arrays.h"
#include "support/ply_writer.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor::fuzz {

namespace {

using test::PlyWriter;

/// Parts an OBJ text from the text of its MTL file.
constexpr char kSeparator = '\x1e';

const test::TemporaryDirectory& folder() {
    static const test::TemporaryDirectory kFolder;
    return kFolder;
}

void check_mesh(const Mesh& mesh) {
    require(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size(), "a mesh has a normal a vertex");
    for (const glm::uvec3& triangle : mesh.triangles)
        require(std::max({triangle.x, triangle.y, triangle.z}) < mesh.positions.size(), "indices are in range");
}

/// Loads a scene file and flattens the scene.
void load(const std::filesystem::path& file) {
    try {
        const Scene scene = load_scene(file);
        require(!scene.cameras.empty(), "a scene has a camera");
        for (const Mesh& mesh : scene.meshes) {
            check_mesh(mesh);
            require(mesh.material < scene.materials.size(), "the material of a mesh exists");
        }
        flatten(scene);
    } catch (const Error&) {
    }
}

std::string ply_seed(PlyWriter::Format format) {
    PlyWriter writer(format);
    writer.line("comment every kind of property").line("element camera 1").line("property list uchar short data");
    writer.line("element vertex 4").line("property float x").line("property double y").line("property short z");
    for (const char* name : {"nx", "ny", "nz"}) writer.line(fmt::format("property float {}", name));
    writer.line("property uchar red").line("element face 3");
    writer.line("property list uchar int vertex_indices").line("property list int ushort uv");
    writer.line("element tristrips 1").line("property list uint int vertex_indices").line("end_header");
    writer.put("uchar", {2}).put("short", {-1, 7}).end_line();
    for (const std::vector<double>& p : {std::vector<double>{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0.5, 1}})
        writer.put("float", {p[0]})
            .put("double", {p[1]})
            .put("short", {p[2]})
            .put("float", p)
            .put("uchar", {9})
            .end_line();
    writer.put("uchar", {3}).put("int", {0, 1, 2}).put("int", {1}).put("ushort", {5}).end_line();
    writer.put("uchar", {4}).put("int", {0, 1, 2, 3}).put("int", {0}).end_line();
    writer.put("uchar", {2}).put("int", {0, 1}).put("int", {0}).end_line();
    writer.put("uint", {6}).put("int", {0, 1, 2, -1, 3, 1}).end_line();
    return writer.bytes();
}

/// Vertices and triangles of the layout that has a fast path, as many as several blocks of the reader.
std::string plain_ply_seed(PlyWriter::Format format) {
    PlyWriter writer(format);
    writer.line("element vertex 9").line("property float x").line("property float y").line("property float z");
    writer.line("element face 9").line("property list uchar int vertex_indices").line("end_header");
    for (int i = 0; i < 9; ++i) writer.put("float", {double(i), double(i % 3), 1.5}).end_line();
    for (int i = 0; i < 9; ++i) writer.put("uchar", {3}).put("int", {double(i), 1, 2}).end_line();
    return writer.bytes();
}

std::string text_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

void run_ply(std::string_view bytes) {
    constexpr std::uint64_t kFewRecords = 4;  // so that small inputs have several blocks
    const std::filesystem::path file = folder().write("mesh.ply", bytes);
    try {
        check_mesh(read_ply(file, {}, kFewRecords));
    } catch (const Error&) {
    }
    load(file);
}

std::vector<std::string> ply_seeds() {
    std::vector<std::string> seeds;
    for (const PlyWriter::Format format : PlyWriter::kFormats) {
        seeds.push_back(ply_seed(format));
        seeds.push_back(plain_ply_seed(format));
    }
    return seeds;
}

void run_obj(std::string_view bytes) {
    const std::size_t end = std::min(bytes.find(kSeparator), bytes.size());
    folder().write("m.mtl", bytes.substr(std::min(end + 1, bytes.size())));
    load(folder().write("mesh.obj", bytes.substr(0, end)));
}

std::vector<std::string> obj_seeds() {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 .5e0\n";
    std::vector<std::string> seeds{
        vertices + "f 1 2 3 4\nf -4 -3 -2\n",
        "# comment\nmtllib m.mtl\n" + vertices +
            "vn 0 0 1\nvn 0 1 0\nvt 0 0\ng a b\no c\ns 1\nusemtl red\nf 1/1/1 2//1 3//1 -1//-1\nusemtl light oak\n"
            "f 1/1 2/1 3/1\nl 1 2\np 1\n" +
            kSeparator +
            "newmtl red\nKa 0 0 0\nKd 1 0 0\nKs 1 1 1\nNs 30\nKe 1 1 1\nillum 2\nd 0.5\nTr 0.5\n"
            "map_Kd -s 1 1 1 a.png\nnewmtl light oak\nKd .1 .2 .3\nillum 5\n",
        "\xef\xbb\xbf" + vertices + "f 1 2 \\\n3 4\n",
    };
    // The first one in UTF-16 of either byte order.
    for (const bool big_endian : {false, true}) {
        std::string wide = big_endian ? "\xfe\xff" : "\xff\xfe";
        for (const char c : seeds.front()) wide += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
        seeds.push_back(wide);
    }
    return seeds;
}

void run_xml(std::string_view bytes) {
    static const std::filesystem::path kPly = folder().write("a.ply", plain_ply_seed(PlyWriter::Format::little)),
                                       kObj = folder().write("a.obj", obj_seeds().front());
    load(folder().write("scene.xml", bytes));
}

std::vector<std::string> xml_seeds() {
    std::vector<std::string> seeds;
    for (const char* name : {"spheres.xml", "planes.xml", "spots.xml", "mirrors.xml"})
        seeds.push_back(text_of(std::filesystem::path(CASTOR_SOURCE_DIR) / "scenes" / name));
    seeds.push_back(R"(<?xml version="1.0"?><Scene><BackgroundColor>1 2 3.5</BackgroundColor>
<ShadowRayEpsilon>1e-3</ShadowRayEpsilon><MaxRecursionDepth>2</MaxRecursionDepth><Cameras><Camera type="lookAt"
handedness="left"><Position>0 0 9</Position><GazePoint>0 0 0</GazePoint><Up>0 1 0</Up><FovY>40</FovY><ImageResolution>
8 6</ImageResolution><ImageName>a.png</ImageName><NumSamples>4</NumSamples></Camera></Cameras><Lights><AmbientLight>1 1
1</AmbientLight><DirectionalLight><Direction>0 -1 0</Direction><Radiance>9 9 9</Radiance></DirectionalLight></Lights>
<Materials><Material id="1" type="conductor" degamma="true"><MirrorReflectance>.5 .5 .5</MirrorReflectance>
<RefractionIndex>.3</RefractionIndex><AbsorptionIndex>3</AbsorptionIndex></Material></Materials><Transformations>
<Translation id="1">1 2 3</Translation><Scaling id="1">1 -1 2</Scaling><Rotation id="1">30 0 1 0</Rotation><Composite
id="1">1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</Composite></Transformations><VertexData>0 0 0 1 0 0 0 1 0 <!-- x --> 1 1 1
</VertexData><Objects><Mesh id="1" shadingMode="smooth"><Material>1</Material><Transformations>t1 s1 r1 c1
</Transformations><Faces vertexOffset="1">0 1 2 1 3 2</Faces></Mesh><Mesh id="2"><Material>1</Material>
<Faces plyFile="a.ply"/></Mesh><Mesh id="3"><Faces objFile="a.obj"/></Mesh><MeshInstance id="4" baseMeshId="1"
resetTransform="true"><Material>1</Material><Transformations>r1</Transformations></MeshInstance><MeshInstance id="5"
baseMeshId="4"/><Triangle><Material>1</Material><Indices>1 2 3</Indices></Triangle><Sphere><Material>1</Material>
<Center>1</Center><Radius>2</Radius><Transformations>s1</Transformations></Sphere><Plane><Material>1</Material><Point>1
</Point><Normal>0 1 0</Normal></Plane></Objects></Scene>)");
    return seeds;
}

}  // namespace castor::fuzz
