// The command line tool as its users meet it: arguments in, streams, files and the exit status out.
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>

#include "castor/scene_io.h"
#include "castor/tracer.h"
#include "reference/random_source.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/gltf_builder.h"
#include "support/picture_bytes.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifndef CASTOR_CLI

TEST_CASE("the command line tool is tested", "[cli]") {
    std::cerr << "skipped: the command line tool is not built (CASTOR_BUILD_CLI)\n";
}

#else

using castor::test::device_under_test;
using castor::test::file_contents;
using castor::test::GltfBuilder;
using castor::test::one_triangle;
using castor::test::ProcessResult;
using castor::test::run_castor;
using castor::test::TemporaryDirectory;
using Json = nlohmann::json;

namespace {

std::string camera_xml(const std::string& image_name, const std::string& resolution = "16 12") {
    return "<Camera><Position>0 0 3</Position><Gaze>0 0 -1</Gaze><Up>0 1 0</Up><NearPlane>-1 1 -0.75 0.75</NearPlane>"
           "<NearDistance>1</NearDistance><ImageResolution>" +
           resolution + "</ImageResolution><ImageName>" + image_name + "</ImageName></Camera>";
}

/// A triangle before a background of 10 20 30.
std::string scene_xml(const std::string& cameras, const std::string& faces = "1 2 3") {
    return "<Scene><BackgroundColor>10 20 30</BackgroundColor><Cameras>" + cameras +
           "</Cameras><Lights><AmbientLight>100 100 100</AmbientLight></Lights><Materials><Material id=\"1\">"
           "<AmbientReflectance>1 1 1</AmbientReflectance><DiffuseReflectance>1 1 "
           "1</DiffuseReflectance></Material></Materials>"
           "<VertexData>-1 -1 0  1 -1 0  0 1 0</VertexData><Objects><Mesh id=\"1\"><Material>1</Material><Faces>" +
           faces + "</Faces></Mesh></Objects></Scene>";
}

struct Ppm {
    int width = 0, height = 0;
    std::vector<int> values;
};

Ppm read_ppm(const std::filesystem::path& file) {
    std::istringstream input(file_contents(file));
    std::string magic;
    int largest = 0;
    Ppm ppm;
    input >> magic >> ppm.width >> ppm.height >> largest;
    REQUIRE(magic == "P3");
    for (int value; input >> value;) ppm.values.push_back(value);
    REQUIRE(ppm.values.size() == static_cast<std::size_t>(3 * ppm.width * ppm.height));
    return ppm;
}

bool is_file(const std::filesystem::path& file) {
    return std::filesystem::is_regular_file(file);
}

}  // namespace

TEST_CASE("help teaches, and wrong usage ends with status 2", "[cli]") {
    const ProcessResult help = run_castor({"--help"});
    CHECK(help.status == 0);
    CHECK(help.out.find("Exit status") != std::string::npos);
    CHECK(help.err.empty());
    for (const char* command : {"render", "trace", "bench", "tune", "devices", "info"}) {
        CAPTURE(command);
        const ProcessResult result = run_castor({command, "--help"});
        CHECK(result.status == 0);
        CHECK(result.out.find("Examples:") != std::string::npos);
    }
    CHECK(run_castor({"--version"}).out.substr(0, 7) == "castor ");

    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.png"))).string();
    CHECK_RESULT(run_castor({}), 2, "subcommand");
    CHECK_RESULT(run_castor({"frobnicate"}), 2, "there is no subcommand \"frobnicate\"");
    CHECK_RESULT(run_castor({"render"}), 2, "SCENE");
    CHECK_RESULT(run_castor({"render", scene, "--frobnicate"}), 2, "--frobnicate");
    CHECK_RESULT(run_castor({"render", scene, "--device", "no such device"}), 2,
                 "no device matches \"no such device\"; there are:");
    CHECK_RESULT(run_castor({"render", scene, "--size", "0x10"}), 2, "0x10");
    CHECK_RESULT(run_castor({"render", scene, "--size", "1000000x1000000"}), 2, "65536");
    CHECK_RESULT(run_castor({"render", scene, "--size", "16"}), 2, "WIDTHxHEIGHT");
    CHECK_RESULT(run_castor({"render", scene, "--samples", "0"}), 2, "--samples");
    CHECK_RESULT(run_castor({"render", scene, "--samples", "-1"}), 2, "--samples");
    CHECK_RESULT(run_castor({"render", scene, "--filter", "sharp"}), 2, "gaussian");
    CHECK_RESULT(run_castor({"render", scene, "--rules", "r1999"}), 2, "r2022");
    CHECK_RESULT(run_castor({"render", scene, "--strategy", "slow"}), 2, "brute");
    CHECK_RESULT(run_castor({"render", scene, "--aov", "depth,colour"}), 2, "there is no plane \"colour\"");
    CHECK_RESULT(run_castor({"render", scene, "--light-group", "key"}), 2, "NAME=LIGHT");
    CHECK_RESULT(run_castor({"render", scene, "--light-group", "key=0,,1"}), 2, "NAME=LIGHT");
    CHECK_RESULT(run_castor({"render", scene, "--camera", "2"}), 2, "cameras 1 to 1");
    CHECK_RESULT(run_castor({"render", scene, "-o", "picture.jpg"}, folder.path()), 2,
                 ".png, .ppm, .pfm, .hdr and .exr");
    CHECK_RESULT(run_castor({"trace", scene, "--rays", "r", "--hits", "h", "--query", "some"}), 2, "--query");
}

