#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "castor/error.h"
#include "remote/protocol.h"
#include "remote/transport.h"
#include "schedule/crew.h"
#include "schedule/schedule.h"

namespace castor {

/// What remote workers do for a job, as the job sees it: a render, or a batch of rays. Workers are named by their
/// number in the Schedule. Called by the thread that calls Manager::serve.
class RemoteJob {
public:
    enum class Answer { go_on, give_back, abandon };

    virtual ~RemoteJob() = default;
    /// Returns all that answers depend on, a line each, as each rank must describe its job too.
    virtual const std::string& description() const = 0;
    /// Returns whether a worker is to get pieces of this job.
    virtual bool takes_part(std::size_t /*worker*/) const { return true; }
    /// The worker is ready for its first piece.
    virtual void ready(std::size_t worker, const WorkerState& state) = 0;
    /// Returns the order for a piece that the Schedule has given to the worker; nullopt: the piece is done already, or
    /// without a schedule: there is nothing to do now.
    virtual std::optional<Bytes> begin(std::size_t worker, const Range& piece) = 0;
    /// Told how much of the order is done, as a sign of life.
    virtual Answer progress(std::size_t worker, std::uint64_t done) = 0;
    /// Takes what the worker gives back. Returns the next order if its piece is to be gone on with. Throws DeviceError
    /// where the bytes are wrong.
    virtual std::optional<Bytes> take(std::size_t worker, std::span<const std::byte> result) = 0;
    /// The worker has no piece any more, if it had one. Not called for a worker that failed.
    virtual void end(std::size_t worker) = 0;
};

/// A worker of another process.
struct RemoteWorker {
    std::size_t rank;
    std::uint32_t number;  // among those of its rank
    std::string name;      // as its rank introduced it
    std::string host;
};

/// What rank 0 does for the workers of the other ranks: gives them pieces of a Schedule, and takes their results, job
/// after job. A rank that is lost, refused or silent is left alone from then on. For one thread; nothing waits.
class Manager {
public:
    using Clock = Schedule::Clock;

    /// `version`: what ranks must have too.
    Manager(Transport& transport, std::string version, std::function<Clock::time_point()> now = Clock::now);

    /// Waits until all ranks have introduced themselves, at most so many seconds, or until `go_on` returns false. Drops
    /// those that have not.
    void gather(double seconds, const std::function<bool()>& go_on);
    /// Takes note of introductions that have come. Returns whether all ranks have introduced themselves or are dropped.
    bool gather_now();
    std::size_t rank_count() const { return ranks_.size(); }
    /// The workers of all ranks that introduced themselves and were not refused, from then on numbered so.
    const std::vector<RemoteWorker>& workers() const { return workers_; }
    bool is_dropped(std::size_t worker) const { return places_[worker].phase == Phase::dropped; }
    /// Returns what there is to tell, once: who was refused or lost, and why.
    std::vector<std::string> take_notices() { return std::exchange(notices_, {}); }

    /// Begins a job, which must live until end_job.
    void begin_job(RemoteJob& job);
    /// From now on workers get pieces of this schedule, in which the i-th of workers() has the number first_worker + i.
    void begin_schedule(std::shared_ptr<Schedule> schedule, std::size_t first_worker);
    /// From now on workers get what the job's `begin` gives them, which is asked with an empty range for each that
    /// waits: there is no schedule. Workers are named by their number in workers().
    void begin_orders() { begin_schedule(nullptr, 0); }
    /// Gives work to those who wait for it, and takes what has come; to be called about every millisecond. Returns the
    /// workers that failed since the last call, by their numbers in the schedule.
    std::vector<WorkerFailure> serve();
    /// Nothing more is given to a worker, nor taken from it: it failed, or is silent.
    void drop_worker(std::size_t worker);
    void end_job();
    /// Tells all ranks that the next job has no work.
    void skip_job();
    /// Tells all ranks that nothing follows, and waits at most so many seconds until they have understood. Returns
    /// whether all ranks that there ever were have.
    bool end(double seconds);

private:
    enum class Phase { absent, idle, busy, dropped };
    struct WorkerPlace {
        Phase phase = Phase::absent;
        WorkerState state;
        std::uint32_t piece = 0;  // the number of its last order
        bool is_asked = false;    // to give the piece back
        bool is_abandoned = false;
        bool has_left = false;  // the schedule
    };
    struct Rank {
        std::string host;
        std::vector<std::size_t> workers;  // numbers in workers_
        bool is_known = false;             // has introduced itself
        bool is_excluded = false;          // its workers get no work
        bool is_dropped = false;           // it cannot be reached, and is not told anything
        bool said_bye = false;
    };

    std::string name_of(std::size_t rank) const;
    void number_by_rank();
    void tell_warnings();
    void take_messages();
    void take(const ReceivedMessage& received);
    void sort_out(const ReceivedMessage& received);
    void take_of_job(std::size_t rank, const Message& message);
    void introduce(std::size_t rank, const RankIntroduction& introduction);
    void join(std::size_t rank, const std::string& description);
    void refuse(std::size_t rank, const std::string& reason);
    void exclude(std::size_t rank, const std::string& reason);
    void drop(std::size_t rank, const std::string& reason);
    void fail(std::size_t worker, const DeviceError& why);
    void take_result(std::size_t worker, const Message& message);
    void tell_ready(std::size_t worker);
    void begin(std::size_t worker, const Range& piece);
    void order(std::size_t worker, Bytes payload);
    void send(std::size_t worker, MessageKind kind, Bytes payload = {});
    void give_work();
    void give_orders();
    void leave(std::size_t worker);
    void end_work();
    void ping();

    Transport& transport_;
    const std::string version_;
    const std::function<Clock::time_point()> now_;
    std::vector<Rank> ranks_;
    std::vector<RemoteWorker> workers_;
    std::vector<WorkerPlace> places_;  // as workers_
    std::vector<std::string> notices_;
    std::map<std::string, std::vector<std::string>> hosts_of_warnings_;  // of introductions, until gather() tells them
    Clock::time_point last_ping_{};

    // Of the job that there is.
    std::uint32_t job_number_ = 0;
    RemoteJob* job_ = nullptr;
    std::vector<std::size_t> idle_;  // workers that wait for a piece
    std::vector<WorkerFailure> failures_;

    std::vector<ReceivedMessage> early_;  // of a job that has not begun here
    std::shared_ptr<Schedule> schedule_;
    std::size_t first_worker_ = 0;
};

/// Lets the manager's workers work on a job for as long as this lives.
class RemoteTurn {
public:
    RemoteTurn(Manager& manager, RemoteJob& job) : manager_(manager) { manager_.begin_job(job); }
    ~RemoteTurn() { manager_.end_job(); }
    RemoteTurn(const RemoteTurn&) = delete;
    RemoteTurn& operator=(const RemoteTurn&) = delete;

private:
    Manager& manager_;
};

}  // namespace castor
