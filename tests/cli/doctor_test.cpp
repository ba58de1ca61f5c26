// `castor doctor`: what it says of drivers that compute, compile, crash or hang as they should not, and that it is
// heeded.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "castor/device.h"
#include "doctor/golden_picture.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

using castor::test::device_under_test;
using castor::test::Environment;
using castor::test::file_contents;
using castor::test::ProcessResult;
using castor::test::TemporaryDirectory;
using Json = nlohmann::json;

namespace fs = std::filesystem;

TEST_CASE("the golden picture is the one that castor doctor expects", "[doctor]") {
    const castor::Scene scene = castor::doctor::golden_scene();
    castor::Renderer renderer(scene, castor::select_devices(device_under_test()));
    const castor::Film film = renderer.render(scene.cameras[0], castor::doctor::golden_options());
    CHECK(film.complete());
    // Every material, and the background, is to be seen.
    const auto plane = std::find_if(film.planes.begin(), film.planes.end(),
                                    [](const castor::FilmPlane& p) { return p.name == "primitive"; });
    REQUIRE(plane != film.planes.end());
    CHECK(std::set<std::uint32_t>(plane->indices.begin(), plane->indices.end()).size() > 20);
    CHECK(castor::doctor::film_checksum(film) == castor::doctor::kGoldenChecksum);
}

#ifdef CASTOR_CLI

using castor::test::run_castor;

namespace {

/// What makes the contexts of each of the doctor's processes share programs, which takes a third of the time.
Environment with_shared_programs(Environment more = {}) {
#ifdef CASTOR_SHARED_PROGRAMS
    more.emplace_back("LD_PRELOAD", CASTOR_SHARED_PROGRAMS);
#endif
    return more;
}

/// A place of its own for what is known of devices.
class Clinic {
public:
    Environment environment(Environment more = {}) const {
        more.emplace_back("CASTOR_PROFILE_DIR", (folder_.path() / "state").string());
        return more;
    }
    /// Looks at these parts of the device under test, and returns what it says of that.
    Json examine(int expected_status, const std::string& parts, const Environment& more = {},
                 const std::vector<std::string>& limits = {"--patience", "120"}) const {
        std::vector<std::string> arguments{
            "doctor", "--seconds", "0",        "--parts",
            parts,    "--json",    "--device", castor::select_devices(device_under_test()).at(0).name};
        arguments.insert(arguments.end(), limits.begin(), limits.end());
        const ProcessResult result = run_castor(arguments, "", environment(more));
        INFO(result.err);
        REQUIRE(result.status == expected_status);
        return Json::parse(result.out).at("devices").at(0);
    }
    /// What `castor devices` says of it.
    Json device() const {
        const ProcessResult result = run_castor({"devices", "--json"}, "", environment());
        INFO(result.err);
        REQUIRE(result.status == 0);
        const std::size_t index = castor::select_devices(device_under_test()).at(0).index;
        return Json::parse(result.out).at("devices").at(index);
    }
    ProcessResult render(std::vector<std::string> more) const {
        more.insert(more.begin(),
                    {"render", std::string(CASTOR_SOURCE_DIR) + "/scenes/meshes/block.obj", "--size", "8x8", "-o",
                     (folder_.path() / "p.ppm").string(), "-q", "--device", device_under_test()});
        return run_castor(more, "", environment());
    }
    const fs::path& path() const { return folder_.path(); }

private:
    TemporaryDirectory folder_;
};

/// Kernels of which some are not as they should be, in place of the true ones.
class BrokenKernels {
public:
    /// Puts `text` before the end of the last function of a source.
    void insert(const std::string& name, const std::string& text) {
        std::string source = read(name);
        source.insert(source.rfind('}'), text);
        write(name, source);
    }
    void replace(const std::string& name, const std::string& before, const std::string& after) {
        std::string source = read(name);
        const std::size_t at = source.find(before);
        REQUIRE(at != std::string::npos);
        write(name, source.replace(at, before.size(), after));
    }
    Environment environment() const { return {{"CASTOR_KERNEL_DIR", folder_.path().string()}}; }

private:
    static std::string read(const std::string& name) {
        const std::string source = file_contents(std::string(CASTOR_SOURCE_DIR) + "/kernels/" + name);
        REQUIRE_FALSE(source.empty());
        return source;
    }
    void write(const std::string& name, const std::string& source) {
        fs::create_directories((folder_.path() / "kernels" / name).parent_path());
        folder_.write("kernels/" + name, source);
    }
    TemporaryDirectory folder_;
};

/// The reasons for which a strategy, or the device (""), fails.
std::string reasons(const Json& document, const std::string& strategy) {
    std::string text;
    for (const Json& fault : document.at("faults"))
        if (fault.at("strategy") == (strategy.empty() ? Json() : Json(strategy)))
            text += fault.at("reason").get<std::string>() + "\n";
    return text;
}

bool is_cpu() {
    return castor::select_devices(device_under_test()).at(0).type == castor::DeviceType::cpu;
}

bool contains(const std::string& text, const std::string& part) {
    INFO(text);
    CHECK(text.find(part) != std::string::npos);
    return true;
}

}  // namespace