TEST_CASE("options that take a number refuse what is none, or infinite", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.png"))).string();
    const std::vector<std::string> render{"render", scene}, trace{"trace", scene, "--rays", "r", "--hits", "h"};
    const std::vector<std::pair<std::vector<std::string>, std::vector<std::string> > > commands{
        {render,
         {"--exposure", "--clamp", "--stop-after", "--noise", "--verify", "--deadline", "--checkpoint-interval",
          "--time", "--sun-angle"}},
        {trace, {"--deadline", "--time", "--sun-angle"}},
        {{"doctor"}, {"--seconds", "--patience"}},
        {{"tune", scene}, {"--seconds"}},
    };
    for (const auto& [command, options] : commands)
        for (const std::string& option : options)
            for (const char* value : {"nan", "-inf", "1e999", "1e4x"}) {
                CAPTURE(command, option, value);
                std::vector<std::string> arguments = command;
                arguments.push_back(option + "=" + value);
                CHECK_RESULT(run_castor(arguments, folder.path()), 2, option + ": " + value + " is not a");
            }
    CHECK_RESULT(run_castor({"render", scene, "--clamp", "1e39"}), 2,
                 "1e39 is not a positive number that 32 bits hold");
    CHECK_RESULT(run_castor({"render", scene, "--memory-limit", "nan"}), 2, "--memory-limit");
}

TEST_CASE("a wrong scene ends with status 3, its file and the reason", "[cli]") {
    const TemporaryDirectory folder;
    const auto expect = [&](const std::string& name, const std::string& text, const std::string& reason) {
        const std::string file = folder.write(name, text).string();
        for (const char* command : {"render", "info"}) {
            CAPTURE(command, name);
            const ProcessResult result = run_castor({command, file}, folder.path());
            CHECK_RESULT(result, 3, "castor: " + file);
            CHECK_RESULT(result, 3, reason);
        }
    };
    const std::string whole = scene_xml(camera_xml("s.png"));
    expect("empty.xml", "", "empty");
    expect("truncated.xml", whole.substr(0, whole.size() / 2), "");
    expect("index.xml", scene_xml(camera_xml("s.png"), "1 2 4"), "4");
    expect("zero.xml", scene_xml(camera_xml("s.png", "0 12")), "0");
    expect("huge.xml", scene_xml(camera_xml("s.png", "1000000 1000000")), "1000000");
    CHECK_RESULT(run_castor({"render", (folder.path() / "missing.xml").string()}), 3, "missing.xml");
    CHECK_FALSE(std::filesystem::exists(folder.path() / "s.png"));
}

TEST_CASE("lights have names, which castor info lists", "[cli]") {
    const std::string scene = CASTOR_SOURCE_DIR "/scenes/lamps.xml";
    CHECK_RESULT(run_castor({"render", scene, "--light-group", "ball=LightSphere-2,Window"}), 2,
                 "there is no light \"Window\": expected a number below 2, or one of \"LightMesh-1\", "
                 "\"LightSphere-2\"");
    CHECK_RESULT(run_castor({"render", scene, "--light-group", "rest=0"}), 2,
                 "a group of lights cannot have the name \"rest\"");
    CHECK_RESULT(run_castor({"render", scene, "--light-group", "a/b=0"}), 2,
                 "the group of lights \"a/b\" has no name of letters");
    const ProcessResult text = run_castor({"info", scene});
    CHECK(text.status == 0);
    CHECK(text.out.find("  lights     2\n    light 0  LightSphere-2\n    light 1  LightMesh-1\n") != std::string::npos);
    const Json lights = Json::parse(run_castor({"info", scene, "--json"}).out).at("lights");
    CHECK(lights.at(1).at("names") == Json::array({"LightMesh-1"}));
}

TEST_CASE("without an OpenCL platform the message says what to install", "[cli]") {
    const TemporaryDirectory folder;
    const castor::test::Environment no_platform = {{"OCL_ICD_VENDORS", folder.path().string() + "/"},
                                                   {"OPENCL_VENDOR_PATH", folder.path().string()}};
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.png"))).string();
    CHECK_RESULT(run_castor({"devices"}, "", no_platform), 4, "pocl-opencl-icd");
    CHECK_RESULT(run_castor({"render", scene}, folder.path(), no_platform), 4, "mesa-opencl-icd");
    CHECK(run_castor({"info", scene}, "", no_platform).status == 0);
}

