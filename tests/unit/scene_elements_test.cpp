// Every element of the courses' scenes beyond the oldest ones (xml_reader_test.cpp), in XML and in JSON.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "scene/xml_reader.h"
#include "support/catch.h"
#include "support/picture_bytes.h"
#include "support/scene_twins.h"
#include "support/shared_folder.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor {

namespace {

using Texts = std::vector<std::string>;

Texts texts(const std::vector<Warning>& warnings) {
    Texts result;
    for (const Warning& warning : warnings) result.push_back(warning.text);
    return result;
}

const test::TemporaryDirectory& folder() {
    static const test::TemporaryDirectory kFolder;
    static const auto kPicture = kFolder.write("a.tga", test::tga_bytes(2, 1, 3, {10, 20, 30, 40, 50, 60}, false));
    static const auto kOther = kFolder.write("b.tga", test::tga_bytes(1, 1, 3, {1, 2, 3}, false));
    static const auto kBroken = kFolder.write("broken.png", "\x89PNG\r\n\x1a\n");
    static const auto kMesh =
        kFolder.write("st.ply",
                      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                      "property float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n"
                      "end_header\n0 0 0 0 0\n1 0 0 1 0.25\n0 1 0 nan 1\n3 0 1 2\n");
    return kFolder;
}

/// Reads a scene as XML and as JSON, and requires that both say the same.
Scene read(const std::string& inner) {
    const std::string xml = "<Scene>" + inner + "</Scene>", json = test::to_json(xml);
    CAPTURE(xml, json);
    const Scene scene = read_xml_scene(folder().write("scene.xml", xml));
    const Scene twin = read_xml_scene(folder().write("scene.json", json));
    REQUIRE(test::describe(scene) == test::describe(twin));
    Texts one = texts(scene.warnings), other = texts(twin.warnings);
    std::sort(one.begin(), one.end());
    std::sort(other.begin(), other.end());
    REQUIRE(one == other);
    return scene;
}

/// Reads a wrong scene as XML and as JSON, and requires the same reason of both.
std::string reason(const std::string& inner) {
    const std::string xml = "<Scene>\n" + inner + "</Scene>";
    std::string reasons[2];
    for (const bool is_json : {false, true}) {
        try {
            read_xml_scene(is_json ? folder().write("wrong.json", test::to_json(xml))
                                   : folder().write("wrong.xml", xml));
        } catch (const SceneError& error) {
            reasons[is_json] = error.reason();
            CHECK(error.line() > 1);
        }
    }
    CAPTURE(xml, test::to_json(xml));
    CHECK(reasons[0] == reasons[1]);
    return reasons[0];
}

const std::string kMaterial = "<Materials><Material id='1'/></Materials>";
const std::string kVertices = "<VertexData>0 0 0 1 0 0 0 1 0 0 0 1</VertexData>";
const std::string kTextures = R"(<Textures><Images><Image id="3">a.tga</Image><Image id="4"> b.tga </Image></Images>
<TextureMap id="1" type="image"><ImageId>3</ImageId></TextureMap>
<TextureMap id="2" type="perlin"><DecalMode>blend_kd</DecalMode></TextureMap></Textures>)";

std::string camera(const std::string& inner) {
    return "<Cameras><Camera id='1'><Position>1 2 3</Position><Gaze>0 0 -1</Gaze><Up>0 1 0</Up><NearPlane>-1 1 -1 1"
           "</NearPlane><NearDistance>1</NearDistance><ImageResolution>4 4</ImageResolution>" +
           inner + "</Camera></Cameras>";
}

std::string sphere(const std::string& inner) {
    return kMaterial + kVertices +
           "<Objects><Sphere id='1'><Material>1</Material><Center>1</Center><Radius>2</Radius>" + inner +
           "</Sphere></Objects>";
}

}  // namespace

TEST_CASE("materials have absorption, transparency and roughness", "[elements]") {
    const Scene scene = read(R"(<Materials>
        <Material id="1" type="dielectric"><AbsorptionCoefficient>0.1 0 2</AbsorptionCoefficient></Material>
        <Material id="2"><Transparency>0.5 1 0</Transparency><RefractionIndex>2</RefractionIndex></Material>
        <Material id="3"><Transparency>0 0 0</Transparency></Material>
        <Material id="4" type="conductor"><Roughness>0.25</Roughness></Material>
        <Material id="5" type="mirror" degamma="true"><MirrorReflectance>0.5 1 0</MirrorReflectance></Material>
        </Materials>)");
    CHECK(texts(scene.warnings) == Texts{});
    REQUIRE(scene.materials.size() == 5);
    CHECK(scene.materials[0].absorption == glm::vec3(0.1f, 0.0f, 2.0f));
    CHECK(scene.materials[1].kind == MaterialKind::dielectric);
    CHECK(scene.materials[1].absorption == glm::vec3(static_cast<float>(std::log(2.0)), 0.0f, 1e5f));
    CHECK(scene.materials[2].kind == MaterialKind::plain);
    CHECK(scene.materials[2].absorption == glm::vec3(0.0f));
    CHECK(scene.materials[3].roughness == 0.25f);
    CHECK(scene.materials[4].mirror == glm::vec3(static_cast<float>(std::pow(0.5, 2.2)), 1.0f, 0.0f));
}

