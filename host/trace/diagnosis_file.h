#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/device.h"
#include "castor/tracer.h"

namespace castor {

/// Something that a device does wrong.
struct Fault {
    std::optional<Strategy> strategy;  // that fails; empty: the device as a whole
    std::string reason;                // what was found, what was expected, and the input

    bool operator==(const Fault&) const = default;
};

/// What `castor doctor` found out about a device with its driver.
struct Diagnosis {
    std::vector<Fault> faults;

    /// Whether anything but single strategies fails.
    bool device_fails() const;
    bool quarantines(Strategy strategy) const;
    /// The strategies that are quarantined, each once.
    std::vector<Strategy> quarantined() const;

    bool operator==(const Diagnosis&) const = default;
};

/// "trusted", "trusted except wide, packet" or "not usable".
std::string verdict(const Diagnosis& diagnosis);

/// Where the diagnosis of a device stands if there is one: a file for each name and version of device, driver and
/// platform, in device_folder("doctor"). Empty without a folder.
std::filesystem::path diagnosis_file(const Device& device);

/// What a diagnosis file says. Neither: the doctor has not looked at this device with this driver and this Castor.
struct StoredDiagnosis {
    std::optional<Diagnosis> diagnosis;
    std::string problem;  // why it cannot be read
};

/// A file made by another version of Castor counts as none. Throws nothing but bad_alloc.
StoredDiagnosis read_diagnosis(const std::filesystem::path& file, const Device& device);

/// Makes the folder and replaces the file, if there is one, in one step. Throws FileError; an old file is then as it
/// was.
void write_diagnosis(const std::filesystem::path& file, const Device& device, const Diagnosis& diagnosis);

}  // namespace castor