TEST_CASE("devices are listed for people and for programs", "[cli]") {
    const ProcessResult text = run_castor({"devices"});
    CHECK(text.status == 0);
    CHECK(text.out.find("largest allocation") != std::string::npos);
    const ProcessResult json = run_castor({"devices", "--json"});
    CHECK(json.status == 0);
    const Json document = Json::parse(json.out);
    REQUIRE(document.at("devices").size() >= 1);
    const Json& device = document.at("devices").at(0);
    CHECK(device.at("index") == 0);
    CHECK(text.out.find(device.at("name").get<std::string>()) != std::string::npos);
    CHECK(device.at("max_allocation_bytes") > 0);
    CHECK(device.at("exact_arithmetic").at("infinity_and_nan").is_boolean());
}

TEST_CASE("info counts what a scene holds", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.png") + camera_xml("t.png"))).string();
    const Json document = Json::parse(run_castor({"info", scene, "--json"}).out);
    CHECK(document.at("triangles") == 1);
    CHECK(document.at("spheres") == 0);
    CHECK(document.at("cameras").size() == 2);
    CHECK(document.at("cameras").at(1).at("image_name") == "t.png");
    CHECK(document.at("bounds").at("lower") == Json::array({-1.0, -1.0, 0.0}));
    CHECK(document.at("bounds").at("upper") == Json::array({1.0, 1.0, 0.0}));
    CHECK(document.at("bytes").at("arrays") > 0);
    CHECK(run_castor({"info", scene}).out.find("1 triangles in 1 meshes") != std::string::npos);
}

TEST_CASE("warnings name file and line, quiet or not", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene =
        folder.write("s.xml", scene_xml(camera_xml("s.png") + "\n<Frobnicator/>", "1 2 3  1 1 2")).string();
    const ProcessResult result = run_castor({"info", scene, "--quiet"});
    CHECK_RESULT(result, 0, "warning: " + scene + ":2: ");
    CHECK_RESULT(result, 0, "Frobnicator");
    CHECK_RESULT(result, 0, "no area");
    CHECK_RESULT(run_castor({"info", scene, "--strict"}), 3, "s.xml: has 1 warning, which --strict takes as errors");
    const std::string clean = folder.write("t.xml", scene_xml(camera_xml("t.png"))).string();
    CHECK(run_castor({"info", clean, "--strict"}).status == 0);

    // What geometry is warned of counts too, by every command that builds.
    const std::string thin = folder.write("u.xml", scene_xml(camera_xml("u.png"), "1 2 3  1 1 2")).string();
    const std::string device = device_under_test();
    const std::string kept = (folder.path() / "u.castor").string();
    for (const std::vector<std::string>& command : std::vector<std::vector<std::string> >{
             {"info", thin}, {"build", thin, "--device", device, "-o", kept}, {"render", thin, "--device", device}}) {
        std::vector<std::string> strict = command;
        strict.push_back("--strict");
        CHECK_RESULT(run_castor(strict, folder.path()), 3, "u.xml: has 1 warning, which --strict takes as errors");
        CHECK_FALSE(std::filesystem::exists(kept));
    }
    const ProcessResult built = run_castor({"build", thin, "--device", device, "-o", kept, "--json"});
    CHECK_RESULT(built, 0, "mesh 0: 1 of 2 triangles has no area and cannot be hit");
    CHECK(Json::parse(built.out).at("warnings").size() == 1);
    CHECK_RESULT(run_castor({"info", kept, "--strict"}), 3, "u.castor: has 1 warning, which --strict");
}

