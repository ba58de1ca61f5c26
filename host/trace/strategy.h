#pragma once

#include <cstddef>
#include <vector>

#include "castor/tracer.h"
#include "opencl/device_context.h"
#include "trace/device_scene.h"

namespace castor {

/// Whether the strategy's kernels read WideBvh.
bool walks_wide_tree(Strategy strategy);

/// For each device the strategy that `automatic` stands for there; any other stands for itself.
std::vector<Strategy> choose_strategies(Strategy wanted, const std::vector<Device>& devices);

/// The pair of kernels of one strategy on one device. One object a thread.
class TraceKernels {
public:
    /// Built for what the scene has.
    TraceKernels(DeviceContext& context, const DeviceScene& scene, Strategy strategy);

    /// Where rays stand: two columns of float4, or one buffer of Ray records twice.
    struct RayBuffers {
        cl::Buffer origin_tmin;
        cl::Buffer direction_tmax;
        bool interleaved = false;
    };

    /// Enqueues the query for rays [first, first + count) on `queue`, in launches of the profile's batch size; answers go to the same positions of
    /// `hits` (Hit records) or `occluded` (bytes). `flags`: CASTOR_TRACE_.... `event` is that of the last launch.
    void closest_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays, const cl::Buffer& hits,
                     std::size_t first, std::size_t count, std::uint32_t flags, cl::Event* event = nullptr);
    void any_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays, const cl::Buffer& occluded,
                 std::size_t first, std::size_t count, std::uint32_t flags, cl::Event* event = nullptr);

private:
    void enqueue(cl::Kernel& kernel, const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                 const cl::Buffer& answers, std::size_t first, std::size_t count, std::uint32_t flags, cl::Event* event);

    DeviceContext& context_;
    std::size_t rays_per_item_;
    std::size_t local_size_;  // 0: the profile's
    cl::Kernel closest_hit_;
    cl::Kernel any_hit_;
};

}  // namespace castor
