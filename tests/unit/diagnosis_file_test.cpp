// What castor doctor found is kept for one driver, read again, and heeded.
#include "trace/diagnosis_file.h"

#include <nlohmann/json.hpp>
#include <string>

#include "support/catch.h"
#include "support/child_process.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"
#include "trace/profile_file.h"
#include "trace/tuning.h"

using namespace castor;
using namespace castor::test;
using Json = nlohmann::ordered_json;

namespace {

Device some_device(DeviceType type = DeviceType::cpu) {
    Device device;
    device.type = type;
    device.name = "some device";
    device.platform_name = "Some Platform";
    device.platform_version = "OpenCL 3.0";
    device.device_version = "OpenCL 3.0 x";
    device.driver_version = "1.2";
    device.infinity_and_nan = device.denormals = true;
    return device;
}

Diagnosis failing(std::vector<Strategy> strategies) {
    Diagnosis diagnosis;
    for (const Strategy strategy : strategies) diagnosis.faults.push_back({strategy, "it dropped a hit\nand more"});
    return diagnosis;
}

/// A folder of its own for what is known of devices.
struct State {
    TemporaryDirectory directory;
    ScopedVariable folder{"CASTOR_PROFILE_DIR", directory.path().string()};
};

void store(const Device& device, const Diagnosis& diagnosis) {
    write_diagnosis(diagnosis_file(device), device, diagnosis);
}

}  // namespace

TEST_CASE("a diagnosis with a long reason for every check is read again", "[doctor]") {
    const State state;
    const Device device = some_device();
    Diagnosis wrong;
    for (int i = 0; i < 80; ++i) wrong.faults.push_back({Strategy::wide, std::string(100000, i % 2 ? '\n' : 'x')});
    store(device, wrong);
    const StoredDiagnosis stored = read_diagnosis(diagnosis_file(device), device);
    INFO(stored.problem);
    REQUIRE(stored.diagnosis);
    CHECK(stored.diagnosis->faults.size() == 80);
}

TEST_CASE("a diagnosis that was written is read again, for each driver its own", "[doctor]") {
    const State state;
    const Device device = some_device();
    CHECK_FALSE(read_diagnosis(diagnosis_file(device), device).diagnosis);
    CHECK(read_diagnosis(diagnosis_file(device), device).problem.empty());
    Diagnosis wrong = failing({Strategy::wide, Strategy::packet, Strategy::wide});
    wrong.faults.push_back({{}, "it said \"\xff\""});
    store(device, wrong);
    const StoredDiagnosis stored = read_diagnosis(diagnosis_file(device), device);
    INFO(stored.problem);
    REQUIRE(stored.diagnosis);
    CHECK(stored.diagnosis->faults.size() == 4);
    CHECK(stored.diagnosis->faults[0] == wrong.faults[0]);
    CHECK(stored.diagnosis->faults[3].reason == "it said \"\xEF\xBF\xBD\"");

    for (std::string Device::*member : {&Device::name, &Device::driver_version, &Device::device_version,
                                        &Device::platform_name, &Device::platform_version}) {
        Device other = device;
        other.*member += " of tomorrow";
        CHECK_FALSE(read_diagnosis(diagnosis_file(other), other).diagnosis);
        store(other, {});
        CHECK(read_diagnosis(diagnosis_file(other), other).diagnosis == Diagnosis{});
    }
    CHECK(read_diagnosis(diagnosis_file(device), device).diagnosis == stored.diagnosis);
}

TEST_CASE("verdicts name what fails", "[doctor]") {
    CHECK(verdict({}) == "trusted");
    CHECK(verdict(failing({Strategy::packet, Strategy::wide, Strategy::packet})) == "trusted except packet, wide");
    Diagnosis diagnosis = failing({Strategy::wide});
    diagnosis.faults.push_back({{}, "sums are wrong"});
    CHECK(verdict(diagnosis) == "not usable");
}

