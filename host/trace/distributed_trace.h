#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "trace/chunk_answerer.h"
#include "trace/chunk_exchange.h"
#include "trace/strategy.h"
#include "trace/surface_kernels.h"

namespace castor {

/// Traces rays of one device through chunks of which other processes keep some. The device tests the chunks of its own
/// share, and the rays travel to the others' with the best hit so far: the same answers as with all chunks here. For
/// one thread.
class DistributedTrace {
public:
    /// All must outlive the object, but `tuning`.
    DistributedTrace(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning, TraceKernels& kernels);

    /// Who has the other chunks, from now on.
    void set_exchange(std::shared_ptr<ChunkExchange> exchange);

    /// As TraceKernels::closest_hit and any_hit on the context's queue, for rays [0, count). Return when the others
    /// have answered.
    void closest_hit(TraceKernels::RayBuffers rays, const TraceKernels::Hits& hits, std::size_t count,
                     std::uint32_t flags, Coherence hint);
    void any_hit(TraceKernels::RayBuffers rays, const TraceKernels::Occluded& occluded, std::size_t count,
                 std::uint32_t flags, Coherence hint);

    /// Find what `kernels` find with all chunks; the query's subset is not looked at, and its hits are those that
    /// closest_hit gave. Return when the others have answered.
    void find_surfaces(SurfaceKernels& kernels, SurfaceKernels::Query query, const SurfaceKernels::Surfaces& surfaces,
                       float pixel_spread);
    void find_uvs(SurfaceKernels& kernels, SurfaceKernels::Query query, const DeviceColumn<columns::surface_uv>& uvs);
    void find_attributes(SurfaceKernels& kernels, SurfaceKernels::Query query,
                         const SurfaceKernels::Attributes& attributes);
    void find_passed(SurfaceKernels& kernels, SurfaceKernels::Query query, const SurfaceKernels::Bounce& bounce,
                     const DeviceColumn<columns::passed>& passed);

private:
    std::vector<Ray> read_rays(const TraceKernels::RayBuffers& rays, std::size_t count);
    std::vector<float> read_times(const TraceKernels::RayBuffers& rays, std::size_t count);
    Bytes answer_here(const ChunkOrder& order);

    /// Asks the other shares about the rays for which wants(share, ray's number) is true, and gives each answer to
    /// take(ray's number, answer). `hits`, `times` and `path_slots`: what the rays bring, one each; empty: nothing.
    template <class Answer, class Wants, class Take>
    void ask(const ChunkOrder& blank, std::span<const Ray> rays, std::span<const Hit> hits,
             std::span<const float> times, const Wants& wants, const Take& take,
             std::span<const std::uint32_t> path_slots = {}) {
        std::vector<ChunkExchange::Question> questions;
        std::vector<std::vector<std::uint32_t>> numbers;  // of the rays of each question
        for (std::size_t share = 1; share < exchange_->share_count(); ++share) {
            ChunkOrder order = blank;
            std::vector<std::uint32_t> asked;
            for (std::uint32_t i = 0; i < rays.size(); ++i) {
                if (!wants(share, i)) continue;
                asked.push_back(i);
                order.rays.push_back(rays[i]);
                if (!hits.empty()) order.hits.push_back(hits[i]);
                if (!times.empty()) order.times.push_back(times[i]);
                if (!path_slots.empty()) order.path_slots.push_back(path_slots[i]);
            }
            if (asked.empty()) continue;
            questions.push_back({share, std::move(order)});
            numbers.push_back(std::move(asked));
        }
        const std::vector<Bytes> answers =
            exchange_->ask(std::move(questions), [this](const ChunkOrder& order) { return answer_here(order); });
        for (std::size_t i = 0; i < answers.size(); ++i) {
            ByteReader reader(answers[i]);
            for (const std::uint32_t number : numbers[i]) take(number, reader.take<Answer>());
        }
    }

    DeviceContext& context_;
    const DeviceScene& scene_;
    const Tuning tuning_;
    TraceKernels& kernels_;
    std::shared_ptr<ChunkExchange> exchange_;
    DeviceScene::Subset own_chunks_;
    std::optional<ChunkAnswerer> answerer_;  // where all others are lost
};

}  // namespace castor
