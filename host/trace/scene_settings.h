#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "trace/scene_contents.h"

namespace castor {

/// All of a contents scene but its columns, as bytes: the values one after the other, in the order in which
/// scene_settings.cpp lists them. A change of that list is a change of kSectionFileVersion.
std::vector<std::byte> settings_of(const SceneContents& contents);

/// Sets what settings_of told. False if the bytes end too early or too late.
bool set_settings(SceneContents& contents, std::span<const std::byte> bytes);

}  // namespace castor
