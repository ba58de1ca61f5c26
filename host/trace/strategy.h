#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "castor/tracer.h"
#include "opencl/device_context.h"
#include "trace/device_scene.h"
#include "trace/tuning.h"

namespace castor {

/// The queries of one device. One object a thread.
class TraceKernels {
public:
    /// Kernels are built on first use, for what the scene has.
    TraceKernels(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning);

    /// Where rays stand: two columns of float4, or one buffer of Ray records twice.
    struct RayBuffers {
        cl::Buffer origin_tmin;
        cl::Buffer direction_tmax;
        bool interleaved = false;
        std::optional<glm::vec3> from =
            {};  // where all or most of them begin, if that is one place: near chunks come first
    };

    /// Enqueues the query for rays [first, first + count) on `queue`, in launches of at most the tuning's launch_items;
    /// answers go to the same positions of `hits` (Hit records) or `occluded` (bytes). `flags`:
    /// CASTOR_TRACE_CULL_BACK_FACES or none. `event` is that of the last launch.
    void closest_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                     const cl::Buffer& hits, std::size_t first, std::size_t count, std::uint32_t flags, Coherence hint,
                     cl::Event* event = nullptr);
    void any_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                 const cl::Buffer& occluded, std::size_t first, std::size_t count, std::uint32_t flags, Coherence hint,
                 cl::Event* event = nullptr);

    /// The same from the first ray on, on the context's own queue, by kernels that count what they do: adds that to
    /// `work`, and returns when all is done.
    void count_closest_hit(const DeviceScene& scene, const RayBuffers& rays, const cl::Buffer& hits, std::size_t count,
                           std::uint32_t flags, Coherence hint, TraceWork& work);
    void count_any_hit(const DeviceScene& scene, const RayBuffers& rays, const cl::Buffer& occluded, std::size_t count,
                       std::uint32_t flags, Coherence hint, TraceWork& work);

private:
    struct BuiltKernel {
        cl::Kernel kernel;
        std::size_t rays_per_item = 1;
        std::size_t local_size = 1;
    };
    void enqueue(Query query, const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                 const cl::Buffer& answers, std::size_t first, std::size_t count, std::uint32_t flags, Coherence hint,
                 cl::Event* event, TraceWork* work = nullptr);
    BuiltKernel& kernel(Query query, Strategy strategy, bool counts);
    BuiltKernel build(Query query, Strategy strategy, bool counts);

    DeviceContext& context_;
    Tuning tuning_;
    std::string build_options_;
    std::string brute_options_;  // the same, and whether there are passes
    std::string simt_options_;   // the same, and the size of the stack
    std::map<std::tuple<Query, Strategy, bool>, BuiltKernel> kernels_;
};

}  // namespace castor
