#pragma once

#include <cstddef>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "castor/tracer.h"
#include "opencl/device_context.h"
#include "trace/device_scene.h"
#include "trace/trace_arguments.h"
#include "trace/tuning.h"

namespace castor {

/// Returns the programs of nearest and any hits that a device with this tuning will need for a scene that is not cut,
/// and rays of these kinds: all but those that depend on the trees.
std::vector<KernelProgram> trace_programs(const SceneArrays& arrays, const Tuning& tuning,
                                          std::initializer_list<Coherence> hints);

/// The trace kernels of one device: all queries by all strategies. For one thread.
class TraceKernels {
public:
    /// Kernels are built on first use, for what the scene has.
    TraceKernels(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning);

    /// The rays of a query: two columns, or one buffer of Ray records that stands for both.
    struct RayBuffers {
        DeviceColumn<columns::ray_origin_tmin> origin_tmin;
        DeviceColumn<columns::ray_direction_tmax> direction_tmax;
        bool interleaved = false;
        std::optional<glm::vec3> from =
            {};  // the origin of all or most rays, if they share one: near chunks come first
        const DeviceScene::Subset* subset = nullptr;  // the chunks that are asked; null: all
        // Of each ray: when it meets what moves. Else all is where it is at time 0.
        std::optional<DeviceColumn<columns::ray_time>> time = {};

        static RayBuffers records(const cl::Buffer& rays, const std::optional<glm::vec3>& from = {}) {
            return {DeviceColumn<columns::ray_origin_tmin>(rays), DeviceColumn<columns::ray_direction_tmax>(rays), true,
                    from};
        }
    };
    using Hits = DeviceColumn<columns::hits>;
    using Occluded = DeviceColumn<columns::occluded>;
    using Crossings = DeviceColumn<columns::crossings>;
    using CrossingCounts = DeviceColumn<columns::crossing_counts>;

    /// Enqueues the query for rays [first, first + count) on `queue`, in launches of at most the tuning's launch_items;
    /// answers go to the same positions of `hits` or `occluded`. `flags`: CASTOR_TRACE_CULL_BACK_FACES or none.
    /// `event` is complete when all answers are, also where `queue` runs commands in any order.
    void closest_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays, const Hits& hits,
                     std::size_t first, std::size_t count, std::uint32_t flags, Coherence hint,
                     cl::Event* event = nullptr);
    void any_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                 const Occluded& occluded, std::size_t first, std::size_t count, std::uint32_t flags, Coherence hint,
                 cl::Event* event = nullptr);

    /// The same; ray i has `limit` places in `crossings`, from limit * i on.
    void count_crossings(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                         const CrossingCounts& counts, std::size_t first, std::size_t count, std::uint32_t flags,
                         Coherence hint, cl::Event* event = nullptr);
    void list_crossings(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                        std::uint32_t limit, const Crossings& crossings, const CrossingCounts& counts,
                        std::size_t first, std::size_t count, std::uint32_t flags, Coherence hint,
                        cl::Event* event = nullptr);

    /// The same for rays [0, count) on the context's own queue, by kernels that count their work: adds the counts to
    /// `work`, and returns when all is done.
    void count_closest_hit(const DeviceScene& scene, const RayBuffers& rays, const Hits& hits, std::size_t count,
                           std::uint32_t flags, Coherence hint, TraceWork& work);
    void count_any_hit(const DeviceScene& scene, const RayBuffers& rays, const Occluded& occluded, std::size_t count,
                       std::uint32_t flags, Coherence hint, TraceWork& work);

private:
    template <class Arguments>
    using KernelsByStrategy = std::map<Strategy, Kernel<Arguments>>;
    struct Batch;
    struct Launch;

    template <class Arguments>
    Kernel<Arguments>& kernel(Strategy strategy, const DeviceScene& scene);
    std::size_t rays_per_item(Strategy strategy) const;
    template <class Enqueue>
    void for_each_launch(const Batch& batch, const Enqueue& enqueue) const;

    DeviceContext& context_;
    Tuning tuning_;
    std::string build_options_;
    std::string brute_options_;  // the same, and whether there are passes
    std::string simt_options_;   // the same, and the size of the stack
    std::tuple<KernelsByStrategy<ClosestHit>, KernelsByStrategy<AnyHit>, KernelsByStrategy<CountCrossings>,
               KernelsByStrategy<ListCrossings>, KernelsByStrategy<CountedClosestHit>, KernelsByStrategy<CountedAnyHit>,
               KernelsByStrategy<TimedClosestHit>, KernelsByStrategy<TimedAnyHit>>
        kernels_;
};

}  // namespace castor
