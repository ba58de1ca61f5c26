#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/range.h"

namespace castor {

/// Divides numbered items among workers whose speeds are learnt meanwhile: large pieces first, small ones at the end,
/// so that all finish together (guided self-scheduling: Polychronopoulos, Kuck 1987). A worker without work duplicates
/// the piece of a slower one, and the first result counts: results do not depend on the worker. The piece of a dropped
/// worker returns to the queue. Usable from several threads.
class Schedule {
public:
    using Clock = std::chrono::steady_clock;

    /// Queues the ranges. A piece never spans two of them. `now`: the time, for tests another than the clock's.
    Schedule(const std::vector<Range>& work, std::size_t worker_count,
             std::function<Clock::time_point()> now = Clock::now);

    // Called by the workers, each in a thread of its own, or by a thread that serves several.

    /// Returns the worker's next piece, of at most `most_items`, or of at most `most_copied` if it duplicates the piece
    /// of a slower worker; the worker's last piece returns to the queue unless it is finished. Waits while all pieces
    /// are handed out but may come back. Returns nullopt when all work is done or the worker should leave.
    std::optional<Range> take(std::size_t worker, std::uint64_t most_items, std::uint64_t most_copied);
    /// The same without waiting: nullopt also where there is no piece for the worker now (see may_have_work).
    std::optional<Range> try_take(std::size_t worker, std::uint64_t most_items, std::uint64_t most_copied);
    std::optional<Range> take(std::size_t worker, std::uint64_t most_items) {
        return take(worker, most_items, most_items);
    }
    /// Returns whether the worker's piece is still wanted. Also a sign of life, so to be called often.
    bool is_wanted(std::size_t worker);
    /// Returns whether there may be a piece for the worker.
    bool may_have_work(std::size_t worker) const;
    /// Sets a function that take and is_wanted call, take also while it waits: for a worker whose thread supervises the
    /// others, and which therefore is never counted as silent. To be set before the worker begins.
    void set_sign_hook(std::size_t worker, std::function<void()> hook);
    /// Sets the worker's speed, whenever it is known better.
    void set_speed(std::size_t worker, double items_per_second);
    /// Marks the worker's piece as finished and calls `store`, which keeps the result, unless another worker was first
    /// or this one was dropped. Returns whether `store` was called.
    bool finish(std::size_t worker, const std::function<void()>& store);
    /// Does the same for an intermediate result: the piece is not finished.
    bool keep(std::size_t worker, const std::function<void()>& store);
    /// Tells that the worker takes no more pieces.
    void leave(std::size_t worker);

    // Called by whoever supervises the workers.

    /// Drops a worker that failed or hangs; its piece returns to the queue. Returns false, dropping nothing, if the
    /// worker is just storing.
    bool drop(std::size_t worker);
    /// Tells all workers to leave.
    void stop();
    bool is_stopped() const;
    /// Extends all deadlines by a time in which no worker could give a sign.
    void excuse(double seconds);
    /// Waits until all workers have left or were dropped, at most so many seconds. Returns whether they have.
    bool wait_for_all(double seconds);
    /// Returns the workers that have work and gave no sign for so many seconds.
    std::vector<std::size_t> silent_workers(double seconds);
    bool is_dropped(std::size_t worker) const;
    std::uint64_t items_left() const;

private:
    /// A piece that one or two workers have.
    struct Piece {
        Range range;
        Clock::time_point begin;
        double items_per_second = 0.0;  // of the worker that has it; 0: not known
        std::size_t place = 0;          // in handed_out_
        int workers = 1;
        std::mutex mutex;  // held while a result is stored; locked before the schedule's
        bool done = false;
    };
    struct Worker {
        std::shared_ptr<Piece> piece;
        double items_per_second = 0.0;  // 0: not known yet
        Clock::time_point last_sign{};
        std::function<void()> sign_hook{};
        bool idle = false;  // waits for a piece
        bool left = false;
        bool dropped = false;
    };

    std::optional<Range> piece_for(std::size_t worker, std::uint64_t most_items, std::uint64_t most_copied);
    bool store(std::size_t worker, const std::function<void()>& store, bool ends_piece);
    void let_go(Worker& worker);
    void part_with(Worker& worker);
    std::uint64_t fair_share(const Worker& worker) const;
    std::shared_ptr<Piece> piece_worth_copying(std::size_t worker, std::uint64_t most_items) const;
    void hand_out(const std::shared_ptr<Piece>& piece);
    void take_back(Piece& piece);

    const std::function<Clock::time_point()> now_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Range> queue_;
    std::uint64_t queued_items_ = 0;
    std::uint64_t items_left_ = 0;  // not finished
    std::vector<Worker> workers_;
    std::vector<std::shared_ptr<Piece>> handed_out_;  // not finished, in any order
    std::size_t alive_ = 0;                           // workers that neither left nor were dropped
    double speed_of_alive_ = 0.0;                     // items a second of all of them
    bool stopped_ = false;
};

}  // namespace castor