TEST_CASE("the doctor trusts a device that does all right", "[cli][doctor]") {
    const Clinic clinic;
    CHECK(clinic.device().at("doctor").is_null());
    const Json document = clinic.examine(0, "driver,functions,brute,simt,wide,packet,compiler");
    CAPTURE(document.dump(2));
    CHECK(document.at("verdict") == "trusted");
    CHECK(document.at("faults").empty());
    CHECK(document.at("parts").size() == 7);
    for (const Json& part : document.at("parts")) CHECK(part == "passed");
    CHECK(clinic.device().at("doctor").at("verdict") == "trusted");
    CHECK(clinic.render({}).err.empty());
}

TEST_CASE("strategies that drop hits, do not compile or crash are named, left out, and taken again once they pass",
          "[cli][doctor]") {
    const Clinic clinic;
    BrokenKernels kernels;
    kernels.insert("closest_hit_wide.cl",
                   "    if (get_global_id(0) == 0) hits[params.first_ray].primitive = CASTOR_INVALID_INDEX;\n");
    kernels.insert("any_hit_packet.cl", "    this is no OpenCL C\n");
    // A work-item of a GPU that writes to nowhere need not end the process.
    kernels.insert("closest_hit_simt.cl", is_cpu() ? "    *(volatile global uint *)(ulong)8 = 1u;\n"
                                                   : "    hits[params.first_ray].t = 0.5f;\n");
    Environment environment = kernels.environment();
    environment.emplace_back("ASAN_OPTIONS", "detect_leaks=0:handle_segv=0");  // the signal is what is told
    const Json document = clinic.examine(4, "brute,simt,wide,packet", with_shared_programs(environment));
    CAPTURE(document.dump(2));
    CHECK(document.at("verdict") == "trusted except simt, wide, packet");
    CHECK(document.at("parts").at("brute") == "passed");
    CHECK(document.at("parts").at("wide") == "failed");
    CHECK(contains(reasons(document, "wide"), "triangles, spheres and planes: "));
    CHECK(contains(reasons(document, "wide"), " rays are answered wrongly, the first, make_ray("));
    CHECK(contains(reasons(document, "wide"), "expected by brute force t "));
    CHECK(contains(reasons(document, "packet"), "trace_packet.cl does not compile"));
    CHECK(contains(reasons(document, "simt"), is_cpu() ? "the process was ended by SIGSEGV" : "answered wrongly"));

    // It is said at every use, and brute force answers.
    const ProcessResult all_wrong = clinic.render({});
    CHECK_RESULT(all_wrong, 0, ": simt, wide, packet is not used because of what \"castor doctor\" found wrong");
    CHECK_RESULT(run_castor({"devices"}, "", clinic.environment()), 0, "is not used because of");
    CHECK(clinic.device().at("profile").at("strategies").at("closest_coherent") == "brute");
    CHECK(clinic.device().at("doctor").at("verdict") == "trusted except simt, wide, packet");
    CHECK_RESULT(clinic.render({"--strategy", "wide"}), 0, " is in use as asked, against what \"castor doctor\" found");
    CHECK_RESULT(run_castor({"tune", "scan:300", "--size", "8", "--seconds", "0", "--device", device_under_test()}, "",
                            clinic.environment()),
                 4, "there is nothing to tune");

    CHECK(clinic.examine(0, "brute,simt,wide,packet", with_shared_programs()).at("verdict") == "trusted");
    CHECK(clinic.render({}).err.empty());
    CHECK(clinic.device().at("profile").at("strategies").at("closest_coherent") != "brute");
}

