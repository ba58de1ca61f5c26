#include "trace/profile_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "castor/error.h"
#include "opencl/quirks.h"
#include "reference/random_source.h"
#include "support/catch.h"
#include "support/child_process.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"
#include "trace/device_file.h"

using namespace castor;
using namespace castor::test;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

Device some_device(DeviceType type = DeviceType::cpu) {
    Device device;
    device.type = type;
    device.name = "cpu-fast \"AMD\" \xff";  // not UTF-8, as a driver may have it
    device.platform_name = "Some Platform";
    device.platform_version = "OpenCL 3.0";
    device.device_version = "OpenCL 3.0 x";
    device.driver_version = "1.2";
    device.infinity_and_nan = device.denormals = true;
    return device;
}

/// Of values other than the defaults wherever there is another.
Tuning odd_tuning(const Device& device) {
    const TuningSpace space = tuning_space(device);
    Tuning tuning;
    std::size_t next = 0;
    for (const auto& [kind, name] : kRayKindsOfChoice)
        tuning.strategies.*kind = space.strategies[next++ % space.strategies.size()];
    for (const TuningNumber& number : space.numbers) tuning.*number.value = number.allowed.front();
    return tuning;
}

Json document_of(const Device& device) {
    return Json::parse(profile_text(device, odd_tuning(device)));
}

std::string problem_of(const Json& document, const Device& device) {
    const StoredProfile stored = parse_profile(document.dump(), device);
    CHECK_FALSE(stored.tuning);
    return stored.problem;
}

}  // namespace

TEST_CASE("a profile that was written is read again", "[profile]") {
    const TemporaryDirectory directory;
    for (const DeviceType type : {DeviceType::cpu, DeviceType::gpu, DeviceType::accelerator}) {
        const Device device = some_device(type);
        const fs::path file = directory.path() / "made" / "when needed" / "p.json";
        for (const Tuning& tuning : {odd_tuning(device), default_tuning(device)}) {
            write_profile(file, device, tuning);
            const StoredProfile stored = read_profile(file, device);
            INFO(file_contents(file) << stored.problem);
            REQUIRE(stored.tuning);
            CHECK(*stored.tuning == tuning);
            CHECK(stored.problem.empty());
        }
    }
    CHECK(std::distance(fs::directory_iterator(directory.path() / "made" / "when needed"), {}) == 1);
}

TEST_CASE("the defaults lie within what may be tuned", "[profile]") {
    for (const DeviceType type : {DeviceType::cpu, DeviceType::gpu, DeviceType::accelerator, DeviceType::other}) {
        const Device device = some_device(type);
        CHECK(parse_profile(profile_text(device, default_tuning(device)), device).tuning == default_tuning(device));
    }
}

TEST_CASE("a CPU that runs work-items in lanes is treated as a GPU", "[profile]") {
    Device device = some_device();
    device.platform_name = "rusticl";
    CHECK(default_tuning(device).strategies == StrategyChoice::all(Strategy::simt));
    CHECK(default_tuning(device) == default_tuning(some_device(DeviceType::gpu)));
    CHECK(tuning_space(device).strategies == std::vector{Strategy::simt});
    CHECK(parse_profile(profile_text(device, default_tuning(device)), device).tuning == default_tuning(device));
}

TEST_CASE("a device that ends long loops is given short ones, and that is told", "[profile]") {
    Device device = some_device();
    device.platform_name = "rusticl";
    const std::size_t promises = broken_promises(device).size();
    device.name = "llvmpipe (LLVM 15.0.6, 256 bits)";
    CHECK(device_quirks(device).loop_turns == 65535);
    CHECK(default_tuning(device).wide_batch == 4);
    REQUIRE(broken_promises(device).size() == promises + 1);
    CHECK(broken_promises(device).back().find("ends loops after 65535 turns") != std::string::npos);
}

TEST_CASE("a profile of another device, driver, Castor or format is refused with the reason", "[profile]") {
    const Device device = some_device();
    for (std::string Device::*member : {&Device::name, &Device::driver_version, &Device::device_version,
                                        &Device::platform_name, &Device::platform_version}) {
        Device other = device;
        other.*member += "-other";
        const StoredProfile stored = parse_profile(profile_text(other, odd_tuning(other)), device);
        CHECK_FALSE(stored.tuning);
        CHECK(stored.problem.find("-other\", here it is \"") != std::string::npos);
    }
    Json document = document_of(device);
    document["version"] = 0;
    CHECK(problem_of(document, device) == "its version is 0, here it is 1");
    document = document_of(device);
    document["castor_version"] = "0.0.1";
    CHECK(problem_of(document, device).starts_with("its castor_version is \"0.0.1\", here it is \""));
    document["format"] = "picture";
    CHECK(problem_of(document, device) == "it is no castor device profile");
    CHECK(problem_of(Json::object(), device) == "it has no \"format\"");
    CHECK(problem_of(Json::array({1, 2}), device) == "it has no \"format\"");
    CHECK(problem_of(Json(), device) == "it has no \"format\"");
}

