#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "castor/shared/types.h"
#include "opencl/device_context.h"
#include "trace/device_scene.h"
#include "trace/strategy.h"

namespace castor {

/// What the eye rays of a wave met, as `write_aovs` leaves it.
struct WaveAovs {
    std::vector<float> position_depth;                       // 4 a slot
    std::vector<float> normal;                               // 4 a slot
    std::vector<float> barycentric_t;                        // 4 a slot
    std::vector<std::uint32_t> primitive_instance_material;  // 4 a slot
};

/// What all waves of a picture share.
struct WaveSettings {
    shared::Camera camera;
    shared::RenderParams params;  // without slots and sample
    std::uint32_t max_depth = 0;
    bool any_reflective = false;  // whether any material can send mirror rays under these rules
};

/// The buffers and kernels with which one device renders some pixel blocks at a time, wave by wave. A pixel of these is
/// a slot: 64 a block, row by row, also where they lie outside the picture. For one thread.
class Wave {
public:
    /// For at most so many blocks at a time.
    Wave(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning, const WaveSettings& settings,
         std::size_t most_blocks);

    /// Forgets the last blocks and begins others: their codes (see PixelBlocks). `sums_before`, if there are any, is
    /// what `sums` gave for these blocks, to go on from with the samples after those.
    void begin(std::span<const std::uint32_t> blocks, std::span<const glm::vec4> sums_before = {});
    /// Enqueues the tracing and shading of one sample of every slot.
    void trace_sample(std::uint32_t sample);
    /// Returns when all that is enqueued is done, about `expected_seconds` from now.
    void wait(double expected_seconds) { context_.wait(expected_seconds); }
    /// Means over `sample_count` samples, one a slot.
    std::vector<glm::vec3> resolve(std::uint32_t sample_count);
    /// Sums over the samples, one a slot; w is nothing.
    std::vector<glm::vec4> sums();
    /// Rays traced since the last `begin`: eye, shadow and mirror rays.
    std::uint64_t ray_count();
    /// What the eye rays through the pixels' centres of the blocks meet. Forgets the blocks that were begun.
    WaveAovs trace_aovs(std::span<const std::uint32_t> blocks);

private:
    void generate_rays();
    void trace_closest_hits(std::uint32_t depth);
    void find_surfaces();
    void shade(std::uint32_t depth);
    void add_light(std::uint32_t light, std::uint32_t depth);
    std::uint32_t scatter();

    DeviceContext& context_;
    const DeviceScene& scene_;
    WaveSettings settings_;
    shared::RenderParams params_;

    TraceKernels trace_kernels_;
    cl::Kernel generate_rays_kernel_;
    Kernel<FindSurface> find_surface_kernel_;
    cl::Kernel shade_kernel_;
    cl::Kernel generate_shadow_rays_kernel_;
    cl::Kernel accumulate_kernel_;
    cl::Kernel scatter_kernel_;
    cl::Kernel resolve_kernel_;

    // One element a slot.
    TraceKernels::RayBuffers rays_;         // float4 columns ray_origin_tmin, ray_direction_tmax
    TraceKernels::RayBuffers shadow_rays_;  // likewise
    DeviceColumn<columns::hits> hits_;
    DeviceColumn<columns::occluded> occluded_;
    cl::Buffer path_throughput_;  // float4
    DeviceColumn<columns::surface_position> surface_position_;
    DeviceColumn<columns::surface_normal> surface_normal_;
    cl::Buffer surface_wo_;  // float4
    DeviceColumn<columns::surface_material> surface_material_;
    cl::Buffer shadow_contribution_;  // float4
    cl::Buffer film_sum_;             // float4
    cl::Buffer ray_counts_;           // uint
    cl::Buffer pixel_means_;          // 3 floats
    cl::Buffer pixel_blocks_;         // uint, one a block
    cl::Buffer alive_count_;          // one uint
};

}  // namespace castor
