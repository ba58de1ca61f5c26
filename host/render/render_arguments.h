#pragma once

#include "opencl/kernel_arguments.h"
#include "trace/trace_arguments.h"

namespace castor {

// The arguments of the kernels of a wave; see kernel_arguments.h.
// clang-format off

#define CASTOR_GENERATE_RAYS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                    \
    value(Camera, camera)                                          \
    in(pixel_blocks)                                               \
    out(ray_origin_tmin)                                           \
    out(ray_direction_tmax)                                        \
    out(ray_counts)

#define CASTOR_TEXTURE_BACKGROUND_ARGUMENTS(value, in, out, columns_of) \
    value(TextureParams, texture_params)                                \
    value(RenderParams, params)                                         \
    value(Camera, camera)                                               \
    in(textures)                                                        \
    in(texture_images)                                                  \
    in(texels)                                                          \
    in(pixel_blocks)                                                    \
    in(surface_material)                                                \
    out(surface_diffuse)

#define CASTOR_DRAW_TIMES_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                 \
    in(pixel_blocks)                                            \
    in(path_slot)                                               \
    in(path_state)                                              \
    out(ray_time)

#define CASTOR_MOVE_RAYS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                \
    in(instances)                                              \
    in(ray_time)                                               \
    in(hits)                                                   \
    in(ray_origin_tmin)                                        \
    out(rest_origin_tmin)

#define CASTOR_MOVE_SURFACES_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                    \
    in(instances)                                                  \
    in(ray_time)                                                   \
    in(hits)                                                       \
    out(surface_position)

#define CASTOR_SHADE_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                            \
    value(uint, depth)                                     \
    value(uint, terms_of_bounce)                           \
    in(materials)                                          \
    in(lights)                                             \
    in(texture_images)                                     \
    in(texels)                                             \
    in(path_slot)                                          \
    in(path_state)                                         \
    in(ray_direction_tmax)                                 \
    in(hits)                                               \
    in(surface_normal)                                     \
    in(surface_material)                                   \
    in(surface_diffuse)                                    \
    out(path_throughput)                                   \
    out(path_terms)                                        \
    out(film_sum)                                          \
    out(film_terms)

#define CASTOR_GENERATE_SHADOW_RAYS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                           \
    value(uint, node)                                                     \
    value(uint, first_light)                                              \
    value(uint, light_count)                                              \
    value(uint, row_length)                                               \
    value(uint, first_term)                                               \
    in(lights)                                                            \
    in(emitters)                                                          \
    in(instances)                                                         \
    in(texture_images)                                                    \
    in(texels)                                                            \
    in(environment_parts)                                                 \
    in(pixel_blocks)                                                      \
    in(materials)                                                         \
    in(path_slot)                                                         \
    in(path_state)                                                        \
    in(ray_time)                                                          \
    in(surface_position)                                                  \
    in(surface_normal)                                                    \
    in(ray_direction_tmax)                                                \
    in(surface_material)                                                  \
    in(surface_diffuse)                                                   \
    in(surface_specular)                                                  \
    in(path_throughput)                                                   \
    out(shadow_origin_tmin)                                               \
    out(shadow_direction_tmax)                                            \
    out(shadow_contribution)                                              \
    out(film_terms)                                                       \
    out(ray_counts)

#define CASTOR_ACCUMULATE_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                 \
    value(uint, light_count)                                    \
    value(uint, row_length)                                     \
    value(uint, first_term)                                     \
    in(path_slot)                                               \
    in(shadow_contribution)                                     \
    in(occluded)                                                \
    out(film_sum)                                               \
    out(film_terms)

#define CASTOR_SCATTER_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                              \
    value(uint, node)                                        \
    value(uint, row_length)                                  \
    in(materials)                                            \
    in(pixel_blocks)                                         \
    in(path_slot)                                            \
    in(path_state)                                           \
    in(surface_position)                                     \
    in(surface_normal)                                       \
    in(ray_direction_tmax)                                   \
    in(surface_material)                                     \
    in(surface_diffuse)                                      \
    in(surface_specular)                                     \
    out(path_throughput)                                     \
    out(next_slot)                                           \
    out(next_origin_tmin)                                    \
    out(next_direction_tmax)                                 \
    out(next_throughput)                                     \
    out(next_state)                                          \
    out(next_rank)                                           \
    out(ray_counts)

#define CASTOR_FIND_BASE_COLORS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                       \
    value(PathParams, path)                                           \
    in(materials)                                                     \
    in(principled_materials)                                          \
    in(textures)                                                      \
    in(texture_images)                                                \
    in(texels)                                                        \
    in(pixel_blocks)                                                  \
    in(path_slot)                                                     \
    in(ray_direction_tmax)                                            \
    in(hits)                                                          \
    in(surface_normal)                                                \
    in(surface_material)                                              \
    in(surface_uvs)                                                   \
    in(surface_tangent)                                               \
    in(surface_color)                                                 \
    out(surface_diffuse)

#define CASTOR_PASS_PANES_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                 \
    value(PathParams, path)                                     \
    value(uint, dimension)                                      \
    value(uint, has_places)                                     \
    in(materials)                                               \
    in(principled_materials)                                    \
    in(textures)                                                \
    in(texture_images)                                          \
    in(texels)                                                  \
    in(pixel_blocks)                                            \
    in(path_slot)                                               \
    in(passing_places)                                          \
    in(ray_origin_tmin)                                         \
    in(ray_direction_tmax)                                      \
    in(hits)                                                    \
    in(surface_normal)                                          \
    in(surface_material)                                        \
    in(surface_uvs)                                             \
    in(surface_tangent)                                         \
    in(surface_color)                                           \
    in(shadow_length)                                           \
    out(shadow_medium)                                          \
    out(shadow_outer)                                           \
    out(shadow_contribution)                                    \
    out(passed)

#define CASTOR_SCATTER_WITHIN_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                     \
    value(PathParams, path)                                         \
    value(uint, step)                                               \
    value(uint, is_last)                                            \
    value(uint, has_roulette)                                       \
    value(uint, sees_lights)                                        \
    in(materials)                                                   \
    in(principled_materials)                                        \
    in(lights)                                                      \
    in(light_groups)                                                \
    in(pixel_blocks)                                                \
    in(path_slot)                                                   \
    in(passing_places)                                              \
    in(inside_hits)                                                 \
    out(hits)                                                       \
    out(ray_origin_tmin)                                            \
    out(ray_direction_tmax)                                         \
    out(passing_origin_tmin)                                        \
    out(passing_direction_tmax)                                     \
    out(path_throughput)                                            \
    out(path_state)                                                 \
    out(passed)                                                     \
    out(shadow_origin_tmin)                                         \
    out(shadow_direction_tmax)                                      \
    out(shadow_contribution)                                        \
    out(shadow_medium)                                              \
    out(shadow_outer)

#define CASTOR_LIGHT_WITHIN_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                   \
    in(path_slot)                                                 \
    in(path_state)                                                \
    out(shadow_origin_tmin)                                       \
    out(shadow_direction_tmax)                                    \
    out(shadow_contribution)                                      \
    out(shadow_length)                                            \
    out(ray_counts)

#define CASTOR_SHADE_PATHS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                  \
    value(PathParams, path)                                      \
    in(materials)                                                \
    in(principled_materials)                                     \
    in(lights)                                                   \
    in(emitters)                                                 \
    in(instances)                                                \
    in(textures)                                                 \
    in(texture_images)                                           \
    in(texels)                                                   \
    in(environment_parts)                                        \
    in(light_nodes)                                              \
    in(light_groups)                                             \
    in(emission_groups)                                          \
    in(pixel_blocks)                                             \
    in(path_slot)                                                \
    in(ray_time)                                                 \
    in(ray_origin_tmin)                                          \
    in(ray_direction_tmax)                                       \
    in(hits)                                                     \
    in(surface_position)                                         \
    in(surface_normal)                                           \
    in(surface_material)                                         \
    in(surface_diffuse)                                          \
    in(surface_specular)                                         \
    in(surface_uvs)                                              \
    in(surface_tangent)                                          \
    in(surface_color)                                            \
    out(path_throughput)                                         \
    out(path_state)                                              \
    out(film_terms)                                              \
    out(shadow_origin_tmin)                                      \
    out(shadow_direction_tmax)                                   \
    out(shadow_contribution)                                     \
    out(shadow_length)                                           \
    out(shadow_medium)                                           \
    out(shadow_outer)                                            \
    out(next_slot)                                               \
    out(next_origin_tmin)                                        \
    out(next_direction_tmax)                                     \
    out(next_rank)                                               \
    out(ray_counts)

#define CASTOR_GO_ON_BEYOND_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                   \
    value(uint, count)                                            \
    value(uint, has_places)                                       \
    value(uint, are_shadow_rays)                                  \
    value(uint, are_scattered)                                    \
    value(uint, is_last)                                          \
    value(uint, has_times)                                        \
    value(uint, turn)                                             \
    in(passing_places)                                            \
    in(inside_hits)                                               \
    in(passed)                                                    \
    in(path_slot)                                                 \
    in(ray_time)                                                  \
    in(ray_origin_tmin)                                           \
    in(ray_direction_tmax)                                        \
    out(hits)                                                     \
    out(occluded)                                                 \
    out(passing_counts)                                           \
    out(next_passing_places)                                      \
    out(passing_slot)                                             \
    out(passing_time)                                             \
    out(passing_origin_tmin)                                      \
    out(passing_direction_tmax)

#define CASTOR_LIMIT_SAMPLES_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                    \
    value(PathParams, path)                                        \
    value(uint, group_count)                                       \
    out(film_terms)

#define CASTOR_SELECT_RAYS_INSIDE_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                         \
    in(path_slot)                                                       \
    in(path_state)                                                      \
    in(ray_origin_tmin)                                                 \
    in(ray_direction_tmax)                                              \
    out(shadow_origin_tmin)                                             \
    out(shadow_direction_tmax)

#define CASTOR_TAKE_HITS_INSIDE_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                       \
    in(path_slot)                                                     \
    in(path_state)                                                    \
    in(inside_hits)                                                   \
    out(hits)

#define CASTOR_RANK_PATHS_ARGUMENTS(value, in, out, columns_of) \
    value(uint, place_count)                                    \
    out(next_rank)                                              \
    out(next_block_places)

#define CASTOR_COMPACT_PATHS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                    \
    in(next_rank)                                                  \
    in(next_block_places)                                          \
    in(next_slot)                                                  \
    in(next_origin_tmin)                                           \
    in(next_direction_tmax)                                        \
    out(path_slot)                                                 \
    out(ray_origin_tmin)                                           \
    out(ray_direction_tmax)

#define CASTOR_LIST_BRANCHES_ARGUMENTS(value, in, out, columns_of) \
    value(uint, place_count)                                       \
    in(next_rank)                                                  \
    in(next_block_places)                                          \
    out(branch_list)

#define CASTOR_TAKE_BRANCHES_ARGUMENTS(value, in, out, columns_of) \
    value(uint, path_count)                                        \
    value(uint, first)                                             \
    in(branch_list)                                                \
    in(next_origin_tmin)                                           \
    in(next_direction_tmax)                                        \
    out(path_slot)                                                 \
    out(ray_origin_tmin)                                           \
    out(ray_direction_tmax)

#define CASTOR_ADD_BRANCHES_ARGUMENTS(value, in, out, columns_of) \
    value(uint, path_count)                                       \
    value(uint, first)                                            \
    value(uint, is_eye)                                           \
    value(uint, row_length)                                       \
    in(branch_list)                                               \
    in(branch_sums)                                               \
    out(film_terms)

#define CASTOR_ADD_FEATURES_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                   \
    value(uint, row_length)                                       \
    in(materials)                                                 \
    in(hits)                                                      \
    in(surface_position)                                          \
    in(surface_normal)                                            \
    in(surface_material)                                          \
    in(surface_diffuse)                                           \
    out(film_features)

#define CASTOR_ADD_GROUPS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                 \
    value(uint, row_length)                                     \
    value(uint, first_row)                                      \
    value(uint, group_count)                                    \
    in(film_terms)                                              \
    out(film_features)

#define CASTOR_ADD_SAMPLES_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                  \
    in(path_terms)                                               \
    in(film_terms)                                               \
    out(film_sum)

#define CASTOR_RESOLVE_ARGUMENTS(value, in, out, columns_of) \
    value(uint, pixel_count)                                 \
    value(uint, sample_count)                                \
    in(film_sum)                                             \
    out(pixel_means)

#define CASTOR_WRITE_AOVS_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, params)                                 \
    in(materials)                                               \
    in(ray_origin_tmin)                                         \
    in(hits)                                                    \
    in(surface_position)                                        \
    in(surface_normal)                                          \
    in(surface_material)                                        \
    in(surface_diffuse)                                         \
    in(surface_uv)                                              \
    out(aov_position_depth)                                     \
    out(aov_normal)                                             \
    out(aov_barycentric_t)                                      \
    out(aov_primitive_instance_material)                        \
    out(aov_albedo)                                             \
    out(aov_uv)

// clang-format on

struct GenerateRays {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "generate_rays";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_GENERATE_RAYS_ARGUMENTS)
};

