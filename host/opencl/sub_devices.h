#pragma once

#include <cstdint>
#include <vector>

#include "castor/device.h"
#include "opencl/cl.h"

namespace castor {

struct SubDevice {
    cl_device_id id;
    std::uint32_t compute_units;
};

/// Divides a device into `count` parts, of at most its number of compute units, that are as equal as can be. They are
/// made once for the whole process: whoever has one may keep it. Throws DeviceError if the driver does not divide it.
std::vector<SubDevice> sub_devices(const Device& device, std::uint32_t count);

}  // namespace castor
