#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace castor {

/// Decodes the %XX of a URI, which may be any bytes, also 0; nullopt where one is broken.
std::optional<std::string> percent_decoded(std::string_view text);

/// Decodes base64 (RFC 4648, section 4), with or without padding; nullopt for other characters or a wrong length.
std::optional<std::string> base64_decoded(std::string_view text);

/// Returns whether a URI is of the scheme `data`, in any case of its letters.
bool is_data_uri(std::string_view uri);

/// Returns the bytes after the comma of a data URI (RFC 2397), where characters of base64 may be percent codes too;
/// nullopt where they are broken.
std::optional<std::string> data_of_uri(std::string_view uri);

/// Returns the file that a relative path names in a folder; nullopt where it leads out of the folder: from a root,
/// upwards, or by a symbolic link.
std::optional<std::filesystem::path> path_in_folder(const std::filesystem::path& folder, std::string_view path);

}  // namespace castor
