#include "scene/xml_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "castor/error.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor {

namespace {

/// A scene with one of everything; most tests change one place of it.
const std::string kScene = R"(<?xml version="1.0"?>
<Scene>
    <BackgroundColor>10 20 30.5</BackgroundColor>
    <ShadowRayEpsilon>2e-3</ShadowRayEpsilon>
    <MaxRecursionDepth>4</MaxRecursionDepth>
    <Cameras>
        <Camera id="1">
            <Position>1 2 3</Position>
            <Gaze>0 0 -2</Gaze>
            <Up>0 1 0</Up>
            <NearPlane>-1 1.5 -0.5 0.75</NearPlane>
            <NearDistance>2</NearDistance>
            <ImageResolution>640 480</ImageResolution>
            <NumSamples>16</NumSamples>
            <ImageName> one.ppm </ImageName>
        </Camera>
    </Cameras>
    <Lights>
        <AmbientLight>25 26 27</AmbientLight>
        <PointLight id="1">
            <Position>4 5 6</Position>
            <Intensity>1000 1001 1002</Intensity>
        </PointLight>
    </Lights>
    <Materials>
        <Material id="7" type="mirror">
            <AmbientReflectance>1 1 1</AmbientReflectance>
            <DiffuseReflectance>0.5 0.25 0.125</DiffuseReflectance>
            <SpecularReflectance>0.1 0.2 0.3</SpecularReflectance>
            <MirrorReflectance>0.4 0.5 0.6</MirrorReflectance>
            <PhongExponent>50</PhongExponent>
        </Material>
        <Material id="-3"></Material>
    </Materials>
    <VertexData>
        -0.5 0.5 -2
        -0.5 -0.5 -2
        0.5 -0.5 -2
        0.5 0.5 -2
        7 8 9
    </VertexData>
    <Objects>
        <Mesh id="1">
            <Material>7</Material>
            <Faces>
                3 1 2
                1 3 4
            </Faces>
        </Mesh>
        <Triangle id="1">
            <Material>-3</Material>
            <Indices>2 3 4</Indices>
        </Triangle>
        <Sphere id="1">
            <Material>7</Material>
            <Center>5</Center>
            <Radius>0.3</Radius>
        </Sphere>
        <Plane id="1">
            <Material>-3</Material>
            <Point>5</Point>
            <Normal>0 2 0</Normal>
        </Plane>
    </Objects>
</Scene>
)";

/// kScene (or `text`) with the only occurrence of `from` replaced.
std::string with(const std::string& from, const std::string& to, std::string text = kScene) {
    const std::size_t place = text.find(from);
    REQUIRE(place != text.npos);
    REQUIRE(text.find(from, place + 1) == text.npos);
    return text.replace(place, from.size(), to);
}

std::string without(const std::string& part) {
    return with(part, "");
}

Scene read(const std::string& text) {
    const test::TemporaryDirectory folder;
    return read_xml_scene(folder.write("scene.xml", text));
}

std::size_t line_of(const std::string& text, const std::string& part) {
    const std::size_t place = text.find(part);
    REQUIRE(place != text.npos);
    return 1 +
           static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n'));
}

std::vector<std::string> texts(const std::vector<Warning>& warnings) {
    std::vector<std::string> lines;
    for (const Warning& warning : warnings) lines.push_back(std::to_string(warning.line) + ": " + warning.text);
    return lines;
}

using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("an XML scene is read element by element", "[xml]") {
    const Scene scene = read(kScene);
    CHECK(texts(scene.warnings) == Texts{});
    CHECK(scene.background == glm::vec3(10.0f, 20.0f, 30.5f));
    CHECK(scene.shadow_ray_epsilon == 2e-3f);
    CHECK(scene.max_recursion_depth == 4);
    CHECK(scene.ambient_light == glm::vec3(25, 26, 27));

    REQUIRE(scene.cameras.size() == 1);
    const Camera& camera = scene.cameras[0];
    CHECK(camera.image_name == "one.ppm");
    CHECK(camera.position == glm::vec3(1, 2, 3));
    CHECK(camera.gaze == glm::vec3(0, 0, -2));
    CHECK(camera.up == glm::vec3(0, 1, 0));
    CHECK(camera.left == -1.0f);
    CHECK(camera.right == 1.5f);
    CHECK(camera.bottom == -0.5f);
    CHECK(camera.top == 0.75f);
    CHECK(camera.distance == 2.0f);
    CHECK(camera.width == 640);
    CHECK(camera.height == 480);
    CHECK(camera.samples_per_pixel == 16);
    CHECK_FALSE(camera.left_handed);
    CHECK(camera.t_min == 0.0f);
    CHECK(camera.t_max == std::numeric_limits<float>::infinity());
    CHECK(camera.line == 7);

    REQUIRE(scene.lights.size() == 1);
    CHECK(scene.lights[0].kind == Light::Kind::point);
    CHECK(scene.lights[0].point.position == glm::vec3(4, 5, 6));
    CHECK(scene.lights[0].point.intensity == glm::vec3(1000, 1001, 1002));
    CHECK(scene.lights[0].line == 20);

    REQUIRE(scene.materials.size() == 2);
    CHECK(scene.materials[0].kind == MaterialKind::mirror);
    CHECK(scene.materials[0].ambient == glm::vec3(1, 1, 1));
    CHECK(scene.materials[0].diffuse == glm::vec3(0.5f, 0.25f, 0.125f));
    CHECK(scene.materials[0].specular == glm::vec3(0.1f, 0.2f, 0.3f));
    CHECK(scene.materials[0].mirror == glm::vec3(0.4f, 0.5f, 0.6f));
    CHECK(scene.materials[0].phong_exponent == 50.0f);
    CHECK(scene.materials[1].kind == MaterialKind::plain);
    CHECK(scene.materials[1].diffuse == glm::vec3(0.0f));
    CHECK(scene.materials[1].phong_exponent == 1.0f);

    REQUIRE(scene.meshes.size() == 2);
    const Mesh& mesh = scene.meshes[0];
    CHECK(mesh.material == 0);
    CHECK(mesh.line == line_of(kScene, "<Mesh"));
    CHECK(mesh.normals.empty());
    // The mesh has its own vertices in the order of their first use.
    REQUIRE(mesh.positions.size() == 4);
    CHECK(mesh.positions[0] == glm::vec3(0.5f, -0.5f, -2));
    CHECK(mesh.positions[1] == glm::vec3(-0.5f, 0.5f, -2));
    CHECK(mesh.positions[2] == glm::vec3(-0.5f, -0.5f, -2));
    CHECK(mesh.positions[3] == glm::vec3(0.5f, 0.5f, -2));
    REQUIRE(mesh.triangles.size() == 2);
    CHECK(mesh.triangles[0] == glm::uvec3(0, 1, 2));
    CHECK(mesh.triangles[1] == glm::uvec3(1, 0, 3));
    REQUIRE(scene.meshes[1].triangles.size() == 1);
    CHECK(scene.meshes[1].material == 1);
    CHECK(scene.meshes[1].positions.size() == 3);
    CHECK(scene.meshes[1].positions[0] == glm::vec3(-0.5f, -0.5f, -2));

    REQUIRE(scene.spheres.size() == 1);
    CHECK(scene.spheres[0].center == glm::vec3(7, 8, 9));
    CHECK(scene.spheres[0].radius == 0.3f);
    CHECK(scene.spheres[0].material == 0);
    CHECK(scene.spheres[0].line == line_of(kScene, "<Sphere"));
    REQUIRE(scene.planes.size() == 1);
    CHECK(scene.planes[0].point == glm::vec3(7, 8, 9));
    CHECK(scene.planes[0].normal == glm::vec3(0, 2, 0));
    CHECK(scene.planes[0].material == 1);
}

