#pragma once

#include <string>

namespace castor::cli {

/// The machine's properties on which measured times depend, beside the device. "unknown" if the system does not say.
struct Machine {
    std::string cpu;
    unsigned cores = 0;  // that this process may use
    std::string os;
    std::string kernel;
};

Machine describe_machine();

}  // namespace castor::cli
