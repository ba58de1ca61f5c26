#include "trace/device_file.h"

#include <fmt/format.h>

#include <cctype>
#include <cerrno>
#include <fstream>
#include <span>
#include <system_error>

#include "base/atomic_file.h"
#include "base/checksum.h"
#include "base/user_folder.h"
#include "castor/error.h"

namespace castor {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 1 << 20;

/// Drivers may give names that are not UTF-8, which JSON has to be; what is not is replaced.
std::string utf8(const std::string& text) {
    return DeviceJson::parse(DeviceJson(text).dump(-1, ' ', false, DeviceJson::error_handler_t::replace))
        .get<std::string>();
}

void expect(const DeviceJson& object, const std::string& name, const DeviceJson& expected) {
    const DeviceJson& found = member(object, name);
    if (found != expected)
        throw DeviceFileProblem(fmt::format("its {} is {}, here it is {}", name, shown(found), shown(expected)));
}

std::string slug(std::string_view text) {
    constexpr std::size_t kMost = 80;
    std::string result;
    for (const unsigned char c : text.substr(0, kMost)) {
        if (std::isalnum(c) && c < 128)
            result += static_cast<char>(std::tolower(c));
        else if (!result.empty() && result.back() != '-')
            result += '-';
    }
    return result;
}

}  // namespace

fs::path device_folder(std::string_view name) {
    return user_folder("CASTOR_PROFILE_DIR", "XDG_STATE_HOME", ".local/state", name);
}

std::string device_file_name(const Device& device, std::string_view names) {
    return fmt::format("{}-{:08x}.json", slug(device.name), checksum(names) >> 32);
}

DeviceJson device_identity(const Device& device) {
    return {{"name", utf8(device.name)},
            {"device_version", utf8(device.device_version)},
            {"driver_version", utf8(device.driver_version)},
            {"platform", utf8(device.platform_name)},
            {"platform_version", utf8(device.platform_version)}};
}

DeviceJson device_document(std::string_view format, int format_version, const Device& device) {
    return {{"format", format},
            {"version", format_version},
            {"castor_version", CASTOR_VERSION},
            {"device", device_identity(device)}};
}

void check_device_document(const DeviceJson& document, std::string_view format, int format_version,
                           const Device& device) {
    if (member(document, "format") != format) throw DeviceFileProblem(fmt::format("it is no {}", format));
    expect(document, "version", format_version);
    expect(document, "castor_version", CASTOR_VERSION);
    const DeviceJson identity = device_identity(device);
    for (const auto& [name, value] : identity.items()) expect(member(document, "device"), name, value);
}

const DeviceJson& member(const DeviceJson& object, const std::string& name) {
    const auto found = object.is_object() ? object.find(name) : object.end();
    if (found == object.end()) throw DeviceFileProblem(fmt::format("it has no \"{}\"", name));
    return *found;
}

std::string shown(const DeviceJson& value) {
    constexpr std::size_t kMost = 60;
    if (value.is_structured()) return fmt::format("an {}", value.type_name());
    const std::string text = value.dump(-1, ' ', true, DeviceJson::error_handler_t::replace);
    return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
}

DeviceJson parse_device_document(std::string_view text) {
    try {
        return DeviceJson::parse(text);
    } catch (const DeviceJson::exception& error) {
        throw DeviceFileProblem(fmt::format("it is damaged ({})", error.what()));
    }
}

std::string read_device_file(const fs::path& file) {
    std::error_code error;
    const fs::file_status status = fs::status(file, error);
    if (status.type() == fs::file_type::not_found) return {};
    if (status.type() == fs::file_type::none) throw DeviceFileProblem("it cannot be read: " + error.message());
    if (status.type() != fs::file_type::regular) throw DeviceFileProblem("it is no regular file");
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw DeviceFileProblem("it cannot be read: " + std::generic_category().message(errno));
    std::string text(kMostBytes + 1, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kMostBytes) throw DeviceFileProblem(fmt::format("it has more than {} bytes", kMostBytes));
    if (text.empty()) throw DeviceFileProblem("it is damaged (it is empty)");
    return text;
}

void make_device_folder(const fs::path& file) {
    try {
        fs::create_directories(file.parent_path());
    } catch (const fs::filesystem_error& error) {
        throw FileError(file.parent_path().string(), "cannot be made: " + error.code().message());
    }
}

void write_device_file(const fs::path& file, std::string_view text) {
    make_device_folder(file);
    write_file_atomically(file, std::as_bytes(std::span(text)));
}

}  // namespace castor