struct TextureBackground {
    static constexpr const char* kProgram = "textured_wave.lanes";
    static constexpr const char* kKernel = "texture_background";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_TEXTURE_BACKGROUND_ARGUMENTS)
};

struct DrawTimes {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "draw_times";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_DRAW_TIMES_ARGUMENTS)
};

struct MoveRays {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "move_rays";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_MOVE_RAYS_ARGUMENTS)
};

struct MoveSurfaces {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "move_surfaces";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_MOVE_SURFACES_ARGUMENTS)
};

struct Shade {
    static constexpr const char* kProgram = "render.lanes";
    static constexpr const char* kKernel = "shade";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_SHADE_ARGUMENTS)
};

struct GenerateShadowRays {
    static constexpr const char* kProgram = "render.lanes";
    static constexpr const char* kKernel = "generate_shadow_rays";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_GENERATE_SHADOW_RAYS_ARGUMENTS)
};

struct Accumulate {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "accumulate";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_ACCUMULATE_ARGUMENTS)
};

struct Scatter {
    static constexpr const char* kProgram = "render.lanes";
    static constexpr const char* kKernel = "scatter";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_SCATTER_ARGUMENTS)
};

struct FindBaseColors {
    static constexpr const char* kProgram = "trace_paths.lanes";
    static constexpr const char* kKernel = "find_base_colors";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_FIND_BASE_COLORS_ARGUMENTS)
};