TEST_CASE("a value out of range, of another type or missing is refused by name", "[profile]") {
    const Device device = some_device();
    const Json whole = document_of(device);
    const std::vector<Json> wrongs{0,    5,    -1,      4294967296,    1e300,          64.5,
                                   "64", true, nullptr, Json::array(), Json::object(), Json::array({64})};
    for (const TuningNumber& number : tuning_space(device).numbers) {
        CAPTURE(number.name);
        for (const Json& wrong : wrongs) {
            CAPTURE(wrong.dump());
            Json document = whole;
            document[std::string(number.name)] = wrong;
            CHECK(problem_of(document, device).starts_with("its " + std::string(number.name) + " is "));
        }
        Json document = whole;
        document.erase(std::string(number.name));
        CHECK(problem_of(document, device) == "it has no \"" + std::string(number.name) + "\"");
    }
    for (const auto& [kind, name] : kRayKindsOfChoice) {
        for (const Json& wrong : std::vector<Json>{"brute", "auto", "", "Wide", 1, nullptr, Json::array({"wide"})}) {
            CAPTURE(name, wrong.dump());
            Json document = whole;
            document["strategies"][std::string(name)] = wrong;
            CHECK(problem_of(document, device).find("may be \"simt\", \"wide\", \"packet\"") != std::string::npos);
        }
    }
    Json document = whole;
    document["strategies"] = "wide";
    CHECK(problem_of(document, device) == "it has no \"closest_coherent\"");
    const Device gpu = some_device(DeviceType::gpu);
    document = document_of(gpu);
    document["strategies"]["any_coherent"] = "wide";
    CHECK(problem_of(document, gpu) == "its any_coherent is \"wide\", here it may be \"simt\"");
}

TEST_CASE("a damaged profile never gives values that nobody wrote", "[profile]") {
    const Device device = some_device();
    const std::string text = profile_text(device, odd_tuning(device));
    for (std::size_t size = 0; size + 2 < text.size(); ++size) {
        CAPTURE(size);
        const StoredProfile stored = parse_profile(text.substr(0, size), device);
        REQUIRE_FALSE(stored.tuning);
        REQUIRE_FALSE(stored.problem.empty());
    }
    RandomSource random(31);
    const TuningSpace space = tuning_space(device);
    std::size_t refused = 0;
    for (int i = 0; i < 3000; ++i) {
        std::string bad = text;
        const std::size_t at = random.below(static_cast<std::uint32_t>(bad.size()));
        bad[at] = static_cast<char>(random.below(256));
        CAPTURE(at, int(bad[at]));
        const StoredProfile stored = parse_profile(bad, device);
        REQUIRE(stored.tuning.has_value() == stored.problem.empty());
        refused += !stored.tuning;
        if (!stored.tuning) continue;
        for (const TuningNumber& number : space.numbers) {
            const std::uint32_t value = (*stored.tuning).*number.value;
            REQUIRE(std::count(number.allowed.begin(), number.allowed.end(), value) == 1);
        }
    }
    CHECK(refused > 1000);
    CHECK_FALSE(parse_profile(std::string(60000, '['), device).tuning);
    CHECK_FALSE(parse_profile("{\"format\": \"castor device profile\", \"version\": " + std::string(30000, '[') +
                                  std::string(30000, ']') + "}",
                              device)
                    .tuning);
    CHECK_FALSE(parse_profile(std::string("\0\xff\xfe", 3), device).tuning);
}

TEST_CASE("what is no readable file is a problem, and no file is none", "[profile]") {
    const TemporaryDirectory directory;
    const Device device = some_device();
    const fs::path missing = directory.path() / "missing" / "p.json";
    CHECK_FALSE(read_profile(missing, device).tuning);
    CHECK(read_profile(missing, device).problem.empty());
    CHECK(read_profile(directory.write("file", "") / "p.json", device).problem.empty());
    CHECK(read_profile(directory.path(), device).problem == "it is no regular file");
    const fs::path pipe = directory.path() / "pipe";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    CHECK(read_profile(pipe, device).problem == "it is no regular file");
    CHECK(read_profile(directory.write("empty", ""), device).problem.starts_with("it is damaged"));
    CHECK(read_profile(directory.write("long", profile_text(device, odd_tuning(device)) + std::string(1 << 20, ' ')),
                       device)
              .problem == "it has more than 1048576 bytes");
    const fs::path file = directory.write("closed", profile_text(device, odd_tuning(device)));
    fs::permissions(file, fs::perms::none);
    if (::geteuid() != 0) CHECK(read_profile(file, device).problem == "it cannot be read: Permission denied");
}

