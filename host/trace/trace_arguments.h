#pragma once

#include <vector>

#include "opencl/kernel_arguments.h"
#include "trace/device_scene.h"

namespace castor {

namespace columns {
/// The counters of the work-items of a launch, CASTOR_WORK_KINDS each.
CASTOR_COLUMN_TYPE(work, std::uint32_t, uint)
/// The first crossings of each ray, as many as the limit says.
CASTOR_COLUMN_TYPE(crossings, shared::Hit, Hit)
/// How many crossings each ray has.
CASTOR_COLUMN_TYPE(crossing_counts, std::uint32_t, uint)
}  // namespace columns

/// The columns of a scene that one stage reads, taken from a chunk that must outlive the object.
class ChunkColumns {
protected:
    ChunkColumns(const DeviceColumns& chunk) : chunk_(&chunk) {}

    const DeviceColumns* chunk_;
};

#define CASTOR_SET_yes(name) setter(chunk_->name.buffer());
#define CASTOR_SET_no(name)
#define CASTOR_DESCRIBE_yes(name) ColumnArgument<columns::name, true>::describe(infos);
#define CASTOR_DESCRIBE_no(name)

/// What trace kernels read: CASTOR_SCENE_PARAMETERS of device/scene.cl.
struct TraceColumns : ChunkColumns {
    TraceColumns(const DeviceColumns& chunk) : ChunkColumns(chunk) {}

#define CASTOR_SET_TRACED(name, host, device, per, place, made, trace, surface) CASTOR_SET_##trace(name)
#define CASTOR_DESCRIBE_TRACED(name, host, device, per, place, made, trace, surface) CASTOR_DESCRIBE_##trace(name)
    void set(ArgumentSetter& setter) const {
        CASTOR_SCENE_COLUMNS(CASTOR_SET_TRACED)
    }
    static void describe(std::vector<ArgumentInfo>& infos) {
        CASTOR_SCENE_COLUMNS(CASTOR_DESCRIBE_TRACED)
    }
#undef CASTOR_SET_TRACED
#undef CASTOR_DESCRIBE_TRACED
};

/// What find_surface reads: CASTOR_SURFACE_PARAMETERS of device/surface.cl.
struct SurfaceColumns : ChunkColumns {
    SurfaceColumns(const DeviceColumns& chunk) : ChunkColumns(chunk) {}

#define CASTOR_SET_SURFACE(name, host, device, per, place, made, trace, surface) CASTOR_SET_##surface(name)
#define CASTOR_DESCRIBE_SURFACE(name, host, device, per, place, made, trace, surface) CASTOR_DESCRIBE_##surface(name)
    void set(ArgumentSetter& setter) const {
        CASTOR_SCENE_COLUMNS(CASTOR_SET_SURFACE)
    }
    static void describe(std::vector<ArgumentInfo>& infos) {
        CASTOR_SCENE_COLUMNS(CASTOR_DESCRIBE_SURFACE)
    }
#undef CASTOR_SET_SURFACE
#undef CASTOR_DESCRIBE_SURFACE
};

#undef CASTOR_SET_yes
#undef CASTOR_SET_no
#undef CASTOR_DESCRIBE_yes
#undef CASTOR_DESCRIBE_no

// clang-format off
#define CASTOR_CLOSEST_HIT_ARGUMENTS(value, in, out, columns_of) \
    value(TraceParams, params)                                   \
    columns_of(TraceColumns, scene)                              \
    in(ray_origin_tmin)                                          \
    in(ray_direction_tmax)                                       \
    out(hits)

#define CASTOR_ANY_HIT_ARGUMENTS(value, in, out, columns_of) \
    value(TraceParams, params)                               \
    columns_of(TraceColumns, scene)                          \
    in(ray_origin_tmin)                                      \
    in(ray_direction_tmax)                                   \
    out(occluded)

#define CASTOR_COUNT_CROSSINGS_ARGUMENTS(value, in, out, columns_of) \
    value(TraceParams, params)                                       \
    columns_of(TraceColumns, scene)                                  \
    in(ray_origin_tmin)                                              \
    in(ray_direction_tmax)                                           \
    out(crossing_counts)

#define CASTOR_LIST_CROSSINGS_ARGUMENTS(value, in, out, columns_of) \
    value(uint, limit)                                              \
    value(TraceParams, params)                                      \
    columns_of(TraceColumns, scene)                                 \
    in(ray_origin_tmin)                                             \
    in(ray_direction_tmax)                                          \
    out(crossings)                                                  \
    out(crossing_counts)

// Built with CASTOR_COUNT_WORK.
#define CASTOR_COUNTED_CLOSEST_HIT_ARGUMENTS(value, in, out, columns_of) \
    value(TraceParams, params)                                           \
    columns_of(TraceColumns, scene)                                      \
    out(work)                                                            \
    in(ray_origin_tmin)                                                  \
    in(ray_direction_tmax)                                               \
    out(hits)

#define CASTOR_COUNTED_ANY_HIT_ARGUMENTS(value, in, out, columns_of) \
    value(TraceParams, params)                                       \
    columns_of(TraceColumns, scene)                                  \
    out(work)                                                        \
    in(ray_origin_tmin)                                              \
    in(ray_direction_tmax)                                           \
    out(occluded)

// Built with CASTOR_HAS_MOTION.
#define CASTOR_TIMED_CLOSEST_HIT_ARGUMENTS(value, in, out, columns_of) \
    value(TraceParams, params)                                         \
    columns_of(TraceColumns, scene)                                    \
    in(ray_time)                                                       \
    in(ray_origin_tmin)                                                \
    in(ray_direction_tmax)                                             \
    out(hits)

#define CASTOR_TIMED_ANY_HIT_ARGUMENTS(value, in, out, columns_of) \
    value(TraceParams, params)                                     \
    columns_of(TraceColumns, scene)                                \
    in(ray_time)                                                   \
    in(ray_origin_tmin)                                            \
    in(ray_direction_tmax)                                         \
    out(occluded)

#define CASTOR_FIND_SURFACE_ARGUMENTS(value, in, out, columns_of) \
    value(uint, path_count)                                       \
    value(TraceParams, params)                                    \
    columns_of(SurfaceColumns, scene)                             \
    in(ray_origin_tmin)                                           \
    in(ray_direction_tmax)                                        \
    in(hits)                                                      \
    out(surface_position)                                         \
    out(surface_normal)                                           \
    out(surface_material)

#define CASTOR_FIND_TEXTURED_SURFACE_ARGUMENTS(value, in, out, columns_of) \
    value(TextureParams, texture_params)                                   \
    value(TraceParams, params)                                             \
    columns_of(SurfaceColumns, scene)                                      \
    in(vertex_uv)                                                          \
    in(materials)                                                          \
    in(textures)                                                           \
    in(texture_uses)                                                       \
    in(texture_images)                                                     \
    in(texels)                                                             \
    in(ray_origin_tmin)                                                    \
    in(ray_direction_tmax)                                                 \
    in(hits)                                                               \
    out(surface_position)                                                  \
    out(surface_normal)                                                    \
    out(surface_material)                                                  \
    out(surface_diffuse)                                                   \
    out(surface_specular)

#define CASTOR_FIND_UVS_ARGUMENTS(value, in, out, columns_of) \
    value(uint, path_count)                                   \
    value(TraceParams, params)                                \
    columns_of(SurfaceColumns, scene)                         \
    in(vertex_uv)                                             \
    in(ray_origin_tmin)                                       \
    in(ray_direction_tmax)                                    \
    in(hits)                                                  \
    out(surface_uv)

#define CASTOR_FIND_ATTRIBUTES_ARGUMENTS(value, in, out, columns_of) \
    value(uint, path_count)                                          \
    value(TraceParams, params)                                       \
    columns_of(SurfaceColumns, scene)                                \
    in(vertex_uv)                                                    \
    in(vertex_attributes)                                            \
    in(ray_origin_tmin)                                              \
    in(ray_direction_tmax)                                           \
    in(hits)                                                         \
    out(surface_uvs)                                                 \
    out(surface_tangent)                                             \
    out(surface_color)

#define CASTOR_FIND_PASSED_ARGUMENTS(value, in, out, columns_of) \
    value(RenderParams, wave)                                    \
    value(uint, node)                                            \
    value(uint, dimension)                                       \
    value(TraceParams, params)                                   \
    columns_of(SurfaceColumns, scene)                            \
    in(vertex_uv)                                                \
    in(vertex_attributes)                                        \
    in(materials)                                                \
    in(principled_materials)                                     \
    in(textures)                                                 \
    in(texture_images)                                           \
    in(texels)                                                   \
    in(pixel_blocks)                                             \
    in(path_slot)                                                \
    in(ray_origin_tmin)                                          \
    in(ray_direction_tmax)                                       \
    in(hits)                                                     \
    out(passed)
// clang-format on

/// closest_hit_<strategy> of trace_<strategy>.cl.
struct ClosestHit {
    static constexpr const char* kProgram = "trace";
    static constexpr const char* kQuery = "closest_hit";
    static constexpr bool kCountsWork = false;
    static constexpr bool kHasTimes = false;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_CLOSEST_HIT_ARGUMENTS)
};

