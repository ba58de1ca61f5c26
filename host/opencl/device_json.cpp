#include "opencl/device_json.h"

namespace castor {

Json json_of(const Device& device) {
    return {{"index", device.index},
            {"type", std::string(to_string(device.type))},
            {"name", device.name},
            {"vendor", device.vendor},
            {"platform", device.platform_name},
            {"platform_version", device.platform_version},
            {"device_version", device.device_version},
            {"driver_version", device.driver_version},
            {"opencl_c_version", device.opencl_c_version},
            {"compute_units", device.compute_units},
            {"part", device.part},
            {"part_count", device.part_count},
            {"global_memory_bytes", device.global_memory_bytes},
            {"max_allocation_bytes", device.max_allocation_bytes},
            {"unified_memory", device.unified_memory},
            {"exact_arithmetic",
             {{"infinity_and_nan", device.infinity_and_nan},
              {"fused_multiply_add", device.fused_multiply_add},
              {"correctly_rounded_divide_sqrt", device.correctly_rounded_divide_sqrt},
              {"denormals", device.denormals}}}};
}

Device device_of(const Json& document) {
    Device device;
    document.at("index").get_to(device.index);
    for (const DeviceType type : {DeviceType::cpu, DeviceType::gpu, DeviceType::accelerator, DeviceType::other})
        if (document.at("type") == std::string(to_string(type))) device.type = type;
    document.at("name").get_to(device.name);
    document.at("vendor").get_to(device.vendor);
    document.at("platform").get_to(device.platform_name);
    document.at("platform_version").get_to(device.platform_version);
    document.at("device_version").get_to(device.device_version);
    document.at("driver_version").get_to(device.driver_version);
    document.at("opencl_c_version").get_to(device.opencl_c_version);
    document.at("compute_units").get_to(device.compute_units);
    document.at("global_memory_bytes").get_to(device.global_memory_bytes);
    document.at("max_allocation_bytes").get_to(device.max_allocation_bytes);
    document.at("unified_memory").get_to(device.unified_memory);
    const Json& arithmetic = document.at("exact_arithmetic");
    arithmetic.at("infinity_and_nan").get_to(device.infinity_and_nan);
    arithmetic.at("fused_multiply_add").get_to(device.fused_multiply_add);
    arithmetic.at("correctly_rounded_divide_sqrt").get_to(device.correctly_rounded_divide_sqrt);
    arithmetic.at("denormals").get_to(device.denormals);
    return device;
}

}  // namespace castor
