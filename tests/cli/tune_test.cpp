// `castor tune`: it keeps what is right and fast, and what it keeps can do no harm.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "castor/device.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

using castor::test::device_under_test;
using castor::test::file_contents;
using castor::test::ProcessResult;
using castor::test::run_castor;
using castor::test::TemporaryDirectory;
using Json = nlohmann::json;

namespace {

namespace fs = std::filesystem;

/// A home of its own, where profiles lie as the XDG rules have it.
class Home {
public:
    castor::test::Environment environment() const {
        // An empty CASTOR_PROFILE_DIR would switch profiles off, which the tests' program does for itself.
        return {{"CASTOR_PROFILE_DIR", (folder_.path() / "state").string()}};
    }
    ProcessResult tune(std::vector<std::string> arguments) const {
        if (std::find(arguments.begin(), arguments.end(), "--size") == arguments.end())
            arguments.insert(arguments.end(), {"--size", "8"});
        arguments.insert(arguments.begin(), {"tune", "scan:300", "--device", device_under_test()});
        return run_castor(arguments, "", environment());
    }
    /// What `castor devices --json` says of the device under test.
    Json device() const {
        const ProcessResult result = run_castor({"devices", "--json"}, "", environment());
        INFO(result.err);
        REQUIRE(result.status == 0);
        const std::size_t index = castor::select_devices(device_under_test()).at(0).index;
        return Json::parse(result.out).at("devices").at(index);
    }
    /// The one profile.
    fs::path file() const {
        REQUIRE(fs::is_directory(folder_.path() / "state" / "profiles"));
        std::vector<fs::path> files;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder_.path() / "state" / "profiles"))
            files.push_back(entry.path());
        REQUIRE(files.size() == 1);
        return files[0];
    }
    void overwrite(const std::string& text) const { std::ofstream(file(), std::ios::binary) << text; }
    const fs::path& path() const { return folder_.path(); }

private:
    TemporaryDirectory folder_;
};

/// A kernel whose answers are a bit off takes the place of the true one; returns what makes the tool use it.
castor::test::Environment break_kernel(const TemporaryDirectory& folder, const std::string& name) {
    std::string source = file_contents(std::string(CASTOR_SOURCE_DIR) + "/kernels/" + name);
    const std::size_t end = source.rfind('}');
    REQUIRE(end != std::string::npos);
    source.insert(end, "    hits[params.first_ray + get_global_id(0)].instance ^= 2u;\n");
    fs::create_directories(folder.path() / "kernels");
    folder.write("kernels/" + name, source);
    return {{"CASTOR_KERNEL_DIR", folder.path().string()}};
}

bool is_cpu() {
    return castor::select_devices(device_under_test()).at(0).type == castor::DeviceType::cpu;
}

}  // namespace

TEST_CASE("what tune keeps is in use afterwards", "[cli][tune]") {
    const Home home;
    CHECK(home.device().at("profile").at("file").is_null());
    CHECK(home.device().at("quirks").is_array());

    const ProcessResult tuned = home.tune({"--seconds", "2", "--json"});
    INFO(tuned.err);
    REQUIRE(tuned.status == 0);
    const Json document = Json::parse(tuned.out).at("devices").at(0);
    CHECK(document.at("written") == true);
    CHECK(document.at("file") == home.file().string());
    CHECK(document.at("checked_rays") > 0);
    CHECK(document.at("checked_against_brute_force") > 0);
    for (const Json& trial : document.at("trials")) {
        CAPTURE(trial.dump());
        CHECK((trial.at("outcome") == "taken" || trial.at("outcome") == "no faster"));
        CHECK(trial.at("time") > 0.0);
    }
    Json in_use = home.device().at("profile");
    CHECK(in_use.at("file") == home.file().string());
    CHECK(in_use.at("warnings").empty());
    for (const auto& [name, value] : document.at("profile").items()) CHECK(in_use.at(name) == value);
    const Json stored = Json::parse(file_contents(home.file()));
    CHECK(stored.at("device").at("driver_version") == home.device().at("driver_version"));

    // People are told the same.
    const ProcessResult text = run_castor({"devices"}, "", home.environment());
    CHECK(text.out.find(home.file().string()) != std::string::npos);
    CHECK(text.out.find("quirks") != std::string::npos);

    // A value that somebody wrote into it is in use too, and --no-profile leaves it out.
    Json changed = stored;
    changed["local_size"] = 32;
    home.overwrite(changed.dump());
    CHECK(home.device().at("profile").at("local_size") == 32);
    const std::string mesh = std::string(CASTOR_SOURCE_DIR) + "/scenes/meshes/block.obj";
    home.overwrite("{");
    const std::vector<std::string> render{
        "render", mesh, "--size", "8x8", "-o", (home.path() / "p.ppm").string(), "-q", "--device", device_under_test()};
    CHECK_RESULT(run_castor(render, "", home.environment()), 0,
                 "warning: " + home.file().string() + ": this device profile is ignored: it is damaged");
    std::vector<std::string> without = render;
    without.push_back("--no-profile");
    CHECK(run_castor(without, "", home.environment()).err.empty());
    CHECK_RESULT(
        run_castor({"bench", mesh, "--size", "8", "--repeat", "1", "--rays", "random", "--device", device_under_test()},
                   "", home.environment()),
        0, "this device profile is ignored");

    // Tuning again repairs it.
    CHECK(home.tune({"--seconds", "0", "-q"}).status == 0);
    CHECK(home.device().at("profile").at("warnings").empty());
}

