#include "trace/strategy.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "name_table.h"

namespace castor {

namespace {

constexpr std::array kStrategies = {
    Named<Strategy>{Strategy::automatic, "auto"},
    Named<Strategy>{Strategy::brute, "brute"},
    Named<Strategy>{Strategy::simt, "simt"},
    Named<Strategy>{Strategy::wide, "wide"},
    Named<Strategy>{Strategy::packet, "packet"},
};

}  // namespace

std::string_view to_string(Strategy strategy) { return name_of(kStrategies, strategy); }
Strategy strategy_from_string(std::string_view word) { return value_of(kStrategies, word, "strategy"); }

bool walks_wide_tree(Strategy strategy) { return strategy == Strategy::wide || strategy == Strategy::packet; }

std::vector<StrategyChoice> choose_strategies(Strategy wanted, const std::vector<Device>& devices) {
    std::vector<StrategyChoice> choices;
    for (const Device& device : devices) {
        if (wanted != Strategy::automatic)
            choices.push_back({wanted, wanted});
        else if (device.type == DeviceType::cpu)
            choices.push_back({Strategy::wide, Strategy::packet});
        else
            choices.push_back({Strategy::simt, Strategy::simt});
    }
    return choices;
}

TraceKernels::TraceKernels(DeviceContext& context, const DeviceScene& scene, const StrategyChoice& strategies)
    : context_(context),
      strategies_(strategies),
      build_options_(fmt::format("-DCASTOR_HAS_SPHERES={} -DCASTOR_HAS_PLANES={}", int{scene.trace_params.sphere_count > 0},
                                 int{scene.trace_params.plane_count > 0})) {}

cl::Kernel& TraceKernels::kernel(Query query, Strategy strategy) {
    cl::Kernel& kernel = kernels_[{query, strategy}];
    const std::string_view prefix = query == Query::closest_hit ? "closest_hit" : "any_hit";
    const std::string_view suffix = to_string(strategy);
    if (!kernel()) kernel = context_.kernel_of(fmt::format("trace_{}", suffix), fmt::format("{}_{}", prefix, suffix), build_options_);
    return kernel;
}

void TraceKernels::closest_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                               const cl::Buffer& hits, std::size_t first, std::size_t count, std::uint32_t flags,
                               Coherence hint, cl::Event* event) {
    enqueue(Query::closest_hit, queue, scene, rays, hits, first, count, flags, hint, event);
}

void TraceKernels::any_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                           const cl::Buffer& occluded, std::size_t first, std::size_t count, std::uint32_t flags,
                           Coherence hint, cl::Event* event) {
    enqueue(Query::any_hit, queue, scene, rays, occluded, first, count, flags, hint, event);
}

void TraceKernels::enqueue(Query query, const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                           const cl::Buffer& answers, std::size_t first, std::size_t count, std::uint32_t flags,
                           Coherence hint, cl::Event* event) {
    const Strategy strategy = strategies_.of(hint);
    const std::size_t rays_per_item = walks_wide_tree(strategy) ? CASTOR_WIDE_BATCH : 1;
    const std::size_t local_size = walks_wide_tree(strategy) ? 1 : 0;
    const std::size_t launch_rays = context_.profile().launch_items * rays_per_item;
    shared::TraceParams params = scene.trace_params;
    params.ray_stride = rays.interleaved ? 2 : 1;
    params.direction_offset = rays.interleaved ? 1 : 0;
    params.flags = flags;
    for (std::size_t done = 0; done < count; done += launch_rays) {
        params.first_ray = static_cast<std::uint32_t>(first + done);
        params.ray_count = static_cast<std::uint32_t>(std::min(launch_rays, count - done));
        const bool is_last = done + launch_rays >= count;
        context_.enqueue_on(queue, kernel(query, strategy), (params.ray_count + rays_per_item - 1) / rays_per_item, local_size,
                            is_last ? event : nullptr, params, scene.vertex_position, scene.triangle_vertices,
                            scene.mesh_ranges, scene.sphere_center_radius, scene.plane_point, scene.plane_normal,
                            scene.bvh_nodes, scene.bvh_primitives, scene.wide_nodes, scene.triangle_blocks,
                            scene.sphere_blocks, rays.origin_tmin, rays.direction_tmax, answers);
    }
}

}  // namespace castor
