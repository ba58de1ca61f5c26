#pragma once

// Runs the command line tool as a child process. CASTOR_CLI is its path, defined if the tool is built.
#include <cstdlib>
#include <string>
#include <vector>

#include "support/child_process.h"
#include "test_paths.h"

namespace castor::test {

/// Returns the argument of --device in a test: the value of CASTOR_TEST_DEVICE.
inline std::string device_under_test() {
    const char* selection = std::getenv("CASTOR_TEST_DEVICE");
    return selection ? selection : "";
}

#ifdef CASTOR_CLI
/// Runs the tool to its end, in `folder` if one is given.
inline ProcessResult run_castor(std::vector<std::string> arguments, const std::string& folder = "",
                                const Environment& changes = {}) {
    arguments.insert(arguments.begin(), CASTOR_CLI);
    return run_process(arguments, changes, folder);
}
#endif

}  // namespace castor::test

#define CHECK_RESULT(result, expected_status, expected_text)          \
    do {                                                              \
        INFO("standard error: " << (result).err);                     \
        CHECK((result).status == (expected_status));                  \
        CHECK((result).err.find(expected_text) != std::string::npos); \
    } while (false)
