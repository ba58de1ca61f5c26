#pragma once

#include <cstdint>
#include <filesystem>

#include "scene/xml_document.h"

namespace castor {

/// Returns the path of a file that the scene names relative to its own folder.
std::filesystem::path path_beside(const XmlDocument& document, std::string_view name);

/// Warns if a path leads out of the scene's folder. `naming` is the element or attribute that names the file, for the
/// message.
void warn_if_outside(XmlDocument& document, const char* where, const std::filesystem::path& file,
                     std::string_view naming);

/// Returns the size of a file; 0 if it is not known, and then the reader of the file reports the reason.
std::uintmax_t size_or_zero(const std::filesystem::path& file);

}  // namespace castor
