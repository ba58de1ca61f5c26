#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/stopwatch.h"
#include "remote/protocol.h"
#include "remote/transport.h"

namespace castor {

/// A worker of this process that gets its orders from the manager. For one thread.
class OrderedWorker {
public:
    /// Told how much of the order is done, often. Returning false ends the work on it early.
    using OnProgress = std::function<bool(std::uint64_t done)>;

    virtual ~OrderedWorker() = default;
    virtual WorkerState state() const = 0;
    /// Does what is ordered, or a part of it. Throws DeviceError when it can work no longer.
    virtual Bytes work(std::span<const std::byte> order, const OnProgress& on_progress) = 0;
};

/// An offer to work for the manager.
struct OrderedWorkerOffer {
    bool stays_in_callers_thread = false;
    /// Makes the worker in the thread that is going to use it, and prepares it. Returns null if `is_needed`, asked
    /// meanwhile, returns false.
    std::function<std::unique_ptr<OrderedWorker>(const std::function<bool()>& is_needed)> make;
};

/// What a rank other than 0 does: introduces itself to the manager, and lets its workers do what the manager orders,
/// job after job. For one thread, which alone uses the transport.
class RankServer {
public:
    /// Rank 0 drops who is silent for `deadline_seconds`, and counts as gone itself after `manager_deadline_seconds`.
    RankServer(Transport& transport, double deadline_seconds, double manager_deadline_seconds);

    void introduce(const RankIntroduction& introduction);
    /// Takes part in the next job until it ends. Returns false if none follows. Throws DeviceError where the manager
    /// refuses this rank, or is silent.
    bool serve(const std::string& description, const std::vector<OrderedWorkerOffer>& offers);
    /// Waits for the end of all jobs, and says goodbye, unless the manager is gone.
    void finish();
    /// Returns whether the manager has told the end of all jobs.
    bool is_told_the_end() const { return is_all_ended_; }
    /// Returns whether a worker did not end with its job. The process is then better ended without waiting for drivers.
    bool has_left_workers_behind() const { return has_left_workers_behind_; }

private:
    class Mailbox;

    /// Lets a worker do what its mailbox brings until the job ends. `poll` is called often if it is set: where the
    /// worker has no thread of its own.
    static void run(const std::shared_ptr<Mailbox>& mailbox, const OrderedWorkerOffer& offer,
                    const std::function<void()>& poll);
    /// Sends what workers have to say, and takes the messages that have come. Throws where there was none for too long.
    void poll();
    void take(const Message& message);
    bool is_job_over() const { return is_all_ended_ || ended_jobs_ >= job_; }
    void end_workers();

    Transport& transport_;
    const double deadline_seconds_, manager_deadline_seconds_;
    Stopwatch since_sign_;          // of the manager
    std::uint32_t job_ = 0;         // the number of the job that is served, or was
    std::uint32_t ended_jobs_ = 0;  // jobs up to this one have ended
    bool is_all_ended_ = false, is_manager_gone_ = false;
    bool has_left_workers_behind_ = false;
    std::vector<std::shared_ptr<Mailbox>> mailboxes_;  // of the job's workers
};

}  // namespace castor
