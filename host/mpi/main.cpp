// The main function of castor-mpi.
#include <mpi.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include "cli/commands.h"
#include "cli/report.h"
#include "cli/tool.h"
#include "mpi_team.h"
#include "opencl/contexts_ahead.h"
#include "schedule/crew.h"

namespace {

constexpr const char* kExamples = R"(Examples:
  mpirun -n 4 --host a,b,c,d castor-mpi render scene.xml -o picture.png
  mpirun -n 4 --host a,b,c,d castor-mpi trace scene.castor --rays rays --hits hits
  mpirun --hostfile hosts castor-mpi render city.castor --samples 4096 --checkpoint city.checkpoint -o city.exr

One process a computer is enough: it feeds all of its devices. host/cli/README.md tells what mpirun needs.
)";

/// Ends the process if MPI has not started in time. Its start waits for all processes and has no deadlines, so that one
/// that is killed meanwhile would leave the others in there for ever.
class StartDeadline {
public:
    StartDeadline() {
        std::signal(SIGALRM, [](int) {
            constexpr std::string_view kText =
                "castor-mpi: MPI has not started within 300 s: a host hangs, or is gone\n";
            [[maybe_unused]] const auto ignored = ::write(STDERR_FILENO, kText.data(), kText.size());
            ::_exit(static_cast<int>(castor::cli::ExitStatus::device));
        });
        ::alarm(300);
    }
    ~StartDeadline() {
        ::alarm(0);
        std::signal(SIGALRM, SIG_DFL);
    }
    StartDeadline(const StartDeadline&) = delete;
    StartDeadline& operator=(const StartDeadline&) = delete;
};

/// Ends the process although others of the job are gone or hang: MPI_Finalize would wait for them. The leader ends the
/// whole job with it.
[[noreturn]] void end_without_the_others(int status, bool leads) {
    constexpr unsigned kAbortSeconds = 10;
    std::fflush(nullptr);
    if (leads) {
        ::alarm(kAbortSeconds);  // which ends the process if MPI_Abort does not
        MPI_Abort(MPI_COMM_WORLD, status);
    }
    std::_Exit(status);
}

/// Ends the process when all others of the job end too.
int end_with_the_others(int status, const castor::mpi::MpiTeam& team) {
    std::fflush(nullptr);
#ifdef MPICH_VERSION
    // MPICH 4 over UCX hangs in MPI_Finalize now and then. mpiexec sometimes fails where all end at once, ends the job
    // where one ends with another status than 0, and loses the status of one that ends after others.
    if (!team.leads()) std::_Exit(0);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    if (status != 0) end_without_the_others(status, true);
    std::_Exit(0);
#endif
    MPI_Finalize();
    if (castor::threads_left_behind() > 0 || castor::programs_being_built() > 0 || team.has_left_workers_behind())
        std::_Exit(status);
    return status;
}

}  // namespace

int main(int argc, char** argv) {
    castor::cli::prepare_process();
    std::optional<StartDeadline> start_deadline(std::in_place);
    int threading = 0;
    if (MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &threading) != MPI_SUCCESS) {
        castor::cli::note("castor-mpi: MPI cannot be initialised");
        return static_cast<int>(castor::cli::ExitStatus::device);
    }
    castor::mpi::MpiTeam team;
    start_deadline.reset();
    CLI::App app(
        "Castor on several computers: castor's commands, with the same options and the same picture, by all processes "
        "that mpirun begins.",
        "castor-mpi");
    castor::cli::Action action;
    castor::cli::add_render(app, action, &team);
    castor::cli::add_trace(app, action, &team);
    castor::cli::describe_tool(app, kExamples);
    const auto ended = castor::cli::parse(app, argc, argv, !team.leads());
    if (ended) return end_with_the_others(static_cast<int>(*ended), team);  // on all ranks alike
    const auto status = static_cast<int>(castor::cli::run(action));
    if (!team.end()) end_without_the_others(status, team.leads());
    return end_with_the_others(status, team);
}
