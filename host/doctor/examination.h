#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "castor/device.h"
#include "doctor/child.h"
#include "trace/diagnosis_file.h"

namespace castor::doctor {

/// How the doctor works. All calls of OpenCL are made in child processes.
struct ExaminationOptions {
    double seconds = 0.0;  // of checks for each device, beside compiling
    ChildLimits limits;    // of a step; one that goes beyond them is a fault
    std::uint32_t seed = 1;
    std::vector<std::string> parts;  // to look at; empty: all
    std::function<void(const std::string& text)> on_step;
    std::function<bool()> go_on;
};

struct FoundDevice {
    Device device;            // `index` is that in Listing::devices; `platform` and `id` are null
    std::size_t index = 0;    // where OpenCL is used as `environment` says
    Environment environment;  // changes that leave out drivers which crash
};

/// Folders with one driver's file each.
class SingleDriverFolders;

struct Listing {
    std::vector<FoundDevice> devices;
    std::vector<std::string> problems;  // of drivers that cannot even be asked for devices
    std::shared_ptr<SingleDriverFolders> folders;
};

/// Asks for all platforms' devices. Where that crashes or hangs, each driver of the loader is asked alone, and those
/// that do are named.
Listing list_patients(const ExaminationOptions& options);

struct PartOutcome {
    std::string name;
    bool passed = false;
};

struct Examination {
    Diagnosis diagnosis;
    std::vector<PartOutcome> parts;
    std::vector<std::string> remarks;
    double seconds = 0.0;
    bool finished = false;  // false: `go_on` said so; the rest is of no use
};

/// Goes through all parts. One in which the driver ends or hangs the process fails, and those after it are tried in a
/// new process.
Examination examine(const FoundDevice& patient, const ExaminationOptions& options);

}  // namespace castor::doctor
