#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "castor/device.h"
#include "trace/tuning.h"

namespace castor {

/// profiles/ in the folder that CASTOR_PROFILE_DIR names, or else in castor/ of $XDG_STATE_HOME or ~/.local/state: what
/// was measured on this machine outlives the process and takes a minute to find again, but is no configuration to carry
/// to other machines. Empty, for no profiles, where CASTOR_PROFILE_DIR is set and empty, or there is no home.
std::filesystem::path profile_folder();

/// Where the profile of a device stands if there is one: a file for each name and platform. Empty without a folder.
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

/// Makes the folder of the file unless it is there. Throws FileError.
void make_profile_folder(const std::filesystem::path& file);

/// Makes the folder and replaces the file, if there is one, in one step. Throws FileError; an old file is then as it
/// was.
void write_profile(const std::filesystem::path& file, const Device& device, const Tuning& tuning);

}  // namespace castor
