// The columns of a wave, written once and read by both compilers; compare scene_columns.h.
#ifndef CASTOR_SHARED_WAVE_COLUMNS_H
#define CASTOR_SHARED_WAVE_COLUMNS_H

// A row: column(name, element on the host, element on the device, one per)
//
//   element   The device may read an element as several: three floats for a glm::vec3.
//   one per   slot: a pixel of the wave's pixel blocks. block: a pixel block. wave: one element.
// clang-format off
#define CASTOR_WAVE_COLUMNS(column)                                    \
    column(ray_origin_tmin,                 glm::vec4,     float4, slot)  \
    column(ray_direction_tmax,              glm::vec4,     float4, slot)  \
    column(shadow_origin_tmin,              glm::vec4,     float4, slot)  \
    column(shadow_direction_tmax,           glm::vec4,     float4, slot)  \
    column(hits,                            shared::Hit,   Hit,    slot)  \
    column(occluded,                        std::uint8_t,  uchar,  slot)  \
    column(path_throughput,                 glm::vec4,     float4, slot)  \
    column(surface_position,                glm::vec4,     float4, slot)  \
    column(surface_normal,                  glm::vec4,     float4, slot)  \
    column(surface_wo,                      glm::vec4,     float4, slot)  \
    column(surface_material,                std::uint32_t, uint,   slot)  \
    column(shadow_contribution,             glm::vec4,     float4, slot)  \
    column(film_sum,                        glm::vec4,     float4, slot)  \
    column(ray_counts,                      std::uint32_t, uint,   slot)  \
    column(pixel_means,                     glm::vec3,     float,  slot)  \
    column(pixel_blocks,                    std::uint32_t, uint,   block) \
    column(alive_count,                     std::uint32_t, uint,   wave)  \
    column(aov_position_depth,              glm::vec4,     float4, slot)  \
    column(aov_normal,                      glm::vec4,     float4, slot)  \
    column(aov_barycentric_t,               glm::vec4,     float4, slot)  \
    column(aov_primitive_instance_material, glm::uvec4,    uint4,  slot)
// clang-format on

#endif