TEST_CASE("what the compiler warns of is a remark, and takes no device away", "[cli][doctor]") {
    const Clinic clinic;
    BrokenKernels kernels;
    kernels.insert("accumulate.lanes.cl", "    uint mark = 0;\n    if (mark = (uint)get_global_id(0)) mark = 0;\n");
    Environment environment = kernels.environment();
    environment.emplace_back("CASTOR_BUILD_OPTIONS", "");
    const Json document = clinic.examine(0, "brute,compiler", with_shared_programs(environment));
    CAPTURE(document.dump(2));
    CHECK(document.at("verdict") == "trusted");
    REQUIRE(document.at("remarks").size() >= 1);
    CHECK(contains(document.at("remarks").at(0), "with warnings as errors: "));
    CHECK(contains(document.at("remarks").at(0), "accumulate.lanes.cl:"));
    // Castor's own kernels have none.
    CHECK(clinic.examine(0, "compiler").at("remarks").dump().find("warnings as errors") == std::string::npos);
}

TEST_CASE("a strategy that hangs is killed, and those after it are looked at", "[cli][doctor]") {
    const Clinic clinic;
    BrokenKernels kernels;
    kernels.insert("closest_hit_simt.cl", "    volatile uint go_on = 1u;\n    while (go_on) go_on |= 1u;\n");
    clinic.examine(0, "wide", with_shared_programs());  // compiles it: what takes long after that is a hang
    const Json document =
        clinic.examine(4, "simt,wide", with_shared_programs(kernels.environment()), {"--patience", "15"});
    CAPTURE(document.dump(2));
    CHECK(document.at("verdict") == "trusted except simt");
    CHECK(contains(reasons(document, "simt"),
                   "triangles, spheres and planes: nothing went on for 15 seconds, and the process was killed"));
    CHECK(document.at("parts").at("wide") == "passed");
}

TEST_CASE("a driver that takes too much memory is killed, and that is told", "[cli][doctor]") {
    const Clinic clinic;
    // A driver with a compiler in it takes more than this to be loaded.
    const Json document = clinic.examine(4, "simt", {}, {"--memory-limit", "10M"});
    CAPTURE(document.dump(2));
    // Now and then it is seen while the context is made, before any strategy.
    const bool is_early = document.at("verdict") == "not usable";
    CHECK((is_early || document.at("verdict") == "trusted except simt"));
    CHECK(contains(reasons(document, is_early ? "" : "simt"),
                   "the process took more than 10.0 MiB of memory, and was killed"));
    CHECK(document.at("parts").at("simt") == "failed");
}

TEST_CASE("a device that cannot divide and ends loops early is not usable, and loudly said so", "[cli][doctor]") {
    const Clinic clinic;
    BrokenKernels kernels;
    kernels.replace(
        "device/exact.cl", "divide_by_integers(const float a, const float b)\n{",
        "divide_by_integers(const float a, const float b)\n{\n    if (a == 3.0f) return as_float(as_uint(a / b) "
        "+ 1u);");
    kernels.replace("doctor/queue.cl", "k < rounds", "k < min(rounds, 65536u)");
    const Json document = clinic.examine(4, "driver", kernels.environment());
    CAPTURE(document.dump(2));
    CHECK(document.at("verdict") == "not usable");
    CHECK(contains(reasons(document, ""), "quotients and roots: divide_by_integers(a, b) for a = 0x1.8p+1, b = "));
    CHECK(contains(reasons(document, ""), "long loops: after a loop of 131072 turns value 0 is "));
    CHECK_RESULT(clinic.render({}), 0, " IS NOT TO BE TRUSTED, and its results may be wrong: quotients and roots: ");
    CHECK(clinic.examine(0, "driver").at("verdict") == "trusted");
    CHECK(clinic.render({}).err.empty());
}