TEST_CASE("what an XML scene leaves out has the format's defaults", "[xml]") {
    const Scene scene = read("<Scene/>");
    CHECK(texts(scene.warnings) == Texts{});
    CHECK(scene.background == glm::vec3(0.0f));
    CHECK(scene.shadow_ray_epsilon == 1e-3f);
    CHECK(scene.max_recursion_depth == 6);
    CHECK(scene.cameras.empty());
    CHECK(scene.meshes.empty());
    CHECK(read(without("            <NumSamples>16</NumSamples>\n")).cameras[0].samples_per_pixel == 1);
    CHECK(read(without("            <ImageName> one.ppm </ImageName>\n")).cameras[0].image_name.empty());
}

TEST_CASE("a lookAt camera has a window from its field of view", "[xml]") {
    const std::string by_angle = with("<NearPlane>-1 1.5 -0.5 0.75</NearPlane>", "<FovY>60</FovY>",
                                      with("<Camera id=\"1\">", "<Camera id=\"1\" type=\"lookAt\">"));
    const double top = 2.0 * std::tan(glm::radians(30.0)), right = top * 640 / 480;
    SECTION("with a direction") {
        const Camera camera = read(by_angle).cameras.at(0);
        CHECK(camera.gaze == glm::vec3(0, 0, -2));
        CHECK(camera.top == static_cast<float>(top));
        CHECK(camera.bottom == static_cast<float>(-top));
        CHECK(camera.right == static_cast<float>(right));
        CHECK(camera.left == static_cast<float>(-right));
    }
    SECTION("with a point") {
        const Camera camera = read(with("<Gaze>0 0 -2</Gaze>", "<GazePoint>4 4 4</GazePoint>", by_angle)).cameras.at(0);
        CHECK(camera.gaze == glm::vec3(3, 2, 1));
    }
    SECTION("without a distance, which is 1 then") {
        const Camera camera = read(with("<NearDistance>2</NearDistance>", "", by_angle)).cameras.at(0);
        CHECK(camera.distance == 1.0f);
        CHECK(camera.top == static_cast<float>(top / 2.0));
    }
    SECTION("with a window that it does not use") {
        const Scene scene = read(with("<FovY>60</FovY>", "<FovY>60</FovY><NearPlane>1 2 3 4</NearPlane>", by_angle));
        CHECK(scene.cameras.at(0).top == static_cast<float>(top));
        CHECK(texts(scene.warnings) == Texts{"11: <NearPlane> is ignored: the camera is not of the type that uses it"});
    }
}

TEST_CASE("cameras have a handedness and a range, and there may be several", "[xml]") {
    CHECK(read(with("<Camera id=\"1\">", "<Camera id=\"1\" handedness=\"left\">")).cameras.at(0).left_handed);
    CHECK_FALSE(read(with("<Camera id=\"1\">", "<Camera id=\"1\" handedness=\"right\">")).cameras.at(0).left_handed);
    const Camera ranged = read(with("<Up>0 1 0</Up>", "<Up>0 1 0</Up><TMin>0.5</TMin><TMax>100</TMax>")).cameras.at(0);
    CHECK(ranged.t_min == 0.5f);
    CHECK(ranged.t_max == 100.0f);

    const std::size_t begin = kScene.find("        <Camera id"), end = kScene.find("    </Cameras>");
    const std::string camera = kScene.substr(begin, end - begin);
    const Scene scene = read(with("    </Cameras>", with("one.ppm", "two.png", camera) + "    </Cameras>"));
    REQUIRE(scene.cameras.size() == 2);
    CHECK(scene.cameras[0].image_name == "one.ppm");
    CHECK(scene.cameras[1].image_name == "two.png");
}

TEST_CASE("lights of all kinds keep their order", "[xml]") {
    const Scene scene = read(with("        <AmbientLight>", R"(
        <SpotLight id="1"><Position>1 2 3</Position><Direction>0 -2 0</Direction><Intensity>4 5 6</Intensity>
            <CoverageAngle>90</CoverageAngle><FalloffAngle>60</FalloffAngle></SpotLight>
        <DirectionalLight id="1"><Direction>0 0 -3</Direction><Radiance>7 8 9</Radiance></DirectionalLight>
        <AmbientLight>)"));
    CHECK(texts(scene.warnings) == Texts{});
    REQUIRE(scene.lights.size() == 3);
    CHECK(scene.lights[0].kind == Light::Kind::spot);
    CHECK(scene.lights[0].spot.position == glm::vec3(1, 2, 3));
    CHECK(scene.lights[0].spot.direction == glm::vec3(0, -2, 0));
    CHECK(scene.lights[0].spot.intensity == glm::vec3(4, 5, 6));
    CHECK(scene.lights[0].spot.coverage_radians == glm::radians(90.0f));
    CHECK(scene.lights[0].spot.falloff_radians == glm::radians(60.0f));
    CHECK(scene.lights[1].kind == Light::Kind::directional);
    CHECK(scene.lights[1].directional.direction == glm::vec3(0, 0, -3));
    CHECK(scene.lights[1].directional.radiance == glm::vec3(7, 8, 9));
    CHECK(scene.lights[2].kind == Light::Kind::point);
}

TEST_CASE("materials have a type, indices and gamma", "[xml]") {
    const auto material = [](const std::string& text) {
        return read("<Scene><Materials>" + text + "</Materials></Scene>").materials.at(0);
    };
    const Material conductor = material(
        "<Material id='1' "
        "type='conductor'><RefractionIndex>0.37</RefractionIndex><AbsorptionIndex>2.82</AbsorptionIndex></Material>");
    CHECK(conductor.kind == MaterialKind::conductor);
    CHECK(conductor.refraction_index == 0.37f);
    CHECK(conductor.absorption_index == 2.82f);
    CHECK(material("<Material id='1' type='dielectric'/>").kind == MaterialKind::dielectric);
    CHECK(material("<Material id='1'><MirrorReflectance>1 1 1</MirrorReflectance></Material>").kind ==
          MaterialKind::plain);
    const Material linear =
        material("<Material id='1' degamma='true'><DiffuseReflectance>0.5 1 0</DiffuseReflectance></Material>");
    CHECK(linear.diffuse == glm::vec3(static_cast<float>(std::pow(0.5, 2.2)), 1, 0));
    CHECK(material("<Material id='1' degamma='false'><DiffuseReflectance>0.5 1 0</DiffuseReflectance></Material>")
              .diffuse.x == 0.5f);
}

TEST_CASE("numbers are read in every spelling", "[xml]") {
    const auto vertex = [](const std::string& numbers) {
        return read("<Scene><Materials><Material id='1'/></Materials><VertexData>" + numbers +
                    "</VertexData><Objects><Sphere><Material>1</Material><Center>1</Center><Radius>1</Radius></"
                    "Sphere></Objects></Scene>")
            .spheres.at(0)
            .center;
    };
    CHECK(vertex("1e-3 7.7898e-009 3.73896e-4") == glm::vec3(1e-3f, 7.7898e-9f, 3.73896e-4f));
    CHECK(vertex("+1 -2 +.5") == glm::vec3(1, -2, 0.5f));
    CHECK(vertex("1. -0 2E+2") == glm::vec3(1, 0, 200));
    CHECK(vertex("\r\n\t1\r\n2\v\f3\r\n") == glm::vec3(1, 2, 3));
    CHECK(vertex("1 <!-- 5 6 --> 2 <!-- \n --> 3") == glm::vec3(1, 2, 3));
    CHECK(vertex("<!-- first -->1 2<!---->3<!-- last -->") == glm::vec3(1, 2, 3));
    CHECK(vertex("<![CDATA[1 2]]> 3") == glm::vec3(1, 2, 3));
    CHECK(vertex("1&#32;2&#x20;3") == glm::vec3(1, 2, 3));
    // Too small for a float is zero, as in every other reader.
    CHECK(vertex("1e-50 -1e-400 0.0000000000000000000000000000000000000000000000000000001") == glm::vec3(0.0f));
    CHECK(vertex("0.1 16777217 3.4028235e38") == glm::vec3(0.1f, 16777216.0f, std::numeric_limits<float>::max()));
}

TEST_CASE("the elements of a scene may come in any order", "[xml]") {
    const std::size_t objects = kScene.find("    <Objects>"), end = kScene.find("</Scene>");
    const std::string moved = "<Scene>\n" + kScene.substr(objects, end - objects) +
                              kScene.substr(kScene.find("    <Background"), objects - kScene.find("    <Background")) +
                              "</Scene>";
    const Scene scene = read(moved);
    CHECK(texts(scene.warnings) == Texts{});
    REQUIRE(scene.meshes.size() == 2);
    CHECK(scene.meshes[0].positions[0] == glm::vec3(0.5f, -0.5f, -2));
    CHECK(scene.meshes[1].material == 1);
}

TEST_CASE("line ends may be LF, CRLF or CR, and all count as lines", "[xml]") {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        CAPTURE(end);
        std::string text;
        for (const char character : with("<Radius>0.3<", "<Radius>zero<"))
            text += character == '\n' ? end : std::string(1, character);
        try {
            read(text);
            FAIL("no error");
        } catch (const SceneError& error) {
            CHECK(error.line() == line_of(kScene, "<Radius>"));
        }
    }
}

