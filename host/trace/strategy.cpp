#include "trace/strategy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <iterator>
#include <set>

#include "base/name_table.h"

namespace castor {

namespace {

constexpr std::array kStrategies = {
    Named<Strategy>{Strategy::automatic, "auto"}, Named<Strategy>{Strategy::brute, "brute"},
    Named<Strategy>{Strategy::simt, "simt"},      Named<Strategy>{Strategy::wide, "wide"},
    Named<Strategy>{Strategy::packet, "packet"},
};

constexpr std::array kQueries = {
    Named<Query>{Query::closest, "closest"},
    Named<Query>{Query::any, "any"},
    Named<Query>{Query::count, "count"},
    Named<Query>{Query::list, "list"},
};

constexpr std::array kTreeQualities = {
    Named<TreeQuality>{TreeQuality::medium, "medium"},
    Named<TreeQuality>{TreeQuality::high, "high"},
};

/// The number in TraceWork of each of the kernels' counters.
constexpr auto kCounters = [] {
    std::array<std::uint64_t TraceWork::*, CASTOR_WORK_KINDS> counters{};
    counters[CASTOR_WORK_COMPRESSED_NODE] = &TraceWork::compressed_nodes;
    counters[CASTOR_WORK_NODE] = &TraceWork::wide_nodes;
    counters[CASTOR_WORK_BUNDLE_NODE] = &TraceWork::bundle_nodes;
    counters[CASTOR_WORK_BUNDLE_BOX] = &TraceWork::bundle_boxes;
    counters[CASTOR_WORK_TRIANGLE] = &TraceWork::triangles;
    counters[CASTOR_WORK_SPHERE] = &TraceWork::spheres;
    counters[CASTOR_WORK_PLANE] = &TraceWork::planes;
    counters[CASTOR_WORK_TRIANGLE_BLOCK] = &TraceWork::triangle_blocks;
    counters[CASTOR_WORK_SPHERE_BLOCK] = &TraceWork::sphere_blocks;
    counters[CASTOR_WORK_BUNDLE_BLOCK] = &TraceWork::bundle_blocks;
    counters[CASTOR_WORK_BUNDLE_TRIANGLE] = &TraceWork::bundle_triangles;
    counters[CASTOR_WORK_BUNDLE_SPHERE] = &TraceWork::bundle_spheres;
    counters[CASTOR_WORK_INSTANCE_NODE] = &TraceWork::instance_nodes;
    return counters;
}();

/// The counters of one launch, zero at first. Every work-item has its own: no atomics, and 32 bits are enough.
class WorkCounters {
public:
    WorkCounters(DeviceContext& context, std::size_t items) : context_(context), counts_(items) {
        column_ = make_column<columns::work>(context, items * CASTOR_WORK_KINDS);
        context.fill_zero(column_, bytes());
    }

    const DeviceColumn<columns::work>& column() const { return column_; }

    void add_to(TraceWork& work) {
        context_.read(column_, counts_.data(), bytes());
        for (const auto& item : counts_)
            for (std::size_t kind = 0; kind < kCounters.size(); ++kind) work.*kCounters[kind] += item[kind];
    }

private:
    std::size_t bytes() const { return counts_.size() * sizeof counts_[0]; }

