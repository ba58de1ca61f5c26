#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "castor/tracer.h"
#include "schedule/schedule.h"

namespace castor {

/// An owner of rays and of memory for their answers, which are `answer_bytes` each. Both are touched only while the
/// Schedule says that a piece is wanted.
struct RayBatch {
    const Ray* rays;
    std::byte* answers;
    std::size_t answer_bytes;
    std::size_t count;
};

/// Someone who answers rays of a batch: a device of this process, or something far away. An item is kRaysPerItem rays.
/// Throws DeviceError when it can work no longer. For one thread.
class RayWorker {
public:
    /// Fills the worker's memory with the rays of a piece. Returns false if the piece is not wanted any more.
    using LoadRays = std::function<bool(Ray* rays)>;
    /// Takes the answers out of the worker's memory. Returns whether they were still wanted.
    using StoreAnswers = std::function<bool(const std::byte* answers)>;

    virtual ~RayWorker() = default;
    /// Returns how many items the next piece should have at most, by the worker's speed.
    virtual std::uint64_t items_wanted() const = 0;
    /// Returns how many items a piece can have at most.
    virtual std::uint64_t most_items() const = 0;
    /// Returns the worker's speed; 0: not known yet.
    virtual double items_per_second() const = 0;
    /// Answers `count` rays. Returns what `store` returned, or false if `load` did.
    virtual bool answer(std::size_t count, const LoadRays& load, const StoreAnswers& store) = 0;
};

/// Called with the size of a piece that counts, and the time that it took.
using OnRaysAnswered = std::function<void(std::size_t rays, double seconds)>;

/// Lets a worker, the `number`-th of the schedule, answer piece after piece until none is left.
void answer_pieces(RayWorker& worker, const RayBatch& batch, Schedule& schedule, std::size_t number,
                   const OnRaysAnswered& on_answered);

}  // namespace castor
