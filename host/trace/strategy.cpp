#include "trace/strategy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>

#include "base/name_table.h"

namespace castor {

namespace {

constexpr std::array kStrategies = {
    Named<Strategy>{Strategy::automatic, "auto"}, Named<Strategy>{Strategy::brute, "brute"},
    Named<Strategy>{Strategy::simt, "simt"},      Named<Strategy>{Strategy::wide, "wide"},
    Named<Strategy>{Strategy::packet, "packet"},
};

constexpr std::array kTreeQualities = {
    Named<TreeQuality>{TreeQuality::medium, "medium"},
    Named<TreeQuality>{TreeQuality::high, "high"},
};

/// The counters of one launch, zero at first. Every work-item has its own: no atomics, and 32 bits are enough.
class WorkCounters {
public:
    WorkCounters(DeviceContext& context, std::size_t items) : context_(context), counts_(items) {
        buffer_ = context.make_buffer(bytes(), "counters");
        context.fill_zero(buffer_, bytes());
    }

    const cl::Buffer& buffer() const { return buffer_; }

    void add_to(TraceWork& work) {
        context_.read(buffer_, counts_.data(), bytes());
        for (const auto& item : counts_)
            for (std::size_t kind = 0; kind < work.size(); ++kind) work[kind] += item[kind];
    }

private:
    std::size_t bytes() const { return counts_.size() * sizeof counts_[0]; }

    DeviceContext& context_;
    std::vector<std::array<cl_uint, CASTOR_WORK_KINDS>> counts_;
    cl::Buffer buffer_;
};

// Primitives that a launch of brute force tests for each ray: the fewest rays that a device is given, a block of
// pixels, then take a processor's core some 30 ms.
constexpr std::uint64_t kBrutePass = 1 << 16;

// For as many levels, and few different numbers: each is a program of its own.
std::uint32_t stack_entries(std::uint32_t levels) {
    return std::bit_ceil(std::max(levels, 8u));
}

}  // namespace

std::string_view to_string(Strategy strategy) {
    return name_of(kStrategies, strategy);
}
Strategy strategy_from_string(std::string_view word) {
    return value_of(kStrategies, word, "strategy");
}

std::string_view to_string(TreeQuality quality) {
    return name_of(kTreeQualities, quality);
}
TreeQuality tree_quality_from_string(std::string_view word) {
    return value_of(kTreeQualities, word, "quality");
}

bool walks_wide_tree(Strategy strategy) {
    return strategy == Strategy::wide || strategy == Strategy::packet;
}

Strategy StrategyChoice::of(Query query, Coherence hint) const {
    const bool coherent = hint == Coherence::coherent;
    if (query == Query::closest) return coherent ? closest_coherent : closest_incoherent;
    return coherent ? any_coherent : any_incoherent;
}

bool StrategyChoice::uses(Strategy strategy) const {
    return std::any_of(std::begin(kRayKindsOfChoice), std::end(kRayKindsOfChoice),
                       [&](const auto& kind) { return this->*kind.first == strategy; });
}

TraceKernels::TraceKernels(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning)
    : context_(context),
      tuning_(tuning),
      build_options_(fmt::format(
          "-DCASTOR_HAS_SPHERES={} -DCASTOR_HAS_PLANES={} -DCASTOR_HAS_INSTANCES={} -DCASTOR_HAS_CHUNKS={}",
          int{scene.has_spheres()}, int{scene.has_planes()}, int{scene.has_instances()}, int{scene.chunk_count() > 1})),
      brute_options_(fmt::format("{} -DCASTOR_BRUTE_PASS={}", build_options_,
                                 scene.most_brute_tests() > kBrutePass ? kBrutePass : 0)),
      simt_options_(
          fmt::format("{} -DCASTOR_SIMT_STACK={}", build_options_, stack_entries(scene.compressed_levels()))) {}

TraceKernels::BuiltKernel& TraceKernels::kernel(Query query, Strategy strategy, bool counts) {
    const std::tuple key{query, strategy, counts};
    const auto found = kernels_.find(key);
    return found != kernels_.end() ? found->second
                                   : kernels_.emplace(key, build(query, strategy, counts)).first->second;
}

TraceKernels::BuiltKernel TraceKernels::build(Query query, Strategy strategy, bool counts) {
    const std::string_view prefix = query == Query::closest ? "closest_hit" : "any_hit";
    const std::string_view suffix = to_string(strategy);
    const std::string& scene_options = strategy == Strategy::simt    ? simt_options_
                                       : strategy == Strategy::brute ? brute_options_
                                                                     : build_options_;
    const std::string options =
        fmt::format("{}{}{}", scene_options, build_options(tuning_, strategy), counts ? " -DCASTOR_COUNT_WORK=1" : "");
    BuiltKernel built;
    built.kernel = context_.kernel_of(fmt::format("trace_{}", suffix), fmt::format("{}_{}", prefix, suffix), options);
    if (walks_wide_tree(strategy)) {
        built.rays_per_item = tuning_.wide_batch;
    } else {
        const std::size_t most = context_.guarded("clGetKernelWorkGroupInfo", [&] {
            return built.kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(cl::Device(context_.device().id, true));
        });
        built.local_size = std::clamp<std::size_t>(most, 1, tuning_.local_size);
    }
    return built;
}

void TraceKernels::closest_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                               const cl::Buffer& hits, std::size_t first, std::size_t count, std::uint32_t flags,
                               Coherence hint, cl::Event* event) {
    enqueue(Query::closest, queue, scene, rays, hits, first, count, flags, hint, event);
}

