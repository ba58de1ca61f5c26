#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/stopwatch.h"
#include "castor/tracer.h"
#include "remote/manager.h"
#include "remote/rank_server.h"
#include "trace/ray_worker.h"

namespace castor {

/// A batch of rays as a job for a Manager: an order is the rays of a piece, a result their answers.
class RemoteBatch : public RemoteJob {
public:
    /// Called with the worker's number in the schedule, the rays of a piece that counts, and the time that it took.
    using OnAnswered = std::function<void(std::size_t worker, std::size_t rays, double seconds)>;

    RemoteBatch(const RayBatch& batch, std::string description, std::shared_ptr<Schedule> schedule,
                std::size_t worker_count, OnAnswered on_answered);

    const std::string& description() const override { return description_; }
    void ready(std::size_t worker, const WorkerState& state) override;
    std::optional<Bytes> begin(std::size_t worker, const Range& piece) override;
    Answer progress(std::size_t worker, std::uint64_t done) override;
    std::optional<Bytes> take(std::size_t worker, std::span<const std::byte> result) override;
    void end(std::size_t) override {}

private:
    struct Piece {
        std::size_t first = 0, count = 0;  // rays
        Stopwatch watch;
    };

    const RayBatch batch_;
    const std::string description_;
    const std::shared_ptr<Schedule> schedule_;
    const OnAnswered on_answered_;
    std::vector<Piece> pieces_;  // one a worker
};

/// Lets `worker` answer the rays of orders. A result has the columns of answers one after the other, each of so many
/// bytes a ray.
std::unique_ptr<OrderedWorker> ordered(std::unique_ptr<RayWorker> worker, std::vector<std::size_t> answer_bytes,
                                       double setup_seconds);

/// Answers as Tracer::closest_hit, any_hit, count_crossings and list_crossings do, together with the manager's workers:
/// the same answers. Tracer::shares then has these after the tracer's own devices.
bool trace_together(Tracer& tracer, std::span<const Ray> rays, std::span<Hit> hits, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager);
bool trace_together(Tracer& tracer, std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager);

bool count_together(Tracer& tracer, std::span<const Ray> rays, std::span<std::uint32_t> counts, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager);
bool list_together(Tracer& tracer, std::span<const Ray> rays, std::size_t limit, std::span<Hit> crossings,
                   std::span<std::uint32_t> counts, Coherence hint, const std::function<bool()>& go_on,
                   Manager& manager);

/// Lets the tracer's devices answer rays of the manager's next batch, until it is done. `limit`: of Query::list.
/// Returns false if no further one follows. Throws DeviceError where the manager refuses this process, or is silent.
bool serve_trace(Tracer& tracer, Query query, std::size_t limit, Coherence hint, RankServer& server);

}  // namespace castor