TEST_CASE("materials name BRDFs, which may follow them", "[elements]") {
    const Scene scene = read(R"(<Materials>
        <Material id="1" BRDF="1"/> <Material id="2" BRDF="2"/> <Material id="3" BRDF="3"/> <Material id="4" BRDF="4"/>
        <Material id="5" BRDF="5"><PhongExponent>3</PhongExponent></Material> <Material id="6"/></Materials>
        <BRDFs><OriginalBlinnPhong id="1"><Exponent>11</Exponent></OriginalBlinnPhong>
        <ModifiedBlinnPhong id="2" normalized="true"><Exponent>12</Exponent></ModifiedBlinnPhong>
        <OriginalPhong id="3"><Exponent>13</Exponent></OriginalPhong>
        <ModifiedPhong id="4" normalized="false"><Exponent>14</Exponent></ModifiedPhong>
        <TorranceSparrow id="5" kdfresnel="true"><Exponent>15</Exponent></TorranceSparrow></BRDFs>)");
    CHECK(texts(scene.warnings) == Texts{"<PhongExponent> is ignored: the BRDF has an <Exponent>"});
    const BrdfModel models[] = {BrdfModel::blinn_phong, BrdfModel::modified_blinn_phong, BrdfModel::phong,
                                BrdfModel::modified_phong, BrdfModel::torrance_sparrow};
    REQUIRE(scene.materials.size() == 6);
    for (std::size_t i = 0; i < 5; ++i) {
        CAPTURE(i);
        CHECK(scene.materials[i].brdf == models[i]);
        CHECK(scene.materials[i].phong_exponent == 11.0f + static_cast<float>(i));
        CHECK(scene.materials[i].brdf_normalized == (i == 1));
        CHECK(scene.materials[i].diffuse_fresnel == (i == 4));
    }
    CHECK(scene.materials[5].brdf == BrdfModel::blinn_phong);
}

TEST_CASE("textures of all kinds", "[elements]") {
    const Scene scene = read(R"(<Textures><Images><Image id="7">a.tga</Image><Image id="9">./a.tga</Image></Images>
        <TextureMap id="1" type="image"><ImageId>7</ImageId><DecalMode>replace_ks</DecalMode>
            <Interpolation>bilinear</Interpolation><Normalizer>1</Normalizer></TextureMap>
        <TextureMap id="2" type="image"><ImageId>7</ImageId><DecalMode>bump_normal</DecalMode>
            <BumpFactor>-0.5</BumpFactor></TextureMap>
        <TextureMap id="3" type="perlin"><DecalMode>blend_kd</DecalMode><NoiseConversion>absval</NoiseConversion>
            <NoiseScale>4</NoiseScale><NumOctaves>3</NumOctaves></TextureMap>
        <TextureMap id="4" type="checkerboard"><DecalMode>replace_kd</DecalMode><BlackColor>1 2 3</BlackColor>
            <WhiteColor>4 5 6</WhiteColor><Scale>7</Scale><Offset>8</Offset></TextureMap>
        <TextureMap id="5" type="image"><ImageId>7</ImageId><DecalMode>replace_background</DecalMode></TextureMap>
        <Texture id="6"><ImageName>a.tga</ImageName><Interpolation>nearest</Interpolation>
            <DecalMode>replace_all</DecalMode><Appearance>clamp</Appearance></Texture>
        <Texture id="7"><ImageName>b.tga</ImageName><DecalMode>replace_normal</DecalMode>
            <Interpolation>trilinear</Interpolation><Appearance>repeat</Appearance></Texture></Textures>)");
    CHECK(texts(scene.warnings) == Texts{});
    REQUIRE(scene.images.size() == 3);  // one for each file as it is named
    CHECK(scene.images[0].width == 2);
    CHECK(scene.images[0].height == 1);
    CHECK(scene.images[0].bytes == std::vector<std::uint8_t>{10, 20, 30, 40, 50, 60});
    CHECK(scene.images[2].bytes == std::vector<std::uint8_t>{1, 2, 3});
    REQUIRE(scene.textures.size() == 7);
    const std::vector<Texture>& t = scene.textures;
    CHECK((t[0].target == TextureTarget::replace_specular && t[0].filter == TextureFilter::bilinear));
    CHECK((t[0].normalizer == 1.0f && t[0].kind == TextureKind::image && t[0].image == 0));
    CHECK((t[1].target == TextureTarget::bump_map && t[1].bump_factor == -0.5f && t[1].normalizer == 255.0f));
    CHECK(t[1].filter == TextureFilter::nearest);
    CHECK((t[2].kind == TextureKind::perlin && t[2].target == TextureTarget::blend_diffuse));
    CHECK((t[2].noise_conversion == NoiseConversion::absolute && t[2].noise_scale == 4.0f && t[2].noise_octaves == 3));
    CHECK((t[3].kind == TextureKind::checkerboard && t[3].target == TextureTarget::replace_diffuse));
    CHECK((t[3].black == glm::vec3(1, 2, 3) && t[3].white == glm::vec3(4, 5, 6)));
    CHECK((t[3].checker_scale == 7.0f && t[3].checker_offset == 8.0f));
    CHECK(t[4].target == TextureTarget::background);
    CHECK(scene.background_texture == std::optional<std::uint32_t>(4));
    CHECK((t[5].target == TextureTarget::replace_all && t[5].image == 0 && t[5].wrap == TextureWrap::clamp));
    CHECK((t[6].target == TextureTarget::normal_map && t[6].image == 2 && t[6].wrap == TextureWrap::repeat));
    CHECK(t[6].filter == TextureFilter::trilinear);
}

