#pragma once

#include <optional>
#include <string>

#include "commands.h"

namespace castor::cli {

// What all programs with these commands do alike.

/// For the begin of main: a process that is safe from closed streams and full disks, and whose drivers are set up.
void prepare_process();

/// Adds to the help what all commands have in common: `examples`, the version, and the list of exit statuses.
void describe_tool(CLI::App& app, const std::string& examples);

/// Reads the command line. Returns a status if the program is to end with it, for wrong usage or after --help; what is
/// wrong is printed unless `is_quiet`.
std::optional<ExitStatus> parse(CLI::App& app, int argc, char** argv, bool is_quiet = false);

/// Runs a command. What it throws is printed, and becomes an exit status.
ExitStatus run(const Action& action);

}  // namespace castor::cli