/// any_hit_<strategy> of trace_<strategy>.cl.
struct AnyHit {
    static constexpr const char* kProgram = "trace";
    static constexpr const char* kQuery = "any_hit";
    static constexpr bool kCountsWork = false;
    static constexpr bool kHasTimes = false;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_ANY_HIT_ARGUMENTS)
};

/// count_crossings_<strategy> of crossings_<strategy>.cl.
struct CountCrossings {
    static constexpr const char* kProgram = "crossings";
    static constexpr const char* kQuery = "count_crossings";
    static constexpr bool kCountsWork = false;
    static constexpr bool kHasTimes = false;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_COUNT_CROSSINGS_ARGUMENTS)
};

/// list_crossings_<strategy> of crossings_<strategy>.cl.
struct ListCrossings {
    static constexpr const char* kProgram = "crossings";
    static constexpr const char* kQuery = "list_crossings";
    static constexpr bool kCountsWork = false;
    static constexpr bool kHasTimes = false;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_LIST_CROSSINGS_ARGUMENTS)
};

struct CountedClosestHit {
    static constexpr const char* kProgram = "trace";
    static constexpr const char* kQuery = "closest_hit";
    static constexpr bool kCountsWork = true;
    static constexpr bool kHasTimes = false;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_COUNTED_CLOSEST_HIT_ARGUMENTS)
};

