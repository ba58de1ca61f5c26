#pragma once

#include <cstdint>
#include <filesystem>

namespace castor {

/// Bytes that this process can still get without anything being swapped out or killed: what the kernel estimates for
/// the machine (MemAvailable), and what the process's control group and those above it have left, whichever is least;
/// pages of files that can be dropped count as free. The largest number where neither is told. `root` is where /proc
/// and /sys are looked for.
std::uint64_t available_host_memory(const std::filesystem::path& root = "/");

}  // namespace castor