TEST_CASE("glTF files are shown at a time, and scenes are lit by a picture, where they are asked to", "[cli]") {
    const TemporaryDirectory folder;
    GltfBuilder builder = one_triangle();
    const std::size_t times = builder.scalars({0, 2}), places = builder.vec3({0, 0, 0, 8, 0, 0});
    builder.json["animations"] = {{{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
                                   {"samplers", {{{"input", times}, {"output", places}}}}}};
    const std::string moving = folder.write("a.glb", builder.glb()).string();
    const auto info = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"info", "--json"});
        return Json::parse(run_castor(arguments).out);
    };
    CHECK(info({moving}).at("bounds").at("lower").at(0) == 0.0);
    CHECK(info({moving, "--time", "0.5"}).at("bounds").at("lower").at(0) == 2.0);
    CHECK_RESULT(run_castor({"info", moving, "--time", "soon"}), 2, "--time");
    builder.json["animations"].push_back(builder.json["animations"][0]);
    builder.json["animations"][1]["name"] = "Up";
    builder.json["animations"][1]["samplers"][0]["output"] = builder.vec3({0, 0, 0, 0, 8, 0});
    const std::string twice = folder.write("b.glb", builder.glb()).string();
    CHECK(info({twice, "--time", "0.5", "--animation", "Up"}).at("bounds").at("lower") == Json{0.0, 2.0, 0.0});
    CHECK_RESULT(run_castor({"info", twice, "--animation", "Up"}), 2, "--animation requires --time");
    const std::string rays = folder.write("rays", std::string(32, '\0')).string();
    for (const char* command : {"render", "trace", "build"}) {
        std::vector<std::string> arguments = {command, twice, "--time", "0", "--animation", "Down"};
        if (command == std::string("build")) arguments.insert(arguments.end(), {"-o", (folder.path() / "b").string()});
        if (command == std::string("trace"))
            arguments.insert(arguments.end(), {"--rays", rays, "--hits", (folder.path() / "h").string()});
        CHECK_RESULT(run_castor(arguments), 2, twice + ": there is no animation \"Down\": expected \"all\", a number");
    }
    CHECK(run_castor({"info", twice}).out.find("  animations 1, 2 \"Up\"\n") != std::string::npos);
    CHECK(info({twice}).at("animations") == Json{"", "Up"});
    CHECK(info({twice}).at("material_variants") == Json::array());
    const std::string variants = folder.write("v.glb", builder.glb()).string();
    CHECK_RESULT(run_castor({"info", variants, "--material-variant", "Red"}), 2,
                 variants + ": there is no material variant \"Red\": the file has none");
    const std::string still = folder.write("s.xml", scene_xml(camera_xml("s.png"))).string();
    CHECK_RESULT(run_castor({"info", still, "--time", "1"}), 2, "only a glTF file has a time to be shown at");
    CHECK_RESULT(run_castor({"info", still, "--material-variant", "1"}), 2, "only a glTF file has material variants");

    CHECK_RESULT(run_castor({"info", moving, "--sun-angle", "1"}), 2, "the scene has no directional light");
    std::string sunny = scene_xml(camera_xml("s.png"));
    const std::string sun =
        "<DirectionalLight><Direction>0 -1 0</Direction><Radiance>1 1 1</Radiance></DirectionalLight>";
    sunny.insert(sunny.find("</Lights>"), sun);
    const std::string with_sun = folder.write("sun.xml", sunny).string();
    for (const double degrees : {0.0, 180.0}) {
        const Json lights = info({with_sun, "--sun-angle", std::to_string(degrees)}).at("lights");
        CHECK(std::abs(lights.back().at("angle_radians").get<double>() - degrees * 3.14159265 / 180) < 1e-6);
    }
    for (const char* wrong : {"-1", "181", "nan"})
        CHECK_RESULT(run_castor({"info", with_sun, "--sun-angle", wrong}), 2, "sun");

    const std::string sky = folder.write("sky.hdr", castor::test::hdr_bytes(1, 1, {1, 1, 1})).string();
    const Json lights = info({still, "--environment", sky}).at("lights");
    REQUIRE(lights.size() == 1);
    CHECK(lights.at(0).at("kind") == "environment");
    const std::string missing = (folder.path() / "gone.hdr").string();
    CHECK_RESULT(run_castor({"info", still, "--environment", missing}), 3, missing);
    const auto sky_with = [&](float value) {
        std::vector<float> texels(12, 1.0f);
        texels[3 * 2 + 1] = value;
        return folder.write("sky.exr", castor::test::exr_bytes(2, 2, {"B", "G", "R"}, texels, 0, 2)).string();
    };
    const std::string wrong = sky_with(std::numeric_limits<float>::quiet_NaN());
    CHECK_RESULT(run_castor({"info", still, "--environment", wrong}), 3,
                 wrong + ": the texel in column 0, row 1 has the value nan, expected finite");
    const std::string told = sky_with(-0.5f) +
                             ": the texel in column 0, row 1 has the value -0.5; negative radiances "
                             "count as 0 (1 of 12 values)";
    CHECK_RESULT(run_castor({"info", still, "--environment", wrong}), 0, told);
    CHECK_RESULT(run_castor({"info", still, "--strict", "--environment", wrong}), 3, told);
    const std::string in_xml = "<Textures><Images><Image id='1'>sky.exr</Image></Images></Textures>";
    std::string lit = scene_xml(camera_xml("s.png"));
    lit.insert(lit.find("<Lights>"), in_xml);
    lit.insert(lit.find("</Lights>"),
               "<SphericalDirectionalLight id='1'><ImageId>1</ImageId></SphericalDirectionalLight>");
    CHECK_RESULT(run_castor({"info", folder.write("lit.xml", lit).string()}), 0, told);
}