struct ShadePaths {
    static constexpr const char* kProgram = "trace_paths.lanes";
    static constexpr const char* kKernel = "shade_paths";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_SHADE_PATHS_ARGUMENTS)
};

struct PassPanes {
    static constexpr const char* kProgram = "trace_paths.lanes";
    static constexpr const char* kKernel = "pass_panes";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_PASS_PANES_ARGUMENTS)
};

struct ScatterWithin {
    static constexpr const char* kProgram = "trace_paths.lanes";
    static constexpr const char* kKernel = "scatter_within";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_SCATTER_WITHIN_ARGUMENTS)
};

struct LightWithin {
    static constexpr const char* kProgram = "trace_paths.lanes";
    static constexpr const char* kKernel = "light_within";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_LIGHT_WITHIN_ARGUMENTS)
};

struct GoOnBeyond {
    static constexpr const char* kProgram = "opacity";
    static constexpr const char* kKernel = "go_on_beyond";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_GO_ON_BEYOND_ARGUMENTS)
};

struct LimitSamples {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "limit_samples";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_LIMIT_SAMPLES_ARGUMENTS)
};

struct SelectRaysInside {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "select_rays_inside";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_SELECT_RAYS_INSIDE_ARGUMENTS)
};

struct TakeHitsInside {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "take_hits_inside";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_TAKE_HITS_INSIDE_ARGUMENTS)
};

