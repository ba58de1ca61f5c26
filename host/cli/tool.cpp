#include "tool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <new>
#include <sstream>
#include <vector>

#include "castor/error.h"
#include "report.h"

namespace castor::cli {

namespace {

constexpr const char* kExitStatuses = R"(Exit status:
  0    done
  1    an error that nobody foresaw: please report it
  2    wrong usage: an unknown option, word, device or file type, or a number out of range
  3    the input is wrong: the scene, a mesh, a ray file or a checkpoint
  4    the device failed, there is none, memory ran out, or answers differ that must be equal
  5    a file cannot be written
  130  interrupted; what was done by then is written)";

ExitStatus failure(ExitStatus status, const char* reason) {
    note("castor: {}", reason);
    return status;
}

/// Returns the message for wrong usage. For an unknown subcommand CLI11 itself says only that one is required.
std::string usage_message(const CLI::App* app, const CLI::Error& error) {
    std::string reason = error.what();
    const std::vector<std::string> unknown = app->remaining();
    if (error.get_name() == "RequiredError" && app->get_parent() == nullptr && !unknown.empty()) {
        reason = fmt::format("there is no subcommand \"{}\"; there are", unknown.front());
        for (const CLI::App* command : app->get_subcommands({})) reason += " " + command->get_name();
    }
    return fmt::format("castor: {}\nRun with --help for more information.\n", reason);
}

/// Opens closed standard streams on /dev/null. Otherwise a file that is opened later could take a stream's number, and
/// receive its output.
void open_standard_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", stream == STDIN_FILENO ? O_RDONLY : O_WRONLY);
}

#ifdef __linux__
/// Returns whether PoCL will have as many threads as there are processors, all of which the process may use, numbered
/// from 0 on.
bool has_a_thread_for_each_processor() {
    cpu_set_t allowed;
    const long online = ::sysconf(_SC_NPROCESSORS_ONLN);
    if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0 || CPU_COUNT(&allowed) != online) return false;
    for (long i = 0; i < online; ++i)
        if (!CPU_ISSET(static_cast<std::size_t>(i), &allowed)) return false;
    const char* const most_threads = std::getenv("POCL_MAX_PTHREAD_COUNT");
    return !most_threads || std::atol(most_threads) == online;
}
#endif

/// Lets PoCL keep each of its threads on a processor of its own, unless the user set POCL_AFFINITY. A launch takes less
/// than a millisecond, and then threads sleep. Where a virtual machine's processors are halted meanwhile, Linux often
/// wakes two threads on the same one, and moves none of them for milliseconds. To be called before the driver is
/// loaded.
void keep_threads_apart() {
#ifdef __linux__
    if (has_a_thread_for_each_processor()) ::setenv("POCL_AFFINITY", "1", 0);
#endif
}

}  // namespace

void prepare_process() {
    keep_threads_apart();
    open_standard_streams();
    // Writing beyond the limit of file sizes is then an error, as on a full disk.
    std::signal(SIGXFSZ, SIG_IGN);
}

void describe_tool(CLI::App& app, const std::string& examples) {
    app.set_version_flag("--version", app.get_name() + " " + CASTOR_VERSION);
    app.require_subcommand(1);
    app.get_formatter()->column_width(34);
    app.footer(examples + "\n" + kExitStatuses);
    app.failure_message(usage_message);
}

std::optional<ExitStatus> parse(CLI::App& app, int argc, char** argv, bool is_quiet) {
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        std::ostringstream nothing;
        const bool asked_for_text =  // --help or --version
            app.exit(error, is_quiet ? nothing : std::cout, is_quiet ? nothing : std::cerr) == 0;
        return asked_for_text ? ExitStatus::done : ExitStatus::usage;
    }
    return std::nullopt;
}

ExitStatus run(const Action& action) try { return action(); } catch (const UsageError& error) {
    return failure(ExitStatus::usage, error.what());
} catch (const SceneError& error) {
    return failure(ExitStatus::input, error.what());
} catch (const DeviceError& error) {
    return failure(ExitStatus::device, error.what());
} catch (const FileError& error) {
    return failure(ExitStatus::file, error.what());
} catch (const std::filesystem::filesystem_error& error) {
    return failure(ExitStatus::file, error.what());
} catch (const Interrupted& stopped) {
    return failure(ExitStatus::interrupted, stopped.what());
} catch (const std::bad_alloc&) {
    return failure(ExitStatus::device, "memory ran out");
} catch (const std::exception& error) {
    return failure(ExitStatus::defect, error.what());
}

}  // namespace castor::cli