TEST_CASE("render writes a picture for each camera where it is told to", "[cli]") {
    const TemporaryDirectory folder;
    const std::string device = device_under_test();
    const std::string two =
        folder.write("two.xml", scene_xml(camera_xml("a.ppm") + camera_xml("a.ppm", "8 6"))).string();
    const std::string one = folder.write("one.xml", scene_xml(camera_xml("../b.ppm"))).string();
    const auto render = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"render", "--device", device});
        return run_castor(arguments, folder.path());
    };

    SECTION("named by the scene, in the current folder, without the scene's own folders") {
        const ProcessResult result = render({one});
        CHECK_RESULT(result, 0, "Mray/s");
        CHECK_RESULT(result, 0, "b.ppm");
        CHECK(result.out.empty());
        const Ppm picture = read_ppm(folder.path() / "b.ppm");
        CHECK(picture.width == 16);
        CHECK(picture.height == 12);
        CHECK(std::vector<int>(picture.values.begin(), picture.values.begin() + 3) == std::vector<int>{10, 20, 30});
        const std::size_t middle = 3 * (6 * 16 + 8);
        CHECK(std::vector<int>(picture.values.begin() + middle, picture.values.begin() + middle + 3) ==
              std::vector<int>(3, 100));
    }
    SECTION("equal names get numbers") {
        CHECK_RESULT(render({two, "-q"}), 0, "several pictures would be named a.ppm");
        CHECK(read_ppm(folder.path() / "a-1.ppm").width == 16);
        CHECK(read_ppm(folder.path() / "a-2.ppm").width == 8);
        CHECK_FALSE(is_file(folder.path() / "a.ppm"));
    }
    SECTION("one file for several cameras gets numbers, one camera does not") {
        CHECK(render({two, "-q", "-o", "x.ppm"}).status == 0);
        CHECK(read_ppm(folder.path() / "x-1.ppm").width == 16);
        CHECK(read_ppm(folder.path() / "x-2.ppm").width == 8);
        CHECK(render({two, "-q", "-o", "x.ppm", "--camera", "2"}).status == 0);
        CHECK(read_ppm(folder.path() / "x.ppm").width == 8);
    }
    SECTION("a folder is made, planes lie beside the picture, and JSON says where") {
        const ProcessResult result = render({one, "-o", "new/folder/", "--aov", "depth,primitive", "--json", "--size",
                                             "24x12", "--samples", "4", "--filter", "box"});
        REQUIRE(result.status == 0);
        const Json document = Json::parse(result.out);
        const Json& picture = document.at("pictures").at(0);
        CHECK(picture.at("file") == (std::filesystem::absolute(folder.path()) / "new/folder/b.ppm").string());
        CHECK(picture.at("width") == 24);
        CHECK(picture.at("samples_per_pixel") == 4);
        CHECK(picture.at("complete") == true);
        CHECK(picture.at("planes").at(1).at("name") == "primitive");
        CHECK(is_file(picture.at("planes").at(0).at("file").get<std::string>()));
        CHECK(is_file(folder.path() / "new/folder/b.primitive.exr"));
        CHECK(document.at("rays") > 0);
        for (const char* stage : {"load", "flatten", "build", "setup", "render", "write"})
            CHECK(document.at("seconds").at(stage) >= 0.0);
        CHECK(read_ppm(folder.path() / "new/folder/b.ppm").width == 24);
    }
    SECTION("planes are layers of the picture's own file") {
        const std::vector<std::string> words = {one, "--aov", "depth,primitive", "--layers", "--json"};
        const auto with_output = [&](const char* output) {
            std::vector<std::string> more = words;
            more.insert(more.end(), {"-o", output});
            return render(more);
        };
        const ProcessResult result = with_output("all.exr");
        REQUIRE(result.status == 0);
        const Json document = Json::parse(result.out);
        const Json& picture = document.at("pictures").at(0);
        for (const Json& plane : picture.at("planes")) CHECK(plane.at("file") == picture.at("file"));
        CHECK(picture.at("planes").size() == 2);
        CHECK(is_file(folder.path() / "all.exr"));
        CHECK_FALSE(is_file(folder.path() / "all.depth.exr"));
        const std::string bytes = file_contents(folder.path() / "all.exr");
        CHECK(bytes.find("depth.Z") != std::string::npos);
        CHECK_RESULT(with_output("all.png"), 2, "a picture with layers cannot be written with the extension \".png\"");
        CHECK_FALSE(is_file(folder.path() / "all.png"));
        CHECK_RESULT(render(words), 2, "extension \".ppm\"; there are .exr");
        CHECK_RESULT(render({one, "--layers", "--part", "1/2", "--checkpoint", "part"}), 2, "--layers: a part has no");
    }
    SECTION("the window is widened, not stretched") {
        CHECK(render({one, "-q", "-o", "wide.ppm", "--size", "32x12"}).status == 0);
        CHECK(render({one, "-q", "-o", "plain.ppm"}).status == 0);
        const Ppm wide = read_ppm(folder.path() / "wide.ppm"), plain = read_ppm(folder.path() / "plain.ppm");
        for (int y = 0; y < 12; ++y)
            for (int x = 0; x < 16; ++x) {
                CAPTURE(x, y);
                REQUIRE(wide.values[3 * (y * 32 + x + 8)] == plain.values[3 * (y * 16 + x)]);
            }
    }
    SECTION("quiet prints nothing") {
        const ProcessResult result = render({one, "-q", "-o", "b.ppm"});
        CHECK(result.status == 0);
        CHECK(result.out.empty());
        CHECK(result.err.empty());
    }
    SECTION("what cannot be written is told before the work, and nothing is lost") {
        CHECK_RESULT(render({one, "-o", "missing/b.png"}), 5, "missing/b.png");
        CHECK_RESULT(render({one, "-o", "one.xml/"}), 5, "one.xml");
        const std::filesystem::path kept = folder.write("kept.png", "kept");
        CHECK_RESULT(render({one, "-o", "kept.png/b.png"}), 5, "Not a directory");
        CHECK(file_contents(kept) == "kept");
        if (std::filesystem::exists("/dev/full")) {
            std::filesystem::create_symlink("/dev/full", folder.path() / "full.ppm");
            CHECK_RESULT(render({one, "-o", "full.ppm"}), 5, "No space left on device");
        }
    }
}