TEST_CASE("a byte-order mark is skipped", "[xml]") {
    CHECK(read("\xef\xbb\xbf" + kScene).meshes.size() == 2);
}

TEST_CASE("triangles of one material in a row are one mesh, and all keep their order", "[xml]") {
    const auto triangle = [](int material, const std::string& indices) {
        return "<Triangle><Material>" + std::to_string(material) + "</Material><Indices>" + indices +
               "</Indices></Triangle>";
    };
    const std::string sphere = "<Sphere><Material>1</Material><Center>1</Center><Radius>1</Radius></Sphere>";
    const std::string mesh = "<Mesh><Material>1</Material><Faces>1 2 3</Faces></Mesh>";
    const Scene scene = read(
        "<Scene><Materials><Material id='1'/><Material id='2'/></Materials>"
        "<VertexData>0 0 0  1 0 0  0 1 0  0 0 1</VertexData><Objects>" +
        triangle(1, "1 2 3") + triangle(1, "2 3 4") + sphere + triangle(1, "4 1 2") + triangle(2, "1 2 4") + mesh +
        triangle(1, "1 3 4") + "</Objects></Scene>");
    REQUIRE(scene.meshes.size() == 4);
    CHECK(scene.meshes[0].triangles == std::vector<glm::uvec3>{{0, 1, 2}, {1, 2, 3}, {3, 0, 1}});
    CHECK(scene.meshes[0].positions.size() == 4);
    CHECK(scene.meshes[1].material == 1);
    CHECK(scene.meshes[1].triangles == std::vector<glm::uvec3>{{0, 1, 2}});
    CHECK(scene.meshes[1].positions[2] == glm::vec3(0, 0, 1));
    CHECK(scene.meshes[2].material == 0);
    CHECK(scene.meshes[3].triangles.size() == 1);
    CHECK(scene.spheres.size() == 1);
}

TEST_CASE("vertexOffset is added to every index of its faces", "[xml]") {
    const auto mesh = [](const std::string& faces) {
        return read(
                   "<Scene><Materials><Material id='1'/></Materials><VertexData>0 0 0  1 0 0  2 1 0  3 0 1</VertexData>"
                   "<Objects><Mesh><Material>1</Material>" +
                   faces + "</Mesh></Objects></Scene>")
            .meshes.at(0);
    };
    const Mesh from_zero = mesh("<Faces vertexOffset='1'>0 1 3</Faces>");
    CHECK(from_zero.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {3, 0, 1}});
    CHECK(mesh("<Faces vertexOffset=' -1 ' type='triangle'>2 3 5</Faces>").positions == from_zero.positions);
}

TEST_CASE("smooth meshes get normals by vertex index, not by position", "[xml]") {
    // Two triangles at right angles that share an edge: by index in the first mesh, by position alone in the second.
    const std::string vertices = "<VertexData>0 0 0  1 0 0  0 1 0  0 0 1  0 0 0  1 0 0</VertexData>";
    const auto mesh = [&](const std::string& faces) {
        return read("<Scene><Materials><Material id='1'/></Materials>" + vertices +
                    "<Objects><Mesh shadingMode='smooth'><Material>1</Material><Faces>" + faces +
                    "</Faces></Mesh></Objects></Scene>")
            .meshes.at(0);
    };
    const Mesh shared = mesh("1 2 3  2 1 4");
    CHECK(shared.positions.size() == 4);
    REQUIRE(shared.normals.size() == 4);
    const float half = std::sqrt(0.5f);
    CHECK(glm::distance(shared.normals[0], glm::vec3(0, half, half)) < 1e-6f);
    const Mesh apart = mesh("1 2 3  6 5 4");
    CHECK(apart.positions.size() == 6);
    REQUIRE(apart.normals.size() == 6);
    CHECK(glm::distance(apart.normals[0], glm::vec3(0, 0, 1)) < 1e-6f);
    CHECK(glm::distance(apart.normals[3], glm::vec3(0, 1, 0)) < 1e-6f);
}

