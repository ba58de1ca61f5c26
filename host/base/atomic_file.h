#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "base/progress.h"

namespace castor {

/// Writes `bytes` to a temporary file beside `file`, flushes it to the disk and renames it, so that an existing file is
/// lost only to a complete one. A symbolic link stays and its target is replaced; what is not a regular file (a device,
/// a pipe) is written in place. Throws FileError with the system's reason where any step fails; nothing is left behind
/// then.
void write_file_atomically(const std::filesystem::path& file, std::span<const std::byte> bytes);
/// The same for bytes that stand in several places, one after the other. An Interrupted leaves nothing behind either.
void write_file_atomically(const std::filesystem::path& file, std::span<const std::span<const std::byte>> pieces,
                           const Progress& progress = {});

/// Throws FileError unless write_file_atomically could begin to write `file`. Leaves nothing behind. For checking
/// before long work.
void check_writable(const std::filesystem::path& file);

}  // namespace castor
