// Memory that is planned before it is taken.
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "castor/device.h"
#include "reference/meshes.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/gltf_builder.h"
#include "support/picture_bytes.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

namespace castor::test {
namespace {

using Json = nlohmann::json;

const std::string kScene = std::string(CASTOR_SOURCE_DIR) + "/scenes/knot.xml";  // 30 thousand triangles

const Json& host_of(const Json& document) {
    return document.at("memory").at(0);
}

}  // namespace

TEST_CASE("too little memory is told with both numbers, before the work", "[cli][memory]") {
    const TemporaryDirectory directory;
    const std::string folder = directory.path().string();
    const std::string device = device_under_test();
    std::string rays(32, '\0');
    directory.write("rays", rays);
    const std::string reason = "too little memory: about ";
    const std::vector<std::vector<std::string>> commands{{"render", kScene, "-o", "p.png"},
                                                         {"build", kScene, "-o", "s.castor"},
                                                         {"trace", kScene, "--rays", "rays", "--hits", "h"}};
    for (std::vector<std::string> command : commands) {
        CAPTURE(command.at(0));
        command.insert(command.end(), {"--device", device, "--memory-limit", "1M"});
        const ProcessResult result = run_castor(command, folder);
        CHECK_RESULT(result, 4, "castor: host: " + reason);
        CHECK(result.err.find("building the trees ") != std::string::npos);
        CHECK(result.err.find("1.0 MiB are available") != std::string::npos);
    }
    CHECK_RESULT(run_castor({"info", kScene, "--memory-limit", "1M"}), 4, reason);
    for (const char* name : {"p.png", "s.castor", "h"}) CHECK_FALSE(std::filesystem::exists(directory.path() / name));
    CHECK_RESULT(run_castor({"info", kScene, "--memory-limit", "much"}), 2, "--memory-limit");

    // Checkpoints are copies of the picture, and of the sums of 64 blocks of 64 pixels.
    const std::vector<std::string> small{"render", kScene,           "-o", "p.png",    "--size",
                                         "64x64",  "--memory-limit", "1M", "--device", device};
    CHECK(run_castor(small, folder).err.find("checkpoints") == std::string::npos);
    std::vector<std::string> with_checkpoints = small;
    with_checkpoints.insert(with_checkpoints.end(), {"--checkpoint", "c"});
    CHECK_RESULT(run_castor(with_checkpoints, folder), 4, "picture 52.0 KiB, checkpoints 250.0 KiB)");

    // A built scene needs nothing of the host but the picture, and the device has rays.
    REQUIRE(run_castor({"build", kScene, "-o", "s.castor", "--device", device}, folder).status == 0);
    const std::vector<std::string> render{"render", "s.castor",  "-o", "p.png",    "--size",
                                          "8x8",    "--samples", "1",  "--device", device};
    std::vector<std::string> limited = render;
    limited.insert(limited.end(), {"--memory-limit", "2M"});
    const ProcessResult result = run_castor(limited, folder);
    CHECK_RESULT(result, 4, reason);
    CHECK(result.err.find("castor: host") == std::string::npos);
    limited.back() = "100M";
    CHECK(run_castor(limited, folder).status == 0);
}

TEST_CASE("pictures that are larger than a device are told before the work", "[cli][memory]") {
    const TemporaryDirectory directory;
    constexpr std::size_t kWidth = 2048, kHeight = 1024;
    const std::string header = fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", kHeight, kWidth);
    directory.write("sky.hdr", header + std::string(4 * kWidth * kHeight, '\x70'));
    std::vector<std::string> command{"render",
                                     kScene,
                                     "-o",
                                     "p.png",
                                     "--size",
                                     "8x8",
                                     "--device",
                                     device_under_test(),
                                     "--samples",
                                     "1",
                                     "--device-memory-limit",
                                     "64M"};
    CHECK(run_castor(command, directory.path().string()).status == 0);
    command[3] = "q.png";
    command.insert(command.end(), {"--environment", "sky.hdr"});
    const ProcessResult result = run_castor(command, directory.path().string());
    CHECK_RESULT(result, 4, "too little memory: about ");
    CHECK(result.err.find("64.0 MiB are available") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(directory.path() / "q.png"));
}

TEST_CASE("castor build warns of devices that cannot render what it saves", "[cli][memory]") {
    const TemporaryDirectory directory;
    const std::string folder = directory.path().string(), device = device_under_test();
    GltfBuilder gltf = one_triangle();
    const std::size_t texture = gltf.texture(png_bytes(512, 512, 3, some_bytes(512, 512, 3)));
    gltf.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}}};
    // A light of its own, since a studio has texels too.
    gltf.json["extensionsUsed"] = {"KHR_lights_punctual"};
    gltf.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    gltf.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
    nlohmann::json& primitive = gltf.json["meshes"][0]["primitives"][0];
    primitive["material"] = 0;
    primitive["attributes"]["TEXCOORD_0"] = gltf.vec2({0, 0, 1, 0, 0, 1});
    directory.write("t.glb", gltf.glb());
    const auto castor = [&](const std::vector<std::string>& words, const std::vector<std::string>& more) {
        std::vector<std::string> arguments = words;
        arguments.insert(arguments.end(), {"--device", device});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_castor(arguments, folder);
    };
    const std::vector<std::string> build{"build", "t.glb", "-o", "t.castor"}, render{"render", "t.glb", "-o", "p.png"};
    const ProcessResult unlimited = castor(build, {"--quiet", "--strict"});
    CHECK(unlimited.status == 0);
    CHECK(unlimited.err.empty());

    const std::vector<std::pair<std::string, std::string>> limits{
        {"--allocation-limit", "the texels need 1.3 MiB in one buffer, the device's largest allocation is 1.0 MiB"},
        {"--device-memory-limit", "too little memory: about "}};
    for (const auto& [option, reason] : limits) {
        CAPTURE(option);
        std::filesystem::remove(directory.path() / "t.castor");
        const ProcessResult strict = castor(build, {option, "1M", "--strict"});
        CHECK_RESULT(strict, 4, reason);
        CHECK_FALSE(std::filesystem::exists(directory.path() / "t.castor"));
        const ProcessResult refused = castor(render, {option, "1M"});
        CHECK_RESULT(refused, 4, reason);
        const ProcessResult built = castor(build, {option, "1M", "--json", "--quiet"});
        REQUIRE(built.status == 0);
        const Json warnings = Json::parse(built.out).at("warnings");
        REQUIRE(warnings.size() == 1);
        CHECK(built.err == fmt::format("warning: t.glb: {}\n", warnings[0].at("text").get<std::string>()));
        // What render says of the device, with its numbers.
        const std::string told = refused.err.substr(refused.err.find(reason));
        CHECK(built.err.ends_with(" cannot render it: " + told));
        CHECK(castor({"render", "t.castor", "-o", "p.png"}, {option, "1M"}).status == 4);
    }
    CHECK(castor(build, {"--device-memory-limit", "1M"}).err.find("textures, lights and instances 1.3 MiB") !=
          std::string::npos);
    // Parts of a device are one device here.
    const Device one = select_devices(device).at(0);
    if (one.compute_units < 2) return;
    const std::string parts = std::to_string(one.index) + "/2";
    const std::string told =
        run_castor({"build", "t.glb", "-o", "t.castor", "--device", parts, "--allocation-limit", "1M"}, folder).err;
    CHECK(told.find("cannot render it") != std::string::npos);
    CHECK(told.find("cannot render it") == told.rfind("cannot render it"));
}