TEST_CASE("meshes come from PLY and OBJ files beside the scene", "[xml]") {
    const test::TemporaryDirectory folder;
    std::filesystem::create_directory(folder.path() / "ply");
    folder.write("ply/x.ply",
                 "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                 "property float nx\nproperty float ny\nproperty float nz\nelement face 1\nproperty list uchar int "
                 "vertex_indices\n"
                 "end_header\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n4 0 1 2 3\n");
    folder.write("y.mtl", "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n");
    folder.write("y.obj",
                 "mtllib y.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3\nusemtl green\nf 1 2 4\n");
    const auto scene = [&](const std::string& mesh) {
        return read_xml_scene(
            folder.write("scene.xml", "<Scene><Materials><Material id='1'/><Material id='2'/></Materials><Objects>\n" +
                                          mesh + "</Objects></Scene>"));
    };
    SECTION("a flat PLY mesh, whose normals are ignored") {
        const Scene flat = scene("<Mesh><Material>2</Material><Faces plyFile='ply/x.ply'/></Mesh>");
        REQUIRE(flat.meshes.size() == 1);
        CHECK(flat.meshes[0].triangles.size() == 2);
        CHECK(flat.meshes[0].normals.empty());
        CHECK(flat.meshes[0].material == 1);
        CHECK(flat.meshes[0].line == 2);
        CHECK(texts(flat.warnings) == Texts{});
    }
    SECTION("a smooth PLY mesh") {
        const Scene smooth =
            scene("<Mesh shadingMode='smooth'><Material>2</Material><Faces plyFile='ply/x.ply'></Faces></Mesh>");
        CHECK(smooth.meshes.at(0).normals.size() == 4);
    }
    SECTION("an OBJ mesh with the scene's material") {
        const Scene obj = scene("<Mesh><Material>2</Material><Faces objFile='y.obj'/></Mesh>");
        REQUIRE(obj.meshes.size() == 2);
        CHECK(obj.meshes[0].material == 1);
        CHECK(obj.meshes[1].material == 1);
        CHECK(obj.materials.size() == 2);
    }
    SECTION("an OBJ mesh with its own materials, smooth") {
        const Scene obj = scene("<Mesh shadingMode='smooth'><Faces objFile='y.obj'/></Mesh>");
        REQUIRE(obj.meshes.size() == 2);
        REQUIRE(obj.materials.size() > obj.meshes[1].material);
        CHECK(obj.materials[obj.meshes[0].material].diffuse == glm::vec3(1, 0, 0));
        CHECK(obj.materials[obj.meshes[1].material].diffuse == glm::vec3(0, 1, 0));
        CHECK(obj.meshes[0].normals.size() == 3);
    }
    SECTION("a file that is not there") {
        CHECK_THROWS_WITH(scene("<Mesh><Material>2</Material><Faces plyFile='ply/none.ply'/></Mesh>"),
                          Catch::Contains("scene.xml:2: ") && Catch::Contains("none.ply"));
    }
    SECTION("a file in the scene's folder, however its path is written") {
        const std::string absolute = (folder.path() / "ply/x.ply").string();
        for (const std::string& path : {std::string("./ply/../ply/x.ply"), absolute}) {
            const Scene inside = scene("<Mesh><Material>2</Material><Faces plyFile='" + path + "'/></Mesh>");
            CHECK(texts(inside.warnings) == Texts{});
        }
    }
    SECTION("a file outside the scene's folder is read with a warning") {
        std::filesystem::create_directory(folder.path() / "inner");
        const std::string absolute = (folder.path() / "y.obj").string();
        const Scene outside =
            read_xml_scene(folder.write("inner/scene.xml",
                                        "<Scene><Materials><Material id='1'/></Materials><Objects>\n"
                                        "<Mesh><Material>1</Material><Faces plyFile='../ply/x.ply'/></Mesh>\n<Mesh>"
                                        "<Material>1</Material><Faces objFile='" +
                                            absolute + "'/></Mesh></Objects></Scene>"));
        CHECK(outside.meshes.size() == 3);
        CHECK(texts(outside.warnings) ==
              Texts{"2: the file '" + (folder.path() / "inner/../ply/x.ply").string() +
                        "' that plyFile names is not in the scene's folder",
                    "3: the file '" + absolute + "' that objFile names is not in the scene's folder"});
    }
    SECTION("a file that is damaged") {
        folder.write("ply/x.ply", "ply\nformat ascii 1.0\n");
        CHECK_THROWS_AS(scene("<Mesh><Material>2</Material><Faces plyFile='ply/x.ply'/></Mesh>"), SceneError);
    }
}

TEST_CASE("what Castor does not know is named once with its line and its count", "[xml]") {
    // clang-format off
    const std::string text = R"(<Scene>
    <Participants>
        <Medium id="1"/>
    </Participants>
    <Cameras>
        <Camera id="1">
            <Position>0 0 0</Position> <Gaze>0 0 -1</Gaze> <Up>0 1 0</Up> <NearPlane>-1 1 -1 1</NearPlane>
            <NearDistance>1</NearDistance> <ImageResolution>8 8</ImageResolution>
            <Shutter>0.1</Shutter> <Scissor2>0 0 4 4</Scissor2>
            <Renderer>PathTracing</Renderer> <RendererParams>NextEventEstimation</RendererParams>
            <MinRecursionDepth>3</MinRecursionDepth> <SplittingFactor>2</SplittingFactor> <SampleMaxVal>9</SampleMaxVal>
        </Camera>
    </Cameras>
    <Lights>
        <LaserLight id="1"/>
    </Lights>
    <Materials>
        <Material id="1" colour="2"><Gloss>0.1</Gloss></Material>
        <Material id="2" colour="3"/>
    </Materials>
    <VertexData>0 0 0 1 0 0 0 1 0</VertexData>
    <Objects>
        <Mesh id="1"><Material>1</Material><Radiance>1 1 1</Radiance><Faces>1 2 3</Faces></Mesh>
        <Cone id="1"><Material>1</Material><Center>1</Center><Radius>1</Radius></Cone>
        <Sphere id="1"><Material>1</Material><Center>1</Center><Radius>1</Radius></Sphere>
    </Objects>
</Scene>)";
    // clang-format on
    const Scene scene = read(text);
    CHECK(texts(scene.warnings) ==
          Texts{
              "2: <Participants> is not known to Castor and is ignored",
              "9: <Scissor2> is ignored: the whole picture is made",
              "9: <Shutter> is not known to Castor and is ignored",
              "11: <MinRecursionDepth> is ignored: the camera's picture is not made with RussianRoulette",
              "11: <SplittingFactor> is ignored: a path has one ray at each bounce; more samples do the same",
              "15: <LaserLight> is not known to Castor and is ignored",
              "18: <Gloss> is not known to Castor and is ignored",
              "18: the attribute colour of <Material> is not known to Castor and is ignored (2 times, the first here)",
              "23: <Radiance> is not known to Castor and is ignored",
              "24: <Cone> is not known to Castor and is ignored",
          });
    CHECK(scene.meshes.size() == 1);
    CHECK(scene.spheres.size() == 1);
}

namespace {

// Line 9 begins the objects.
constexpr const char* kTransforms = R"(<Scene>
    <Transformations>
        <Translation id="1">10 20 30</Translation> <Translation id="-2">1 0 0</Translation>
        <Scaling id="1">2 3 4</Scaling> <Rotation id="1">90 0 0 5</Rotation>
        <Composite id="1">1 2 3 4  0 1 5 6  0 0 1 7  0 0 0 1</Composite>
    </Transformations>
    <Materials><Material id="1"/><Material id="2"/></Materials>
    <VertexData>0 0 0 1 0 0 0 1 0</VertexData>
    <Objects>
        OBJECTS
    </Objects>
</Scene>)";

