// Several drivers on one machine: each alone and all together make the same bytes.
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "base/cpu_registers.h"
#include "castor/built_scene.h"
#include "castor/tracer.h"
#include "reference/random_source.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/small_path_scene.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

using castor::test::Environment;
using castor::test::file_contents;
using castor::test::ProcessResult;
using castor::test::run_castor;
using castor::test::TemporaryDirectory;
using Json = nlohmann::json;

namespace fs = std::filesystem;

namespace {

const std::string kScenes = std::string(CASTOR_SOURCE_DIR) + "/scenes/";

/// Of a bundled scene, or of a file with its whole path.
std::string path_of(const std::string& scene) {
    return (fs::path(kScenes) / scene).string();
}

std::string random_rays(std::size_t count) {
    castor::test::RandomSource random(3);
    std::string bytes;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 origin = random.in_box(-3.0f, 3.0f), direction = random.direction();
        const castor::Ray ray{{origin.x, origin.y, origin.z}, 0.0f, {direction.x, direction.y, direction.z}, 1e30f};
        bytes.append(reinterpret_cast<const char*>(&ray), sizeof(ray));
    }
    return bytes;
}

/// Runs the tool where some drivers are to be had.
class Drivers {
public:
    /// `log`: a file that must be empty after each run; empty: none. A run that writes begins it anew.
    explicit Drivers(Environment environment, fs::path log = {})
        : log_(std::move(log)), environment_(std::move(environment)) {
        environment_.emplace_back("CASTOR_CACHE_DIR", (folder_.path() / "cache").string());
    }

    /// The indices of the devices whose platform's name is this.
    std::vector<std::string> devices_of(const std::string& platform) const {
        const ProcessResult result = run_castor({"devices", "--json"}, "", environment_);
        INFO(result.err);
        REQUIRE(result.status == 0);
        std::vector<std::string> indices;
        const Json document = Json::parse(result.out);
        for (const Json& device : document.at("devices"))
            if (device.at("platform") == platform) indices.push_back(std::to_string(device.at("index").get<int>()));
        return indices;
    }
    /// Pixels and planes, and what was said.
    std::pair<std::string, std::string> render(const std::string& scene, const std::string& devices,
                                               const std::string& size, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"render", path_of(scene), "--camera", "1",
                                           "--size", size,           "--device", devices,
                                           "-o",     "p.pfm",        "--aov",    "depth,normal,primitive"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const ProcessResult result = run(arguments);
        std::string files;
        for (const char* name : {"p.pfm", "p.depth.exr", "p.normal.exr", "p.primitive.exr"}) {
            REQUIRE_FALSE(file_contents(folder_.path() / name).empty());
            files += file_contents(folder_.path() / name);
            fs::remove(folder_.path() / name);
        }
        return {files, result.err};
    }
    std::string trace(const std::string& scene, const std::string& devices, std::size_t rays,
                      const std::vector<std::string>& more) const {
        folder_.write("rays", random_rays(rays));
        std::vector<std::string> arguments{"trace",  path_of(scene), "--rays",   "rays",
                                           "--hits", "hits",         "--device", devices};
        arguments.insert(arguments.end(), more.begin(), more.end());
        run(arguments);
        const std::string hits = file_contents(folder_.path() / "hits");
        CHECK(hits.size() == rays * sizeof(castor::Hit));
        fs::remove(folder_.path() / "hits");
        return hits;
    }

private:
    ProcessResult run(const std::vector<std::string>& arguments) const {
        const ProcessResult result = run_castor(arguments, folder_.path().string(), environment_);
        INFO(result.err);
        REQUIRE(result.status == 0);
        if (!log_.empty()) CHECK(file_contents(log_).substr(0, 1000) == "");
        return result;
    }

    TemporaryDirectory folder_;
    fs::path log_;
    Environment environment_;
};

/// Each of two devices, and both: the picture is made twice, so that each makes all of it. Returns what was said of
/// that.
std::string check_same_bytes(const Drivers& drivers, const std::vector<std::string>& devices, const std::string& scene,
                             const std::string& size, std::size_t rays) {
    CAPTURE(scene, devices);
    REQUIRE(devices.size() == 2);
    const std::string both = devices[0] + "," + devices[1];
    const std::string first = drivers.render(scene, devices[0], size, {"--samples", "2"}).first;
    CHECK(drivers.render(scene, devices[1], size, {"--samples", "2"}).first == first);
    const auto [shared, said] = drivers.render(scene, both, size, {"--samples", "2", "--verify", "100"});
    CHECK(shared == first);
    INFO(said);
    CHECK(said.find(" pixels are the same bits on two devices") != std::string::npos);
    CHECK(said.find("dropped") == std::string::npos);

    const std::string hits = drivers.trace(scene, devices[0], rays, {});
    CHECK(drivers.trace(scene, devices[1], rays, {}) == hits);
    CHECK(drivers.trace(scene, both, rays, {"--repeat", "2"}) == hits);
    return said;
}

}  // namespace

