#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "trace/scene_contents.h"

namespace castor {

/// Returns all contents of a scene but its columns, as bytes: the values one after the other, in the order in which
/// scene_settings.cpp lists them. A change of that list is a change of kSectionFileVersion.
std::vector<std::byte> settings_of(const SceneContents& contents);

/// Sets what settings_of told, whatever the values are (check_built_scene looks at them). Returns why the bytes cannot
/// be such settings: they end too early or too late, or have a flag other than 0 and 1. Empty: they can.
std::string set_settings(SceneContents& contents, std::span<const std::byte> bytes);

}  // namespace castor
