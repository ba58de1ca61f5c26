#pragma once

#include <filesystem>

#include "base/progress.h"
#include "castor/scene.h"

namespace castor {

/// Reads an STL file, ASCII or binary: one flat mesh, in which equal points are one vertex. A binary file is told by
/// its size; its header may begin with "solid", too. The file's normals are not looked at. Throws SceneError.
Mesh read_stl(const std::filesystem::path& file, const Progress& progress = {});

/// Whether so many bytes that begin so are a binary STL file: 80 bytes, a number n, and 50 bytes n times.
bool is_binary_stl(std::string_view beginning, std::uint64_t size);

}  // namespace castor