TEST_CASE("a diagnosis file that is no such is a problem, one of another Castor is none", "[doctor]") {
    const State state;
    const Device device = some_device();
    store(device, failing({Strategy::wide}));
    const std::filesystem::path file = diagnosis_file(device);
    const Json whole = Json::parse(file_contents(file));
    const auto read = [&](const std::string& text) {
        std::ofstream(file, std::ios::binary) << text;
        return read_diagnosis(file, device);
    };
    const auto problem_of = [&](const std::string& text) {
        const StoredDiagnosis stored = read(text);
        CHECK_FALSE(stored.diagnosis);
        return stored.problem;
    };
    Json changed = whole;
    changed["castor_version"] = "0.0.1";
    CHECK(problem_of(changed.dump()).empty());
    const std::string text = whole.dump();
    for (std::size_t size = 0; size < text.size(); size += 7) CHECK_FALSE(problem_of(text.substr(0, size)).empty());
    changed = whole;
    changed["faults"] = 1;
    CHECK(problem_of(changed.dump()) == "its faults are 1, not a list");
    changed = whole;
    changed["faults"][0]["strategy"] = "guess";
    CHECK(problem_of(changed.dump()) == "its strategy is \"guess\", which there is not");
    changed["faults"][0]["strategy"] = 7;
    CHECK(problem_of(changed.dump()) == "its strategy is 7, here it is a text");
    changed = whole;
    changed["faults"][0].erase("reason");
    CHECK(problem_of(changed.dump()) == "it has no \"reason\"");
    changed = whole;
    changed["device"]["driver_version"] = "9";
    CHECK(problem_of(changed.dump()) == "its driver_version is \"9\", here it is \"1.2\"");
    CHECK(problem_of("{\"format\": \"picture\"}") == "it is no castor doctor's diagnosis");
    // It is said, and nothing else happens.
    const TuningInUse in_use = tuning_in_use(device);
    REQUIRE(in_use.warnings.size() == 1);
    CHECK(in_use.warnings[0].file == file.string());
    CHECK(in_use.warnings[0].text ==
          "what \"castor doctor\" found is ignored: it is no castor doctor's diagnosis; run it again");
    CHECK(in_use.tuning == default_tuning(device));
}

TEST_CASE("quarantined strategies are replaced by ones that passed, brute force at worst", "[doctor]") {
    const State state;
    const Device cpu = some_device(), gpu = some_device(DeviceType::gpu);
    using enum Strategy;
    const auto strategies = [&](const Device& device, std::vector<Strategy> quarantined) {
        store(device, failing(quarantined));
        const TuningInUse in_use = tuning_in_use(device);
        CHECK(in_use.warnings.size() == (quarantined.empty() ? 0 : 1));
        CHECK(in_use.diagnosis->quarantined() == quarantined);
        return in_use.tuning.strategies;
    };
    CHECK(strategies(cpu, {}) == default_tuning(cpu).strategies);
    CHECK(strategies(cpu, {simt}) == default_tuning(cpu).strategies);
    CHECK(strategies(cpu, {packet}) == StrategyChoice::all(wide));
    CHECK(strategies(cpu, {wide}) == StrategyChoice::all(packet));
    CHECK(strategies(cpu, {wide, packet}) == StrategyChoice::all(simt));
    CHECK(strategies(cpu, {wide, packet, simt}) == StrategyChoice::all(brute));
    CHECK(strategies(gpu, {packet}) == StrategyChoice::all(simt));
    CHECK(strategies(gpu, {simt}) == StrategyChoice::all(brute));  // wide and packet are for CPUs
    CHECK(strategies(gpu, {simt, brute}) == StrategyChoice::all(brute));
    const Device accelerator = some_device(DeviceType::accelerator);
    CHECK(strategies(accelerator, {simt}) == StrategyChoice::all(wide));

    // A profile that was stored before does not bring one back.
    Tuning tuned = default_tuning(cpu);
    tuned.strategies = StrategyChoice::all(packet);
    write_profile(profile_file(cpu), cpu, tuned);
    CHECK(strategies(cpu, {packet}) == StrategyChoice::all(wide));
    CHECK(strategies(cpu, {}) == StrategyChoice::all(packet));
}

TEST_CASE("every use says what the doctor found, also of a strategy that was asked for", "[doctor]") {
    const State state;
    const Device device = some_device();
    store(device, failing({Strategy::packet}));
    const auto warning = [&](Strategy wanted) {
        const std::vector<Warning> warnings = warnings_of(choose_tunings(wanted, {device, device}, false));
        REQUIRE(warnings.size() == 1);
        CHECK(warnings[0].file == diagnosis_file(device).string());
        return warnings[0].text;
    };
    CHECK(
        warning(Strategy::automatic) ==
        "some device: packet is not used because of what \"castor doctor\" found wrong with this driver: it dropped a "
        "hit");
    CHECK(warning(Strategy::packet) ==
          "some device: packet is in use as asked, against what \"castor doctor\" found wrong with this driver: it "
          "dropped a hit");
    CHECK(choose_tunings(Strategy::packet, {device}, true)[0].tuning.strategies ==
          StrategyChoice::all(Strategy::packet));
    Diagnosis diagnosis = failing({Strategy::packet});
    diagnosis.faults.push_back({{}, "1 + 1 gave 3"});
    store(device, diagnosis);
    CHECK(warning(Strategy::wide)
              .starts_with("some device IS NOT TO BE TRUSTED, and its results may be wrong: 1 + 1 "
                           "gave 3. "));
    store(device, {});
    CHECK(warnings_of(choose_tunings(Strategy::automatic, {device}, true)).empty());
    CHECK(tuning_in_use(device).diagnosis == Diagnosis{});
}
