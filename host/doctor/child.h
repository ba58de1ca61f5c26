#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace castor::doctor {

/// How a child process ended.
struct ChildEnd {
    enum class Kind { exited, signalled, hung, too_large, interrupted };
    Kind kind = Kind::exited;
    int code = 0;          // exit status or signal
    std::string messages;  // the last of what it printed for people

    bool succeeded() const { return kind == Kind::exited && code == 0; }
};

/// What a child process may take before it is killed.
struct ChildLimits {
    double patience_seconds = 0.0;   // without a line
    std::uint64_t memory_bytes = 0;  // resident, of the process itself; looked at ten times a second
};

/// "ended by SIGSEGV", "ended with status 1", "did not go on for 60 seconds"; and what it said last.
std::string describe(const ChildEnd& end, const ChildLimits& limits);

/// The descriptor on which a child reports, a line at a time; what it and the libraries that it loads print goes
/// elsewhere.
inline constexpr int kReportDescriptor = 3;

using Environment = std::vector<std::pair<std::string, std::string>>;

/// Runs this program once more, with these arguments and changes of the environment, and calls `on_line` for each line
/// that it reports. It is killed, with all that it started, where it goes beyond `limits`, or `go_on` returns false.
/// Throws FileError if it cannot be started.
ChildEnd run_child(const std::vector<std::string>& arguments, const Environment& changes, const ChildLimits& limits,
                   const std::function<void(const std::string&)>& on_line, const std::function<bool()>& go_on);

}  // namespace castor::doctor
