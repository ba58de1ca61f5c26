#include "report.h"

#include <CLI/CLI.hpp>
#include <cerrno>
#include <system_error>

#include "castor/denoise.h"
#include "castor/error.h"
#include "render/oidn.h"

namespace castor::cli {

void add_report_options(CLI::App& command, ReportOptions& options) {
    command.add_flag("--json", options.json, "print one JSON document on standard output");
    command.add_flag("-q,--quiet", options.quiet,
                     "print no progress and no figures for people (warnings and errors stay)");
}

std::string without_control_characters(std::string text) {
    for (char& c : text)
        if ((c >= '\0' && c < ' ' && c != '\n') || c == '\x7f') c = '?';
    return text;
}

void print_text(std::string_view text) {
    errno = 0;
    const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
    if (!written) throw FileError("standard output", "cannot be written: " + std::generic_category().message(errno));
}

void print_json(const Json& document) {
    // File names need not be UTF-8; other bytes are replaced.
    print_text(document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

void print_warnings(const std::vector<Warning>& warnings) {
    for (const Warning& warning : warnings) {
        std::string place = warning.file;
        if (warning.line != 0) place += fmt::format(":{}", warning.line);
        note("warning: {}{}{}", place, place.empty() ? "" : ": ", warning.text);
    }
}

std::string name_of_denoiser(std::uint32_t oidn_version) {
    return oidn_version == 0 ? std::string(to_string(Denoiser::castor)) : name_of_oidn(oidn_version);
}

std::string note_on_denoiser(std::uint32_t oidn_version) {
    return oidn_version == 0 ? ""
                             : fmt::format(" by {} (bytes may differ between machines)", name_of_oidn(oidn_version));
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
        note("  {}: {:.1f} % of the rays in {} tiles, busy {:.3f} s, {:.1f} Mray/s{}{}", share.device, part,
             share.tiles, share.busy_seconds, rate, share.failure.empty() ? "" : "; dropped: ", share.failure);
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

void note_traffic(const Traffic& traffic) {
    note("messages: rank 0 received {} of {} together, and sent {} of {}", traffic.messages_received,
         byte_count(traffic.bytes_received), traffic.messages_sent, byte_count(traffic.bytes_sent));
}

Json json_of(const Traffic& traffic) {
    return {{"messages_received", traffic.messages_received},
            {"bytes_received", traffic.bytes_received},
            {"messages_sent", traffic.messages_sent},
            {"bytes_sent", traffic.bytes_sent}};
}

std::string names_of(const std::vector<Device>& devices) {
    std::string names;
    for (const Device& device : devices) names += (names.empty() ? "" : ", ") + label(device);
    return names;
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

}  // namespace castor::cli