TEST_CASE("options that change nothing are told, and the picture is made", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.png"))).string();
    const auto warnings = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"render", scene, "--device", device_under_test(), "--json", "-q"});
        const ProcessResult result = run_castor(arguments, folder.path());
        INFO(result.err);
        REQUIRE(result.status == 0);
        CHECK(is_file(folder.path() / "s.png"));
        std::string texts;
        const Json document = Json::parse(result.out);
        for (const Json& warning : document.at("warnings"))
            texts += "warning: " + warning.at("text").get<std::string>() + "\n";
        CHECK(result.err == texts);
        return texts;
    };
    const std::vector<std::string> depth{"--max-depth", "3"},
        of_paths{"--bounces", "3", "--light-choice", "uniform", "--clamp", "9"};
    const auto with = [](std::vector<std::string> arguments, const std::vector<std::string>& more) {
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    };
    const std::string reason = " has no effect: it is for path tracing, as --integrator path asks for\n";
    CHECK(warnings(with(of_paths, depth)) ==
          "warning: --bounces" + reason + "warning: --light-choice" + reason + "warning: --clamp" + reason);
    CHECK(warnings(with(with(of_paths, depth), {"--integrator", "path"})) ==
          "warning: --max-depth has no effect: --bounces is the limit where paths are traced\n");
}