std::string objects(const std::string& text) {
    return with("OBJECTS", text, kTransforms);
}

std::string mesh(const std::string& attributes, const std::string& transformations) {
    return "<Mesh " + attributes + "><Material>1</Material><Faces>1 2 3</Faces><Transformations>" + transformations +
           "</Transformations></Mesh>";
}

/// `expected` in the order of a matrix on paper, row by row.
void check_transform(const Transform& found, std::array<float, 12> expected) {
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) {
            CAPTURE(row, column);
            CHECK(found[column][row] == Approx(expected[static_cast<std::size_t>(4 * row + column)]).margin(1e-6));
        }
}

}  // namespace

TEST_CASE("transformations are applied from left to right", "[xml]") {
    const auto transform = [](const std::string& list) {
        return read(objects(mesh("id=\"1\"", list))).meshes.at(0).transform;
    };
    check_transform(transform(""), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    check_transform(transform("t1"), {1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30});
    check_transform(transform("s1"), {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0});
    check_transform(transform("r1"), {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0});
    check_transform(transform("c1"), {1, 2, 3, 4, 0, 1, 5, 6, 0, 0, 1, 7});
    check_transform(transform(" t1\n s1 "), {2, 0, 0, 20, 0, 3, 0, 60, 0, 0, 4, 120});
    check_transform(transform("s1 t1"), {2, 0, 0, 10, 0, 3, 0, 20, 0, 0, 4, 30});
    check_transform(transform("r1 t-2 s1"), {0, -2, 0, 2, 3, 0, 0, 0, 0, 0, 4, 0});
}

TEST_CASE("all objects take transformations", "[xml]") {
    // clang-format off
    const Scene scene = read(objects(R"(
        <Sphere id="1"><Material>1</Material><Center>2</Center><Radius>1</Radius><Transformations>s1</Transformations></Sphere>
        <Plane id="1"><Material>1</Material><Point>2</Point><Normal>1 0 0</Normal><Transformations>r1 t1</Transformations></Plane>
        <Triangle id="1"><Material>1</Material><Indices>1 2 3</Indices><Transformations>t1</Transformations></Triangle>
        <Triangle id="2"><Material>1</Material><Indices>1 2 3</Indices><Transformations>t1</Transformations></Triangle>
        <Triangle id="3"><Material>1</Material><Indices>1 2 3</Indices></Triangle>)"));
    // clang-format on
    CHECK(scene.warnings.empty());
    check_transform(scene.spheres.at(0).transform, {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0});
    CHECK(scene.planes.at(0).point == glm::vec3(10, 21, 30));
    CHECK(glm::distance(scene.planes.at(0).normal, glm::vec3(0, 1, 0)) < 1e-6f);
    REQUIRE(scene.meshes.size() == 2);
    CHECK(scene.meshes[0].triangles.size() == 2);
    check_transform(scene.meshes[0].transform, {1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30});
}

TEST_CASE("instances of meshes and of instances", "[xml]") {
    // Before their bases too; ids of instances may be those of meshes, and then a base is a mesh.
    // clang-format off
    const Scene scene =
        read(objects(R"(<MeshInstance id="5" baseMeshId="4"><Transformations>t-2</Transformations></MeshInstance>
        <MeshInstance id="4" baseMeshId="1"><Material>2</Material><Transformations>s1</Transformations></MeshInstance>
        <MeshInstance id="1" baseMeshId="1"/>
        <MeshInstance id="7" baseMeshId="5" resetTransform="true"><Material>1</Material><Transformations>s1</Transformations></MeshInstance>
        )" + mesh("id=\"1\" shadingMode=\"smooth\"", "t1")));
    // clang-format on
    CHECK(scene.warnings.empty());
    REQUIRE(scene.meshes.size() == 1);
    REQUIRE(scene.instances.size() == 4);
    check_transform(scene.instances[0].transform, {2, 0, 0, 21, 0, 3, 0, 60, 0, 0, 4, 120});
    check_transform(scene.instances[1].transform, {2, 0, 0, 20, 0, 3, 0, 60, 0, 0, 4, 120});
    check_transform(scene.instances[2].transform, {1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30});
    check_transform(scene.instances[3].transform, {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0});
    for (const MeshInstance& instance : scene.instances) CHECK(instance.mesh == 0);
    CHECK(scene.instances[0].material == 1);
    CHECK(scene.instances[1].material == 1);
    CHECK(scene.instances[2].material == 0);
    CHECK(scene.instances[3].material == 0);
    CHECK(scene.instances[1].line == 11);
}

TEST_CASE("wrong transformations and instances name line and reason", "[xml]") {
    struct Case {
        std::string text;
        std::string reason;
    };
    const auto instance = [](const std::string& attributes) { return objects("<MeshInstance " + attributes + "/>"); };
    const Case cases[] = {
        {objects(mesh("", "t1 t9")), "10: the transformation t9 does not exist"},
        {objects(mesh("", "x1")), "10: 'x1' is no transformation"},
        {objects(mesh("", "t")), "10: 't' is no transformation"},
        {objects(mesh("", "t1s1")), "10: 't1s1' is no transformation"},
        {with("<Rotation id=\"1\">90 0 0 5<", "<Rotation id=\"1\">90 0 0 0<", kTransforms),
         "4: the axis of <Rotation> is 0 0 0"},
        {with("<Scaling id=\"1\">2 3 4<", "<Scaling id=\"1\">2 3<", kTransforms),
         "4: <Scaling> holds 2 numbers: 3 were expected"},
        {with("<Scaling id", "<Scaling name", kTransforms), "4: <Scaling> has no id"},
        {with("0 0 0 1<", "0 0 0 2<", kTransforms), "5: the last row of <Composite> is 0 0 0 2: 0 0 0 1 was expected"},
        {instance("id=\"1\""), "10: <MeshInstance> has no baseMeshId"},
        {instance("id=\"1\" baseMeshId=\"3\""), "10: the baseMeshId 3 is neither a mesh nor an instance of the scene"},
        {instance("id=\"1\" baseMeshId=\"1\""), "10: the baseMeshId 1 leads back to this instance itself"},
        {objects("<MeshInstance id=\"1\" baseMeshId=\"2\"/><MeshInstance id=\"2\" baseMeshId=\"1\"/>"),
         "leads back to this instance itself"},
        {instance("id=\"1\" baseMeshId=\"1\" resetTransform=\"maybe\""), "10: "},
    };
    for (const Case& c : cases) {
        CAPTURE(c.text, c.reason);
        try {
            read(c.text);
            FAIL("was read");
        } catch (const SceneError& error) {
            CAPTURE(error.what());
            CHECK(std::string(error.what()).find(c.reason) != std::string::npos);
        }
    }
}

