#include "c/handle.h"

using namespace castor;
using namespace castor::c;

namespace castor::c {

std::vector<Device> devices_of(const castor_devices* devices) {
    return devices ? devices->devices : select_devices();
}

void get_warning(const std::vector<Warning>& warnings, std::size_t i, castor_warning* warning) {
    const Warning& found = warnings[position(i, warnings.size(), "the warnings")];
    castor_warning told{};
    told.text = found.text.c_str();
    told.file = found.file.c_str();
    told.line = found.line;
    write_struct(warning, told, "warning");
}

void get_share(const std::vector<DeviceShare>& shares, std::size_t i, const ToldTexts& texts,
               castor_device_share* share) {
    const DeviceShare& found = shares[position(i, shares.size(), "the devices")];
    castor_device_share told{};
    told.device = texts.keep(found.device);
    told.failure = texts.keep(found.failure);
    told.pieces = found.tiles;
    told.samples = found.samples;
    told.rays = found.rays;
    told.retries = found.retries;
    told.left_busy = found.left_busy;
    told.busy_seconds = found.busy_seconds;
    told.setup_seconds = found.setup_seconds;
    write_struct(share, told, "share");
}

}  // namespace castor::c

castor_status castor_devices_list(castor_devices** devices) {
    return guarded([&] {
        make_handle(devices, "devices", [] {
            auto list = std::make_unique<castor_devices>();
            std::vector<std::string> problems;
            list->devices = list_devices(&problems);
            for (std::string& problem : problems) list->warnings.push_back({"", 0, std::move(problem)});
            return list.release();
        });
    });
}

castor_status castor_devices_select(const char* selection, castor_devices** devices) {
    return guarded([&] {
        make_handle(devices, "devices", [&] {
            auto selected = std::make_unique<castor_devices>();
            selected->devices = select_devices(selection ? selection : "");
            return selected.release();
        });
    });
}

void castor_devices_retain(castor_devices* devices) {
    retain(devices);
}
void castor_devices_release(castor_devices* devices) {
    release(devices);
}

castor_status castor_devices_get_count(const castor_devices* devices, size_t* count) {
    return guarded([&] { require(count, "count") = require(devices, "devices").devices.size(); });
}

castor_status castor_devices_get_info(const castor_devices* devices, size_t i, castor_device_info* info) {
    return guarded([&] {
        const std::vector<Device>& list = require(devices, "devices").devices;
        const Device& device = list[position(i, list.size(), "the devices")];
        static_assert(static_cast<int>(DeviceType::other) == CASTOR_DEVICE_TYPE_OTHER);
        castor_device_info told{};
        told.index = device.index;
        told.name = device.name.c_str();
        told.vendor = device.vendor.c_str();
        told.platform_name = device.platform_name.c_str();
        told.platform_version = device.platform_version.c_str();
        told.device_version = device.device_version.c_str();
        told.driver_version = device.driver_version.c_str();
        told.type = static_cast<castor_device_type>(device.type);
        told.compute_units = device.compute_units;
        told.part = device.part;
        told.part_count = device.part_count;
        told.global_memory_bytes = device.global_memory_bytes;
        told.max_allocation_bytes = device.max_allocation_bytes;
        told.unified_memory = device.unified_memory;
        told.correctly_rounded_divide_sqrt = device.correctly_rounded_divide_sqrt;
        told.platform = device.platform;
        told.device = device.id;
        write_struct(info, told, "info");
    });
}

castor_status castor_devices_get_warning_count(const castor_devices* devices, size_t* count) {
    return guarded([&] { require(count, "count") = require(devices, "devices").warnings.size(); });
}

castor_status castor_devices_get_warning(const castor_devices* devices, size_t i, castor_warning* warning) {
    return guarded([&] { get_warning(require(devices, "devices").warnings, i, warning); });
}
