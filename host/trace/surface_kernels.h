#pragma once

#include <optional>
#include <string>

#include "opencl/device_context.h"
#include "trace/device_scene.h"
#include "trace/strategy.h"
#include "trace/trace_arguments.h"

namespace castor {

/// The kernels that find what rays met, and what textures say of it. For one thread.
class SurfaceKernels {
public:
    /// `program`: that of a wave. Textures are applied where there are some.
    SurfaceKernels(DeviceContext& context, bool has_textures, const KernelProgram& program);
    /// The same where there is no wave.
    SurfaceKernels(DeviceContext& context, bool has_textures);
    bool has_textures() const { return find_textured_surface_kernel_.has_value(); }

    /// Rays, the hits that were found for them, and which chunks are asked: null: all. What moves has its surfaces
    /// found as it rests, with rays that are moved instead.
    struct Query {
        DeviceColumn<columns::ray_origin_tmin> origin_tmin;
        DeviceColumn<columns::ray_direction_tmax> direction_tmax;
        DeviceColumn<columns::hits> hits;
        std::size_t count;
        const DeviceScene::Subset* subset = nullptr;
        std::uint32_t flags = 0;  // CASTOR_TRACE_BENDS_NORMALS or none
    };
    struct Surfaces {
        DeviceColumn<columns::surface_position> position;
        DeviceColumn<columns::surface_normal> normal;
        DeviceColumn<columns::surface_material> material;
        DeviceColumn<columns::surface_diffuse> diffuse = {};  // where there are textures, as the next one
        DeviceColumn<columns::surface_specular> specular = {};
    };

    /// Enqueues on the context's queue what writes the surfaces of the hits that the chunks have.
    /// `pixel_spread`: the width of a pixel's cone of directions at distance 1, for textures.
    void find(const DeviceScene& scene, const Query& query, const Surfaces& surfaces, float pixel_spread);
    /// The same for texture coordinates.
    void find_uvs(const DeviceScene& scene, const Query& query, const DeviceColumn<columns::surface_uv>& uvs);

    struct Attributes {
        DeviceColumn<columns::surface_uvs> uvs;
        DeviceColumn<columns::surface_tangent> tangent;
        DeviceColumn<columns::surface_color> color;
    };
    /// The same for what principled materials need to know.
    void find_attributes(const DeviceScene& scene, const Query& query, const Attributes& attributes);
    /// Samples, and the bounce that their paths are at.
    struct Bounce {
        shared::RenderParams params;
        std::uint32_t node;
        std::uint32_t dimension;  // CASTOR_DIMENSION_...
        DeviceColumn<columns::pixel_blocks> pixel_blocks;
        DeviceColumn<columns::path_slot> path_slot;
        std::size_t block_count;  // of pixel_blocks in use
    };
    /// The same for which surfaces rays pass.
    void find_passed(const DeviceScene& scene, const Query& query, const Bounce& bounce,
                     const DeviceColumn<columns::passed>& passed);

private:
    DeviceContext& context_;
    std::optional<Kernel<FindSurface>> find_surface_kernel_;  // where there are no textures
    std::optional<Kernel<FindTexturedSurface>> find_textured_surface_kernel_;
    std::optional<Kernel<FindUvs>> find_uvs_kernel_;
    std::optional<Kernel<FindAttributes>> find_attributes_kernel_;
    std::optional<Kernel<FindPassed>> find_passed_kernel_;
};

}  // namespace castor