TEST_CASE("a picture that cannot be read is a warning, and magenta and black", "[elements]") {
    const Scene scene =
        read("<Textures><Images><Image id='1'>none.png</Image><Image id='2'>broken.png</Image></Images></Textures>");
    REQUIRE(scene.warnings.size() == 2);
    for (const Warning& warning : scene.warnings)  // of one line, and so in the order of the alphabet
        CHECK_THAT(warning.text, Catch::Contains(": a checkerboard of magenta and black takes its place"));
    CHECK_THAT(scene.warnings[0].text, Catch::Contains("broken.png"));
    CHECK_THAT(scene.warnings[1].text, Catch::Contains("none.png"));
    CHECK_THAT(scene.warnings[0].file, Catch::EndsWith("scene.xml"));
    CHECK(scene.warnings[0].line == 1);
    REQUIRE(scene.images.size() == 2);
    CHECK(scene.images[0].bytes == std::vector<std::uint8_t>{255, 0, 255, 0, 0, 0, 0, 0, 0, 255, 0, 255});
}

TEST_CASE("a picture outside the scene's folder is a warning", "[elements]") {
    std::filesystem::create_directory(folder().path() / "inner");
    const Scene scene = read_xml_scene(folder().write(
        "inner/scene.xml",
        "<Scene><Textures>\n<Texture id='1'><ImageName>../a.tga</ImageName></Texture></Textures></Scene>"));
    REQUIRE(scene.warnings.size() == 1);
    CHECK(scene.warnings[0].line == 2);
    CHECK_THAT(scene.warnings[0].text, Catch::Contains("that <ImageName> names is not in the scene's folder"));
    CHECK(scene.images.at(0).width == 2);
}

TEST_CASE("objects with the same material and textures share a variant", "[elements]") {
    const Scene scene = read(kTextures + kVertices + R"(<Materials><Material id="1"><DiffuseReflectance>1 2 3
        </DiffuseReflectance></Material><Material id="2"/></Materials><Objects>
        <Mesh id="1"><Material>1</Material><Textures>2</Textures><Faces>1 2 3</Faces></Mesh>
        <Mesh id="2"><Material>1</Material><Faces>1 2 3</Faces></Mesh>
        <MeshInstance id="3" baseMeshId="1"/>
        <MeshInstance id="4" baseMeshId="1"><Material>2</Material></MeshInstance>
        <MeshInstance id="5" baseMeshId="1"><Textures> </Textures></MeshInstance>
        <MeshInstance id="6" baseMeshId="2"><Textures>2 1</Textures></MeshInstance>
        <Triangle id="1"><Material>1</Material><Indices>1 2 3</Indices></Triangle>
        <Triangle id="2"><Material>1</Material><Textures>2</Textures><Indices>1 2 3</Indices></Triangle>
        <Sphere id="1"><Material>1</Material><Texture>2</Texture><Center>1</Center><Radius>1</Radius></Sphere>
        <Sphere id="2"><Material>1</Material><Textures>1 2</Textures><Center>1</Center><Radius>1</Radius></Sphere>
        <Plane id="1"><Material>2</Material><Textures>2</Textures><Point>1</Point><Normal>0 1 0</Normal></Plane>
        </Objects>)");
    CHECK(texts(scene.warnings) == Texts{});
    const auto use = [&](std::uint32_t material) {
        return std::pair(scene.materials[material].diffuse == glm::vec3(1, 2, 3), scene.materials[material].textures);
    };
    using Use = std::pair<bool, std::vector<std::uint32_t>>;
    REQUIRE(scene.meshes.size() == 4);
    CHECK(use(scene.meshes[0].material) == Use{true, {1}});
    CHECK(scene.meshes[1].material == 0);
    CHECK(scene.meshes[2].material == 0);
    CHECK(scene.meshes[3].material == scene.meshes[0].material);
    REQUIRE(scene.instances.size() == 4);
    CHECK(scene.instances[0].material == scene.meshes[0].material);
    CHECK(use(scene.instances[1].material) == Use{false, {1}});
    CHECK(scene.instances[2].material == 0);
    CHECK(use(scene.instances[3].material) == Use{true, {1, 0}});
    CHECK(scene.spheres.at(0).material == scene.meshes[0].material);
    CHECK(use(scene.spheres.at(1).material) == Use{true, {0, 1}});
    CHECK(scene.planes.at(0).material == scene.instances[1].material);
    CHECK(scene.materials.size() == 6);
}

