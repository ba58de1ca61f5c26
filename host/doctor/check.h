#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/stopwatch.h"
#include "castor/device.h"
#include "castor/tracer.h"
#include "reference/kernel_runner.h"

namespace castor::doctor {

/// How many random cases a check tries: few at first, and no more if it has no time, then more for as long as its time
/// lasts. What is compiled in the first round takes none of the time.
class Rounds {
public:
    explicit Rounds(double seconds) : seconds_(seconds) {}

    /// The size of the next round, 0 if there is none.
    std::size_t next();
    /// Rounds begun: a part of their seeds.
    std::uint32_t number() const { return number_; }

private:
    double seconds_;
    Stopwatch watch_;
    double round_began_ = 0.0;
    std::size_t size_ = 0;
    std::uint32_t number_ = 0;
};

/// The device that is looked at.
struct Patient {
    const Device& device;
    reference::KernelRunner& runner;  // with the kernels that the checks are made of
    std::uint32_t seed;
    std::function<void(const std::string&)> remark;  // on what is worth knowing and no fault
};

/// One thing that is looked at. `run` returns what is wrong: what was found, what was expected, and the input; empty if
/// nothing is. It may throw DeviceError, which is a fault too.
struct Check {
    std::string name;
    std::function<std::string(Patient&, Rounds&)> run;
};

/// Checks that stand or fall together, in a process of their own where one before them ended theirs.
struct Part {
    std::string name;
    std::optional<Strategy> strategy;  // that they look at; empty: at the device as a whole
    double time_share;                 // of the examination
    std::vector<Check> checks;
};

/// All parts, in order.
std::vector<Part> make_parts();

std::vector<Check> driver_checks();
std::vector<Check> compiler_checks();
std::vector<Check> function_checks();
std::vector<Check> strategy_checks(Strategy strategy);

}  // namespace castor::doctor