TEST_CASE("trace finds the hits that a Tracer finds", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.png"))).string();
    castor::test::RandomSource random(7);
    std::vector<castor::Ray> rays(1000);
    for (castor::Ray& ray : rays) {
        const glm::vec3 origin = random.in_box(-2.0f, 2.0f), direction = random.direction();
        ray = {{origin.x, origin.y, origin.z}, 0.0f, {direction.x, direction.y, direction.z}, 1e30f};
    }
    const std::string_view bytes(reinterpret_cast<const char*>(rays.data()), rays.size() * sizeof(castor::Ray));
    const std::string ray_file = folder.write("rays", bytes).string();
    const std::string hit_file = (folder.path() / "hits").string();
    const auto trace = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {"trace", scene, "--device", device_under_test()});
        return run_castor(arguments);
    };
    castor::Tracer tracer(castor::load_scene(scene), castor::select_devices(device_under_test()));

    SECTION("closest, timed") {
        const ProcessResult result =
            trace({"--rays", ray_file, "--hits", hit_file, "--repeat", "3", "--hint", "coherent", "--json"});
        INFO(result.err);
        REQUIRE(result.status == 0);
        std::vector<castor::Hit> expected(rays.size());
        tracer.closest_hit(rays, expected);
        const std::string hits = file_contents(hit_file);
        REQUIRE(hits.size() == expected.size() * sizeof(castor::Hit));
        CHECK(std::memcmp(hits.data(), expected.data(), hits.size()) == 0);

        const Json document = Json::parse(result.out);
        CHECK(document.at("rays") == 1000);
        CHECK(document.at("hits") == std::count_if(expected.begin(), expected.end(), [](const castor::Hit& hit) {
                  return hit.primitive != CASTOR_INVALID_INDEX;
              }));
        CHECK(document.at("hits") > 0);
        CHECK(document.at("device").is_string());
        CHECK(document.at("strategy").is_string());
        CHECK(document.at("query") == "closest");
        CHECK(document.at("hint") == "coherent");
        CHECK(document.at("build_seconds") >= 0.0);
        CHECK(document.at("setup_seconds") >= 0.0);
        REQUIRE(document.at("seconds").size() == 3);
        const double best = *std::min_element(document.at("seconds").begin(), document.at("seconds").end());
        CHECK(document.at("mrays_per_second").get<double>() == Approx(1000 / best / 1e6));
    }
    SECTION("any, with brute force") {
        REQUIRE(trace({"--rays", ray_file, "--hits", hit_file, "--query", "any", "--strategy", "brute", "-q"}).status ==
                0);
        std::vector<std::uint8_t> expected(rays.size());
        tracer.any_hit(rays, expected);
        const std::string text = file_contents(hit_file);
        REQUIRE(text.size() == rays.size() * sizeof(castor::Hit));
        for (std::size_t i = 0; i < rays.size(); ++i) {
            castor::Hit hit;
            std::memcpy(&hit, text.data() + i * sizeof(hit), sizeof(hit));
            CAPTURE(i, expected[i]);
            REQUIRE(hit.t == (expected[i] ? 0.0f : std::numeric_limits<float>::infinity()));
            REQUIRE(hit.u == 0.0f);
            REQUIRE(hit.v == 0.0f);
            REQUIRE(hit.primitive == (expected[i] ? 0u : CASTOR_INVALID_INDEX));
            REQUIRE(hit.instance == hit.primitive);
        }
    }
    SECTION("crossings") {
        std::vector<std::uint32_t> counts(rays.size());
        tracer.count_crossings(rays, counts);
        const std::string expected_counts(reinterpret_cast<const char*>(counts.data()), 4 * counts.size());
        const ProcessResult counted = trace({"--rays", ray_file, "--hits", hit_file, "--query", "count", "--json"});
        INFO(counted.err);
        REQUIRE(counted.status == 0);
        CHECK(file_contents(hit_file) == expected_counts);
        const Json document = Json::parse(counted.out);
        CHECK(document.at("crossings") == std::accumulate(counts.begin(), counts.end(), 0u));
        CHECK(document.at("hits") == rays.size() - std::count(counts.begin(), counts.end(), 0u));
        CHECK(document.at("hits") > 0);

        std::vector<castor::Hit> first(2 * rays.size());
        tracer.list_crossings(rays, 2, first, counts);
        REQUIRE(trace({"--rays", ray_file, "--hits", hit_file, "--query", "list", "--limit", "2", "-q"}).status == 0);
        CHECK(file_contents(hit_file) ==
              expected_counts + std::string(reinterpret_cast<const char*>(first.data()), 20 * first.size()));

        const std::vector<castor::Hit> all = tracer.list_all_crossings(rays).value().crossings;
        REQUIRE(trace({"--rays", ray_file, "--hits", hit_file, "--query", "list", "-q"}).status == 0);
        CHECK(file_contents(hit_file) ==
              expected_counts + std::string(reinterpret_cast<const char*>(all.data()), 20 * all.size()));
        CHECK_RESULT(trace({"--rays", ray_file, "--hits", hit_file, "--query", "list", "--part", "1/2"}), 2,
                     "--query list with --limit only");
        CHECK_RESULT(trace({"--rays", ray_file, "--hits", hit_file, "--query", "count", "--limit", "2"}), 2,
                     "--limit is for --query list, and the query is count");
        CHECK_RESULT(trace({"--rays", ray_file, "--hits", hit_file, "--query", "list", "--limit", "0"}), 2, "--limit");
        CHECK_RESULT(trace({"--rays", ray_file, "--hits", hit_file, "--query", "list", "--limit", "4294967295"}), 2,
                     "4294967295 crossings of a ray are asked for");
    }
    SECTION("on the parts of a device") {
        const castor::Device device = castor::select_devices(device_under_test()).at(0);
        if (device.compute_units < 2) return;
        for (const std::string query : {"closest", "any"}) {
            CAPTURE(query);
            REQUIRE(trace({"--rays", ray_file, "--hits", hit_file, "--query", query, "-q"}).status == 0);
            const std::string expected = file_contents(hit_file);
            const ProcessResult result =
                run_castor({"trace", scene, "--device", std::to_string(device.index) + "/2", "--rays", ray_file,
                            "--hits", hit_file, "--query", query, "--repeat", "2", "--json"});
            INFO(result.err);
            REQUIRE(result.status == 0);
            CHECK(file_contents(hit_file) == expected);
            const Json document = Json::parse(result.out);
            CHECK(document.at("seconds").size() == 2);
            REQUIRE(document.at("shares").size() == 2);
            CHECK(document.at("shares")[0].at("rays").get<int>() + document.at("shares")[1].at("rays").get<int>() ==
                  3000);
        }
    }
    SECTION("no rays") {
        const ProcessResult result = trace({"--rays", folder.write("none", "").string(), "--hits", hit_file, "--json"});
        CHECK(result.status == 0);
        CHECK(Json::parse(result.out).at("rays") == 0);
        CHECK(is_file(hit_file));
        CHECK(file_contents(hit_file).empty());
    }
    SECTION("wrong files") {
        CHECK_RESULT(trace({"--rays", folder.write("odd", bytes.substr(0, 33)).string(), "--hits", hit_file}), 3,
                     "33 bytes");
        CHECK_RESULT(trace({"--rays", (folder.path() / "missing").string(), "--hits", hit_file}), 3, "No such file");
        CHECK_RESULT(trace({"--rays", folder.path().string(), "--hits", hit_file}), 3, "Is a directory");
        CHECK_RESULT(trace({"--rays", ray_file, "--hits", (folder.path() / "no" / "hits").string()}), 5,
                     "No such file");
        CHECK_RESULT(trace({"--rays", ray_file, "--hits", ray_file}), 2, "would be overwritten");
        CHECK(file_contents(ray_file) == bytes);
        CHECK_FALSE(is_file(hit_file));
    }
}

