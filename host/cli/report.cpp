#include "report.h"

#include <array>
#include <cerrno>
#include <system_error>

#include "castor/error.h"

namespace castor::cli {

void add_report_options(CLI::App& command, ReportOptions& options) {
    command.add_flag("--json", options.json, "print one JSON document on standard output");
    command.add_flag("-q,--quiet", options.quiet,
                     "print no progress and no figures for people (warnings and errors stay)");
}

void print_text(std::string_view text) {
    errno = 0;
    const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
    if (!written) throw FileError("standard output", "cannot be written: " + std::generic_category().message(errno));
}

void print_json(const Json& document) {
    // Names of files need not be UTF-8; what is not is replaced.
    print_text(document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

void print_warnings(const std::vector<Warning>& warnings) {
    for (const Warning& warning : warnings) {
        std::string place = warning.file;
        if (warning.line != 0) place += fmt::format(":{}", warning.line);
        note("warning: {}{}{}", place, place.empty() ? "" : ": ", warning.text);
    }
}

std::string describe(const Device& device) {
    return fmt::format("{} ({}, {})", label(device), to_string(device.type), device.platform_name);
}

void note_shares(const std::vector<DeviceShare>& shares) {
    std::uint64_t all = 0;
    for (const DeviceShare& share : shares) all += share.rays;
    for (const DeviceShare& share : shares) {
        const double part = all > 0 ? 100.0 * static_cast<double>(share.rays) / static_cast<double>(all) : 0.0;
        const double rate = share.busy_seconds > 0.0 ? static_cast<double>(share.rays) / share.busy_seconds / 1e6 : 0.0;
        note("  {}: {:.1f} % of the rays in {} tiles, busy {:.3f} s, {:.1f} Mray/s{}{}", share.device, part, share.tiles, share.busy_seconds, rate,
             share.failure.empty() ? "" : "; dropped: ", share.failure);
    }
}

Json json_of(const std::vector<DeviceShare>& shares) {
    Json list = Json::array();
    for (const DeviceShare& share : shares)
        list.push_back({{"device", share.device},
                        {"tiles", share.tiles},
                        {"samples", share.samples},
                        {"rays", share.rays},
                        {"retries", share.retries},
                        {"left_busy", share.left_busy},
                        {"busy_seconds", share.busy_seconds},
                        {"setup_seconds", share.setup_seconds},
                        {"failure", share.failure}});
    return list;
}

std::string names_of(const std::vector<Device>& devices) {
    std::string names;
    for (const Device& device : devices) names += (names.empty() ? "" : ", ") + label(device);
    return names;
}

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

Json json_of(const std::vector<Device>& devices) {
    Json list = Json::array();
    for (const Device& device : devices) list.push_back(json_of(device));
    return list;
}

Json json_of(const std::vector<Warning>& warnings) {
    Json list = Json::array();
    for (const Warning& warning : warnings)
        list.push_back({{"file", warning.file}, {"line", warning.line}, {"text", warning.text}});
    return list;
}

Json json_of(const glm::vec3& v) {
    return Json::array({v.x, v.y, v.z});
}

std::string byte_count(std::uint64_t bytes) {
    constexpr std::array kUnits = {"bytes", "KiB", "MiB", "GiB", "TiB"};
    double value = static_cast<double>(bytes);
    std::size_t unit = 0;
    for (; value >= 1024.0 && unit + 1 < kUnits.size(); ++unit) value /= 1024.0;
    return fmt::format("{:.{}f} {}", value, unit == 0 ? 0 : 1, kUnits[unit]);
}

}  // namespace castor::cli
