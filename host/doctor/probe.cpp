#include "doctor/probe.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

#include "castor/error.h"
#include "doctor/check.h"
#include "doctor/child.h"

namespace castor::kernels {
extern const SourceTable doctor_kernels;  // kernels/doctor/*.cl
}

namespace castor::doctor {

namespace {

void report(const Json& line) {
    const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    for (std::size_t written = 0; written < text.size();) {
        const ssize_t count = ::write(kReportDescriptor, text.data() + written, text.size() - written);
        if (count <= 0) throw FileError("the doctor's pipe", "cannot be written");
        written += static_cast<std::size_t>(count);
    }
}

/// A child that crashes leaves no core, and none outlives its parent.
void become_child() {
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_CORE, &none);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
}

void run_part(const Part& part, Patient& patient, double seconds) {
    report({{"part", part.name}});
    for (const Check& check : part.checks) {
        report({{"step", check.name}});
        Rounds rounds(seconds * part.time_share / static_cast<double>(part.checks.size()));
        std::string wrong;
        try {
            wrong = check.run(patient, rounds);
        } catch (const DeviceError& error) {
            wrong = error.what();
        }
        if (!wrong.empty()) report({{"fault", fmt::format("{}: {}", check.name, wrong)}});
    }
    report({{"part_done", part.name}});
}

}  // namespace

void list_devices_to_parent() {
    become_child();
    report({{"step", "asking for platforms and devices"}});
    std::vector<std::string> problems;
    for (const Device& device : list_devices(&problems)) report({{"device", json_of(device)}});
    for (const std::string& problem : problems) report({{"problem", problem}});
}

void examine_for_parent(std::size_t device_index, const std::vector<std::string>& part_names, double seconds,
                        std::uint32_t seed) {
    become_child();
    report({{"step", "making a context"}});
    const Device device = select_devices(std::to_string(device_index)).at(0);
    reference::KernelRunner runner(device, kernels::doctor_kernels);
    Patient patient{device, runner, seed, [](const std::string& text) { report({{"remark", text}}); }};
    for (const Part& part : make_parts())
        if (std::count(part_names.begin(), part_names.end(), part.name)) run_part(part, patient, seconds);
}

}  // namespace castor::doctor
