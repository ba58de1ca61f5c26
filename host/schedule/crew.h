#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "castor/error.h"
#include "schedule/schedule.h"

namespace castor {

/// The work of one worker: takes pieces from the schedule until there are none. It must own or share all that it uses,
/// because a worker that hangs is left behind in its thread. It throws DeviceError for a failure that concerns this
/// worker alone.
using WorkerFunction = std::function<void(Schedule& schedule, std::size_t worker)>;

/// Limits on a worker's silence.
struct Deadlines {
    double seconds = 300.0;       // after which a worker is dropped
    double stop_seconds = 300.0;  // after which a worker is not waited for, once all work is done or is to stop
};

/// A worker that can work no longer.
struct WorkerFailure {
    std::size_t worker;
    DeviceError why;
};

struct CrewOptions {
    Deadlines deadlines{};
    std::vector<std::string> names{};  // one a worker, for messages
    /// One flag a worker; empty: all false. Such workers take turns in the caller's thread, have no deadlines, and
    /// supervise the others meanwhile.
    std::vector<bool> in_callers_thread{};
    /// Serves the workers without a function, which are not of this process: takes pieces for them, and leaves the
    /// schedule for them. Called about every millisecond by the thread that runs the crew. Returns those that failed.
    std::function<std::vector<WorkerFailure>()> serve{};
    /// Whether workers wait for what `serve` brings: while they do, their silence does not count.
    std::function<bool()> is_serve_awaited{};
    /// Called about every 20 ms by the thread that runs the crew. Returning false stops all workers; it is then not
    /// called again.
    std::function<bool()> tick{};
    /// Called by the same thread when a worker was dropped.
    std::function<void(std::size_t worker, const DeviceError& why)> on_drop{};
    /// Called by the same thread when a worker was not waited for, although no failure of it is known.
    std::function<void(std::size_t worker)> on_leave{};
};

/// Runs the workers until all have left, each in a thread of its own unless it has to stay in the caller's or has no
/// function. Drops a worker that throws DeviceError or is silent for too long; any other exception, also one of `tick`,
/// stops all workers and is thrown again here.
void run_crew(const std::shared_ptr<Schedule>& schedule, const std::vector<WorkerFunction>& workers,
              const CrewOptions& options);

/// Returns the number of workers that were left behind in their threads and still run. If there are any, the process is
/// better ended without waiting for drivers.
std::size_t threads_left_behind();

}  // namespace castor
