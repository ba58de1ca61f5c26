#include "trace/surface_kernels.h"

namespace castor {

SurfaceKernels::SurfaceKernels(DeviceContext& context, bool has_textures, const KernelProgram& program)
    : context_(context) {
    if (has_textures)
        find_textured_surface_kernel_.emplace(context, program);
    else
        find_surface_kernel_.emplace(context, program);
}

SurfaceKernels::SurfaceKernels(DeviceContext& context, bool has_textures)
    : SurfaceKernels(context, has_textures,
                     {has_textures ? FindTexturedSurface::kProgram : FindSurface::kProgram, ""}) {}

void SurfaceKernels::find(const DeviceScene& scene, const Query& query, const Surfaces& surfaces, float pixel_spread) {
    const auto count = static_cast<cl_uint>(query.count);
    const shared::TextureParams texture_params{
        .path_count = count, .background = CASTOR_INVALID_INDEX, .pixel_spread = pixel_spread, .reserved = 0};
    const DeviceColumns& of_scene = scene.columns();
    scene.visit_chunks(
        context_.queue(), std::nullopt,
        [&](const DeviceScene::Turn& turn) {
            shared::TraceParams params = turn.params;
            params.flags |= query.flags;
            if (find_textured_surface_kernel_)
                find_textured_surface_kernel_->enqueue(count, {.texture_params = texture_params,
                                                               .params = params,
                                                               .scene = turn.chunk,
                                                               .vertex_uv = turn.chunk.vertex_uv,
                                                               .materials = of_scene.materials,
                                                               .textures = of_scene.textures,
                                                               .texture_uses = of_scene.texture_uses,
                                                               .texture_images = of_scene.texture_images,
                                                               .texels = of_scene.texels,
                                                               .ray_origin_tmin = query.origin_tmin,
                                                               .ray_direction_tmax = query.direction_tmax,
                                                               .hits = query.hits,
                                                               .surface_position = surfaces.position,
                                                               .surface_normal = surfaces.normal,
                                                               .surface_material = surfaces.material,
                                                               .surface_diffuse = surfaces.diffuse,
                                                               .surface_specular = surfaces.specular});
            else
                find_surface_kernel_->enqueue(count, {.path_count = count,
                                                      .params = params,
                                                      .scene = turn.chunk,
                                                      .ray_origin_tmin = query.origin_tmin,
                                                      .ray_direction_tmax = query.direction_tmax,
                                                      .hits = query.hits,
                                                      .surface_position = surfaces.position,
                                                      .surface_normal = surfaces.normal,
                                                      .surface_material = surfaces.material});
        },
        query.subset);
}

void SurfaceKernels::find_uvs(const DeviceScene& scene, const Query& query,
                              const DeviceColumn<columns::surface_uv>& uvs) {
    if (!find_uvs_kernel_) find_uvs_kernel_.emplace(context_);
    scene.visit_chunks(
        context_.queue(), std::nullopt,
        [&](const DeviceScene::Turn& turn) {
            find_uvs_kernel_->enqueue(query.count, {.path_count = static_cast<cl_uint>(query.count),
                                                    .params = turn.params,
                                                    .scene = turn.chunk,
                                                    .vertex_uv = turn.chunk.vertex_uv,
                                                    .ray_origin_tmin = query.origin_tmin,
                                                    .ray_direction_tmax = query.direction_tmax,
                                                    .hits = query.hits,
                                                    .surface_uv = uvs});
        },
        query.subset);
}

void SurfaceKernels::find_attributes(const DeviceScene& scene, const Query& query, const Attributes& attributes) {
    if (!find_attributes_kernel_) find_attributes_kernel_.emplace(context_);
    scene.visit_chunks(
        context_.queue(), std::nullopt,
        [&](const DeviceScene::Turn& turn) {
            find_attributes_kernel_->enqueue(query.count, {.path_count = static_cast<cl_uint>(query.count),
                                                           .params = turn.params,
                                                           .scene = turn.chunk,
                                                           .vertex_uv = turn.chunk.vertex_uv,
                                                           .vertex_attributes = turn.chunk.vertex_attributes,
                                                           .ray_origin_tmin = query.origin_tmin,
                                                           .ray_direction_tmax = query.direction_tmax,
                                                           .hits = query.hits,
                                                           .surface_uvs = attributes.uvs,
                                                           .surface_tangent = attributes.tangent,
                                                           .surface_color = attributes.color});
        },
        query.subset);
}

void SurfaceKernels::find_passed(const DeviceScene& scene, const Query& query, const Bounce& bounce,
                                 const DeviceColumn<columns::passed>& passed) {
    if (!find_passed_kernel_) find_passed_kernel_.emplace(context_);
    const DeviceColumns& of_scene = scene.columns();
    scene.visit_chunks(
        context_.queue(), std::nullopt,
        [&](const DeviceScene::Turn& turn) {
            find_passed_kernel_->enqueue(query.count, {.wave = bounce.params,
                                                       .node = bounce.node,
                                                       .dimension = bounce.dimension,
                                                       .params = turn.params,
                                                       .scene = turn.chunk,
                                                       .vertex_uv = turn.chunk.vertex_uv,
                                                       .vertex_attributes = turn.chunk.vertex_attributes,
                                                       .materials = of_scene.materials,
                                                       .principled_materials = of_scene.principled_materials,
                                                       .textures = of_scene.textures,
                                                       .texture_images = of_scene.texture_images,
                                                       .texels = of_scene.texels,
                                                       .pixel_blocks = bounce.pixel_blocks,
                                                       .path_slot = bounce.path_slot,
                                                       .ray_origin_tmin = query.origin_tmin,
                                                       .ray_direction_tmax = query.direction_tmax,
                                                       .hits = query.hits,
                                                       .passed = passed});
        },
        query.subset);
}

}  // namespace castor
