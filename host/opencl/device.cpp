#include "castor/device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <mutex>
#include <utility>

#include "castor/error.h"
#include "opencl/cl.h"
#include "opencl/sub_devices.h"

namespace castor {

namespace {

DeviceType device_type(cl_device_type type) {
    if (type & CL_DEVICE_TYPE_GPU) return DeviceType::gpu;
    if (type & CL_DEVICE_TYPE_CPU) return DeviceType::cpu;
    if (type & CL_DEVICE_TYPE_ACCELERATOR) return DeviceType::accelerator;
    return DeviceType::other;
}

Device describe(const cl::Platform& platform, const cl::Device& id, std::size_t index) {
    Device device;
    device.index = index;
    device.type = device_type(id.getInfo<CL_DEVICE_TYPE>());
    device.name = id.getInfo<CL_DEVICE_NAME>();
    device.vendor = id.getInfo<CL_DEVICE_VENDOR>();
    device.platform_name = platform.getInfo<CL_PLATFORM_NAME>();
    device.platform_version = platform.getInfo<CL_PLATFORM_VERSION>();
    device.device_version = id.getInfo<CL_DEVICE_VERSION>();
    device.driver_version = id.getInfo<CL_DRIVER_VERSION>();
    device.opencl_c_version = id.getInfo<CL_DEVICE_OPENCL_C_VERSION>();
    device.compute_units = id.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
    device.global_memory_bytes = id.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    device.max_allocation_bytes = id.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
    device.unified_memory = id.getInfo<CL_DEVICE_HOST_UNIFIED_MEMORY>();
    const cl_device_fp_config floats = id.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>();
    device.correctly_rounded_divide_sqrt = floats & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT;
    device.fused_multiply_add = floats & CL_FP_FMA;
    device.denormals = floats & CL_FP_DENORM;
    device.infinity_and_nan = floats & CL_FP_INF_NAN;
    device.platform = platform();
    device.id = id();
    return device;
}

/// Returns false for a platform older than 1.2: its drivers crash where a device is retained, and Castor needs 1.2.
bool is_usable(const cl::Platform& platform) {
    const std::string version = platform.getInfo<CL_PLATFORM_VERSION>();
    return !version.starts_with("OpenCL 1.0") && !version.starts_with("OpenCL 1.1");
}

std::string lower_case(std::string_view text) {
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return std::tolower(c); });
    return result;
}

std::string_view trim(std::string_view text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
    return text;
}

bool matches(const Device& device, std::string_view word) {
    if (word == "all" || word == to_string(device.type)) return true;
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
    if (error == std::errc() && end == word.data() + word.size()) return device.index == index;
    return lower_case(device.name).find(word) != std::string::npos ||
           lower_case(device.platform_name).find(word) != std::string::npos;
}

/// Splits "WORD/N" into WORD and N; N is 1 if it is missing. Names of devices may have slashes too.
std::pair<std::string_view, std::uint32_t> split_part_count(std::string_view text) {
    const std::size_t slash = text.rfind('/');
    if (slash == std::string_view::npos) return {text, 1};
    const std::string_view number = trim(text.substr(slash + 1));
    std::uint32_t count = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), count);
    if (error != std::errc() || end != number.data() + number.size()) return {text, 1};
    if (count == 0) throw UsageError(fmt::format("\"{}\": a device cannot be split into 0 parts", text));
    return {trim(text.substr(0, slash)), count};
}

/// Returns the device itself, or its parts.
std::vector<Device> parts_of(const Device& device, std::uint32_t count) {
    if (count == 1) return {device};
    if (count > device.compute_units)
        throw UsageError(fmt::format("{} has {} compute units, and cannot be split into {} parts", device.name,
                                     device.compute_units, count));
    const std::vector<SubDevice> ids = sub_devices(device, count);
    std::vector<Device> parts;
    for (std::uint32_t i = 0; i < count; ++i) {
        Device& part = parts.emplace_back(device);
        part.id = ids[i].id;
        part.part = i + 1;
        part.part_count = count;
        part.compute_units = ids[i].compute_units;
    }
    return parts;
}

std::string listing(const std::vector<Device>& devices) {
    std::string text;
    for (const Device& device : devices)
        text +=
            fmt::format("\n  {}: {} ({}, {})", device.index, device.name, to_string(device.type), device.platform_name);
    return text;
}

