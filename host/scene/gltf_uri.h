#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace castor {

/// Decodes the %XX of a URI; nullopt where one is broken, or is a byte 0.
std::optional<std::string> percent_decoded(std::string_view text);

/// Decodes base64 (RFC 4648, section 4), with or without padding; nullopt for other characters or a wrong length.
std::optional<std::string> base64_decoded(std::string_view text);

/// Whether a path that stands in a file may be opened in the file's folder: it is relative, and no part of it leads
/// upwards.
bool stays_in_folder(std::string_view path);

}  // namespace castor
