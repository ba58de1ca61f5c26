// The columns of a wave, written once and read by both compilers; compare scene_columns.h. The buffers of a wave, their
// sizes and the parameters of the kernels that use them follow from this list.
//
// A slot belongs to one sample of one pixel while that sample is traced: see kernels/device/slots.cl. The queue holds
// the slots of the paths that go on; a place is a position in the queue. What a bounce makes (rays, hits, surfaces) is
// kept by place, so that all stages read and write without gaps; what a path takes from bounce to bounce is kept by
// slot. At the first bounce each path is at the place of its slot with throughput 1: path_slot and path_throughput mean
// nothing there (CASTOR_RENDER_FIRST_BOUNCE).
#ifndef CASTOR_SHARED_WAVE_COLUMNS_H
#define CASTOR_SHARED_WAVE_COLUMNS_H

#include "castor/shared/types.h"

// A row: column(name, element on the host, element on the device, one per)
//
//   element   The device may read an element as several: three floats for a glm::vec3.
//   one per   place, slot, pixel: a wave has room for equally many of each. block: CASTOR_BLOCK_SLOTS of these.
//             texture: as place, in waves of scenes that have textures.
//             attribute: as place, where principled materials have textures, or vertices have colours.
//             none: not made with the others. next_origin_tmin and next_direction_tmax use the memory of the shadow
//             rays, which a bounce needs no more when it scatters; where paths are traced by shade_paths they have
//             an element for each place; film_terms, made when it is needed, has a row of slots for each term of a
//             sample, or after that of the sample one for each group of lights; film_features, made where a picture
//             has planes of means or of groups, has a row of pixels for each of CASTOR_FEATURE_..., if there are
//             means, and then for each group; light_groups has the group of each light, and of what is no light's,
//             emission_groups that of each material's emission; path_state, made where paths are traced by
//             shade_paths, has one row of slots; where paths branch at dielectrics, each level of branches has
//             path_state, path_throughput, film_terms, next_origin_tmin and next_direction_tmax of its own, with an
//             element for each branch, which the level before knows as next_state, next_throughput and branch_sums,
//             and branch_list with the numbers of those that there are; surface_uv and the planes of write_aovs have
//             one element for each pixel; inside_hits has one for each place where rays are traced once more, inside
//             dielectrics or beyond surfaces that they pass, where passed and passing_... have as many; ray_time has
//             one for each place where something moves, and rest_origin_tmin then uses the memory of the shadow
//             rays, or has memory of its own for shadow rays that meet panes; shadow_length, made where there are
//             panes, has for each place the length of the path up to its shadow ray; shadow_medium and shadow_outer,
//             made where there are solids of index 1, in which solids the rest of the shadow ray begins
//             (media.lanes.cl), or CASTOR_STOPPED_BY_SOLIDS.
//
// Rays that go on beyond a surface are put side by side: passing_places has their places, the other columns passing_...
// what stands there of them, next_passing_places the places of those that go on once more, and passing_counts, with two
// elements, how many those are.
//
// A work-item of a stage adds the rays that it makes to the element of ray_counts with its own number.
//
// surface_diffuse and surface_specular hold the reflectances that shading takes where a scene has textures; w of
// surface_diffuse is 1 where the surface sends surface_diffuse itself, without shading. surface_specular, and that w,
// mean nothing where no texture can change them (CASTOR_HAS_OTHER_TEXTURES).
//
// The columns next_... hold the rays of the next bounce at the places of this one, until compact_paths moves them.
// clang-format off
#define CASTOR_WAVE_COLUMNS(column)                                           \
    column(path_slot,                       std::uint32_t, uint,   place)     \
    column(ray_origin_tmin,                 glm::vec4,     float4, place)     \
    column(ray_direction_tmax,              glm::vec4,     float4, place)     \
    column(ray_time,                        float,         float,  none)      \
    column(rest_origin_tmin,                glm::vec4,     float4, none)      \
    column(hits,                            shared::Hit,   Hit,    place)     \
    column(surface_position,                glm::vec4,     float4, place)     \
    column(surface_normal,                  glm::vec4,     float4, place)     \
    column(surface_material,                std::uint32_t, uint,   place)     \
    column(surface_diffuse,                 glm::vec4,     float4, texture)   \
    column(surface_specular,                glm::vec4,     float4, texture)   \
    column(surface_uv,                      glm::vec2,     float2, none)      \
    column(surface_uvs,                     glm::vec4,     float4, attribute) \
    column(surface_tangent,                 glm::vec4,     float4, attribute) \
    column(surface_color,                   glm::vec4,     float4, attribute) \
    column(light_groups,                    std::uint32_t, uint,   none)      \
    column(emission_groups,                 std::uint32_t, uint,   none)      \
    column(shadow_origin_tmin,              glm::vec4,     float4, place)     \
    column(shadow_direction_tmax,           glm::vec4,     float4, place)     \
    column(shadow_contribution,             glm::vec4,     float4, place)     \
    column(shadow_length,                   float,         float,  none)      \
    column(shadow_medium,                   std::uint32_t, uint,   none)      \
    column(shadow_outer,                    std::uint32_t, uint,   none)      \
    column(occluded,                        std::uint8_t,  uchar,  place)     \
    column(next_slot,                       std::uint32_t, uint,   place)     \
    column(next_origin_tmin,                glm::vec4,     float4, none)      \
    column(next_direction_tmax,             glm::vec4,     float4, none)      \
    column(next_rank,                       std::uint8_t,  uchar,  place)     \
    column(next_block_places,               std::uint32_t, uint,   block)     \
    column(path_throughput,                 glm::vec4,     float4, slot)      \
    column(path_terms,                      std::uint32_t, uint,   slot)      \
    column(path_state,                      glm::uvec4,    uint4,  none)      \
    column(next_throughput,                 glm::vec4,     float4, none)      \
    column(next_state,                      glm::uvec4,    uint4,  none)      \
    column(branch_list,                     std::uint32_t, uint,   none)      \
    column(branch_sums,                     glm::vec4,     float4, none)      \
    column(inside_hits,                     shared::Hit,   Hit,    none)      \
    column(passed,                          std::uint8_t,  uchar,  none)      \
    column(passing_places,                  std::uint32_t, uint,   none)      \
    column(next_passing_places,             std::uint32_t, uint,   none)      \
    column(passing_counts,                  std::uint32_t, uint,   none)      \
    column(passing_slot,                    std::uint32_t, uint,   none)      \
    column(passing_time,                    float,         float,  none)      \
    column(passing_origin_tmin,             glm::vec4,     float4, none)      \
    column(passing_direction_tmax,          glm::vec4,     float4, none)      \
    column(ray_counts,                      std::uint32_t, uint,   place)     \
    column(pixel_blocks,                    std::uint32_t, uint,   block)     \
    column(film_sum,                        glm::vec4,     float4, pixel)     \
    column(pixel_means,                     glm::vec3,     float,  pixel)     \
    column(film_terms,                      glm::vec4,     float4, none)      \
    column(film_features,                   glm::vec4,     float4, none)      \
    column(aov_position_depth,              glm::vec4,     float4, none)      \
    column(aov_normal,                      glm::vec4,     float4, none)      \
    column(aov_barycentric_t,               glm::vec4,     float4, none)      \
    column(aov_primitive_instance_material, glm::uvec4,    uint4,  none)      \
    column(aov_albedo,                      glm::vec4,     float4, none)      \
    column(aov_uv,                          glm::vec4,     float4, none)
// clang-format on

#ifdef __OPENCL_VERSION__
// Parameters of kernels: CASTOR_READ(hits) is `const global Hit *restrict hits`, and CASTOR_WRITE(hits) the same
// without const. A column that is not in the list does not compile.
#define CASTOR_DEFINE_ELEMENT(name, host, device, per) typedef device name##_element;
CASTOR_WAVE_COLUMNS(CASTOR_DEFINE_ELEMENT)
#undef CASTOR_DEFINE_ELEMENT
#define CASTOR_READ(name) const global name##_element* restrict name
#define CASTOR_WRITE(name) global name##_element* restrict name
#endif

#endif
