#pragma once

#include <filesystem>
#include <functional>
#include <future>
#include <optional>
#include <string>

#include "base/stopwatch.h"
#include "render/checkpoint.h"

namespace castor {

/// Writes checkpoints at intervals, each in a thread of its own, and tells every problem once. For one thread.
class CheckpointKeeper {
public:
    /// An empty file name: keeps nothing.
    CheckpointKeeper(std::filesystem::path file, double seconds, std::function<void(const std::string&)> tell);

    /// Begins another checkpoint if it is time. `gather` returns a copy of the state; until it is late, it may return
    /// nullopt instead, to be asked again by the next tick.
    void tick(const std::function<std::optional<Checkpoint>(bool is_late)>& gather);
    /// Waits for a checkpoint that is being written.
    void finish();
    /// Writes the last checkpoint, of a picture that is not complete, in this thread.
    void write(const Checkpoint& checkpoint);

private:
    void tell_once(const std::string& problem);

    std::filesystem::path file_;
    double seconds_;
    std::function<void(const std::string&)> tell_;
    Stopwatch since_last_;
    std::future<std::string> writing_;  // gives the problem; empty: none
    std::string last_problem_;
};

}  // namespace castor
