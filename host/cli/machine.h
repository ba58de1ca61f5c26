#pragma once

#include <string>

namespace castor::cli {

/// What measured times depend on, beside the device. "unknown" where the system does not say.
struct Machine {
    std::string cpu;
    unsigned cores = 0;  // that this process may use
    std::string os;
    std::string kernel;
};

Machine describe_machine();

}  // namespace castor::cli
