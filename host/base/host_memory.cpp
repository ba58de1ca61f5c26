#include "base/host_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace castor {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// A file of one number; none for "max".
std::optional<std::uint64_t> number_in(const fs::path& file) {
    std::uint64_t value = 0;
    if (std::ifstream stream(file); stream >> value) return value;
    return std::nullopt;
}

/// The number after a word that begins a line.
std::uint64_t number_after(const fs::path& file, std::string_view word, std::uint64_t otherwise) {
    std::ifstream stream(file);
    for (std::string first; stream >> first; stream.ignore(kUnlimited >> 1, '\n')) {
        std::uint64_t value = 0;
        if (first == word && stream >> value) return value;
    }
    return otherwise;
}

/// How the two versions of control groups call the same things.
struct GroupFiles {
    const char *limit, *usage, *droppable;
};
constexpr GroupFiles kVersion1{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"};
constexpr GroupFiles kVersion2{"memory.max", "memory.current", "inactive_file"};

std::uint64_t left_in(const fs::path& folder, const GroupFiles& files) {
    const auto limit = number_in(folder / files.limit), usage = number_in(folder / files.usage);
    if (!limit || !usage) return kUnlimited;
    const std::uint64_t droppable = number_after(folder / "memory.stat", files.droppable, 0);
    const std::uint64_t held = *usage - std::min(*usage, droppable);
    return *limit - std::min(*limit, held);
}

/// The least of the group and all above it. In a container the group's path may not be there, but its own group is then
/// at the mount.
std::uint64_t left_in_groups(const fs::path& mount, std::string group, const GroupFiles& files) {
    std::uint64_t left = left_in(mount, files);
    for (; group.size() > 1; group.resize(group.rfind('/')))
        left = std::min(left, left_in(mount / group.substr(1), files));
    return left;
}

}  // namespace

std::uint64_t available_host_memory(const fs::path& root) {
    std::uint64_t available = kUnlimited;
    const std::uint64_t kib = number_after(root / "proc/meminfo", "MemAvailable:", kUnlimited / 1024);
    available = std::min(available, kib * 1024);
    // Lines such as "4:memory:/group" (version 1) and "0::/group" (version 2).
    std::ifstream groups(root / "proc/self/cgroup");
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == line.npos || line.find('/', second) != second + 1) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1), group = line.substr(second + 1);
        if (controllers == "memory")
            available = std::min(available, left_in_groups(root / "sys/fs/cgroup/memory", group, kVersion1));
        else if (controllers.empty())
            available = std::min(available, left_in_groups(root / "sys/fs/cgroup", group, kVersion2));
    }
    return available;
}

}  // namespace castor
