#include "machine.h"

#include <sched.h>
#include <sys/utsname.h>

#include <fstream>
#include <string_view>
#include <thread>

namespace castor::cli {

namespace {

/// Returns the text after `key` and `separator` in the file's first line that begins with the key, without quotes.
std::string value_in(const char* file, std::string_view key, char separator) {
    std::ifstream input(file);
    for (std::string line; std::getline(input, line);) {
        if (!line.starts_with(key)) continue;
        const std::size_t at = line.find(separator);
        if (at == std::string::npos) continue;
        const std::size_t first = line.find_first_not_of(" \t\"", at + 1), last = line.find_last_not_of(" \t\"");
        if (first != std::string::npos && first <= last) return line.substr(first, last - first + 1);
    }
    return "unknown";
}

unsigned usable_cores() {
    cpu_set_t cores;
    if (sched_getaffinity(0, sizeof cores, &cores) == 0) return static_cast<unsigned>(CPU_COUNT(&cores));
    return std::thread::hardware_concurrency();
}

}  // namespace

Machine describe_machine() {
    Machine machine{value_in("/proc/cpuinfo", "model name", ':'), usable_cores(),
                    value_in("/etc/os-release", "PRETTY_NAME", '='), "unknown"};
    utsname name{};
    if (uname(&name) == 0) machine.kernel = std::string(name.sysname) + " " + name.release + " " + name.machine;
    return machine;
}

}  // namespace castor::cli