TEST_CASE("vertices have texture coordinates", "[elements]") {
    const std::string textured = "<Material>1</Material><Textures>1</Textures>";
    const auto scene = [&](const std::string& objects) {
        return read(kTextures + kMaterial + kVertices +
                    "<TexCoordData type='uv'>0 0 0.25 0 0 0.5 0.75 1 2 -3</TexCoordData><Objects>" + objects +
                    "</Objects>");
    };
    using Pairs = std::vector<glm::vec2>;
    SECTION("by the same index as positions") {
        const Scene plain = scene("<Mesh id='1'>" + textured + "<Faces>2 4 3</Faces></Mesh>");
        CHECK(plain.meshes.at(0).texture_coordinates == Pairs{{0.25f, 0}, {0.75f, 1}, {0, 0.5f}});
        CHECK(texts(plain.warnings) == Texts{});
    }
    SECTION("with an offset of their own") {
        const Scene shifted =
            scene("<Mesh id='1'>" + textured + "<Faces vertexOffset='1' textureOffset='2'>0 1 2</Faces></Mesh>");
        CHECK(shifted.meshes.at(0).positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
        CHECK(shifted.meshes.at(0).texture_coordinates == Pairs{{0.25f, 0}, {0, 0.5f}, {0.75f, 1}});
    }
    SECTION("that of positions is not theirs") {
        const Scene shifted = scene("<Mesh id='1'>" + textured + "<Faces vertexOffset='1'>1 2 3</Faces></Mesh>");
        CHECK(shifted.meshes.at(0).positions == std::vector<glm::vec3>{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
        CHECK(shifted.meshes.at(0).texture_coordinates == Pairs{{0, 0}, {0.25f, 0}, {0, 0.5f}});
    }
    SECTION("missing ones are (0, 0), with a warning") {
        const Scene missing = scene("<Mesh id='1'>" + textured + "<Faces textureOffset='3'>1 2 3</Faces></Mesh>");
        CHECK(missing.meshes.at(0).texture_coordinates == Pairs{{0.75f, 1}, {2, -3}, {0, 0}});
        CHECK(texts(missing.warnings) == Texts{"<Mesh> has a texture with an image, but vertices without texture "
                                               "coordinates: (0, 0) is used"});
    }
    SECTION("of triangles") {
        const Scene triangle = scene("<Triangle id='1'>" + textured + "<Indices>1 2 4</Indices></Triangle>");
        CHECK(triangle.meshes.at(0).texture_coordinates == Pairs{{0, 0}, {0.25f, 0}, {0.75f, 1}});
    }
    SECTION("of PLY files") {
        const Scene ply = scene("<Mesh id='1'>" + textured + "<Faces plyFile='st.ply'/></Mesh>");
        CHECK(ply.meshes.at(0).texture_coordinates == Pairs{{0, 0}, {1, 0.25f}, {0, 0}});
    }
    SECTION("are dropped without textures") {
        const Scene bare = read(kMaterial + kVertices + "<TexCoordData>0 0 1 1</TexCoordData><Objects><Mesh id='1'>" +
                                "<Material>1</Material><Faces>1 2 3</Faces></Mesh></Objects>");
        CHECK(bare.meshes.at(0).texture_coordinates.empty());
    }
}

TEST_CASE("lights with an extent", "[elements]") {
    const Scene scene = read(kTextures + kMaterial + kVertices + R"(<Transformations><Translation id="1">1 2 3
        </Translation><Scaling id="1">2 2 2</Scaling><Rotation id="1">90 0 0 1</Rotation></Transformations><Lights>
        <AreaLight id="1"><Position>0 9 2</Position><Normal>0 -2 0</Normal><Size>3</Size><Radiance>5 6 7</Radiance>
        </AreaLight>
        <AreaLight id="2"><Transformations>s1 r1 t1</Transformations><Position>1 0 0</Position><Normal>0 -2 0</Normal>
        <Size>3</Size><Radiance>5 6 7</Radiance></AreaLight>
        <SphericalDirectionalLight id="3" type="probe"><ImageId>4</ImageId><Sampler>cosine</Sampler>
        </SphericalDirectionalLight>
        <SphericalDirectionalLight id="4"><ImageId>3</ImageId></SphericalDirectionalLight></Lights><Objects>
        <LightMesh id="1"><Material>1</Material><Faces>1 2 3</Faces><Radiance>1 2 3</Radiance>
        <Transformations>t1</Transformations></LightMesh>
        <LightMesh id="2"><Material>1</Material><Faces plyFile="st.ply"/><Radiance>1 2 3</Radiance></LightMesh>
        <LightSphere id="1"><Material>1</Material><Center>2</Center><Radius>2</Radius><Radiance>4 5 6</Radiance>
        </LightSphere></Objects>)");
    CHECK(texts(scene.warnings) == Texts{});
    REQUIRE(scene.lights.size() == 7);
    CHECK(scene.lights[1].names == Texts{"AreaLight-2"});
    CHECK(scene.lights[4].names == Texts{"LightMesh-1"});
    CHECK(scene.lights[6].names == Texts{"LightSphere-1"});
    CHECK(scene.lights[0].kind == Light::Kind::area);
    CHECK(scene.lights[0].area.position == glm::vec3(0, 9, 2));
    CHECK(scene.lights[0].area.normal == glm::vec3(0, -2, 0));
    CHECK(scene.lights[0].area.size == 3.0f);
    CHECK(scene.lights[0].area.radiance == glm::vec3(5, 6, 7));
    CHECK(glm::distance(scene.lights[1].area.position, glm::vec3(1, 4, 3)) < 1e-6f);
    CHECK(glm::distance(scene.lights[1].area.normal, glm::vec3(1, 0, 0)) < 1e-6f);
    CHECK(scene.lights[1].area.size == Approx(6.0f));
    CHECK(scene.lights[2].kind == Light::Kind::environment);
    CHECK((scene.lights[2].environment.image == 1 && scene.lights[2].environment.mapping == EnvironmentMapping::probe));
    CHECK(scene.lights[2].environment.sampling == EnvironmentSampling::cosine);
    CHECK(scene.lights[3].environment.mapping == EnvironmentMapping::latlong);
    CHECK(scene.lights[3].environment.sampling == EnvironmentSampling::picture);
    for (const std::size_t i : {4, 5}) {
        CHECK(scene.lights[i].kind == Light::Kind::mesh);
        CHECK(scene.lights[i].object.object == i - 4);
        CHECK(scene.materials[scene.meshes.at(i - 4).material].emission == glm::vec3(1, 2, 3));
    }
    CHECK(scene.meshes[0].transform[3] == glm::vec3(1, 2, 3));
    CHECK(scene.lights[6].kind == Light::Kind::sphere);
    CHECK(scene.lights[6].object.object == 0);
    CHECK(scene.materials[scene.spheres.at(0).material].emission == glm::vec3(4, 5, 6));
    CHECK(scene.materials.size() == 3);
}

TEST_CASE("lights and cameras take transformations", "[elements]") {
    const Scene scene = read(R"(<Transformations><Translation id="1">10 20 30</Translation><Rotation id="1">90 0 0 1
        </Rotation></Transformations><Lights>
        <PointLight id="1"><Position>1 0 0</Position><Intensity>1 1 1</Intensity>
        <Transformations>r1 t1</Transformations></PointLight>
        <DirectionalLight id="2"><Direction>1 0 0</Direction><Radiance>1 1 1</Radiance>
        <Transformations>r1 t1</Transformations></DirectionalLight>
        <SpotLight id="3"><Position>1 0 0</Position><Direction>0 2 0</Direction><Intensity>1 1 1</Intensity>
        <CoverageAngle>40</CoverageAngle><FalloffAngle>20</FalloffAngle>
        <Transformations>r1 t1</Transformations></SpotLight></Lights>)" +
                             camera("<Transformations>r1 t1</Transformations>"));
    CHECK(texts(scene.warnings) == Texts{});
    REQUIRE(scene.lights.size() == 3);
    CHECK(glm::distance(scene.lights[0].point.position, glm::vec3(10, 21, 30)) < 1e-5f);
    CHECK(glm::distance(scene.lights[1].directional.direction, glm::vec3(0, 1, 0)) < 1e-6f);
    CHECK(glm::distance(scene.lights[2].spot.position, glm::vec3(10, 21, 30)) < 1e-5f);
    CHECK(glm::distance(scene.lights[2].spot.direction, glm::vec3(-2, 0, 0)) < 1e-6f);
    const Camera& view = scene.cameras.at(0);
    CHECK(glm::distance(view.position, glm::vec3(8, 21, 33)) < 1e-5f);
    CHECK(glm::distance(view.gaze, glm::vec3(0, 0, -1)) < 1e-6f);
    CHECK(glm::distance(view.up, glm::vec3(-1, 0, 0)) < 1e-6f);
}

TEST_CASE("cameras have a lens and tone maps", "[elements]") {
    const Scene scene = read(camera(R"(<FocusDistance>9</FocusDistance><ApertureSize>0.5</ApertureSize>
        <Tonemap><TMO>Photographic</TMO></Tonemap>
        <Tonemap><TMO>ACES</TMO><TMOOptions>0.25 2</TMOOptions><Saturation>0.5</Saturation><Gamma>sRGB</Gamma>
        <Extension> _aces.png </Extension></Tonemap>
        <Tonemap><TMO>filmic</TMO><Gamma>1.8</Gamma></Tonemap>
        <Tonemap><TMO>AgX</TMO></Tonemap>)"));
    CHECK(texts(scene.warnings) == Texts{});
    const Camera& view = scene.cameras.at(0);
    CHECK(view.focus_distance == 9.0f);
    CHECK(view.aperture_size == 0.5f);
    REQUIRE(view.tone_maps.size() == 4);
    CHECK(view.tone_maps[0].tone_operator == ToneOperator::photographic);
    CHECK((view.tone_maps[0].key == 0.18f && view.tone_maps[0].burn_percent == 1.0f));
    CHECK((view.tone_maps[0].gamma == 2.2f && !view.tone_maps[0].is_srgb && view.tone_maps[0].extension.empty()));
    CHECK(view.tone_maps[1].tone_operator == ToneOperator::aces);
    CHECK((view.tone_maps[1].key == 0.25f && view.tone_maps[1].burn_percent == 2.0f));
    CHECK((view.tone_maps[1].saturation == 0.5f && view.tone_maps[1].is_srgb));
    CHECK(view.tone_maps[1].extension == "_aces.png");
    CHECK(view.tone_maps[2].tone_operator == ToneOperator::filmic);
    CHECK(view.tone_maps[2].gamma == 1.8f);
    CHECK(view.tone_maps[3].tone_operator == ToneOperator::agx);
}

TEST_CASE("cameras say how they are path traced", "[elements]") {
    const auto traced = [](const std::string& elements) {
        const Scene scene =
            read("<MaxRecursionDepth>4</MaxRecursionDepth>" + camera("<Renderer>PathTracing</Renderer>" + elements));
        CHECK(texts(scene.warnings) == Texts{});
        return scene.cameras.at(0).path_tracing.value();
    };
    const PathTracing plain = traced("<RendererParams></RendererParams>");
    CHECK_FALSE((plain.samples_brdf || plain.samples_lights || plain.weighs || plain.roulette_from));
    CHECK(plain.bounces == 4u);
    CHECK(std::isinf(plain.largest_sample));
    const PathTracing lights = traced("<RendererParams>NextEventEstimation ImportanceSampling</RendererParams>");
    CHECK((lights.samples_brdf && lights.samples_lights && !lights.weighs));
    CHECK(lights.bounces == 5u);  // a ray to a light is one more
    const PathTracing roulette = traced(
        "<RendererParams>mis_balance RussianRoulette</RendererParams><MinRecursionDepth>2</MinRecursionDepth>"
        "<SplittingFactor>1</SplittingFactor><SampleMaxVal>9</SampleMaxVal>");
    CHECK((!roulette.samples_brdf && roulette.samples_lights && roulette.weighs));
    CHECK(roulette.roulette_from == 2u);
    CHECK_FALSE(roulette.bounces);
    CHECK(roulette.largest_sample == 9.0f);

    const Scene direct = read(camera("<Renderer>DirectLighting</Renderer><RendererParams></RendererParams>"));
    CHECK(texts(direct.warnings) == Texts{});
    CHECK_FALSE(direct.cameras.at(0).path_tracing);
    const Scene others = read(camera("<Renderer>Photons</Renderer><RendererParams>RussianRoulette</RendererParams>"));
    CHECK(texts(others.warnings) ==
          Texts{"<Renderer>: \"Photons\" is ignored: DirectLighting and PathTracing are known",
                "<RendererParams> is ignored: the camera's picture is not path traced"});
    const Scene unknown =
        read(camera("<Renderer>PathTracing</Renderer><RendererParams>Guiding</RendererParams>"
                    "<MinRecursionDepth>2</MinRecursionDepth><SplittingFactor>3</SplittingFactor>"));
    CHECK(
        texts(unknown.warnings) ==
        Texts{"<MinRecursionDepth> is ignored: the camera's picture is not made with RussianRoulette",
              "<RendererParams>: \"Guiding\" is ignored: ImportanceSampling, NextEventEstimation, RussianRoulette and "
              "MIS_BALANCE are known",
              "<SplittingFactor> is ignored: a path has one ray at each bounce; more samples do the same"});
    CHECK_THROWS_WITH(read(camera("<Renderer>PathTracing</Renderer><SampleMaxVal>0</SampleMaxVal>")),
                      Catch::Contains("<SampleMaxVal>") && Catch::Contains("a positive number"));
}

TEST_CASE("objects move", "[elements]") {
    const std::string motion = "<MotionBlur>1 2 3</MotionBlur>";
    const Scene scene =
        read(kMaterial + kVertices + "<Objects><Mesh id='1'><Material>1</Material><Faces>1 2 3</Faces>" + motion +
             "</Mesh><MeshInstance id='2' baseMeshId='1'/><MeshInstance id='3' baseMeshId='1'>" +
             "<MotionBlur>4 5 6</MotionBlur></MeshInstance><Triangle id='1'><Material>1</Material>" +
             "<Indices>1 2 3</Indices></Triangle><Triangle id='2'><Material>1</Material><Indices>1 2 3" + "</Indices>" +
             motion + "</Triangle><Sphere id='1'><Material>1</Material><Center>1</Center>" + "<Radius>1</Radius>" +
             motion + "</Sphere></Objects>");
    CHECK(texts(scene.warnings) == Texts{});
    const glm::vec3 moved(1, 2, 3);
    REQUIRE(scene.meshes.size() == 3);
    CHECK(scene.meshes[0].motion == moved);
    CHECK(scene.meshes[1].motion == glm::vec3(0));
    CHECK(scene.meshes[2].motion == moved);
    CHECK(scene.instances.at(0).motion == glm::vec3(0));
    CHECK(scene.instances.at(1).motion == glm::vec3(4, 5, 6));
    CHECK(scene.spheres.at(0).motion == moved);
}

TEST_CASE("a cylinder is a closed surface with the normals of its side", "[elements]") {
    const Scene scene =
        read(kMaterial + kVertices + R"(<Transformations><Scaling id="1">2 2 -2</Scaling></Transformations>
        <Objects><Cylinder id="1"><Material>1</Material><Center>2</Center><Axis>0 3 4</Axis><Radius>0.5</Radius>
        <Height>3</Height><Transformations>s1</Transformations><MotionBlur>1 0 0</MotionBlur></Cylinder></Objects>)");
    CHECK(texts(scene.warnings) == Texts{});
    REQUIRE(scene.meshes.size() == 2);
    const glm::dvec3 centre(1, 0, 0), axis(0, 0.6, 0.8);
    double volume = 0.0;
    for (const Mesh& mesh : scene.meshes) {
        CHECK(mesh.transform[2].z == -2.0f);
        CHECK(mesh.motion == glm::vec3(1, 0, 0));
        for (const glm::uvec3& triangle : mesh.triangles) {
            const glm::dvec3 a = glm::dvec3(mesh.positions[triangle.x]) - centre;
            const glm::dvec3 b = glm::dvec3(mesh.positions[triangle.y]) - centre;
            const glm::dvec3 c = glm::dvec3(mesh.positions[triangle.z]) - centre;
            volume += glm::dot(a, glm::cross(b, c)) / 6.0;
        }
    }
    CHECK(volume == Approx(3.14159265 * 0.25 * 3.0).epsilon(1e-4));  // so all triangles face outwards
    const Mesh& side = scene.meshes[0];
    REQUIRE(side.normals.size() == side.positions.size());
    CHECK(scene.meshes[1].normals.empty());
    for (std::size_t i = 0; i < side.positions.size(); ++i) {
        const glm::dvec3 from_centre = glm::dvec3(side.positions[i]) - centre;
        CHECK(std::abs(glm::dot(from_centre, axis)) == Approx(1.5));
        const glm::dvec3 outward = from_centre - glm::dot(from_centre, axis) * axis;
        CHECK(glm::distance(2.0 * outward, glm::dvec3(side.normals[i])) < 1e-6);
    }
}

TEST_CASE("what files leave out or write in an unusual way is read", "[elements]") {
    SECTION("a camera with a field of view alone") {
        const Scene scene = read(R"(<Cameras><Camera id="1"><Position>0 0 0</Position><GazePoint>0 0 -3</GazePoint>
            <Up>0 1 0</Up><FovY>90</FovY><NearDistance>2</NearDistance><ImageResolution>800.0 400.</ImageResolution>
            <NumSamples>10.0</NumSamples></Camera></Cameras>)");
        CHECK(texts(scene.warnings) == Texts{});
        CHECK(scene.cameras.at(0).top == 2.0f);
        CHECK(scene.cameras[0].right == 4.0f);
        CHECK(scene.cameras[0].width == 800);
        CHECK(scene.cameras[0].height == 400);
        CHECK(scene.cameras[0].samples_per_pixel == 10);
    }
    SECTION("lamps without a material") {
        const Scene scene = read(kVertices + R"(<Objects>
            <LightSphere id="1"><Center>1</Center><Radius>1</Radius><Radiance>1 2 3</Radiance></LightSphere>
            <LightMesh id="1"><Faces>1 2 3</Faces><Radiance>4 5 6</Radiance></LightMesh></Objects>)");
        CHECK(texts(scene.warnings) == Texts{});
        CHECK(scene.materials.at(scene.spheres.at(0).material).emission == glm::vec3(1, 2, 3));
        CHECK(scene.materials.at(scene.meshes.at(0).material).emission == glm::vec3(4, 5, 6));
    }
    SECTION("rotations by nothing, and ids that occur again") {
        const Scene scene = read(kMaterial + kVertices + R"(<Transformations><Rotation id="1">0 0 0 0</Rotation>
            <Translation id="1">1 2 3</Translation><Translation id="1">4 5 6</Translation></Transformations><Objects>
            <Mesh id="1"><Material>1</Material><Faces>1 2 3</Faces><Transformations>r1 t1</Transformations></Mesh>
            </Objects>)");
        CHECK(texts(scene.warnings) == Texts{"the id 1 of a <Translation> occurs again: objects get the first one"});
        CHECK(scene.meshes.at(0).transform == Transform(glm::vec3(1, 0, 0), {0, 1, 0}, {0, 0, 1}, {1, 2, 3}));
    }
    SECTION("an index of refraction that means nothing") {
        const Scene scene =
            read("<Materials><Material id='1'><RefractionIndex>0</RefractionIndex></Material></Materials>");
        CHECK(scene.materials.at(0).refraction_index == 0.0f);
    }
}

TEST_CASE("wrong elements are refused with their reason in either spelling", "[elements]") {
    const auto material = [](const std::string& inner) {
        return "<Materials><Material id='1'>" + inner + "</Material></Materials>";
    };
    const auto texture = [](const std::string& inner) {
        return "<Textures><Images><Image id='3'>a.tga</Image></Images><TextureMap id='1' type='image'>" + inner +
               "</TextureMap></Textures>";
    };
    const auto tone_map = [](const std::string& inner) { return camera("<Tonemap>" + inner + "</Tonemap>"); };
    const auto light = [](const std::string& inner) { return "<Lights>" + inner + "</Lights>"; };
    const std::string area = "<Position>0 0 0</Position><Normal>0 1 0</Normal><Radiance>1 1 1</Radiance>";
    const std::vector<std::pair<std::string, std::string>> cases{
        {material("<AbsorptionCoefficient>0 -1 0</AbsorptionCoefficient>"), "three numbers of at least 0"},
        {material("<Transparency>0 2 0</Transparency>"), "three numbers of 0 to 1"},
        {"<Materials><Material id='1' type='dielectric'><RefractionIndex>0</RefractionIndex></Material></Materials>",
         "a positive number of a dielectric"},
        {material("<PhongExponent>1.5.0</PhongExponent>"), "'1.5.0': a finite number"},
        {camera("<NumSamples>10.5</NumSamples>"), "<NumSamples> holds '10.5': an integer was expected"},
        {kMaterial + kVertices +
             "<Objects><Cylinder id='1'><Material>1</Material><Center>1</Center><Axis>0 0 0</Axis>"
             "<Radius>1</Radius><Height>1</Height></Cylinder></Objects>",
         "<Axis> of <Cylinder>"},
        {kMaterial + kVertices +
             "<Objects><Cylinder id='1'><Material>1</Material><Center>1</Center><Axis>0 0 1</Axis>"
             "<Radius>1</Radius><Height>0</Height></Cylinder></Objects>",
         "<Height> of <Cylinder>"},
        {material("<Roughness>-1</Roughness>"), "<Roughness> of <Material> is '-1'"},
        {material("<Roughness>nan</Roughness>"), "'nan': a finite number"},
        {"<Materials><Material id='1' BRDF='2'/></Materials>", "the BRDF 2 does not exist: the scene has no BRDFs"},
        {"<BRDFs><ModifiedPhong><Exponent>2</Exponent></ModifiedPhong></BRDFs>",
         "<ModifiedPhong> needs an attribute id"},
        {"<BRDFs><ModifiedPhong id='1' normalized='2'/></BRDFs>", "normalized=\"2\""},
        {"<BRDFs><ModifiedPhong id='1'><Exponent>-1</Exponent></ModifiedPhong></BRDFs>", "<Exponent>"},
        {texture("<ImageId>4</ImageId>"), "the image 4 does not exist: the scene has 3"},
        {texture(""), "<TextureMap> needs a <ImageId>"},
        {texture("<ImageId>3</ImageId><DecalMode>paint</DecalMode>"),
         "<DecalMode> is 'paint': allowed are replace_kd, blend_kd"},
        {texture("<ImageId>3</ImageId><Interpolation>cubic</Interpolation>"), "<Interpolation> is 'cubic'"},
        {texture("<ImageId>3</ImageId><Appearance>tile</Appearance>"), "<Appearance> is 'tile'"},
        {texture("<ImageId>3</ImageId><Normalizer>0</Normalizer>"), "<Normalizer>"},
        {texture("<ImageId>3</ImageId><NumOctaves>99</NumOctaves>"), "1 to 32 octaves"},
        {texture("<ImageId>3</ImageId><NoiseConversion>none</NoiseConversion>"), "<NoiseConversion> is 'none'"},
        {"<Textures><TextureMap type='perlin'/></Textures>", "<TextureMap> needs an attribute id"},
        {"<Textures><TextureMap id='1' type='wood'/></Textures>", "type=\"wood\""},
        {sphere("<Textures>5</Textures>"), "the texture 5 does not exist: the scene has no textures"},
        {sphere("<Textures>a</Textures>"), "<Textures> holds 'a': an integer was expected"},
        {sphere("<MotionBlur>1 2</MotionBlur>"), "<MotionBlur> holds 2 numbers"},
        {"<TexCoordData>0 0 1</TexCoordData>", "<TexCoordData> ends within a pair, after 1 whole ones"},
        {light("<AreaLight id='1'>" + area + "<Size>0</Size></AreaLight>"), "<Size>"},
        {light("<AreaLight id='1'>" + area + "</AreaLight>"), "<AreaLight> needs a <Size>"},
        {light("<SphericalDirectionalLight id='1'><ImageId>1</ImageId></SphericalDirectionalLight>"),
         "the image 1 does not exist: the scene has no images"},
        {"<Transformations><Scaling id='1'>1 0 1</Scaling></Transformations>" +
             light("<PointLight id='1'><Position>0 0 0</Position><Intensity>1 1 1</Intensity>"
                   "<Transformations>s1</Transformations></PointLight>"),
         "the transformations of <PointLight> have no inverse"},
        {kMaterial + kVertices +
             "<Objects><LightSphere id='1'><Material>1</Material><Center>1</Center><Radius>1</Radius></LightSphere>"
             "</Objects>",
         "<LightSphere> needs a <Radiance>"},
        {kMaterial + kVertices +
             "<Objects><LightMesh id='1'><Material>1</Material><Faces>1 2 3</Faces><Radiance>1 -1 1</Radiance>"
             "</LightMesh></Objects>",
         "<Radiance> of <LightMesh>"},
        {camera("<ApertureSize>-1</ApertureSize>"), "<ApertureSize>"},
        {camera("<ApertureSize>1</ApertureSize>"), "<Camera> needs a <FocusDistance>"},
        {camera("<FocusDistance>0</FocusDistance>"), "<FocusDistance>"},
        {tone_map("<Gamma>2</Gamma>"), "<Tonemap> needs a <TMO>"},
        {tone_map("<TMO>Reinhard</TMO>"), "<TMO> is 'Reinhard': allowed are Photographic, ACES, Filmic, AgX"},
        {tone_map("<TMO>ACES</TMO><TMOOptions>0 1</TMOOptions>"), "<TMOOptions>"},
        {tone_map("<TMO>ACES</TMO><TMOOptions>1 101</TMOOptions>"), "percentage of 0 to 100"},
        {tone_map("<TMO>ACES</TMO><TMOOptions>1</TMOOptions>"), "<TMOOptions> holds 1 numbers"},
        {tone_map("<TMO>ACES</TMO><Gamma>0</Gamma>"), "<Gamma>"},
        {tone_map("<TMO>ACES</TMO><Gamma>linear</Gamma>"), "<Gamma> holds 'linear'"},
        {tone_map("<TMO>ACES</TMO><Saturation>-1</Saturation>"), "<Saturation>"},
        {tone_map("<TMO>ACES</TMO><Extension>/../../x.png</Extension>"), "without slashes"},
    };
    for (const auto& [inner, expected] : cases) {
        CAPTURE(inner);
        CHECK_THAT(reason(inner), Catch::Contains(expected));
    }
}

TEST_CASE("the bundled scenes say the same in XML and in JSON", "[elements]") {
    for (const auto& entry : std::filesystem::directory_iterator(CASTOR_SOURCE_DIR "/scenes")) {
        if (entry.path().extension() != ".xml") continue;
        CAPTURE(entry.path());
        std::ifstream stream(entry.path());
        const std::string xml{std::istreambuf_iterator<char>(stream), {}};
        const bool names_meshes = xml.find("File=") != xml.npos;  // those are not beside the twin, nor are pictures
        const Scene scene = read_xml_scene(entry.path());
        if (names_meshes || !scene.images.empty()) continue;
        const Scene twin = read_xml_scene(folder().write("twin.json", test::to_json(xml)));
        CHECK(test::describe(scene) == test::describe(twin));
    }
}

TEST_CASE("the shared scenes of CENG 795 are read", "[elements]") {
    const std::filesystem::path scenes = test::shared_folder() / "scenes" / "ceng795";
    if (!std::filesystem::exists(scenes)) {
        std::printf("skipped: no reference scenes in %s\n", scenes.c_str());
        return;
    }
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(scenes)) {
        const std::string extension = entry.path().extension().string();
        if (extension != ".xml" && extension != ".json") continue;
        CAPTURE(entry.path());
        const Scene scene = load_scene(entry.path());
        for (const Warning& warning : scene.warnings) FAIL_CHECK(warning.text);
        ++count;
    }
    CHECK(count >= 9);
}

}  // namespace castor