    DeviceContext& context_;
    std::vector<std::array<cl_uint, CASTOR_WORK_KINDS>> counts_;
    DeviceColumn<columns::work> column_;
};

// Primitives that a launch of brute force tests for each ray: the fewest rays that a device is given, a block of
// pixels, then take a processor's core some 15 ms. That is half of the turns that some drivers give to loops
// (DeviceQuirks::loop_turns).
constexpr std::uint64_t kBrutePass = 1 << 15;

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

std::string_view to_string(Query query) {
    return name_of(kQueries, query);
}
Query query_from_string(std::string_view word) {
    return value_of(kQueries, word, "query");
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
    if (query == Query::count || query == Query::list)
        return closest_incoherent == Strategy::packet ? Strategy::wide : closest_incoherent;
    const bool coherent = hint == Coherence::coherent;
    if (query == Query::closest) return coherent ? closest_coherent : closest_incoherent;
    return coherent ? any_coherent : any_incoherent;
}

bool StrategyChoice::uses(Strategy strategy) const {
    return std::any_of(std::begin(kRayKindsOfChoice), std::end(kRayKindsOfChoice),
                       [&](const auto& kind) { return this->*kind.first == strategy; });
}

namespace {

std::string options_of_scene(bool has_spheres, bool has_planes, bool has_instances, bool has_chunks) {
    return fmt::format(
        "-DCASTOR_HAS_SPHERES={} -DCASTOR_HAS_PLANES={} -DCASTOR_HAS_INSTANCES={} -DCASTOR_HAS_CHUNKS={}",
        int{has_spheres}, int{has_planes}, int{has_instances}, int{has_chunks});
}

std::string program_of_strategy(std::string_view program, Strategy strategy) {
    return fmt::format("{}_{}", program, to_string(strategy));
}

}  // namespace

std::vector<KernelProgram> trace_programs(const SceneArrays& arrays, const Tuning& tuning,
                                          std::initializer_list<Coherence> hints) {
    const std::string options =
        options_of_scene(arrays.sphere_count() > 0, arrays.plane_count() > 0, !arrays.instances.empty(), false);
    std::set<Strategy> strategies;
    for (const Coherence hint : hints)
        for (const Query query : {Query::closest, Query::any}) strategies.insert(tuning.strategies.of(query, hint));
    std::vector<KernelProgram> programs;
    for (const Strategy strategy : strategies)
        if (walks_wide_tree(strategy))
            programs.push_back(
                {program_of_strategy(ClosestHit::kProgram, strategy), options + build_options(tuning, strategy)});
    return programs;
}

TraceKernels::TraceKernels(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning)
    : context_(context),
      tuning_(tuning),
      build_options_(
          options_of_scene(scene.has_spheres(), scene.has_planes(), scene.has_instances(), scene.chunk_count() > 1)),
      brute_options_(fmt::format("{} -DCASTOR_BRUTE_PASS={}", build_options_,
                                 scene.most_brute_tests() > kBrutePass ? kBrutePass : 0)),
      simt_options_(
          fmt::format("{} -DCASTOR_SIMT_STACK={}", build_options_, stack_entries(scene.compressed_levels()))) {}

/// Some rays and how they are traced.
struct TraceKernels::Batch {
    const cl::CommandQueue& queue;
    const DeviceScene& scene;
    const RayBuffers& rays;
    std::size_t first;
    std::size_t count;
    std::uint32_t flags;
    Strategy strategy;
    cl::Event* event = nullptr;  // complete when all answers are
};

/// One launch of a batch: some of its rays, against a chunk of the scene or a part of it.
struct TraceKernels::Launch {
    const DeviceColumns& chunk;
    shared::TraceParams params;
    std::size_t items;
    cl::Event* event;  // to be given to the launch; null for all but the last one
};

std::size_t TraceKernels::rays_per_item(Strategy strategy) const {
    return walks_wide_tree(strategy) ? tuning_.wide_batch : 1;
}

template <class Arguments>
Kernel<Arguments>& TraceKernels::kernel(Strategy strategy, const DeviceScene& scene) {
    auto& built = std::get<KernelsByStrategy<Arguments>>(kernels_);
    if (const auto found = built.find(strategy); found != built.end()) return found->second;
    const std::string& scene_options = strategy == Strategy::simt    ? simt_options_
                                       : strategy == Strategy::brute ? brute_options_
                                                                     : build_options_;
    std::string options = scene_options + build_options(tuning_, strategy);
    if (Arguments::kCountsWork) options += " -DCASTOR_COUNT_WORK=1";
    if (Arguments::kHasTimes) options += " -DCASTOR_HAS_MOTION=1";
    if (std::string_view(Arguments::kProgram) == CountCrossings::kProgram && strategy != Strategy::brute &&
        scene.has_pieces())
        options += " -DCASTOR_HAS_PIECES=1";
    const std::string_view suffix = to_string(strategy);
    const std::size_t local_size = walks_wide_tree(strategy) ? 1 : tuning_.local_size;
    return built
        .emplace(strategy, Kernel<Arguments>(context_, program_of_strategy(Arguments::kProgram, strategy),
                                             fmt::format("{}_{}", Arguments::kQuery, suffix), options, local_size))
        .first->second;
}

void TraceKernels::closest_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                               const Hits& hits, std::size_t first, std::size_t count, std::uint32_t flags,
                               Coherence hint, cl::Event* event) {
    const Strategy strategy = tuning_.strategies.of(Query::closest, hint);
    if (rays.time) {
        auto& built = kernel<TimedClosestHit>(strategy, scene);
        for_each_launch({queue, scene, rays, first, count, flags, strategy, event}, [&](const Launch& launch) {
            built.enqueue_on(queue, launch.items,
                             {.params = launch.params,
                              .scene = launch.chunk,
                              .ray_time = *rays.time,
                              .ray_origin_tmin = rays.origin_tmin,
                              .ray_direction_tmax = rays.direction_tmax,
                              .hits = hits},
                             launch.event);
        });
        return;
    }
    auto& built = kernel<ClosestHit>(strategy, scene);
    for_each_launch({queue, scene, rays, first, count, flags, strategy, event}, [&](const Launch& launch) {
        built.enqueue_on(queue, launch.items,
                         {.params = launch.params,
                          .scene = launch.chunk,
                          .ray_origin_tmin = rays.origin_tmin,
                          .ray_direction_tmax = rays.direction_tmax,
                          .hits = hits},
                         launch.event);
    });
}

void TraceKernels::any_hit(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                           const Occluded& occluded, std::size_t first, std::size_t count, std::uint32_t flags,
                           Coherence hint, cl::Event* event) {
    const Strategy strategy = tuning_.strategies.of(Query::any, hint);
    if (rays.time) {
        auto& built = kernel<TimedAnyHit>(strategy, scene);
        for_each_launch({queue, scene, rays, first, count, flags, strategy, event}, [&](const Launch& launch) {
            built.enqueue_on(queue, launch.items,
                             {.params = launch.params,
                              .scene = launch.chunk,
                              .ray_time = *rays.time,
                              .ray_origin_tmin = rays.origin_tmin,
                              .ray_direction_tmax = rays.direction_tmax,
                              .occluded = occluded},
                             launch.event);
        });
        return;
    }
    auto& built = kernel<AnyHit>(strategy, scene);
    for_each_launch({queue, scene, rays, first, count, flags, strategy, event}, [&](const Launch& launch) {
        built.enqueue_on(queue, launch.items,
                         {.params = launch.params,
                          .scene = launch.chunk,
                          .ray_origin_tmin = rays.origin_tmin,
                          .ray_direction_tmax = rays.direction_tmax,
                          .occluded = occluded},
                         launch.event);
    });
}

void TraceKernels::count_crossings(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                                   const CrossingCounts& counts, std::size_t first, std::size_t count,
                                   std::uint32_t flags, Coherence hint, cl::Event* event) {
    const Strategy strategy = tuning_.strategies.of(Query::count, hint);
    auto& built = kernel<CountCrossings>(strategy, scene);
    for_each_launch({queue, scene, rays, first, count, flags, strategy, event}, [&](const Launch& launch) {
        built.enqueue_on(queue, launch.items,
                         {.params = launch.params,
                          .scene = launch.chunk,
                          .ray_origin_tmin = rays.origin_tmin,
                          .ray_direction_tmax = rays.direction_tmax,
                          .crossing_counts = counts},
                         launch.event);
    });
}

void TraceKernels::list_crossings(const cl::CommandQueue& queue, const DeviceScene& scene, const RayBuffers& rays,
                                  std::uint32_t limit, const Crossings& crossings, const CrossingCounts& counts,
                                  std::size_t first, std::size_t count, std::uint32_t flags, Coherence hint,
                                  cl::Event* event) {
    const Strategy strategy = tuning_.strategies.of(Query::list, hint);
    auto& built = kernel<ListCrossings>(strategy, scene);
    for_each_launch({queue, scene, rays, first, count, flags, strategy, event}, [&](const Launch& launch) {
        built.enqueue_on(queue, launch.items,
                         {.limit = limit,
                          .params = launch.params,
                          .scene = launch.chunk,
                          .ray_origin_tmin = rays.origin_tmin,
                          .ray_direction_tmax = rays.direction_tmax,
                          .crossings = crossings,
                          .crossing_counts = counts},
                         launch.event);
    });
}

void TraceKernels::count_closest_hit(const DeviceScene& scene, const RayBuffers& rays, const Hits& hits,
                                     std::size_t count, std::uint32_t flags, Coherence hint, TraceWork& work) {
    const Strategy strategy = tuning_.strategies.of(Query::closest, hint);
    auto& built = kernel<CountedClosestHit>(strategy, scene);
    for_each_launch({context_.queue(), scene, rays, 0, count, flags, strategy}, [&](const Launch& launch) {
        WorkCounters counters(context_, launch.items);
        built.enqueue(launch.items, {.params = launch.params,
                                     .scene = launch.chunk,
                                     .work = counters.column(),
                                     .ray_origin_tmin = rays.origin_tmin,
                                     .ray_direction_tmax = rays.direction_tmax,
                                     .hits = hits});
        counters.add_to(work);
    });
}

void TraceKernels::count_any_hit(const DeviceScene& scene, const RayBuffers& rays, const Occluded& occluded,
                                 std::size_t count, std::uint32_t flags, Coherence hint, TraceWork& work) {
    const Strategy strategy = tuning_.strategies.of(Query::any, hint);
    auto& built = kernel<CountedAnyHit>(strategy, scene);
    for_each_launch({context_.queue(), scene, rays, 0, count, flags, strategy}, [&](const Launch& launch) {
        WorkCounters counters(context_, launch.items);
        built.enqueue(launch.items, {.params = launch.params,
                                     .scene = launch.chunk,
                                     .work = counters.column(),
                                     .ray_origin_tmin = rays.origin_tmin,
                                     .ray_direction_tmax = rays.direction_tmax,
                                     .occluded = occluded});
        counters.add_to(work);
    });
}

/// Calls enqueue(launch) for all launches of a batch in order: chunk by chunk, of brute force pass by pass, and at most
/// the tuning's launch_items work-items at a time.
template <class Enqueue>
void TraceKernels::for_each_launch(const Batch& batch, const Enqueue& enqueue) const {
    const std::size_t per_item = rays_per_item(batch.strategy);
    const std::size_t launch_rays = tuning_.launch_items * per_item;
    std::size_t last_launches = 0;  // which write the answers for good
    const auto visit = [&](const DeviceScene::Turn& turn) {
        shared::TraceParams params = turn.params;
        params.ray_stride = batch.rays.interleaved ? 2 : 1;
        params.direction_offset = batch.rays.interleaved ? 1 : 0;
        const std::uint64_t passes = batch.strategy == Strategy::brute
                                         ? std::max<std::uint64_t>(1, (turn.brute_tests + kBrutePass - 1) / kBrutePass)
                                         : 1;
        for (std::uint64_t pass = 0; pass < passes; ++pass) {
            const bool is_last_pass = pass + 1 == passes;
            if (pass > 0)
                context_.guarded("clEnqueueBarrierWithWaitList", [&] { batch.queue.enqueueBarrierWithWaitList(); });
            params.pass = static_cast<std::uint32_t>(pass);
            params.flags = turn.params.flags | batch.flags | (pass > 0 ? CASTOR_TRACE_GOES_ON : 0u) |
                           (is_last_pass ? 0u : CASTOR_TRACE_MORE_FOLLOWS);
            for (std::size_t done = 0; done < batch.count; done += launch_rays) {
                const std::size_t rays = std::min(launch_rays, batch.count - done);
                params.first_ray = static_cast<std::uint32_t>(batch.first + done);
                params.ray_count = static_cast<std::uint32_t>(rays);
                last_launches += turn.is_last && is_last_pass;
                const bool is_last = turn.is_last && is_last_pass && done + rays == batch.count;
                enqueue(Launch{turn.chunk, params, (rays + per_item - 1) / per_item, is_last ? batch.event : nullptr});
            }
        }
    };
    batch.scene.visit_chunks(batch.queue, batch.rays.from, visit, batch.rays.subset);
    // The caller's queue may run launches in any order: the last one's event says nothing of the others.
    if (batch.event && last_launches != 1)
        context_.guarded("clEnqueueMarkerWithWaitList",
                         [&] { batch.queue.enqueueMarkerWithWaitList(nullptr, batch.event); });
}

}  // namespace castor
