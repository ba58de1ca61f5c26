#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace castor {

/// Decodes the %XX of a URI; nullopt where one is broken, or is a byte 0.
std::optional<std::string> percent_decoded(std::string_view text);

/// Decodes base64 (RFC 4648, section 4), with or without padding; nullopt for other characters or a wrong length.
std::optional<std::string> base64_decoded(std::string_view text);

/// Returns the file that a relative path names in a folder; nullopt where it leads out of the folder: from a root,
/// upwards, or by a symbolic link.
std::optional<std::filesystem::path> path_in_folder(const std::filesystem::path& folder, std::string_view path);

}  // namespace castor
