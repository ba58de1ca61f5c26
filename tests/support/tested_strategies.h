#pragma once

#include <string>

#include "castor/tracer.h"
#include "support/kernel_fixture.h"

namespace castor::test {

/// Returns whether the driver under test can run the kernels of a strategy on all that the tests have. Oclgrind 21.10
/// takes a float16 that is passed by value for uninitialised, even a constant, and its check of uninitialised reads
/// crashes in vector code of the wide strategy (a shuffle with places that do not matter). Mesa's rusticl 22.3 takes
/// minutes to compile the packet strategy for each kind of scene: there castor doctor alone looks at it.
inline bool can_be_tested(Strategy strategy) {
    const std::string platform = test_device().platform_name;
    if (strategy == Strategy::packet) return platform != "Oclgrind" && platform != "rusticl";
    return strategy != Strategy::wide || platform != "Oclgrind";
}

}  // namespace castor::test
