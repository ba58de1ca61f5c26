#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "castor/device.h"
#include "opencl/device_json.h"

namespace castor::doctor {

// What runs in child processes, since a driver may crash or hang. Each line that a child reports is a JSON object with
// one of these members; it is written before what may go wrong.
//   "device"     a device that was found, as json_of has it
//   "problem"    a platform or device that cannot be asked
//   "part"       the name of the part that begins
//   "step"       what is about to be done
//   "fault"      what is wrong, in the part that goes on
//   "remark"     what is worth knowing
//   "part_done"  the name of the part that ended

/// Reports all devices.
void list_devices_to_parent();

/// Examines the device with this index by parts of these names, in about so many seconds if they were all.
void examine_for_parent(std::size_t device_index, const std::vector<std::string>& part_names, double seconds,
                        std::uint32_t seed);

}  // namespace castor::doctor
