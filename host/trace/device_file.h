#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

#include "castor/device.h"

namespace castor {

/// Keys stay in the order in which they are set.
using DeviceJson = nlohmann::ordered_json;

/// A file that cannot be used; what() says why, as the end of "it is ignored: ...".
struct DeviceFileProblem : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// NAME/ in the folder that CASTOR_PROFILE_DIR names, or else in castor/ of $XDG_STATE_HOME or ~/.local/state: what was
/// found out about devices on this machine outlives the process and takes time to find again, but is no configuration
/// to carry to other machines. Empty, for none, where CASTOR_PROFILE_DIR is set and empty, or there is no home.
std::filesystem::path device_folder(std::string_view name);

/// A file name for a device: readable, and different for different `names`, which make up the device's identity.
std::string device_file_name(const Device& device, std::string_view names);

/// The names and versions of device, driver and platform, in UTF-8.
DeviceJson device_identity(const Device& device);

/// What a document of this format begins with: its format, the format's and Castor's versions, and the device.
DeviceJson device_document(std::string_view format, int format_version, const Device& device);

/// Throws DeviceFileProblem unless the document begins so for this device.
void check_device_document(const DeviceJson& document, std::string_view format, int format_version,
                           const Device& device);

/// The member of an object. Throws DeviceFileProblem if there is none.
const DeviceJson& member(const DeviceJson& object, const std::string& name);

/// A value, for a message: short, whatever it is.
std::string shown(const DeviceJson& value);

/// Parses, so that what is no JSON is a DeviceFileProblem.
DeviceJson parse_device_document(std::string_view text);

/// The text of the file; empty if there is none. Throws DeviceFileProblem where it is no readable regular file of a
/// sensible size.
std::string read_device_file(const std::filesystem::path& file);

/// Makes the folder of the file unless it is there. Throws FileError.
void make_device_folder(const std::filesystem::path& file);

/// Makes the folder and replaces the file, if there is one, in one step. Throws FileError; an old file is then as it
/// was.
void write_device_file(const std::filesystem::path& file, std::string_view text);

}  // namespace castor
