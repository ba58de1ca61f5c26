#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "castor/device.h"

namespace castor {

/// How Castor treats one device; see device_quirks for the reasons.
struct DeviceQuirks {
    std::string build_options;         // for every program
    std::string prelude;               // source that stands before every program, as an #include names it; empty: none
    std::uint32_t local_size = 64;     // work-items in a group, where a kernel allows as many
    std::uint32_t loop_turns = ~0u;    // that the driver gives a work-item for all of its loops together
    std::uint32_t first_launch = 0;    // work-items at least of a kernel's first launch on a queue
    std::uint32_t tile_size = 256;     // pixels, edge of a render tile
    std::uint32_t teams = 1;           // that render pieces of a picture side by side (teams.h); 1: all of the device
    std::uint32_t lanes = 16;          // of kernels that are written for any number of lanes (kernels/device/lanes.cl)
    bool is_like_gpu = false;          // work-items run side by side, and each has few resources
    bool keeps_programs = true;        // compiled programs go into a ProgramCache
    bool stays_in_thread = false;      // only the thread that used the driver first may use it
    bool waits_asleep = false;         // the driver's own calls wait without taking a core
    std::vector<std::string> remarks;  // what of this is unusual, in words
};

/// Returns what Castor promises and the device cannot keep, by what its driver reports: sentences, empty for most.
std::vector<std::string> broken_promises(const Device& device);

/// Returns the quirks of a device. All of them stand in this function, each with its reason. The environment variable
/// CASTOR_BUILD_OPTIONS adds build options to those of every device: the tests build with -Werror.
DeviceQuirks device_quirks(const Device& device);

}  // namespace castor