TEST_CASE("a profile that cannot be written leaves the old one", "[profile]") {
    const TemporaryDirectory directory;
    const Device device = some_device();
    CHECK_THROWS_AS(write_profile(directory.write("file", "text") / "profiles" / "p.json", device, odd_tuning(device)),
                    FileError);
    const fs::path file = directory.path() / "p.json";
    fs::create_directory(file);
    CHECK_THROWS_AS(write_profile(file, device, odd_tuning(device)), FileError);
    CHECK(fs::is_directory(file));
}

TEST_CASE("the profiles' folder and files follow the environment and the device", "[profile]") {
    const ScopedVariable home("HOME", "/home/ada");
    const ScopedVariable xdg("XDG_STATE_HOME", std::nullopt);
    const ScopedVariable own("CASTOR_PROFILE_DIR", std::nullopt);
    CHECK(device_folder("profiles") == "/home/ada/.local/state/castor/profiles");
    const ScopedVariable relative("XDG_STATE_HOME", "relative");
    CHECK(device_folder("profiles") == "/home/ada/.local/state/castor/profiles");
    const ScopedVariable absolute("XDG_STATE_HOME", "/var/state");
    CHECK(device_folder("profiles") == "/var/state/castor/profiles");

    const Device device = some_device();
    CHECK(profile_file(device).parent_path() == device_folder("profiles"));
    CHECK(profile_file(device).filename().string().starts_with("cpu-fast-amd-"));
    Device other = device;
    other.driver_version = "2";  // takes the old one's place
    CHECK(profile_file(other) == profile_file(device));
    other.platform_name = "Other Platform";
    CHECK(profile_file(other) != profile_file(device));
    other = device;
    other.name = "../../" + std::string(1000, 'x');
    CHECK(profile_file(other).parent_path() == device_folder("profiles"));
    CHECK(profile_file(other).filename().string().size() < 120);

    const ScopedVariable named("CASTOR_PROFILE_DIR", "/tmp/mine");
    CHECK(device_folder("profiles") == "/tmp/mine/profiles");
    const ScopedVariable off("CASTOR_PROFILE_DIR", "");
    CHECK(device_folder("profiles").empty());
    CHECK(profile_file(device).empty());
}

TEST_CASE("a device that cannot keep what Castor promises is told of once, whoever asks", "[profile]") {
    const ScopedVariable off("CASTOR_PROFILE_DIR", "");
    Device flushes = some_device(), odd = some_device();
    flushes.denormals = false;
    odd.denormals = odd.infinity_and_nan = false;
    const auto texts = [](const std::vector<Device>& devices, Strategy wanted) {
        std::string all;
        for (const Warning& warning : warnings_of(choose_tunings(wanted, devices, true))) {
            CHECK(warning.file.empty());
            all += warning.text + "\n";
        }
        return all;
    };
    const std::string name = some_device().name;
    const std::string of_denormals =
        name + " takes numbers below 1.2e-38 for 0: answers that depend on one may differ from other devices' bits\n";
    const std::string of_infinities =
        name +
        " reports no infinities and NaN, by which Castor tells misses and empty boxes: its answers may be wrong\n";
    CHECK(texts({some_device()}, Strategy::automatic).empty());
    CHECK(texts({flushes, flushes}, Strategy::simt) == of_denormals);
    CHECK(texts({some_device(), odd, flushes}, Strategy::automatic) == of_infinities + of_denormals);
}

TEST_CASE("the tuning in use is the stored one unless it is wrong, or switched off", "[profile]") {
    const TemporaryDirectory directory;
    const ScopedVariable folder("CASTOR_PROFILE_DIR", directory.path().string());
    const Device device = some_device();
    CHECK(tuning_in_use(device).tuning == default_tuning(device));
    CHECK(tuning_in_use(device).profile_file.empty());
    CHECK(tuning_in_use(device).warnings.empty());

    const fs::path file = profile_file(device);
    write_profile(file, device, odd_tuning(device));
    CHECK(tuning_in_use(device).tuning == odd_tuning(device));
    CHECK(tuning_in_use(device).profile_file == file);
    CHECK(tuning_in_use(device, false).tuning == default_tuning(device));
    CHECK(choose_tunings(Strategy::wide, {device}, true).at(0).tuning.strategies ==
          StrategyChoice::all(Strategy::wide));
    CHECK(choose_tunings(Strategy::wide, {device}, true).at(0).tuning.wide_lanes == odd_tuning(device).wide_lanes);

    Device updated = device;
    updated.driver_version = "1.3";
    const std::vector<TuningInUse> two = choose_tunings(Strategy::automatic, {updated, updated}, true);
    CHECK(two.at(1).tuning == default_tuning(device));
    CHECK(two.at(1).profile_file.empty());
    const std::vector<Warning> warnings = warnings_of(two);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].file == file.string());
    CHECK(warnings[0].text ==
          "this device profile is ignored: its driver_version is \"1.2\", here it is \"1.3\"; \"castor tune\" makes a "
          "new one");
    CHECK(tuning_in_use(updated, false).warnings.empty());
}
