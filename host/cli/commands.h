#pragma once

#include <functional>

#include "exit_status.h"

namespace CLI {
class App;
}

namespace castor::cli {

/// The work of a subcommand, called after its options are read.
using Action = std::function<ExitStatus()>;

class Team;

// Each function adds one subcommand, which sets `action` when the user chooses it. `team`: the processes that work on
// the command together; null: this one alone.
void add_render(CLI::App& app, Action& action, Team* team = nullptr);
void add_build(CLI::App& app, Action& action);
void add_trace(CLI::App& app, Action& action, Team* team = nullptr);
void add_bench(CLI::App& app, Action& action);
void add_tune(CLI::App& app, Action& action);
void add_doctor(CLI::App& app, Action& action);
void add_devices(CLI::App& app, Action& action);
void add_merge(CLI::App& app, Action& action);
void add_info(CLI::App& app, Action& action);

}  // namespace castor::cli
