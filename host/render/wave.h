#pragma once

#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

#include "castor/shared/types.h"
#include "opencl/device_context.h"
#include "trace/device_scene.h"
#include "trace/strategy.h"

namespace castor {

/// A rectangle of pixels.
struct Tile {
    std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

/// What the eye rays of a tile met: row-major columns of the tile, as `write_aovs` leaves them.
struct TileAovs {
    std::vector<float> position_depth;                        // 4 a pixel
    std::vector<float> normal;                                // 4 a pixel
    std::vector<float> barycentric_t;                         // 4 a pixel
    std::vector<std::uint32_t> primitive_instance_material;   // 4 a pixel
};

/// What all waves of a picture share.
struct WaveSettings {
    shared::Camera camera;
    shared::RenderParams params;  // without tile and sample
    std::uint32_t max_depth = 0;
    bool any_reflective = false;  // whether any material can send mirror rays under these rules
};

/// The buffers and kernels with which one device renders one tile at a time, wave by wave. For one thread.
class Wave {
public:
    /// No tile may be wider or higher than `largest_tile`.
    Wave(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning, const WaveSettings& settings, const Tile& largest_tile);

    /// Forgets the last tile and begins another.
    void begin_tile(const Tile& tile);
    /// Traces and shades one sample of every pixel of the tile.
    void trace_sample(std::uint32_t sample);
    /// The tile's pixels, row-major: means over `sample_count` samples.
    std::vector<glm::vec3> resolve(std::uint32_t sample_count);
    /// Rays traced for the tile so far: eye, shadow and mirror rays.
    std::uint64_t ray_count();
    /// What the eye rays through the pixels' centres of a tile meet. Ends the tile that was begun.
    TileAovs trace_aovs(const Tile& tile);

private:
    void generate_rays();
    void trace_closest_hits(std::uint32_t depth);
    void shade(std::uint32_t depth);
    void add_light(std::uint32_t light, std::uint32_t depth);
    std::uint32_t scatter();

    DeviceContext& context_;
    const DeviceScene& scene_;
    WaveSettings settings_;
    shared::RenderParams params_;
    Tile tile_;

    TraceKernels trace_kernels_;
    cl::Kernel generate_rays_kernel_;
    cl::Kernel shade_kernel_;
    cl::Kernel generate_shadow_rays_kernel_;
    cl::Kernel accumulate_kernel_;
    cl::Kernel scatter_kernel_;
    cl::Kernel resolve_kernel_;

    // One element a slot.
    TraceKernels::RayBuffers rays_;           // float4 columns ray_origin_tmin, ray_direction_tmax
    TraceKernels::RayBuffers shadow_rays_;    // likewise
    cl::Buffer hits_;                         // Hit
    cl::Buffer occluded_;                     // uchar
    cl::Buffer path_throughput_;              // float4
    cl::Buffer surface_position_;             // float4
    cl::Buffer surface_normal_;               // float4
    cl::Buffer surface_wo_;                   // float4
    cl::Buffer surface_material_;             // uint
    cl::Buffer shadow_contribution_;          // float4
    cl::Buffer film_sum_;                     // float4
    cl::Buffer ray_counts_;                   // uint
    cl::Buffer tile_pixels_;                  // 3 floats a pixel
    cl::Buffer alive_count_;                  // one uint
};

}  // namespace castor
