#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "castor/device.h"
#include "castor/tuner.h"
#include "trace/tuning.h"

namespace castor {

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

}  // namespace castor