struct CountedAnyHit {
    static constexpr const char* kProgram = "trace";
    static constexpr const char* kQuery = "any_hit";
    static constexpr bool kCountsWork = true;
    static constexpr bool kHasTimes = false;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_COUNTED_ANY_HIT_ARGUMENTS)
};

struct TimedClosestHit {
    static constexpr const char* kProgram = "trace";
    static constexpr const char* kQuery = "closest_hit";
    static constexpr bool kCountsWork = false;
    static constexpr bool kHasTimes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_TIMED_CLOSEST_HIT_ARGUMENTS)
};

struct TimedAnyHit {
    static constexpr const char* kProgram = "trace";
    static constexpr const char* kQuery = "any_hit";
    static constexpr bool kCountsWork = false;
    static constexpr bool kHasTimes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_TIMED_ANY_HIT_ARGUMENTS)
};

struct FindSurface {
    static constexpr const char* kProgram = "wave.lanes";
    static constexpr const char* kKernel = "find_surface";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_FIND_SURFACE_ARGUMENTS)
};

/// Stands in for FindSurface where a scene has textures.
struct FindTexturedSurface {
    static constexpr const char* kProgram = "textured_wave.lanes";
    static constexpr const char* kKernel = "find_textured_surface";
    static constexpr bool kInLanes = true;
    CASTOR_KERNEL_ARGUMENTS(CASTOR_FIND_TEXTURED_SURFACE_ARGUMENTS)
};

struct FindUvs {
    static constexpr const char* kProgram = "find_uvs";
    static constexpr const char* kKernel = "find_uvs";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_FIND_UVS_ARGUMENTS)
};

struct FindPassed {
    static constexpr const char* kProgram = "opacity";
    static constexpr const char* kKernel = "find_passed";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_FIND_PASSED_ARGUMENTS)
};

struct FindAttributes {
    static constexpr const char* kProgram = "find_attributes";
    static constexpr const char* kKernel = "find_attributes";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_FIND_ATTRIBUTES_ARGUMENTS)
};

}  // namespace castor