std::vector<Device> default_device(const std::vector<Device>& devices) {
    const auto gpu =
        std::find_if(devices.begin(), devices.end(), [](const Device& d) { return d.type == DeviceType::gpu; });
    return {gpu != devices.end() ? *gpu : devices.front()};
}

}  // namespace

std::vector<Device> list_devices(std::vector<std::string>* problems) {
    // The first call of a process loads the drivers. A second thread that asks the loader meanwhile (ocl-icd 2.3.1) is
    // told that there is no platform, or crashes.
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    std::vector<cl::Platform> platforms;
    try {
        cl::Platform::get(&platforms);
    } catch (const cl::Error& error) {
        if (error.err() == CL_PLATFORM_NOT_FOUND_KHR) return {};
        throw DeviceError("", error.what(), error.err(), "the OpenCL platforms cannot be listed");
    }
    std::vector<Device> devices;
    for (std::size_t i = 0; i < platforms.size(); ++i) {
        std::string name = fmt::format("OpenCL platform {}", i);
        const auto note = [&](const cl::Error& error, const char* consequence) {
            if (problems)
                problems->push_back(
                    DeviceError(name, error.what() ? error.what() : "", error.err(), consequence).what());
        };
        try {
            name = platforms[i].getInfo<CL_PLATFORM_NAME>();
            if (!is_usable(platforms[i])) continue;
            std::vector<cl::Device> ids;
            platforms[i].getDevices(CL_DEVICE_TYPE_ALL, &ids);
            for (const cl::Device& id : ids) {
                try {
                    devices.push_back(describe(platforms[i], id, devices.size()));
                } catch (const cl::Error& error) {
                    note(error, "one of the platform's devices is skipped");
                }
            }
        } catch (const cl::Error& error) {
            if (error.err() != CL_DEVICE_NOT_FOUND) note(error, "the platform is skipped");
        }
    }
    return devices;
}

std::vector<Device> select_devices(std::string_view selection) {
    std::vector<std::string> problems;
    const std::vector<Device> devices = list_devices(&problems);
    if (devices.empty() && !problems.empty())
        throw DeviceError("", "", 0, fmt::format("no OpenCL device can be used: {}", fmt::join(problems, "; ")));
    return select_devices(devices, selection);
}

std::vector<Device> select_devices(const std::vector<Device>& devices, std::string_view selection) {
    if (devices.empty())
        throw DeviceError(
            "", "", 0,
            "there is no OpenCL device. Install a driver: on Debian or Ubuntu pocl-opencl-icd for any CPU, "
            "nvidia-opencl-icd, intel-opencl-icd or mesa-opencl-icd for GPUs");
    if (trim(selection).empty()) return default_device(devices);

    std::vector<Device> selected;
    for (std::size_t begin = 0; begin <= selection.size();) {
        const std::size_t end = std::min(selection.find(',', begin), selection.size());
        const auto [text, part_count] = split_part_count(trim(selection.substr(begin, end - begin)));
        const std::string word = lower_case(text);
        begin = end + 1;
        bool found = false;
        for (const Device& device : devices) {
            if (word.empty() || !matches(device, word)) continue;
            found = true;
            const bool known = std::any_of(selected.begin(), selected.end(),
                                           [&](const Device& other) { return other.index == device.index; });
            if (known) continue;
            for (const Device& part : parts_of(device, part_count)) selected.push_back(part);
        }
        if (!found) throw UsageError(fmt::format("no device matches \"{}\"; there are:{}", word, listing(devices)));
    }
    return selected;
}

std::string label(const Device& device) {
    std::string text = device.host.empty() ? device.name : fmt::format("{}: {}", device.host, device.name);
    if (device.part_count > 1) text += fmt::format(" (part {} of {})", device.part, device.part_count);
    return text;
}

std::string_view to_string(DeviceType type) {
    switch (type) {
        case DeviceType::cpu:
            return "cpu";
        case DeviceType::gpu:
            return "gpu";
        case DeviceType::accelerator:
            return "accelerator";
        case DeviceType::other:
            break;
    }
    return "other";
}

}  // namespace castor
