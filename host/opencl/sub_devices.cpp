#include "opencl/sub_devices.h"

#include <map>
#include <mutex>
#include <utility>

#include "castor/error.h"

namespace castor {

std::vector<SubDevice> sub_devices(const Device& device, std::uint32_t count) {
    std::vector<SubDevice> parts(count);
    std::vector<cl_device_partition_property> properties;
    for (std::uint32_t i = 0; i < count; ++i)
        parts[i].compute_units = device.compute_units / count + (i < device.compute_units % count ? 1 : 0);
    if (device.compute_units % count == 0) {  // more drivers can do this
        properties = {CL_DEVICE_PARTITION_EQUALLY, parts[0].compute_units, 0};
    } else {
        properties = {CL_DEVICE_PARTITION_BY_COUNTS};
        for (const SubDevice& part : parts) properties.push_back(part.compute_units);
        properties.insert(properties.end(), {CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0});
    }
    static std::mutex mutex;
    static auto& made = *new std::map<std::pair<cl_device_id, std::uint32_t>, std::vector<cl_device_id>>;
    const std::lock_guard lock(mutex);
    std::vector<cl_device_id>& ids = made[{device.id, count}];
    if (ids.empty()) {
        ids.resize(count);
        const cl_int status = clCreateSubDevices(device.id, properties.data(), count, ids.data(), nullptr);
        if (status != CL_SUCCESS) {
            ids.clear();
            throw DeviceError(device.name, "clCreateSubDevices", status, "the device is not split");
        }
    }
    for (std::uint32_t i = 0; i < count; ++i) parts[i].id = ids[i];
    return parts;
}

}  // namespace castor