TEST_CASE("a profile that cannot be used is named with the reason, and the defaults are in use", "[cli][tune]") {
    const Home home;
    REQUIRE(home.tune({"--seconds", "0"}).status == 0);
    const std::string whole = file_contents(home.file());
    const Json defaults = Json::parse(whole);
    const auto expect = [&](const std::string& text, const std::string& reason) {
        home.overwrite(text);
        const ProcessResult result = run_castor({"devices"}, "", home.environment());
        CAPTURE(reason);
        CHECK_RESULT(result, 0, "warning: " + home.file().string() + ": this device profile is ignored: " + reason);
        CHECK(result.out.find("none in use: the defaults") != std::string::npos);
        const Json profile = home.device().at("profile");
        CHECK(profile.at("file").is_null());
        CHECK(profile.at("strategies") == defaults.at("strategies"));
        CHECK(profile.at("warnings").size() == 1);
    };
    expect(whole.substr(0, whole.size() / 2), "it is damaged");
    Json changed = defaults;
    changed["device"]["driver_version"] = "0.1 of yesterday";
    expect(changed.dump(), "its driver_version is \"0.1 of yesterday\", here it is \"");
    changed = defaults;
    changed["castor_version"] = "0.0.0";
    expect(changed.dump(), "its castor_version is \"0.0.0\", here it is \"");
    changed = defaults;
    changed["launch_items"] = 0;
    expect(changed.dump(), "its launch_items is 0, here it may be ");
    changed = defaults;
    changed["strategies"]["any_coherent"] = "brute";
    expect(changed.dump(), "its any_coherent is \"brute\", here it may be ");
}

TEST_CASE("a dry run keeps nothing, and a folder that refuses is told before the work", "[cli][tune]") {
    const Home home;
    const ProcessResult dry = home.tune({"--seconds", "0", "--dry-run"});
    CHECK_RESULT(dry, 0, "time ran out after 0 trials");
    CHECK(dry.out.find("the defaults are the best") != std::string::npos);
    CHECK(dry.out.find("none: --dry-run") != std::string::npos);
    CHECK_FALSE(fs::exists(home.path() / "state"));

    std::ofstream(home.path() / "state") << "in the way";
    CHECK_RESULT(home.tune({"--seconds", "0"}), 5, "state");
    fs::remove(home.path() / "state");
    fs::create_directories(home.path() / "state" / "profiles");
    fs::permissions(home.path() / "state" / "profiles", fs::perms::owner_read | fs::perms::owner_exec);
    if (::geteuid() != 0) CHECK_RESULT(home.tune({"--seconds", "0"}), 5, "Permission denied");
    fs::permissions(home.path() / "state" / "profiles", fs::perms::owner_all);

    const castor::test::Environment off{{"CASTOR_PROFILE_DIR", ""}};
    CHECK_RESULT(run_castor({"tune"}, "", off), 2, "there is no folder for profiles");
    CHECK_RESULT(home.tune({"--size", "12"}), 2, "12 is no multiple of 8");
    CHECK_RESULT(home.tune({"--seconds", "-1"}), 2, "--seconds");
    CHECK_RESULT(home.tune({"no such scene.ply"}), 3, "no such scene.ply");
}

TEST_CASE("tune takes nothing that gives wrong hits", "[cli][tune]") {
    const Home home;
    const TemporaryDirectory folder;
    // Time enough to compile the kernels on a busy machine.
    const std::vector<std::string> command{"tune",   "scan:300", "--size",           "8", "--seconds", "10",
                                           "--json", "--device", device_under_test()};
    castor::test::Environment changes = home.environment();
    const auto broken = [&](const std::string& kernel) {
        castor::test::Environment with = changes;
        for (const auto& change : break_kernel(folder, kernel)) with.push_back(change);
        return run_castor(command, "", with);
    };
    if (is_cpu()) {
        const ProcessResult result = broken("closest_hit_simt.cl");
        CHECK_RESULT(
            result, 0,
            "warning: strategies simt is not taken: scan:300, primary rays: the answer to ray 0 of 64 is wrong");
        const Json document = Json::parse(result.out).at("devices").at(0);
        CHECK(document.at("trials").at(0).at("outcome") == "wrong hits");
        CHECK(document.at("profile").at("strategies").at("closest_coherent") != "simt");
        fs::remove(home.file());
        fs::remove_all(folder.path() / "kernels");
    }
    const ProcessResult result = broken(is_cpu() ? "closest_hit_packet.cl" : "closest_hit_simt.cl");
    CHECK_RESULT(result, 4, "the defaults differ from brute force: scan:300, primary rays");
    CHECK(fs::is_empty(home.path() / "state" / "profiles"));
}

TEST_CASE("Ctrl-C leaves the old profile", "[cli][tune]") {
    const Home home;
    REQUIRE(home.tune({"--seconds", "0"}).status == 0);
    const std::string old = file_contents(home.file()) + " ";
    home.overwrite(old);
    const fs::path messages = home.path() / "err";
    const int errors = ::open(messages.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    // Large enough that it cannot be done before the signal.
    const pid_t process = castor::test::start_process(
        {CASTOR_CLI, "tune", "scan:100000", "interior:100000", "--size", "512", "--device", device_under_test()},
        errors, errors, home.environment());
    ::close(errors);
    for (int tries = 0; tries < 1200 && file_contents(messages).find("building the trees") == std::string::npos;
         ++tries)
        ::usleep(50000);
    ::kill(process, SIGINT);
    CHECK(castor::test::wait_for(process) == 130);
    INFO(file_contents(messages));
    CHECK(file_contents(messages).find("is as it was") != std::string::npos);
    CHECK(file_contents(home.file()) == old);
}

#endif
