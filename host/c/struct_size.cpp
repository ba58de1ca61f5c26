// The sizes of the header's structs. A test finds what is missing here.
#include "c/call.h"

using namespace castor::c;

namespace {

using StructSize = std::pair<std::string_view, std::size_t>;

#define CASTOR_STRUCT(name) StructSize(#name, sizeof(name))
constexpr StructSize kStructSizes[] = {
    CASTOR_STRUCT(castor_error),
    CASTOR_STRUCT(castor_warning),
    CASTOR_STRUCT(castor_device_info),
    CASTOR_STRUCT(castor_device_share),
    CASTOR_STRUCT(castor_load_options),
    CASTOR_STRUCT(castor_scene_settings),
    CASTOR_STRUCT(castor_material),
    CASTOR_STRUCT(castor_principled_material),
    CASTOR_STRUCT(castor_image),
    CASTOR_STRUCT(castor_texture),
    CASTOR_STRUCT(castor_light),
    CASTOR_STRUCT(castor_camera),
    CASTOR_STRUCT(castor_tone_map),
    CASTOR_STRUCT(castor_mesh),
    CASTOR_STRUCT(castor_scene_counts),
    CASTOR_STRUCT(castor_build_options),
    CASTOR_STRUCT(castor_ray),
    CASTOR_STRUCT(castor_hit),
    CASTOR_STRUCT(castor_tracer_options),
    CASTOR_STRUCT(castor_batch_options),
    CASTOR_STRUCT(castor_crossings_arrays),
    CASTOR_STRUCT(castor_tracer_info),
    CASTOR_STRUCT(castor_renderer_options),
    CASTOR_STRUCT(castor_render_progress),
    CASTOR_STRUCT(castor_light_group),
    CASTOR_STRUCT(castor_render_options),
    CASTOR_STRUCT(castor_render_statistics),
    CASTOR_STRUCT(castor_film_info),
    CASTOR_STRUCT(castor_film_plane),
    CASTOR_STRUCT(castor_image_options),
};
#undef CASTOR_STRUCT

}  // namespace

castor_status castor_get_struct_size(const char* name, std::size_t* bytes) {
    return guarded([&] {
        const std::string_view wanted = &require(name, "name");
        std::size_t& target = require(bytes, "bytes");
        const auto* const found = std::find_if(std::begin(kStructSizes), std::end(kStructSizes),
                                               [&](const StructSize& known) { return known.first == wanted; });
        if (found == std::end(kStructSizes))
            throw ArgumentError("name", fmt::format("is \"{}\", which is no struct of castor_c.h", wanted));
        target = found->second;
    });
}
