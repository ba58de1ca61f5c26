#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "castor/tracer.h"
#include "opencl/device_context.h"
#include "reference/random_source.h"
#include "support/kernel_fixture.h"
#include "trace/device_scene.h"
#include "trace/strategy.h"
#include "trace/tuning.h"

namespace castor::test {

/// The way in which a scene is cut for a test.
struct Cut {
    std::size_t chunks;  // approximate number of chunks, by the size of columns
    bool streams;        // whether the device has memory of its own that holds half of the scene
};

/// A tracer for a scene in chunks, whose order differs from query to query.
class ChunkedTracer {
public:
    ChunkedTracer(const Scene& scene, Strategy strategy, TreeQuality quality, const Cut& cut)
        : prepared_(prepare(scene, strategy, quality, cut)), context_(device(cut)), scene_(context_, prepared_) {
        tuning_ = default_tuning(context_.device());
        tuning_.strategies = StrategyChoice::all(strategy);
    }

    std::size_t chunk_count() const { return scene_.chunk_count(); }
    std::size_t streaming_count() const { return scene_.streaming_count(); }

    void trace(const std::vector<Ray>& rays, std::vector<Hit>& hits, std::vector<std::uint8_t>& occluded,
               bool cull_back_faces = false) {
        hits.resize(rays.size());
        occluded.resize(rays.size());
        TraceKernels kernels(context_, scene_, tuning_);
        const cl::Buffer ray_buffer = context_.make_buffer(rays.size() * sizeof(Ray), "rays");
        const auto hit_buffer = make_column<columns::hits>(context_, rays.size());
        const auto occluded_buffer = make_column<columns::occluded>(context_, rays.size());
        context_.write(ray_buffer, rays.data(), rays.size() * sizeof(Ray));
        const std::uint32_t flags = cull_back_faces ? CASTOR_TRACE_CULL_BACK_FACES : 0;
        auto records = TraceKernels::RayBuffers::records(ray_buffer, random_.in_box(-3, 3));
        kernels.closest_hit(context_.queue(), scene_, records, hit_buffer, 0, rays.size(), flags,
                            Coherence::incoherent);
        records.from = random_.in_box(-3, 3);
        kernels.any_hit(context_.queue(), scene_, records, occluded_buffer, 0, rays.size(), flags,
                        Coherence::incoherent);
        context_.read(hit_buffer, hits.data(), rays.size() * sizeof(Hit));
        context_.read(occluded_buffer, occluded.data(), rays.size());
    }

    /// Writes as Tracer::list_crossings does, and returns what Tracer::count_crossings counts.
    std::vector<std::uint32_t> list_crossings(const std::vector<Ray>& rays, std::uint32_t limit,
                                              std::vector<Hit>& crossings, std::vector<std::uint32_t>& counts) {
        crossings.resize(rays.size() * limit);
        counts.resize(rays.size());
        TraceKernels kernels(context_, scene_, tuning_);
        const cl::Buffer ray_buffer = context_.make_buffer(rays.size() * sizeof(Ray), "rays");
        const auto crossing_buffer = make_column<columns::crossings>(context_, crossings.size());
        const auto count_buffer = make_column<columns::crossing_counts>(context_, rays.size());
        context_.write(ray_buffer, rays.data(), rays.size() * sizeof(Ray));
        auto records = TraceKernels::RayBuffers::records(ray_buffer, random_.in_box(-3, 3));
        kernels.list_crossings(context_.queue(), scene_, records, limit, crossing_buffer, count_buffer, 0, rays.size(),
                               0, Coherence::incoherent);
        context_.read(crossing_buffer, crossings.data(), crossings.size() * sizeof(Hit));
        context_.read(count_buffer, counts.data(), counts.size() * sizeof counts[0]);
        std::vector<std::uint32_t> counted(rays.size());
        records.from = random_.in_box(-3, 3);
        kernels.count_crossings(context_.queue(), scene_, records, count_buffer, 0, rays.size(), 0,
                                Coherence::incoherent);
        context_.read(count_buffer, counted.data(), counted.size() * sizeof counted[0]);
        return counted;
    }

private:
    SceneContents prepare(const Scene& scene, Strategy strategy, TreeQuality quality, const Cut& cut) {
        const std::vector<StrategyChoice> strategies{StrategyChoice::all(strategy)};
        const SceneSizes whole = sizes_of(build_scene(scene, strategies, quality).chunks.front(), {}, quality);
        ChunkLimits limits{whole.largest_column / cut.chunks + 1};
        if (cut.streams) limits.scene_bytes = scene_bytes_ = whole.total / 2;
        return build_scene(scene, strategies, quality, limits);
    }

    Device device(const Cut& cut) const {
        Device device = test_device();
        if (!cut.streams) return device;
        device.unified_memory = false;
        device.global_memory_bytes = 2 * scene_bytes_;  // half of which limits_of leaves to the scene
        return device;
    }

    std::uint64_t scene_bytes_ = 0;
    RandomSource random_{5};
    SceneContents prepared_;
    DeviceContext context_;
    DeviceScene scene_;
    Tuning tuning_;
};

}  // namespace castor::test