struct RankPaths {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "rank_paths";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_RANK_PATHS_ARGUMENTS)
};

struct CompactPaths {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "compact_paths";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_COMPACT_PATHS_ARGUMENTS)
};

struct ListBranches {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "list_branches";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_LIST_BRANCHES_ARGUMENTS)
};

struct TakeBranches {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "take_branches";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_TAKE_BRANCHES_ARGUMENTS)
};

struct AddBranches {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "add_branches";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_ADD_BRANCHES_ARGUMENTS)
};

/// Of pictures with planes of means.
struct AddFeatures {
    static constexpr const char* kProgram = "add_features";
    static constexpr const char* kKernel = "add_features";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_ADD_FEATURES_ARGUMENTS)
};

/// Of pictures with planes of groups of lights.
struct AddGroups {
    static constexpr const char* kProgram = "add_groups";
    static constexpr const char* kKernel = "add_groups";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_ADD_GROUPS_ARGUMENTS)
};

struct AddSamples {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "add_samples";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_ADD_SAMPLES_ARGUMENTS)
};

struct Resolve {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "resolve";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_RESOLVE_ARGUMENTS)
};

struct WriteAovs {
    static constexpr const char* kProgram = "write_aovs";
    static constexpr const char* kKernel = "write_aovs";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_WRITE_AOVS_ARGUMENTS)
};

}  // namespace castor