TEST_CASE("wrong functions and a wrong picture are told with what was expected", "[cli][doctor]") {
    const Clinic clinic;
    BrokenKernels kernels;
    kernels.replace("device/intersect_plane.cl", "candidate.t = t;", "candidate.t = 1.0001f * t;");
    kernels.replace("generate_shadow_rays.lanes.cl", "const Mask is_lit",
                    "contribution.x *= 1.5f;\n        const Mask is_lit");
    const Json document = clinic.examine(4, "functions,brute", with_shared_programs(kernels.environment()));
    CAPTURE(document.dump(2));
    CHECK(contains(reasons(document, ""), "intersect_plane: intersect_plane, case \"from above\""));
    CHECK(contains(reasons(document, ""), "expected t 0x1p+1"));
    CHECK(contains(reasons(document, ""), "triangles, spheres and planes: "));
    CHECK(contains(reasons(document, ""), "the golden picture: the checksum of the picture is 0x"));
}

TEST_CASE("a driver that ends the process when it is asked for platforms is named, and the others are looked at",
          "[cli][doctor]") {
    const TemporaryDirectory folder;
    folder.write("aborting.icd", CASTOR_ABORTING_ICD);
    const Clinic clinic;
    const std::vector<std::string> command{"doctor", "--parts", "driver", "--seconds", "0", "--json"};
    const Environment changes = clinic.environment({{"OCL_ICD_VENDORS", folder.path().string()}});
    const ProcessResult alone = run_castor(command, "", changes);
    CHECK_RESULT(alone, 4, "aborting.icd cannot be asked for its devices: the process was ended by SIGABRT");
    CHECK(Json::parse(alone.out).at("devices").empty());

    const fs::path installed = "/etc/OpenCL/vendors";
    REQUIRE(fs::is_directory(installed));
    for (const fs::directory_entry& entry : fs::directory_iterator(installed))
        fs::copy(entry.path(), folder.path() / entry.path().filename());
    const ProcessResult beside = run_castor(command, "", changes);
    CHECK_RESULT(beside, 4, "aborting.icd cannot be asked for its devices: the process was ended by SIGABRT");
    const Json document = Json::parse(beside.out);
    CHECK(document.at("problems").size() == 1);
    REQUIRE(document.at("devices").size() >= 1);
    CHECK(document.at("devices").at(0).at("verdict") == "trusted");
}

TEST_CASE("the doctor refuses what it cannot do, keeps nothing in a dry run, and is stopped by Ctrl-C",
          "[cli][doctor]") {
    const Clinic clinic;
    CHECK_RESULT(run_castor({"doctor", "--device", "quantum"}, "", clinic.environment()), 2,
                 "no device matches \"quantum\"; there are:");
    CHECK_RESULT(run_castor({"doctor", "--device", "0/2"}), 2, "names parts of devices");
    CHECK_RESULT(run_castor({"doctor", "--seconds", "-1"}), 2, "--seconds");
    CHECK_RESULT(run_castor({"doctor", "--dry-run", "--parts", "driver", "--seconds", "0", "--device",
                             device_under_test().empty() ? "0" : device_under_test()},
                            "", clinic.environment()),
                 0, "driver: exact arithmetic");
    CHECK_FALSE(fs::exists(clinic.path() / "state"));
    std::ofstream(clinic.path() / "state") << "in the way";
    CHECK_RESULT(run_castor({"doctor"}, "", clinic.environment()), 5, "state");
    fs::remove(clinic.path() / "state");

    const fs::path messages = clinic.path() / "err";
    const int errors = ::open(messages.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const pid_t process =
        castor::test::start_process({CASTOR_CLI, "doctor", "--seconds", "600"}, errors, errors, clinic.environment());
    ::close(errors);
    for (int tries = 0; tries < 1200 && file_contents(messages).find("exact arithmetic") == std::string::npos; ++tries)
        ::usleep(50000);
    ::kill(process, SIGINT);
    CHECK(castor::test::wait_for(process) == 130);
    INFO(file_contents(messages));
    CHECK(file_contents(messages).find("interrupted: what was known") != std::string::npos);
    CHECK(fs::is_empty(clinic.path() / "state" / "doctor"));
}

#endif
