#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "castor/error.h"
#include "schedule/schedule.h"

namespace castor {

/// What a worker does: takes from the schedule until there is nothing. What it needs it must own, or share: if it
/// hangs, it is left alone in its thread.
using WorkerFunction = std::function<void(Schedule& schedule, std::size_t worker)>;

struct Deadlines {
    double seconds = 300.0;  // a worker that gives no sign for so long is dropped
    double stop_seconds =
        300.0;  // one that gives none for so long, once all is done or all are to stop, is not waited for
};

struct CrewOptions {
    Deadlines deadlines{};
    std::vector<std::string> names{};  // of the workers' devices, for messages
    /// Of each worker; none if empty. Such workers take turns in the caller's thread, without deadlines, and watch over
    /// the others meanwhile.
    std::vector<bool> in_callers_thread{};
    /// Called every 20 ms or so by the thread that runs the crew. False: all are to stop; it is then not called again.
    std::function<bool()> tick{};
    /// Called by the same thread when a worker was dropped.
    std::function<void(std::size_t worker, const DeviceError& why)> on_drop{};
    /// Called by the same thread when a worker was not waited for. There is nothing wrong with it as far as is known.
    std::function<void(std::size_t worker)> on_leave{};
};

/// Runs the workers, each in a thread of its own unless it is to stay in the caller's, until all have left. One that
/// throws a DeviceError or cl::Error is dropped, and one that gives no sign for too long; any other exception, also of
/// `tick`, stops all and is thrown again here.
void run_crew(const std::shared_ptr<Schedule>& schedule, const std::vector<WorkerFunction>& workers,
              const CrewOptions& options);

/// How many workers were left alone in their threads, and are there still: where there are any, the process is better
/// ended without waiting for drivers.
std::size_t threads_left_behind();

}  // namespace castor
