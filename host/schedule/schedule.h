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

/// Divides numbered items among workers whose speeds are learnt as they go: large pieces first, small ones at the end,
/// so that all finish together (guided self-scheduling: Polychronopoulos, Kuck 1987). A worker that has nothing left to
/// do takes up what a slower one is at, and whoever is first counts: results do not depend on who makes them. What a
/// worker has that is dropped goes to the others. Usable from several threads.
class Schedule {
public:
    /// A piece does not reach beyond one of the ranges.
    Schedule(const std::vector<Range>& work, std::size_t worker_count);

    // For the workers, each in a thread of its own.

    /// The worker's next piece, of at most so many items, or `most_copied` where it takes up what a slower worker is
    /// at; it has let the last one go. Waits while all is handed out and might come back. Nothing: all is done, or the
    /// worker is to leave.
    std::optional<Range> take(std::size_t worker, std::uint64_t most_items, std::uint64_t most_copied);
    std::optional<Range> take(std::size_t worker, std::uint64_t most_items) {
        return take(worker, most_items, most_items);
    }
    /// Whether the worker's piece is still wanted. To be asked often: it also tells that the worker is alive.
    bool is_wanted(std::size_t worker);
    /// Called by the worker whenever it asks for a piece, also while it waits for one, and whether its piece is wanted:
    /// for a worker that watches over all, and is never silent itself. To be set before the worker begins.
    void set_sign_hook(std::size_t worker, std::function<void()> hook);
    /// What the worker can do, to be told when it is known better.
    void set_speed(std::size_t worker, double items_per_second);
    /// The piece is finished: calls `store`, which keeps what was made, unless another worker was first, or this one
    /// was dropped. Whether it was called.
    bool finish(std::size_t worker, const std::function<void()>& store);
    /// The same for a part of the work on a piece, of which more may come.
    bool keep(std::size_t worker, const std::function<void()>& store);
    /// The worker will not take any more.
    void leave(std::size_t worker);

    // For whoever watches over them.

    /// The worker failed or hangs; what it has goes to the others. False if it is just storing, and is not dropped.
    bool drop(std::size_t worker);
    /// All workers are to leave.
    void stop();
    bool is_stopped() const;
    /// Nobody could give a sign for so many seconds.
    void excuse(double seconds);
    /// Returns when all workers have left or were dropped, or after so many seconds; whether they have.
    bool wait_for_all(double seconds);
    /// Workers that have not been heard of for so many seconds though they have something to do.
    std::vector<std::size_t> silent_workers(double seconds);
    bool is_dropped(std::size_t worker) const;
    std::uint64_t items_left() const;

private:
    using Clock = std::chrono::steady_clock;

    /// A piece that one worker or two are at.
    struct Piece {
        Range range;
        Clock::time_point begin;
        int workers = 1;
        std::mutex mutex;  // held while a result is stored; taken before that of the schedule
        bool done = false;
    };
    struct Worker {
        std::shared_ptr<Piece> piece;
        double items_per_second = 0.0;  // 0: not known yet
        Clock::time_point last_sign = Clock::now();
        std::function<void()> sign_hook{};
        bool idle = false;  // waits for something to do
        bool left = false;
        bool dropped = false;
    };

    bool store(std::size_t worker, const std::function<void()>& store, bool ends_piece);
    void let_go(Worker& worker);
    std::uint64_t fair_share(const Worker& worker) const;
    std::shared_ptr<Piece> piece_worth_copying(std::size_t worker, std::uint64_t most_items) const;

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Range> queue_;
    std::uint64_t queued_items_ = 0;
    std::uint64_t items_left_ = 0;  // not finished
    std::vector<Worker> workers_;
    bool stopped_ = false;
};

}  // namespace castor
