#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "castor/device.h"

namespace castor {

/// What is done differently for one kind of device; see device_profile for the reasons.
struct DeviceProfile {
    std::string build_options;        // for every program
    std::uint32_t local_size = 64;    // of every kernel
    std::uint32_t tile_size = 128;    // pixels, edge of a render tile
    bool keeps_programs = true;       // compiled ones, in a ProgramCache
    bool stays_in_thread = false;     // the driver is used by the thread alone that used it first
    bool waits_asleep = false;        // the driver's own calls wait without taking a core
    std::vector<std::string> quirks;  // what of this is unusual, in words
};

/// All quirks of devices live here, one line of reason each.
DeviceProfile device_profile(const Device& device);

}  // namespace castor
