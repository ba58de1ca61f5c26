#pragma once

#include <CL/cl.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "castor/api.h"

namespace castor {

enum class DeviceType { cpu, gpu, accelerator, other };

/// An OpenCL device as its driver describes it, or an equal part of one. `id` stays valid as long as the process lives.
struct Device {
    std::size_t index = 0;  // position in list_devices()
    DeviceType type = DeviceType::other;
    std::string name;
    std::string vendor;
    std::string platform_name;
    std::string platform_version;
    std::string device_version;
    std::string driver_version;
    std::string opencl_c_version;
    std::uint32_t compute_units = 0;
    std::uint32_t part = 1, part_count = 1;  // of a device that was split: which part, from 1 on, of how many
    std::string host;  // of a device among those of several computers: the name of its own; empty: this computer
    std::uint64_t global_memory_bytes = 0;
    std::uint64_t max_allocation_bytes = 0;
    bool unified_memory = false;  // shares the host's memory
    // Exact-arithmetic abilities. Castor needs infinities, NaN and round-to-nearest; the rest it can do without.
    bool correctly_rounded_divide_sqrt = false;
    bool fused_multiply_add = false;  // in hardware
    bool denormals = false;
    bool infinity_and_nan = false;
    cl_platform_id platform = nullptr;
    cl_device_id id = nullptr;
};

/// Returns all devices of all platforms, in the loader's order; none if there is none. A platform or device whose
/// driver cannot be asked is skipped; `problems`, if not null, receives a sentence about each. Throws DeviceError if
/// OpenCL cannot even list its platforms. Usable from several threads, also by a process that has used no OpenCL yet.
CASTOR_API std::vector<Device> list_devices(std::vector<std::string>* problems = nullptr);

/// Returns the devices that a comma-separated list names: "all", "cpu", "gpu", "accelerator", an index of
/// list_devices(), or a part of a name (any case). "/N" after one of these splits each such device into N parts, whose
/// numbers of compute units differ by one at most, and which then are devices of their own. Each device comes once, in
/// the order of the list; an empty selection means the first GPU, else the first device. Throws DeviceError if there is
/// no OpenCL device at all (naming what to install, or what is wrong with the drivers) or a driver does not split a
/// device, UsageError if a part of the selection names none (listing the devices) or asks for more parts than there are
/// compute units.
CASTOR_API std::vector<Device> select_devices(std::string_view selection = "");

/// Selects among these devices. Those that are to be split need their `id`.
CASTOR_API std::vector<Device> select_devices(const std::vector<Device>& devices, std::string_view selection);

/// Returns the device's name, which part of the device this is, and before them the host if it has one: "host: name".
CASTOR_API std::string label(const Device& device);

/// Returns "cpu", "gpu", "accelerator" or "other".
CASTOR_API std::string_view to_string(DeviceType type);

}  // namespace castor