TEST_CASE("Ctrl-C in castor trace leaves all hits or none", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = std::string(CASTOR_SOURCE_DIR) + "/scenes/knot.xml";
    const auto interrupt = [&](const std::vector<std::string>& more, useconds_t delay) {
        std::vector<std::string> arguments{CASTOR_CLI, "trace", scene, "--rays", "rays", "--hits", "hits"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const std::string errors_file = (folder.path() / "err").string();
        const int errors = ::open(errors_file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
        const pid_t process = castor::test::start_process(arguments, errors, errors, {}, folder.path());
        ::close(errors);
        for (int tries = 0; tries < 1200 && file_contents(errors_file).find("tracing") == std::string::npos; ++tries)
            ::usleep(50000);
        ::usleep(delay);
        ::kill(process, SIGINT);
        CHECK(castor::test::wait_for(process) == 130);
        return file_contents(errors_file);
    };
    const castor::Device one = castor::select_devices(device_under_test()).at(0);
    const std::string device = std::to_string(one.index);
    SECTION("before they are found") {
        folder.write("rays", std::string(1'000'000 * sizeof(castor::Ray), '\1'));
        for (const std::string& devices : {device, device + "/2"}) {
            if (devices != device && one.compute_units < 2) continue;
            CAPTURE(devices);
            const std::string errors = interrupt({"--strategy", "brute", "--device", devices, "--json"}, 20000);
            INFO(errors);
            CHECK(errors.find("interrupted before all rays were answered: no hits are written") != std::string::npos);
            CHECK(errors.find("\"hits\": null") != std::string::npos);
            CHECK_FALSE(is_file(folder.path() / "hits"));
        }
    }
    SECTION("while runs are repeated") {
        folder.write("rays", std::string(10 * sizeof(castor::Ray), '\1'));
        const std::string errors = interrupt({"--repeat", "1000000", "--device", device}, 300000);
        INFO(errors);
        // On a machine so slow that the first run had not ended there are none.
        const bool are_written = errors.find("interrupted: the hits are written") != std::string::npos;
        CHECK(are_written == is_file(folder.path() / "hits"));
        if (are_written) CHECK(file_contents(folder.path() / "hits").size() == 10 * sizeof(castor::Hit));
    }
}

TEST_CASE("a picture of which nothing was done does not take the place of an older one", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.ppm"))).string();
    folder.write("s.ppm", "older");
    // Nothing is compiled yet, which takes longer than the deadline.
    const std::string cache = (folder.path() / "cache").string();
    const ProcessResult result =
        run_castor({"render", scene, "--device", device_under_test(), "--deadline", "0.1", "--json"}, folder.path(),
                   {{"POCL_CACHE_DIR", cache}, {"CASTOR_CACHE_DIR", cache}, {"CUDA_CACHE_DISABLE", "1"}});
    INFO(result.err);
    CHECK(result.status == 4);
    CHECK(result.err.find("has not answered for 0.1 s") != std::string::npos);
    CHECK(result.err.find("no device is left: no sample was done") != std::string::npos);
    CHECK(file_contents(folder.path() / "s.ppm") == "older");
    const nlohmann::json picture = nlohmann::json::parse(result.out).at("pictures").at(0);
    CHECK(picture.at("file").is_null());
    CHECK_FALSE(picture.at("complete").get<bool>());
}

TEST_CASE("a signal in the first tile leaves the mean of its samples so far", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.ppm", "64 48"))).string();
    const int errors = ::open((folder.path() / "err").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const pid_t process = castor::test::start_process(
        {CASTOR_CLI, "render", scene, "--device", device_under_test(), "--samples", "1048576"}, errors, errors, {},
        folder.path());
    ::close(errors);
    // The first plain line of progress says that samples are being taken.
    const auto is_under_way = [&] { return file_contents(folder.path() / "err").find(" left") != std::string::npos; };
    for (int tries = 0; tries < 1200 && !is_under_way(); ++tries) ::usleep(50000);
    ::kill(process, SIGTERM);
    CHECK(castor::test::wait_for(process) == 130);
    INFO(file_contents(folder.path() / "err"));
    const Ppm picture = read_ppm(folder.path() / "s.ppm");
    CHECK(std::vector<int>(picture.values.begin(), picture.values.begin() + 3) == std::vector<int>{10, 20, 30});
}

TEST_CASE("Ctrl-C in a long render leaves the picture so far and status 130", "[cli]") {
    const TemporaryDirectory folder;
    const std::string scene = folder.write("s.xml", scene_xml(camera_xml("s.ppm", "512 384"))).string();
    // A terminal for standard error, so that the bar shows when the render is under way.
    const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    REQUIRE(terminal >= 0);
    REQUIRE(::grantpt(terminal) == 0);
    REQUIRE(::unlockpt(terminal) == 0);
    const int slave = ::open(::ptsname(terminal), O_RDWR | O_NOCTTY | O_CLOEXEC);
    REQUIRE(slave >= 0);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    const pid_t process = castor::test::start_process(
        {CASTOR_CLI, "render", scene, "--device", device_under_test(), "--samples", "4096", "--tile", "8"}, nowhere,
        slave, {{"TERM", "xterm"}}, folder.path());
    ::close(slave);
    ::close(nowhere);

    std::string text;
    bool sent = false;
    char piece[4096];
    // Rays are counted as tiles end: a rate in rays means that some pixels are done. The terminal's end is an error.
    for (ssize_t size; (size = ::read(terminal, piece, sizeof(piece))) > 0;) {
        text.append(piece, static_cast<std::size_t>(size));
        if (!sent && text.find("ray/s") != std::string::npos) sent = ::kill(process, SIGINT) == 0;
    }
    ::close(terminal);
    const int status = castor::test::wait_for(process);
    CAPTURE(text.substr(0, 4000));
    CHECK(sent);
    CHECK(status == 130);
    CHECK(text.find(" left") != std::string::npos);
    CHECK(text.find("holds the picture so far") != std::string::npos);
    const Ppm picture = read_ppm(folder.path() / "s.ppm");
    CHECK(picture.width == 512);
    CHECK(std::count(picture.values.begin(), picture.values.end(), 30) > 0);
    CHECK(std::count(picture.values.begin(), picture.values.end(), 0) > 0);
}

#endif
