// Targets for the readers of scene files: PLY, OBJ with MTL, STL, glTF, XML, JSON. What they read also goes through the
// checks and the flattening, as on the way to a device.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "fuzz/targets.h"
#include "scene/ply_reader.h"
#include "scene/scene_arrays.h"
#include "support/compressed_gltf.h"
#include "support/gltf_builder.h"
#include "support/picture_bytes.h"
#include "support/ply_writer.h"
#include "support/scene_twins.h"
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
void load(const std::filesystem::path& file, const LoadOptions& options = {}) {
    try {
        const Scene scene = load_scene(file, options);
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

/// Writes the picture that scenes and materials may name.
void write_picture() {
    static const std::filesystem::path kPicture = folder().write("a.bmp", test::bmp_bytes(2, 1, 3, {1, 2, 3, 4, 5, 6}));
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
    write_picture();
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
            "map_Kd -s 1 1 1 a.png\nmap_Bump b.png\nnewmtl light oak\nKd .1 .2 .3\nillum 5\n",
        "mtllib m.mtl\n" + vertices + "vt 0 0\nvt 1\nvt 1 1 0\nusemtl a\nf 1/1 2/2 3/3\nf 1/3 3/-1 4\n" + kSeparator +
            "newmtl a\nmap_Kd -clamp on -o 1 0 0 x\\a.bmp\nnorm n.png\n",
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

void run_stl(std::string_view bytes) {
    load(folder().write("mesh.stl", bytes));
}

std::vector<std::string> stl_seeds() {
    std::string binary(80, '\0');
    binary += std::string("\2\0\0\0", 4);
    for (int triangle = 0; triangle < 2; ++triangle) {
        binary.append(12, '\0');
        for (int i = 0; i < 9; ++i) binary += std::string("\0\0\x80", 3) + (i % 4 == triangle ? '\x3f' : '\0');
        binary.append(2, '\0');
    }
    return {binary,
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 -0.5\nendloop\n"
            "endfacet\nendsolid a\n"};
}

// A .glb file; or JSON and, after a separator, the bytes of the file m.bin, which its buffer may name.
void run_gltf(std::string_view bytes) {
    if (bytes.starts_with("glTF")) {
        load(folder().write("scene.glb", bytes));
        return;
    }
    const std::size_t end = std::min(bytes.find(kSeparator), bytes.size());
    folder().write("m.bin", bytes.substr(std::min(end + 1, bytes.size())));
    LoadOptions moving;
    moving.time_seconds = 0.4;
    moving.animation = "all";
    const std::filesystem::path file = folder().write("scene.gltf", bytes.substr(0, end));
    load(file);
    load(file, moving);
    LoadOptions varied;
    varied.material_variant = "1";
    load(file, varied);
}

/// A file with something of each kind.
test::GltfBuilder full_gltf() {
    using nlohmann::json;
    test::GltfBuilder builder = test::one_triangle();
    json attributes = {{"POSITION", 0}};
    attributes["NORMAL"] =
        builder.accessor(std::vector<std::int8_t>{0, 0, 127, 0, 0, 0, 127, 0, 0, 127, 0, 0}, "VEC3", 4, 5120);
    builder.json["bufferViews"].back()["byteStride"] = 4;
    builder.json["accessors"].back()["normalized"] = true;
    attributes["TANGENT"] = builder.vec4({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1});
    attributes["TEXCOORD_0"] = builder.vec2({0, 0, 1, 0, 0, 1});
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"];
    attributes["COLOR_0"] = builder.accessor(std::vector<std::uint8_t>(12, 200), "VEC4", 4, 5121);
    attributes["JOINTS_0"] = builder.accessor(std::vector<std::uint8_t>(12, 0), "VEC4", 4, 5121);
    attributes["WEIGHTS_0"] = builder.vec4({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
    const std::size_t moved = builder.vec3({0, 0, 1, 0, 0, 2, 0, 0, 3});
    builder.json["accessors"].back()["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", builder.view(std::vector<std::uint8_t>{2})}, {"componentType", 5121}}},
        {"values", {{"bufferView", builder.view(std::vector<float>{7, 8, 9})}}}};
    const std::size_t indices = builder.indices({0, 1, 2, 1});
    const std::size_t picture = builder.texture(test::png_bytes(2, 1, 4, {10, 20, 30, 255, 40, 50, 60, 128}));
    builder.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9729}, {"minFilter", 9987}}};
    builder.json["textures"][0]["sampler"] = 0;
    json map = {{"index", picture}};
    map["extensions"]["KHR_texture_transform"] = {{"offset", {0, 1}}, {"rotation", 1}, {"scale", {0.5, 0.5}}};
    json material = {{"pbrMetallicRoughness",
                      {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}},
                       {"baseColorTexture", map},
                       {"metallicRoughnessTexture", {{"index", picture}, {"texCoord", 1}}}}},
                     {"normalTexture", {{"index", picture}, {"scale", 2}}},
                     {"emissiveFactor", {1, 0, 0}},
                     {"alphaMode", "BLEND"}};
    material["extensions"] = {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
                              {"KHR_materials_volume", {{"thicknessFactor", 1}, {"attenuationDistance", 2}}},
                              {"KHR_materials_volume_scatter", {{"multiscatterColor", {0.5, 0.5, 0.5}}}},
                              {"KHR_materials_ior", {{"ior", 1.4}}},
                              {"KHR_materials_clearcoat", {{"clearcoatTexture", {{"index", picture}}}}},
                              {"KHR_materials_unlit", json::object()}};
    json shiny = {{"normalTexture", {{"index", picture}}}, {"emissiveFactor", {1, 1, 1}}};
    shiny["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {{"diffuseFactor", {0.1, 0.2, 0.3, 0.4}},
                                                                  {"specularGlossinessTexture", {{"index", picture}}},
                                                                  {"glossinessFactor", 0.5}};
    builder.json["materials"] = {shiny, material};
    builder.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "Dark"}}};
    json varied = {{"attributes", {{"POSITION", 0}}}, {"material", 0}};
    varied["extensions"]["KHR_materials_variants"]["mappings"] = {{{"material", 1}, {"variants", {0}}}};
    builder.json["meshes"] = {{{"primitives",
                                {{{"attributes", attributes},
                                  {"indices", indices},
                                  {"mode", 5},
                                  {"material", 1},
                                  {"targets", {{{"POSITION", moved}}}}}}},
                               {"weights", {0.5}}},
                              {{"primitives", {varied}}}};
    const std::size_t bind = builder.mat4({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    builder.json["skins"] = {{{"joints", {1}}, {"inverseBindMatrices", bind}}};
    builder.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}},
                               {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 2}}}}};
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "spot"}, {"spot", {{"outerConeAngle", 0.5}}}}};
    json placed = {{"mesh", 1}};
    placed["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"TRANSLATION", moved}};
    placed["extensions"]["KHR_lights_punctual"] = {{"light", 0}};
    builder.json["nodes"] = {{{"mesh", 0}, {"skin", 0}},
                             {{"translation", {1, 2, 3}}, {"rotation", {0, 0, 0.6, 0.8}}, {"children", {2}}},
                             placed,
                             {{"camera", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1}}},
                             {{"camera", 1}}};
    builder.json["scenes"] = {{{"nodes", {0, 1, 3, 4}}}};
    builder.json["nodes"][4]["extensions"]["KHR_node_visibility"] = {{"visible", true}};
    const std::size_t times = builder.scalars({0, 1});
    json pointed = {{"path", "pointer"}};
    pointed["extensions"]["KHR_animation_pointer"] = {{"pointer", "/materials/1/pbrMetallicRoughness/baseColorFactor"}};
    builder.json["animations"] = {
        {{"channels",
          {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}},
           {{"sampler", 0}, {"target", pointed}},
           {{"sampler", 1}, {"target", {{"node", 0}, {"path", "weights"}}}}}},
         {"samplers",
          {{{"input", times}, {"output", builder.vec4({0, 0, 0, 1, 0, 0, 1, 0})}},
           {{"input", times}, {"output", builder.scalars({0, 0, 0, 0, 1, 0})}, {"interpolation", "CUBICSPLINE"}}}}}};
    return builder;
}

