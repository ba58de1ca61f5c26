#pragma once

#include <algorithm>
#include <cstdlib>

#include "reference/kernel_runner.h"

namespace castor::kernels {
extern const SourceTable test_kernels;    // tests/kernels/*.cl
extern const SourceTable doctor_kernels;  // kernels/doctor/*.cl: functions that castor doctor checks too
}  // namespace castor::kernels

namespace castor::test {

/// Returns the device that CASTOR_TEST_DEVICE selects, as select_devices reads it, or the default device if it is
/// unset. Throws, and so fails the test, if there is none.
inline Device test_device() {
    const char* selection = std::getenv("CASTOR_TEST_DEVICE");
    return select_devices(selection ? selection : "").at(0);
}

/// Returns how many cases to try: `full`, or at most `small` if CASTOR_TEST_SMALL is set, as for Oclgrind, which
/// interprets kernels.
inline std::size_t test_size(std::size_t full, std::size_t small = 192) {
    return std::getenv("CASTOR_TEST_SMALL") ? std::min(full, small) : full;
}

/// A runner of the kernels in tests/kernels and kernels/doctor on the device under test.
class KernelFixture : public reference::KernelRunner {
public:
    KernelFixture() : KernelRunner(test_device(), sources()) {}

private:
    static kernels::SourceTable sources() {
        kernels::SourceTable all = kernels::test_kernels;
        all.insert(all.end(), kernels::doctor_kernels.begin(), kernels::doctor_kernels.end());
        return all;
    }
};

}  // namespace castor::test
