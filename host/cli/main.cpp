// The main function. Only this file prints errors and exits.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <initializer_list>
#include <new>
#include <string>
#include <vector>

#include "castor/error.h"
#include "commands.h"
#include "report.h"
#include "schedule/crew.h"

namespace {

using castor::cli::Action;
using castor::cli::ExitStatus;

constexpr const char* kFooter = R"(Examples:
  castor render scene.xml                   one picture a camera, named as the scene says
  castor render bunny.ply -o bunny.png      a mesh alone is a scene
  castor build lucy.ply -o lucy.castor      a file from which later renders start at once
  castor trace bunny.ply --rays r --hits h  nearest hits of a file of rays
  castor merge part1 part2 -o picture.png   the picture of parts that several computers rendered
  castor bench bunny.ply                    how many rays a second
  castor tune                               measure what is fastest on this machine, and store it
  castor doctor                             can the drivers be trusted?
  castor devices                            what --device can name
  castor info scene.xml                     what a scene holds
  castor render --help                      everything about one command

Exit status:
  0    done
  1    an error that nobody foresaw: please report it
  2    wrong usage: an unknown option, word, device or file type
  3    the input is wrong: the scene, a mesh, a ray file or a checkpoint
  4    the device failed, there is none, memory ran out, or answers differ that must be equal
  5    a file cannot be written
  130  interrupted; what was done by then is written)";

ExitStatus failure(ExitStatus status, const char* reason) {
    castor::cli::note("castor: {}", reason);
    return status;
}

ExitStatus run(const Action& action) try { return action(); } catch (const castor::UsageError& error) {
    return failure(ExitStatus::usage, error.what());
} catch (const castor::SceneError& error) {
    return failure(ExitStatus::input, error.what());
} catch (const castor::DeviceError& error) {
    return failure(ExitStatus::device, error.what());
} catch (const castor::FileError& error) {
    return failure(ExitStatus::file, error.what());
} catch (const std::filesystem::filesystem_error& error) {
    return failure(ExitStatus::file, error.what());
} catch (const castor::Interrupted& stopped) {
    return failure(ExitStatus::interrupted, stopped.what());
} catch (const std::bad_alloc&) {
    return failure(ExitStatus::device, "memory ran out");
} catch (const std::exception& error) {
    return failure(ExitStatus::defect, error.what());
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

}  // namespace

int main(int argc, char** argv) {
    open_standard_streams();
    std::signal(SIGXFSZ,
                SIG_IGN);  // writing beyond the limit of file sizes is then an error, as on a full disk
    CLI::App app(
        "Castor, an OpenCL data-parallel ray caster: a scene file in, the picture out, the same on every device.",
        "castor");
    app.set_version_flag("--version", std::string("castor ") + CASTOR_VERSION);
    app.require_subcommand(1);
    app.get_formatter()->column_width(34);
    Action action;
    castor::cli::add_render(app, action);
    castor::cli::add_build(app, action);
    castor::cli::add_trace(app, action);
    castor::cli::add_bench(app, action);
    castor::cli::add_tune(app, action);
    castor::cli::add_doctor(app, action);
    castor::cli::add_devices(app, action);
    castor::cli::add_merge(app, action);
    castor::cli::add_info(app, action);
    app.footer(kFooter);
    app.failure_message(usage_message);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const bool asked_for_text = app.exit(error) == 0;  // --help or --version
        return static_cast<int>(asked_for_text ? ExitStatus::done : ExitStatus::usage);
    }
    const ExitStatus status = run(action);
    // A driver that hangs would also hang the end of the process.
    if (castor::threads_left_behind() > 0) {
        std::fflush(nullptr);
        std::_Exit(static_cast<int>(status));
    }
    return static_cast<int>(status);
}
