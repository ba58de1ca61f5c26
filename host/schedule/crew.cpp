#include "schedule/crew.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "base/stopwatch.h"

namespace castor {

namespace {

constexpr double kTickSeconds = 0.02;
constexpr double kServeSeconds = 0.001;

// A tick that takes longer tells that the process did not run, as after Ctrl-Z, and so its workers did not either.
constexpr double kLongestTickSeconds = 1.0;

std::atomic<std::size_t> left_behind = 0;

/// Messages of the workers' threads to the thread that waits for them. Threads that are left behind share it.
struct Board {
    std::mutex mutex;
    std::vector<WorkerFailure> failures;  // not yet reported
    std::exception_ptr unexpected;
    enum class Thread { works, has_ended, is_left_behind };
    std::vector<Thread> threads;

    explicit Board(const std::vector<WorkerFunction>& workers) {
        for (const WorkerFunction& worker : workers) threads.push_back(worker ? Thread::works : Thread::has_ended);
    }

    std::vector<WorkerFailure> take_failures() {
        std::lock_guard lock(mutex);
        return std::exchange(failures, {});
    }
};

/// Runs one worker. Owns all that it uses, because its thread may be left behind.
void work(std::shared_ptr<Schedule> schedule, std::shared_ptr<Board> board, WorkerFunction function,
          std::size_t worker) {
    const auto fail = [&](const DeviceError& error) {
        {
            std::lock_guard lock(board->mutex);
            board->failures.push_back({worker, error});
        }
        while (!schedule->drop(worker)) std::this_thread::yield();  // another worker stores the same piece
    };
    try {
        function(*schedule, worker);
    } catch (const DeviceError& error) {
        if (!schedule->is_dropped(worker)) fail(error);
    } catch (...) {
        if (!schedule->is_dropped(worker)) {
            std::lock_guard lock(board->mutex);
            if (!board->unexpected) board->unexpected = std::current_exception();
            schedule->stop();
        }
    }
    schedule->leave(worker);
    function = nullptr;  // releases what the worker owns before the thread counts as ended
    std::lock_guard lock(board->mutex);
    if (board->threads[worker] == Board::Thread::is_left_behind) --left_behind;
    board->threads[worker] = Board::Thread::has_ended;
}

class Threads {
public:
    explicit Threads(std::size_t workers) : threads_(workers) {}
    ~Threads() {
        for (std::thread& thread : threads_)
            if (thread.joinable()) thread.join();
    }
    void begin(const std::shared_ptr<Schedule>& schedule, const std::shared_ptr<Board>& board,
               const WorkerFunction& function, std::size_t worker) {
        try {
            threads_[worker] = std::thread(work, schedule, board, function, worker);
        } catch (...) {  // too many threads; those already started end
            schedule->stop();
            throw;
        }
    }
    void leave_behind(Board& board, std::size_t worker) {
        std::lock_guard lock(board.mutex);
        if (board.threads[worker] == Board::Thread::has_ended) return;
        board.threads[worker] = Board::Thread::is_left_behind;
        ++left_behind;
        threads_[worker].detach();
    }

private:
    std::vector<std::thread> threads_;
};

}  // namespace

void run_crew(const std::shared_ptr<Schedule>& schedule, const std::vector<WorkerFunction>& workers,
              const CrewOptions& options) {
    const auto board = std::make_shared<Board>(workers);
    std::exception_ptr of_tick;
    std::optional<Stopwatch> since_end;  // of the work, or since all are to stop
    const auto guarded = [&](const auto& action) {
        try {
            action();
        } catch (...) {
            if (!of_tick) of_tick = std::current_exception();
            schedule->stop();
        }
    };
    const auto report = [&] {
        for (const WorkerFailure& failure : board->take_failures())
            if (options.on_drop) options.on_drop(failure.worker, failure.why);
    };
    const auto serve = [&] {
        if (!options.serve) return;
        for (const WorkerFailure& failure : options.serve()) {
            while (!schedule->drop(failure.worker)) std::this_thread::yield();  // another worker stores the same piece
            if (options.on_drop) options.on_drop(failure.worker, failure.why);
        }
    };
    const auto tick = [&] {
        if (schedule->is_stopped() || !options.tick || options.tick()) return;
        schedule->stop();
    };
    const auto name_of = [&](std::size_t worker) {
        return worker < options.names.size() ? options.names[worker] : std::string();
    };
    const auto stays = [&](std::size_t worker) {
        return worker < options.in_callers_thread.size() && options.in_callers_thread[worker];
    };
    {
        Threads threads(workers.size());
        const auto watch = [&] {
            guarded(serve);
            guarded(report);
            guarded(tick);
            const auto give_up = [&](double deadline, const auto& tell) {
                for (const std::size_t worker : schedule->silent_workers(deadline)) {
                    if (!schedule->drop(worker)) continue;
                    threads.leave_behind(*board, worker);
                    guarded([&] { tell(worker); });
                }
            };
            give_up(options.deadlines.seconds, [&](std::size_t worker) {
                if (options.on_drop)
                    options.on_drop(worker,
                                    DeviceError(name_of(worker), "", 0,
                                                fmt::format("has not answered for {:g} s", options.deadlines.seconds)));
            });
            if (!since_end && (schedule->is_stopped() || schedule->items_left() == 0)) since_end.emplace();
            if (since_end && since_end->seconds() > options.deadlines.stop_seconds)
                give_up(options.deadlines.stop_seconds, [&](std::size_t worker) {
                    if (options.on_leave) options.on_leave(worker);
                });
        };
        for (std::size_t i = 0; i < workers.size(); ++i)
            if (stays(i)) schedule->set_sign_hook(i, watch);
        for (std::size_t i = 0; i < workers.size(); ++i)
            if (workers[i] && !stays(i)) threads.begin(schedule, board, workers[i], i);
        for (std::size_t i = 0; i < workers.size(); ++i)
            if (stays(i)) work(schedule, board, workers[i], i);
        Stopwatch since_watch;
        for (Stopwatch turn; !schedule->wait_for_all(options.serve ? kServeSeconds : kTickSeconds); turn = {}) {
            if (turn.seconds() > kLongestTickSeconds) schedule->excuse(turn.seconds());
            if (options.serve && since_watch.seconds() < kTickSeconds) {
                guarded(serve);
                continue;
            }
            if (options.is_serve_awaited && options.is_serve_awaited()) schedule->excuse(since_watch.seconds());
            since_watch = {};
            watch();
        }
        guarded(report);
    }
    {
        std::lock_guard lock(board->mutex);
        if (board->unexpected) std::rethrow_exception(board->unexpected);
    }
    if (of_tick) std::rethrow_exception(of_tick);
}

std::size_t threads_left_behind() {
    return left_behind;
}

}  // namespace castor
