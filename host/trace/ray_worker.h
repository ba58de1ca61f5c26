#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "castor/tracer.h"
#include "schedule/schedule.h"

namespace castor {

/// Memory for answers of one kind, `bytes` a ray.
struct AnswerColumn {
    std::byte* data;
    std::size_t bytes;
};

/// An owner of rays and of memory for their answers. Both are touched only while the Schedule says that a piece is
/// wanted. A piece is a range of items, of rays_per_item rays each.
struct RayBatch {
    std::span<const Ray> rays;
    std::vector<AnswerColumn> answers;
    std::size_t rays_per_item;

    std::size_t items() const { return (rays.size() + rays_per_item - 1) / rays_per_item; }
    std::size_t first_ray(const Range& piece) const { return piece.begin * rays_per_item; }
    /// Returns the rays of a piece.
    std::span<const Ray> rays_of(const Range& piece) const {
        return rays.subspan(first_ray(piece), std::min(piece.end * rays_per_item, rays.size()) - first_ray(piece));
    }
};

/// Someone who answers rays of a batch: a device of this process, or something far away. Throws DeviceError when it can
/// work no longer. For one thread.
class RayWorker {
public:
    /// Fills the worker's memory with the rays of a piece. Returns false if the piece is not wanted any more.
    using LoadRays = std::function<bool(Ray* rays)>;
    /// Takes the answers out of the worker's memory, column by column. Returns whether they were still wanted.
    using StoreAnswers = std::function<bool(std::span<const std::byte* const> answers)>;

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
