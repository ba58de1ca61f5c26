#include "render/checkpoint_keeper.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

namespace castor {

namespace {

// After which a checkpoint is written without the sums of workers that are still busy.
constexpr double kLongestWaitForSums = 2.0;

std::string problem_of(const std::exception& error) {
    return fmt::format("the checkpoint is not written: {}", error.what());
}

/// Returns the problem; empty: none.
std::string write_checkpoint(const std::filesystem::path& file, Checkpoint checkpoint) {
    try {
        save_checkpoint(file, std::move(checkpoint));
        return "";
    } catch (const std::exception& error) {
        return problem_of(error);
    }
}

}  // namespace

CheckpointKeeper::CheckpointKeeper(std::filesystem::path file, double seconds,
                                   std::function<void(const std::string&)> tell)
    : file_(std::move(file)), seconds_(seconds), tell_(std::move(tell)) {}

void CheckpointKeeper::tick(const std::function<std::optional<Checkpoint>(bool is_late)>& gather) {
    if (file_.empty()) return;
    if (writing_.valid()) {
        if (writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
        tell_once(writing_.get());
        since_last_ = {};
    }
    if (since_last_.seconds() < seconds_) return;
    try {
        std::optional<Checkpoint> copy = gather(since_last_.seconds() > seconds_ + kLongestWaitForSums);
        if (!copy) return;
        writing_ = std::async(std::launch::async, [file = file_, checkpoint = std::move(*copy)]() mutable {
            return write_checkpoint(file, std::move(checkpoint));
        });
    } catch (const std::exception& error) {  // no memory for the copy, or no thread
        tell_once(problem_of(error));
        since_last_ = {};
    }
}

void CheckpointKeeper::finish() {
    if (writing_.valid()) tell_once(writing_.get());
}

void CheckpointKeeper::write(const Checkpoint& checkpoint) {
    if (file_.empty()) return;
    const std::string problem = write_checkpoint(file_, checkpoint);
    if (!problem.empty()) tell_(problem);
}

void CheckpointKeeper::tell_once(const std::string& problem) {
    if (!problem.empty() && problem != last_problem_) tell_(problem + "; the render goes on");
    last_problem_ = problem;
}

}  // namespace castor