TEST_CASE("unclean files are read with a warning", "[xml]") {
    struct Case {
        std::string text;
        std::string warning;
    };
    const std::vector<Case> cases{
        {with("-0.5 0.75</NearPlane>", "-0.5 0.75 2</NearPlane>"),
         "11: <NearPlane> holds more than 4 numbers: the others are ignored"},
        {with("<Material id=\"-3\">", "<Material id=\"7\">",
              with("<Material>-3</Material>\n            <Point>", "<Material>7</Material>\n            <Point>",
                   with("<Material>-3</Material>\n            <Indices>",
                        "<Material>7</Material>\n            <Indices>"))),
         "33: the material id 7 occurs again: objects get the first one"},
        {with("<Up>0 1 0</Up>", "<Up>0 1 0</Up><Up>1 0 0</Up>"),
         "10: <Up> occurs again in its <Camera> and is ignored there: the first one counts"},
        {with("<Lights>", "<Lights> stray text"), "18: text in <Lights> is ignored: 'stray'"},
        {kScene + "\nmore", "67: text outside <Scene> is ignored"},
        {kScene + "\n<Scene/>", "67: <Scene> outside <Scene> is ignored"},
        {with("<Up>0 1 0</Up>", "<Up>0 1 0<Down/></Up>"), "10: <Down> is not known to Castor and is ignored"},
        {with("                3 1 2\n                1 3 4\n", ""), "45: <Faces> is empty: the mesh has no triangle"},
    };
    for (const Case& one : cases) {
        CAPTURE(one.text);
        CHECK(texts(read(one.text).warnings) == Texts{one.warning});
    }
    // Ids of other things than materials mean nothing.
    CHECK(texts(read(with("<Sphere id=\"1\">", "<Sphere id=\"one\">")).warnings) == Texts{});
    CHECK(read(with("-0.5 0.75</NearPlane>", "-0.5 0.75 2</NearPlane>")).cameras[0].top == 0.75f);
    CHECK(read(with("<Up>0 1 0</Up>", "<Up>0 1 0</Up><Up>1 0 0</Up>")).cameras[0].up == glm::vec3(0, 1, 0));
}