TEST_CASE("memory that is planned for a render is what its scene takes, and not much more", "[cli][memory]") {
    const TemporaryDirectory directory;
    const Mesh mesh = bumpy_sphere(6);  // 80 thousand triangles
    std::string text;
    for (const glm::vec3& p : mesh.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
    for (const glm::uvec3& t : mesh.triangles) text += fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
    const std::string file = directory.write("m.obj", text).string();
    const Json info = Json::parse(run_castor({"info", file, "--json"}).out);
    const Json& host = host_of(info);
    CHECK(host.at("owner") == "host");
    CHECK(host.at("available") > host.at("needed"));
    const double arrays = info.at("bytes").at("arrays");
    const double trees =
        info.at("bytes").at("wide_tree").get<double>() + info.at("bytes").at("compressed_tree").get<double>();
    const double columns = host.at("parts").at("columns");
    CHECK(columns <= arrays);
    CHECK(columns > 0.99 * arrays);  // without lights and materials

    // Vertices of glTF files have tangents, colours and a second set of texture coordinates.
    GltfBuilder gltf = one_triangle();
    std::vector<float> many(3 * 30000);
    for (std::size_t i = 0; i < many.size(); ++i) many[i] = static_cast<float>(i % 7);
    nlohmann::json& attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["POSITION"] = gltf.vec3(many);
    attributes["COLOR_0"] = gltf.vec3(std::vector<float>(many.size(), 0.5f));
    const std::string colored = directory.write("c.glb", gltf.glb()).string();
    const Json of_colored = Json::parse(run_castor({"info", colored, "--json"}).out);
    const double planned = host_of(of_colored).at("parts").at("columns");
    const double made = of_colored.at("bytes").at("arrays");
    CHECK(planned <= made);
    CHECK(planned > 0.99 * made);
    const double building = host.at("parts").at("building the trees");
    CHECK(building > trees);
    CHECK(building < 3 * trees);
    CHECK(host.at("parts").at("picture") == 1024 * 1024 * 13);
}

}  // namespace castor::test

#endif