std::vector<std::string> gltf_seeds() {
    std::vector<std::string> seeds{test::one_triangle().glb(), full_gltf().glb(), test::one_triangle().gltf()};
    for (test::GltfBuilder builder : {test::one_triangle(), full_gltf()}) {
        builder.json["buffers"] = {{{"byteLength", builder.bytes.size()}, {"uri", "m.bin"}}};
        seeds.push_back(builder.json.dump() + kSeparator + builder.bytes);
    }
    for (test::GltfBuilder& builder : test::compressed_gltfs()) seeds.push_back(builder.glb());
    return seeds;
}

/// Writes the files that scenes may name.
void write_named_files() {
    static const std::filesystem::path kPly = folder().write("a.ply", plain_ply_seed(PlyWriter::Format::little)),
                                       kObj = folder().write("a.obj", obj_seeds().front());
    write_picture();
}

void run_xml(std::string_view bytes) {
    write_named_files();
    load(folder().write("scene.xml", bytes));
}

void run_json(std::string_view bytes) {
    write_named_files();
    load(folder().write("scene.json", bytes));
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
    seeds.push_back(R"(<Scene><BRDFs><ModifiedPhong id="1" normalized="true"><Exponent>3</Exponent></ModifiedPhong>
<TorranceSparrow id="2" kdfresnel="true"/><OriginalPhong id="3"/><OriginalBlinnPhong id="4"/>
<ModifiedBlinnPhong id="5"/>
</BRDFs><Textures><Images><Image id="1">a.bmp</Image><Image id="2">b.bmp</Image></Images>
<TextureMap id="1" type="image">
<ImageId>1</ImageId><DecalMode>blend_kd</DecalMode><Interpolation>bilinear</Interpolation><Normalizer>1</Normalizer>
<BumpFactor>2</BumpFactor></TextureMap><TextureMap id="2" type="perlin"><NoiseConversion>absval</NoiseConversion>
<NoiseScale>4</NoiseScale><NumOctaves>2</NumOctaves></TextureMap><TextureMap id="3" type="checkerboard">
<BlackColor>0 0 0
</BlackColor><WhiteColor>1 1 1</WhiteColor><Scale>2</Scale><Offset>.5</Offset></TextureMap><TextureMap id="4"
type="image"><ImageId>2</ImageId><DecalMode>replace_background</DecalMode></TextureMap><Texture id="5"><ImageName>a.bmp
</ImageName><Appearance>clamp</Appearance></Texture></Textures><Materials><Material id="1" BRDF="1" type="dielectric">
<AbsorptionCoefficient>1 0 1</AbsorptionCoefficient><Roughness>.1</Roughness></Material><Material id="2" BRDF="2">
<Transparency>.5 .5 0</Transparency></Material></Materials><Transformations><Rotation id="1">30 0 1 0</Rotation>
</Transformations><Cameras><Camera><Position>0 0 9</Position><Gaze>0 0 -1</Gaze><Up>0 1 0</Up><NearPlane>-1 1 -1 1
</NearPlane><NearDistance>1</NearDistance><ImageResolution>2 2</ImageResolution><FocusDistance>9</FocusDistance>
<ApertureSize>1</ApertureSize><Transformations>r1</Transformations><Tonemap><TMO>ACES</TMO>
<TMOOptions>.18 1</TMOOptions>
<Saturation>1</Saturation><Gamma>sRGB</Gamma><Extension>_a.png</Extension></Tonemap><Renderer>PathTracing</Renderer>
<RendererParams>MIS_BALANCE</RendererParams></Camera></Cameras><Lights><AreaLight><Position>0 0 0</Position>
<Normal>0 1 0
</Normal><Size>1</Size><Radiance>1 1 1</Radiance><Transformations>r1</Transformations></AreaLight>
<SphericalDirectionalLight type="probe"><ImageId>1</ImageId><Sampler>cosine</Sampler></SphericalDirectionalLight>
</Lights>
<VertexData>0 0 0 1 0 0 0 1 0</VertexData><TexCoordData>0 0 1 0 0 1</TexCoordData><Objects><Mesh id="1"><Material>1
</Material><Textures>1 2</Textures><MotionBlur>0 1 0</MotionBlur><Faces textureOffset="1">1 2 3</Faces></Mesh>
<MeshInstance baseMeshId="1"><Textures>3</Textures></MeshInstance><Sphere><Material>2</Material><Texture>5</Texture>
<Center>1</Center><Radius>1</Radius></Sphere><LightMesh><Material>1</Material><Faces>1 2 3</Faces><Radiance>1 1 1
</Radiance></LightMesh><LightSphere><Material>1</Material><Center>1</Center><Radius>1</Radius><Radiance>1 1 1</Radiance>
</LightSphere><Cylinder><Material>1</Material><Center>1</Center><Axis>0 1 1</Axis><Radius>1</Radius><Height>2</Height>
</Cylinder></Objects></Scene>)");
    return seeds;
}

std::vector<std::string> json_seeds() {
    std::vector<std::string> seeds;
    for (const std::string& xml : xml_seeds()) seeds.push_back(test::to_json(xml));
    seeds.push_back(
        "\xef\xbb\xbf{\"a\": null, \"Scene\": {\"BackgroundColor\": [1, 2.5, -3e-1], \"MaxRecursionDepth\": 2, "
        "\"Materials\": {\"Material\": [{\"_id\": 1, \"_degamma\": true}]}, \"VertexData\": {\"_data\": [0, 0, 0]}, "
        "\"Objects\": {\"Sphere\": {\"Material\": \"\\u0031\", \"Center\": 1, \"Radius\": 1}}}}");
    return seeds;
}

}  // namespace castor::fuzz