TEST_CASE("a wrong XML scene is refused with its line and what is wrong", "[xml]") {
    struct Case {
        std::string text;
        std::size_t line;
        std::vector<std::string> words;
    };
    const std::string look_at = with("<Camera id=\"1\">", "<Camera id=\"1\" type=\"lookAt\">");
    const auto light = [](const std::string& text) { return with("        <AmbientLight>", text + "<AmbientLight>"); };
    const std::string spot =
        "<SpotLight><Position>1 2 3</Position><Direction>0 1 0</Direction><Intensity>1 1 1</Intensity>";
    const std::vector<Case> cases{
        // The file as a whole.
        {"", 0, {"is empty"}},
        {" \n\n", 0, {"is empty"}},
        {"hello world", 1, {"'hello'", "XML"}},
        {"\n\n{\"Szene\": {}}", 1, {"\"Scene\""}},
        {std::string("<Scene>\n\0</Scene>", 17), 2, {"byte 8 is zero"}},
        {"<?xml version='1.0'?>\n<!-- nothing -->", 2, {"<Scene> was expected"}},
        {"\n<html></html>", 2, {"<html>", "<Scene>"}},
        {"<Scene>\n<Cameras>\n", 2, {"ends too early"}},
        {kScene.substr(0, kScene.find("<Mesh") + 3), 43, {"ends too early"}},
        {with("</Camera>\n", "</Kamera>\n"), 16, {"not well-formed"}},
        {with("<Up>", "<Up"), 10, {"not well-formed"}},
        // Numbers.
        {with("<Radius>0.3", "<Radius>abc"), 57, {"<Radius>", "'abc'", "a finite number"}},
        {with("<Radius>0.3", "<Radius>0.3x"), 57, {"'0.3x'"}},
        {with("<Radius>0.3", "<Radius>0.3 x"), 57, {"'x'"}},
        {with("<Radius>0.3", "<Radius>0,3"), 57, {"'0,3'"}},
        {with("<Radius>0.3", "<Radius>0x3"), 57, {"'0x3'"}},
        {with("<Radius>0.3", "<Radius>+-3"), 57, {"'+-3'"}},
        {with("<Radius>0.3", "<Radius>+"), 57, {"'+'"}},
        {with("<Radius>0.3", "<Radius>"), 57, {"<Radius>", "0 numbers", "1 were expected"}},
        {with("<Radius>0.3", "<Radius>nan"), 57, {"'nan'", "finite"}},
        {with("<Radius>0.3", "<Radius>-inf"), 57, {"'-inf'", "finite"}},
        {with("<Radius>0.3", "<Radius>1e39"), 57, {"'1e39'", "range of float"}},
        {with("<Radius>0.3", "<Radius>1e999999999999"), 57, {"range of float"}},
        {with("<Radius>0.3", "<Radius>" + std::string(100, '7') + "z"), 57, {"7777..."}},
        {with("<Gaze>0 0 -2", "<Gaze>0 0"), 9, {"<Gaze>", "2 numbers", "3 were expected"}},
        {with("0.5 -0.5 -2\n        0.5 0.5", "0.5 -0.5 1.2.3\n        0.5 0.5"), 38, {"<VertexData>", "'1.2.3'"}},
        {with("7 8 9", "7 8"), 40, {"<VertexData>", "4 whole ones", "x y z"}},
        {with("7 8 9", "7 8 nan"), 40, {"'nan'"}},
        {with("<MaxRecursionDepth>4", "<MaxRecursionDepth>4.5"), 5, {"'4.5'", "integer"}},
        {with("<MaxRecursionDepth>4", "<MaxRecursionDepth>-1"), 5, {"'-1'"}},
        {with("<ShadowRayEpsilon>2e-3", "<ShadowRayEpsilon>-1"), 4, {"'-1'", "at least 0"}},
        // Indices.
        {with("1 3 4\n", "1 3 0\n"), 47, {"vertex 0", "5 vertices"}},
        {with("1 3 4\n", "1 3 6\n"), 47, {"vertex 6", "5 vertices"}},
        {with("1 3 4\n", "1 3 -1\n"), 47, {"vertex -1"}},
        {with("1 3 4\n", "1 3 1e3\n"), 47, {"'1e3'", "integer"}},
        {with("1 3 4\n", "1 3 9223372036854775807\n"), 47, {"vertex 9223372036854775807"}},
        {with("1 3 4\n", "1 3 9223372036854775808\n"), 47, {"'9223372036854775808'"}},
        {with("1 3 4\n", "1 3\n"), 47, {"<Faces>", "1 whole ones"}},
        {with("<Faces>", "<Faces vertexOffset=\"2\">"), 47, {"vertex 4", "vertexOffset 2"}},
        {with("<Faces>", "<Faces vertexOffset=\"-9223372036854775808\">"), 45, {"vertexOffset", "out of range"}},
        {with("<Faces>", "<Faces vertexOffset=\"a\">"), 45, {"vertexOffset=\"a\"", "integer"}},
        {with("<Faces>", "<Faces binaryFile=\"a\">"), 45, {"binaryFile"}},
        {with("<VertexData>", "<VertexData binaryFile=\"a\">"), 35, {"binaryFile"}},
        {with("<Indices>2 3 4", "<Indices>2 3 40"), 52, {"vertex 40"}},
        {with("<Indices>2 3 4", "<Indices>2 3"), 52, {"<Indices>", "2 numbers"}},
        {with("<Center>5", "<Center>6"), 56, {"vertex 6", "5 vertices"}},
        {with("<Point>5", "<Point>0"), 61, {"vertex 0"}},
        // Materials.
        {with("<Material>7</Material>\n            <Faces>", "<Material>8</Material>\n            <Faces>"),
         44,
         {"material 8", "-3, 7"}},
        {with("<Material>7</Material>\n            <Faces>", "<Faces>"), 43, {"<Mesh>", "<Material>"}},
        {with("<Material id=\"-3\">", "<Material>"), 33, {"attribute id"}},
        {with("<Material id=\"-3\">", "<Material id=\"x\">"), 33, {"id=\"x\"", "integer"}},
        {with("type=\"mirror\"", "type=\"shiny\""), 26, {"\"shiny\"", "mirror, conductor, dielectric"}},
        {with("type=\"mirror\"", "degamma=\"yes\""), 26, {"\"yes\"", "true, false"}},
        {with("0.5 0.25 0.125", "0.5 -0.25 0.125"), 28, {"<DiffuseReflectance>", "0.5 -0.25 0.125"}},
        {with("0.5 0.25 0.125", "1e30 0 0", with("type=\"mirror\"", "degamma=\"true\"")),
         28,
         {"<DiffuseReflectance>", "1e17"}},
        {with("<PhongExponent>50", "<PhongExponent>-50"), 31, {"<PhongExponent>", "-50"}},
        {with("<PhongExponent>50</PhongExponent>", "<RefractionIndex>-1</RefractionIndex>"), 31, {"<RefractionIndex>"}},
        {with("<PhongExponent>50</PhongExponent>", "<AbsorptionIndex>-1</AbsorptionIndex>"), 31, {"<AbsorptionIndex>"}},
        // Cameras.
        {without("            <Position>1 2 3</Position>\n"), 7, {"<Camera>", "<Position>"}},
        {without("            <Gaze>0 0 -2</Gaze>\n"), 7, {"<Camera>", "<Gaze>"}},
        {without("            <Up>0 1 0</Up>\n"), 7, {"<Camera>", "<Up>"}},
        {without("            <NearPlane>-1 1.5 -0.5 0.75</NearPlane>\n"), 7, {"<Camera>", "<NearPlane>"}},
        {without("            <NearDistance>2</NearDistance>\n"), 7, {"<Camera>", "<NearDistance>"}},
        {without("            <ImageResolution>640 480</ImageResolution>\n"), 7, {"<Camera>", "<ImageResolution>"}},
        {look_at, 7, {"<Camera>", "<FovY>"}},
        {with("<Camera id=\"1\">", "<Camera id=\"1\" type=\"fish\">"), 7, {"\"fish\"", "lookAt"}},
        {with("<Camera id=\"1\">", "<Camera id=\"1\" handedness=\"both\">"), 7, {"\"both\"", "right, left"}},
        {with("<Gaze>0 0 -2", "<Gaze>0 0 0"), 9, {"<Gaze>", "'0 0 0'"}},
        {with("<Gaze>0 0 -2</Gaze>", "<GazePoint>1 2 3</GazePoint>"), 9, {"<GazePoint>", "position"}},
        {with("<Up>0 1 0", "<Up>0 0 0"), 10, {"<Up>", "'0 0 0'"}},
        {with("<Up>0 1 0", "<Up>0 0 1"), 10, {"<Up>", "'0 0 1'", "parallel"}},
        {with("<Up>0 1 0", "<Up>0 1e-9 -1"), 10, {"parallel"}},
        {with("-1 1.5 -0.5 0.75", "1 1 -0.5 0.75"), 11, {"<NearPlane>"}},
        {with("-1 1.5 -0.5 0.75", "-1 1 0.5 0.5"), 11, {"<NearPlane>"}},
        {with("-1 1.5 -0.5 0.75", "-1 1 0.5"), 11, {"<NearPlane>", "3 numbers", "4 were expected"}},
        {with("<NearDistance>2", "<NearDistance>0"), 12, {"<NearDistance>", "'0'", "positive"}},
        {with("640 480", "0 480"), 13, {"<ImageResolution>", "'0 480'", "65536"}},
        {with("640 480", "640 -480"), 13, {"'640 -480'"}},
        {with("640 480", "640 1000000"), 13, {"'640 1000000'", "65536"}},
        {with("640 480", "640"), 13, {"1 numbers"}},
        {with("640 480", "640.5 480"), 13, {"'640.5'", "integer"}},
        {with("<NumSamples>16", "<NumSamples>0"), 14, {"<NumSamples>"}},
        {with("<NearPlane>-1 1.5 -0.5 0.75</NearPlane>", "<FovY>180</FovY>", look_at), 11, {"<FovY>", "'180'"}},
        {with("<NearPlane>-1 1.5 -0.5 0.75</NearPlane>", "<FovY>0</FovY>", look_at), 11, {"<FovY>", "'0'"}},
        {with("<NearDistance>2", "<TMin>-1</TMin><NearDistance>2"), 12, {"<TMin>"}},
        {with("<NearDistance>2", "<TMin>3</TMin><TMax>2</TMax><NearDistance>2"), 12, {"<TMax>"}},
        // Lights.
        {light("<PointLight><Position>1 2 3</Position></PointLight>"), 19, {"<PointLight>", "<Intensity>"}},
        {light("<DirectionalLight><Direction>0 0 0</Direction><Radiance>1 1 1</Radiance></DirectionalLight>"),
         19,
         {"<Direction>"}},
        {light("<DirectionalLight><Direction>0 -1 0</Direction><Radiance>1 1 1</Radiance><Angle>181</Angle>"
               "</DirectionalLight>"),
         19,
         {"<Angle>", "'181'", "0 to 180 degrees"}},
        {light(spot + "<CoverageAngle>0</CoverageAngle><FalloffAngle>0</FalloffAngle></SpotLight>"),
         19,
         {"<CoverageAngle>", "'0'"}},
        {light(spot + "<CoverageAngle>40</CoverageAngle><FalloffAngle>60</FalloffAngle></SpotLight>"),
         19,
         {"<FalloffAngle>", "'60'"}},
        {light(spot + "<CoverageAngle>40</CoverageAngle></SpotLight>"), 19, {"<SpotLight>", "<FalloffAngle>"}},
        // Objects.
        {with("<Radius>0.3", "<Radius>0"), 57, {"<Radius>", "'0'", "positive"}},
        {with("<Radius>0.3", "<Radius>-2"), 57, {"<Radius>", "'-2'", "positive"}},
        {without("            <Radius>0.3</Radius>\n"), 54, {"<Sphere>", "<Radius>"}},
        {without("            <Center>5</Center>\n"), 54, {"<Sphere>", "<Center>"}},
        {without("            <Indices>2 3 4</Indices>\n"), 50, {"<Triangle>", "<Indices>"}},
        {with("<Normal>0 2 0", "<Normal>0 0 0"), 62, {"<Normal>"}},
        {without("            <Point>5</Point>\n"), 59, {"<Plane>", "<Point>"}},
        {with("<Mesh id=\"1\">", "<Mesh id=\"1\" shadingMode=\"gouraud\">"), 43, {"\"gouraud\"", "flat, smooth"}},
        {with("<Faces>", "<Faces type=\"quad\">"), 45, {"\"quad\"", "triangle"}},
        {with("<Faces>\n                3 1 2\n                1 3 4\n            </Faces>", ""),
         43,
         {"<Mesh>", "<Faces>"}},
    };
    for (const Case& one : cases) {
        CAPTURE(one.text, one.line, one.words);
        try {
            read(one.text);
            FAIL_CHECK("no error");
        } catch (const SceneError& error) {
            CHECK(error.line() == one.line);
            for (const std::string& word : one.words) CHECK_THAT(error.reason(), Catch::Contains(word));
            CHECK_THAT(error.file(), Catch::EndsWith("scene.xml"));
        }
    }
}

