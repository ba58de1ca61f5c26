// The main function of castor.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>

#include "commands.h"
#include "opencl/contexts_ahead.h"
#include "schedule/crew.h"
#include "tool.h"

namespace {

constexpr const char* kExamples = R"(Examples:
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
)";

}  // namespace

int main(int argc, char** argv) {
    castor::cli::prepare_process();
    CLI::App app(
        "Castor, an OpenCL data-parallel ray caster: a scene file in, the picture out, the same on every device.",
        "castor");
    castor::cli::Action action;
    castor::cli::add_render(app, action);
    castor::cli::add_build(app, action);
    castor::cli::add_trace(app, action);
    castor::cli::add_bench(app, action);
    castor::cli::add_tune(app, action);
    castor::cli::add_doctor(app, action);
    castor::cli::add_devices(app, action);
    castor::cli::add_merge(app, action);
    castor::cli::add_info(app, action);
    castor::cli::describe_tool(app, kExamples);
    const auto ended = castor::cli::parse(app, argc, argv);
    const auto status = static_cast<int>(ended ? *ended : castor::cli::run(action));
    // A driver that hangs would also hang the end of the process.
    if (castor::threads_left_behind() > 0 || castor::programs_being_built() > 0) {
        std::fflush(nullptr);
        std::_Exit(status);
    }
    return status;
}
