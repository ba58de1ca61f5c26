#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "castor/device.h"
#include "trace/tuning.h"

namespace castor {

/// Where the profile of a device stands if there is one: a file for each name and platform, in
/// device_folder("profiles"). Empty without a folder.
std::filesystem::path profile_file(const Device& device);

/// What a profile file says. Neither: there is no file.
struct StoredProfile {
    std::optional<Tuning> tuning;
    std::string problem;  // why it cannot be used
};

/// Only a whole file of this version of the format, made by this version of Castor for this device and driver, whose
/// values are all in tuning_space(device), gives a tuning. Throws nothing but bad_alloc.
StoredProfile read_profile(const std::filesystem::path& file, const Device& device);
/// The same for the text of a file.
StoredProfile parse_profile(std::string_view text, const Device& device);

/// The text of a profile file, JSON.
std::string profile_text(const Device& device, const Tuning& tuning);

/// Makes the folder and replaces the file, if there is one, in one step. Throws FileError; an old file is then as it
/// was.
void write_profile(const std::filesystem::path& file, const Device& device, const Tuning& tuning);

}  // namespace castor