void TraceKernels::any_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                           const cl::Buffer& occluded, std::size_t first, std::size_t count, std::uint32_t flags,
                           Coherence hint, cl::Event* event) {
    enqueue(Query::any, queue, scene, rays, occluded, first, count, flags, hint, event);
}

void TraceKernels::count_closest_hit(const DeviceScene& scene, const RayBuffers& rays, const cl::Buffer& hits,
                                     std::size_t count, std::uint32_t flags, Coherence hint, TraceWork& work) {
    enqueue(Query::closest, context_.queue(), scene, rays, hits, 0, count, flags, hint, nullptr, &work);
}

void TraceKernels::count_any_hit(const DeviceScene& scene, const RayBuffers& rays, const cl::Buffer& occluded,
                                 std::size_t count, std::uint32_t flags, Coherence hint, TraceWork& work) {
    enqueue(Query::any, context_.queue(), scene, rays, occluded, 0, count, flags, hint, nullptr, &work);
}

void TraceKernels::enqueue(Query query, const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                           const cl::Buffer& answers, std::size_t first, std::size_t count, std::uint32_t flags,
                           Coherence hint, cl::Event* event, TraceWork* work) {
    const Strategy strategy = tuning_.strategies.of(query, hint);
    BuiltKernel& built = kernel(query, strategy, work != nullptr);
    const std::size_t launch_rays = tuning_.launch_items * built.rays_per_item;
    const auto item_count = [&](std::size_t ray_count) {
        return (ray_count + built.rays_per_item - 1) / built.rays_per_item;
    };
    scene.visit_chunks(queue, rays.from, [&](const DeviceScene::Turn& turn) {
        const DeviceChunk& chunk = turn.chunk;
        shared::TraceParams params = turn.params;
        params.flags |= flags;
        params.ray_stride = rays.interleaved ? 2 : 1;
        params.direction_offset = rays.interleaved ? 1 : 0;
        const auto launch = [&](cl::Event* launch_event, const auto&... counters) {
            context_.enqueue_on(queue, built.kernel, item_count(params.ray_count), built.local_size, launch_event,
                                params, chunk.vertex_position, chunk.triangle_vertices, chunk.mesh_ranges,
                                chunk.sphere_center_radius, chunk.plane_point, chunk.plane_normal,
                                chunk.compressed_nodes, chunk.compressed_primitives, chunk.wide_nodes,
                                chunk.triangle_blocks, chunk.sphere_blocks, chunk.geometries, scene.instances,
                                chunk.instance_nodes, chunk.compressed_roots, chunk.wide_roots, chunk.primitive_numbers,
                                counters..., rays.origin_tmin, rays.direction_tmax, answers);
        };
        const std::uint64_t passes = strategy == Strategy::brute
                                         ? std::max<std::uint64_t>(1, (turn.brute_tests + kBrutePass - 1) / kBrutePass)
                                         : 1;
        const std::uint32_t flags_of_turn = params.flags;
        for (std::uint64_t pass = 0; pass < passes; ++pass) {
            const bool is_last = pass + 1 == passes;
            if (pass > 0) context_.guarded("clEnqueueBarrierWithWaitList", [&] { queue.enqueueBarrierWithWaitList(); });
            params.pass = static_cast<std::uint32_t>(pass);
            params.flags =
                flags_of_turn | (pass > 0 ? CASTOR_TRACE_GOES_ON : 0u) | (is_last ? 0u : CASTOR_TRACE_MORE_FOLLOWS);
            for (std::size_t done = 0; done < count; done += launch_rays) {
                params.first_ray = static_cast<std::uint32_t>(first + done);
                params.ray_count = static_cast<std::uint32_t>(std::min(launch_rays, count - done));
                if (work) {
                    WorkCounters counters(context_, item_count(params.ray_count));
                    launch(nullptr, counters.buffer());
                    counters.add_to(*work);
                } else {
                    launch(is_last && turn.is_last && done + launch_rays >= count ? event : nullptr);
                }
            }
        }
    });
}

}  // namespace castor
