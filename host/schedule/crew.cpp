#include "schedule/crew.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "opencl/cl.h"

namespace castor {

namespace {

constexpr double kTickSeconds = 0.02;

std::atomic<bool> left_behind = false;

/// What the threads tell the one that waits for them. Shared with threads that are left behind.
struct Board {
    struct Failure {
        std::size_t worker;
        DeviceError error;
    };
    std::mutex mutex;
    std::vector<Failure> failures;   // that nobody has looked at yet
    std::exception_ptr unexpected;

    std::vector<Failure> take_failures() {
        std::lock_guard lock(mutex);
        return std::exchange(failures, {});
    }
};

void work(const std::shared_ptr<Schedule>& schedule, const std::shared_ptr<Board>& board, const WorkerFunction& function, std::size_t worker,
          const std::string& name) {
    const auto fail = [&](const DeviceError& error) {
        if (schedule->is_dropped(worker)) return;
        {
            std::lock_guard lock(board->mutex);
            board->failures.push_back({worker, error});
        }
        while (!schedule->drop(worker)) std::this_thread::yield();  // another worker stores the same piece
    };
    try {
        function(*schedule, worker);
    } catch (const DeviceError& error) {
        fail(error);
    } catch (const cl::Error& error) {
        fail(DeviceError(name, error.what(), error.err(), ""));
    } catch (...) {
        {
            std::lock_guard lock(board->mutex);
            if (!board->unexpected) board->unexpected = std::current_exception();
        }
        schedule->stop();
    }
    schedule->leave(worker);
}

class Threads {
public:
    Threads(const std::shared_ptr<Schedule>& schedule, const std::shared_ptr<Board>& board, const std::vector<WorkerFunction>& workers, const CrewOptions& options) {
        for (std::size_t i = 0; i < workers.size(); ++i)
            threads_.emplace_back(work, schedule, board, workers[i], i, i < options.names.size() ? options.names[i] : "");
    }
    ~Threads() {
        for (std::thread& thread : threads_)
            if (thread.joinable()) thread.join();
    }
    void leave_behind(std::size_t worker) {
        left_behind = true;
        threads_[worker].detach();
    }

private:
    std::vector<std::thread> threads_;
};

}  // namespace

void run_crew(const std::shared_ptr<Schedule>& schedule, const std::vector<WorkerFunction>& workers, const CrewOptions& options) {
    const auto board = std::make_shared<Board>();
    std::exception_ptr of_tick;
    bool is_stopped = false;
    {
        Threads threads(schedule, board, workers, options);
        const auto guarded = [&](const auto& action) {
            try {
                action();
            } catch (...) {
                if (!of_tick) of_tick = std::current_exception();
                schedule->stop();
            }
        };
        const auto report = [&] {
            for (const Board::Failure& failure : board->take_failures())
                if (options.on_drop) options.on_drop(failure.worker, failure.error);
        };
        while (!schedule->wait_for_all(kTickSeconds)) {
            guarded(report);
            guarded([&] {
                if (is_stopped || of_tick || !options.tick || options.tick()) return;
                is_stopped = true;
                schedule->stop();
            });
            for (const std::size_t worker : schedule->silent_workers(options.deadline_seconds)) {
                if (!schedule->drop(worker)) continue;
                threads.leave_behind(worker);
                const std::string name = worker < options.names.size() ? options.names[worker] : "";
                guarded([&] {
                    if (options.on_drop)
                        options.on_drop(worker, DeviceError(name, "", 0, fmt::format("has not answered for {:g} s", options.deadline_seconds)));
                });
            }
        }
        guarded(report);
    }
    if (board->unexpected) std::rethrow_exception(board->unexpected);
    if (of_tick) std::rethrow_exception(of_tick);
}

bool left_threads_behind() { return left_behind; }

}  // namespace castor
