#pragma once

#include <filesystem>

#include "base/progress.h"
#include "trace/scene_contents.h"

namespace castor {

/// Writes the columns, each a section (see section_file.h), and beside them the section "settings" with all else.
/// Throws FileError; an old file is then as it was.
void save_scene(const std::filesystem::path& file, const SceneContents& contents, const Progress& progress = {});

/// Maps what save_scene wrote: the columns stand in the file. Checks every byte (SectionFile) and every value that is
/// relied on (check_built_scene). Throws SceneError with the reason where the file cannot be used.
SceneContents map_saved_scene(const std::filesystem::path& file, const Progress& progress = {});

}  // namespace castor