TEST_CASE("an XML scene without vertices or materials names what is missing", "[xml]") {
    const std::string sphere =
        "<Objects><Sphere><Material>1</Material><Center>1</Center><Radius>1</Radius></Sphere></Objects></Scene>";
    CHECK_THROWS_WITH(read("<Scene>" + sphere),
                      Catch::Contains("scene.xml:1: the material 1 does not exist: the scene has no materials"));
    CHECK_THROWS_WITH(read("<Scene><Materials><Material id='1'/></Materials>" + sphere),
                      Catch::Contains("the vertex 1 does not exist: the scene has no vertices"));
}

TEST_CASE("a plane may call its point its centre", "[xml]") {
    const Scene scene = read(with("<Point>5</Point>", "<Center>5</Center>"));
    CHECK(scene.planes.at(0).point == glm::vec3(7, 8, 9));
    CHECK(texts(scene.warnings) == Texts{});
}

TEST_CASE("missing and unreadable XML files are refused", "[xml]") {
    const test::TemporaryDirectory folder;
    CHECK_THROWS_WITH(read_xml_scene(folder.path() / "none.xml"), Catch::Contains("none.xml: cannot be opened"));
    CHECK_THROWS_WITH(read_xml_scene(folder.path()), Catch::Contains("is a directory"));
}

TEST_CASE("very deep and very wide XML is no danger", "[xml]") {
    std::string
        deep = "<Scene>",
        wide = "<Scene><Materials><Material id='1'/></Materials><VertexData>0 0 0 1 0 0 0 1 0</VertexData><Objects>";
    for (int i = 0; i < 200'000; ++i) deep += "<a>";
    for (int i = 0; i < 200'000; ++i) deep += "</a>";
    CHECK(read(deep + "</Scene>").warnings.size() == 1);
    CHECK_THROWS_AS(read(deep), SceneError);
    for (int i = 0; i < 20'000; ++i) wide += "<Triangle><Material>1</Material><Indices>1 2 3</Indices></Triangle>";
    CHECK(read(wide + "</Objects></Scene>").meshes.at(0).triangles.size() == 20'000);
}

TEST_CASE("an XML scene cut short anywhere is refused or still whole", "[xml]") {
    const test::TemporaryDirectory folder;
    std::size_t refused = 0;
    for (std::size_t size = 0; size < kScene.size(); size += 7) {
        CAPTURE(size);
        const std::filesystem::path file = folder.write("scene.xml", kScene.substr(0, size));
        if (size >= kScene.find("</Scene>") + 8) {
            CHECK(read_xml_scene(file).meshes.size() == 2);
            continue;
        }
        ++refused;
        CHECK_THROWS_AS(read_xml_scene(file), SceneError);
    }
    CHECK(refused > 200);
}

TEST_CASE("randomly damaged XML scenes are read or refused", "[xml]") {
    const test::TemporaryDirectory folder;
    std::mt19937 random(477);
    const auto below = [&](std::size_t count) { return random() % count; };
    const std::vector<std::string> pieces{"<",         ">",
                                          "/",         "</",
                                          "<!--",      "-->",
                                          "&",         "&#0;",
                                          "\"",        "0",
                                          "-",         "1e38",
                                          "nan",       "99999999999999999999",
                                          "<Mesh>",    "</Scene>",
                                          "<![CDATA[", "]]>",
                                          "\xff",      std::string(1, '\0'),
                                          "<?",        "<!DOCTYPE",
                                          " ",         "id=\"7\""};
    std::size_t accepted = 0, refused = 0;
    for (int round = 0; round < 400; ++round) {
        std::string text = kScene;
        for (std::size_t change = 1 + below(4); change > 0; --change) {
            const std::size_t place = below(text.size());
            const std::size_t length = std::min(below(12), text.size() - place);
            switch (below(4)) {
                case 0:
                    text[place] = static_cast<char>(random());
                    break;
                case 1:
                    text.erase(place, length);
                    break;
                case 2:
                    text.insert(place, pieces[below(pieces.size())]);
                    break;
                default:
                    text.replace(place, length, text.substr(below(text.size()), below(60)));
                    break;
            }
        }
        CAPTURE(round, text);
        try {
            const Scene scene = read_xml_scene(folder.write("scene.xml", text));
            for (const Mesh& mesh : scene.meshes) {
                REQUIRE(mesh.material < scene.materials.size());
                for (const glm::uvec3& triangle : mesh.triangles)
                    for (int corner = 0; corner < 3; ++corner) REQUIRE(triangle[corner] < mesh.positions.size());
            }
            ++accepted;
        } catch (const SceneError& error) {
            REQUIRE(error.reason().size() > 10);
            ++refused;
        }
    }
    CHECK(accepted > 0);
    CHECK(refused > 0);
}

TEST_CASE("the shared reference scenes are read", "[xml]") {
    const char* const variable = std::getenv("CASTOR_SHARED_DIR");
    const std::filesystem::path shared = variable ? variable : CASTOR_SOURCE_DIR "/../shared";
    const std::filesystem::path folder = shared / "scenes" / "ceng477";
    if (!std::filesystem::exists(folder)) {
        std::printf("skipped: no reference scenes in %s\n", folder.c_str());
        return;
    }
    struct Case {
        const char* name;
        std::size_t triangles, spheres, lights, materials;
        std::uint32_t width;
    };
    for (const Case& one : {Case{"simple", 3, 1, 1, 1, 800}, Case{"simple_reflectance", 2, 1, 2, 2, 800},
                            Case{"bunny", 4968, 0, 1, 1, 512}}) {
        CAPTURE(one.name);
        const Scene scene = read_xml_scene(folder / (one.name + std::string(".xml")));
        CHECK(texts(scene.warnings) == Texts{});
        std::size_t triangles = 0;
        for (const Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
        CHECK(triangles == one.triangles);
        CHECK(scene.spheres.size() == one.spheres);
        CHECK(scene.lights.size() == one.lights);
        CHECK(scene.materials.size() == one.materials);
        REQUIRE(scene.cameras.size() == 1);
        CHECK(scene.cameras[0].width == one.width);
        CHECK(scene.cameras[0].image_name == one.name + std::string(".ppm"));
    }
}

}  // namespace castor
