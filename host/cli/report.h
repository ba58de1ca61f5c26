#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "base/byte_count.h"
#include "castor/device.h"
#include "castor/device_share.h"
#include "castor/scene.h"
#include "commands.h"
#include "opencl/device_json.h"
#include "remote/transport.h"

namespace castor::cli {

/// The options that every subcommand has.
struct ReportOptions {
    bool json = false;
    bool quiet = false;
};
void add_report_options(CLI::App& command, ReportOptions& options);

/// Prints text for people on standard error. Errors are ignored: if that stream is closed or full, only this text is
/// lost.
inline void say(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stderr);
}
/// Returns a text with '?' for control characters other than the ends of lines: files may hold commands to terminals.
std::string without_control_characters(std::string text);

/// Prints a formatted line of such text, without control characters.
template <class... Arguments>
void note(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    say(without_control_characters(fmt::format(format, std::forward<Arguments>(arguments)...)) + "\n");
}

/// Print the result on standard output. Throw FileError if it cannot be written.
void print_text(std::string_view text);
void print_json(const Json& document);

/// Prints "warning: file:line: text" on standard error, even with --quiet.
void print_warnings(const std::vector<Warning>& warnings);

/// Returns what removed noise from a picture: "castor", or "Open Image Denoise 1.4.3" where there is a version.
std::string name_of_denoiser(std::uint32_t oidn_version);
/// Returns what a note on it adds: nothing of Castor's own denoiser; else its name, and that bytes may differ.
std::string note_on_denoiser(std::uint32_t oidn_version);

/// Returns "name (type, platform)".
std::string describe(const Device& device);
/// Prints a line for each device: its share of the work, and its rate while it was busy.
void note_shares(const std::vector<DeviceShare>& shares);
Json json_of(const std::vector<DeviceShare>& shares);
/// The same of what rank 0 exchanged with the other processes.
void note_traffic(const Traffic& traffic);
Json json_of(const Traffic& traffic);
std::string names_of(const std::vector<Device>& devices);

using castor::json_of;  // for a device
Json json_of(const std::vector<Device>& devices);
Json json_of(const std::vector<Warning>& warnings);
Json json_of(const glm::vec3& v);

}  // namespace castor::cli
