#include "trace/strategy.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace castor {

namespace {

constexpr std::array kStrategies = {
    std::pair{Strategy::automatic, std::string_view("auto")},
    std::pair{Strategy::brute, std::string_view("brute")},
    std::pair{Strategy::simt, std::string_view("simt")},
    std::pair{Strategy::wide, std::string_view("wide")},
    std::pair{Strategy::packet, std::string_view("packet")},
};

}  // namespace

std::string_view to_string(Strategy strategy) {
    return std::find_if(kStrategies.begin(), kStrategies.end(), [&](const auto& s) { return s.first == strategy; })->second;
}

Strategy strategy_from_string(std::string_view word) {
    const auto found = std::find_if(kStrategies.begin(), kStrategies.end(), [&](const auto& s) { return s.second == word; });
    if (found != kStrategies.end()) return found->first;
    throw UsageError(fmt::format("there is no strategy \"{}\"; there are auto, brute, simt, wide and packet", word));
}

bool walks_wide_tree(Strategy strategy) { return strategy == Strategy::wide || strategy == Strategy::packet; }

std::vector<Strategy> choose_strategies(Strategy wanted, const std::vector<Device>& devices) {
    std::vector<Strategy> strategies;
    for (const Device& device : devices) {
        const Strategy by_type = device.type == DeviceType::cpu ? Strategy::wide : Strategy::simt;
        strategies.push_back(wanted == Strategy::automatic ? by_type : wanted);
    }
    return strategies;
}

TraceKernels::TraceKernels(DeviceContext& context, const DeviceScene& scene, Strategy strategy)
    : context_(context), rays_per_item_(walks_wide_tree(strategy) ? CASTOR_WIDE_BATCH : 1),
      local_size_(walks_wide_tree(strategy) ? 1 : 0) {
    const std::string options = fmt::format("-DCASTOR_HAS_SPHERES={} -DCASTOR_HAS_PLANES={}",
                                            int{scene.trace_params.sphere_count > 0}, int{scene.trace_params.plane_count > 0});
    closest_hit_ = context.kernel(fmt::format("closest_hit_{}", to_string(strategy)), options);
    any_hit_ = context.kernel(fmt::format("any_hit_{}", to_string(strategy)), options);
}

void TraceKernels::closest_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                               const cl::Buffer& hits, std::size_t first, std::size_t count, std::uint32_t flags,
                               cl::Event* event) {
    enqueue(closest_hit_, queue, scene, rays, hits, first, count, flags, event);
}

void TraceKernels::any_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                           const cl::Buffer& occluded, std::size_t first, std::size_t count, std::uint32_t flags,
                           cl::Event* event) {
    enqueue(any_hit_, queue, scene, rays, occluded, first, count, flags, event);
}

void TraceKernels::enqueue(cl::Kernel& kernel, const cl::CommandQueue& queue, const DeviceScene& scene,
                           const RayBuffers& rays, const cl::Buffer& answers, std::size_t first, std::size_t count,
                           std::uint32_t flags, cl::Event* event) {
    shared::TraceParams params = scene.trace_params;
    params.ray_stride = rays.interleaved ? 2 : 1;
    params.direction_offset = rays.interleaved ? 1 : 0;
    params.flags = flags;
    const std::size_t batch = context_.profile().batch_rays;
    for (std::size_t done = 0; done < count; done += batch) {
        params.first_ray = static_cast<std::uint32_t>(first + done);
        params.ray_count = static_cast<std::uint32_t>(std::min(batch, count - done));
        const bool is_last = done + batch >= count;
        context_.enqueue_on(queue, kernel, (params.ray_count + rays_per_item_ - 1) / rays_per_item_, local_size_,
                            is_last ? event : nullptr, params, scene.vertex_position,
                            scene.triangle_vertices, scene.mesh_ranges, scene.sphere_center_radius, scene.plane_point,
                            scene.plane_normal, scene.bvh_nodes, scene.bvh_primitives, scene.wide_nodes, scene.triangle_blocks,
                            scene.sphere_blocks, rays.origin_tmin,
                            rays.direction_tmax, answers);
    }
}

}  // namespace castor