TEST_CASE("PoCL's drivers make the same picture and hits, alone and together", "[cli][drivers]") {
    const Drivers drivers(Environment{{"POCL_DEVICES", "pthread basic"}});
    const std::vector<std::string> devices = drivers.devices_of("Portable Computing Language");
    for (const char* scene : {"spheres.xml", "meshes.xml"}) check_same_bytes(drivers, devices, scene, "96x64", 20000);
}

TEST_CASE("any number of PoCL's threads, in teams of one or two, makes the same picture", "[cli][drivers]") {
    std::string first;
    for (const char* threads : {"1", "2", "5", "18"}) {  // at most 16 teams; more threads than many a machine has
        CAPTURE(threads);
        const Drivers drivers(Environment{{"POCL_DEVICES", "pthread"}, {"POCL_MAX_PTHREAD_COUNT", threads}});
        const std::vector<std::string> devices = drivers.devices_of("Portable Computing Language");
        if (devices.empty()) {
            std::cerr << "skipped: there is no PoCL\n";
            return;
        }
        const auto [files, said] =
            drivers.render("spheres.xml", devices[0], "96x64", {"--samples", "2", "--tile", "8"});
        if (first.empty()) first = files;
        CHECK(files == first);
    }
}

#ifdef CASTOR_OCLGRIND_ICD

namespace {

/// PoCL's driver and Oclgrind, which reports nothing. `folder`: empty.
Drivers oclgrind_beside_pocl(const TemporaryDirectory& folder) {
    folder.write("oclgrind.icd", CASTOR_OCLGRIND_ICD);
    const fs::path installed = "/etc/OpenCL/vendors", log = folder.path() / "log";
    for (const fs::directory_entry& entry : fs::directory_iterator(installed))
        fs::copy(entry.path(), folder.path() / entry.path().filename());
    // Its check for uninitialised values does not know of those that clEnqueueFillBuffer wrote.
    return Drivers(Environment{{"OCL_ICD_VENDORS", folder.path().string()},
                               {"OCLGRIND_BUILD_OPTIONS", "-cl-opt-disable"},
                               {"OCLGRIND_DATA_RACES", "1"},
                               {"OCLGRIND_LOG", log.string()},
                               {"POCL_DEVICES", "pthread"}},
                   log);
}

}  // namespace

TEST_CASE("Oclgrind and PoCL make the same picture and hits, alone and together", "[cli][drivers]") {
    const TemporaryDirectory folder;
    const Drivers drivers = oclgrind_beside_pocl(folder);
    std::vector<std::string> devices = drivers.devices_of("Portable Computing Language");
    const std::vector<std::string> oclgrind = drivers.devices_of("Oclgrind");
    devices.insert(devices.end(), oclgrind.begin(), oclgrind.end());
    const std::string said = check_same_bytes(drivers, devices, "spheres.xml", "16x8", 100);
    INFO(said);
    const std::string of_few = castor::has_registers_of_16() ? "wide" : "packet";
    CHECK(said.find("(cpu, Portable Computing Language), strategy " + of_few) != std::string::npos);
    CHECK(said.find("(gpu, Oclgrind), strategy simt") != std::string::npos);
}

TEST_CASE("Oclgrind and PoCL make the same path-traced picture", "[cli][drivers]") {
    const TemporaryDirectory folder, scenes;
    const Drivers drivers = oclgrind_beside_pocl(folder);
    const std::string file = (scenes.path() / "paths.castor").string();
    castor::BuiltScene(castor::test::small_path_scene(), {castor::test::test_device()}).save(file);
    std::vector<std::string> pictures;
    for (const char* platform : {"Portable Computing Language", "Oclgrind"}) {
        const std::vector<std::string> devices = drivers.devices_of(platform);
        REQUIRE(devices.size() == 1);
        pictures.push_back(drivers.render(file, devices[0], "6x4", {"--samples", "2"}).first);
    }
    CHECK((pictures[0] == pictures[1]));  // bytes, which no message needs
}

#else

TEST_CASE("Oclgrind and PoCL make the same picture and hits, alone and together", "[cli][drivers]") {
    std::cerr << "skipped: Oclgrind is not installed, or this build is sanitized\n";
}

#endif

#endif
