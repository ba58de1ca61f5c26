#include "castor/renderer.h"

#include "c/handle.h"

using namespace castor;
using namespace castor::c;

namespace {

RendererOptions renderer_options(const castor_renderer_options* options) {
    const castor_renderer_options given = read_options(options);
    require_zero(given.reserved);
    return to_options<RendererOptions>(given);
}

/// The words between commas; none of an empty text.
std::vector<std::string> words_of(std::string_view text) {
    std::vector<std::string> words;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find(','), text.size());
        words.emplace_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return words;
}

RenderOptions to_render_options(const castor_render_options& given) {
    static_assert(static_cast<int>(ReconstructionFilter::gaussian) + 1 == CASTOR_RECONSTRUCTION_FILTER_GAUSSIAN);
    static_assert(static_cast<int>(RuleSet::r2018) == CASTOR_RULE_SET_R2018);
    static_assert(static_cast<int>(RenderOrder::progressive) == CASTOR_RENDER_ORDER_PROGRESSIVE);
    static_assert(static_cast<int>(Integrator::path) + 1 == CASTOR_INTEGRATOR_PATH);
    static_assert(static_cast<int>(SampleOrder::z) == CASTOR_SAMPLE_ORDER_Z);
    static_assert(static_cast<int>(Denoiser::oidn) + 1 == CASTOR_DENOISER_OIDN);
    require_zero(given.reserved);
    require_zero(given.reserved_end);
    require_zero(given.reserved_more);
    RenderOptions options;
    if (const auto denoiser = enumerator<std::uint32_t>(given.denoise, 3, "denoise")) {
        options.denoise = true;
        options.denoiser = static_cast<Denoiser>(denoiser - 1);
    }
    options.samples_per_pixel = given.samples_per_pixel;
    if (const auto filter = enumerator<std::uint32_t>(given.filter, 4, "filter"))
        options.filter = static_cast<ReconstructionFilter>(filter - 1);
    options.rules = enumerator<RuleSet>(given.rules, 4, "rules");
    options.order = enumerator<RenderOrder>(given.order, 2, "order");
    options.cull_back_faces = flag(given.cull_back_faces, "cull_back_faces");
    options.tile_size = given.tile_size;
    options.seed = given.seed;
    if (given.part_count > 0)
        options.part = {given.part_number, given.part_count};
    else if (given.part_number > 0)
        throw ArgumentError("part_number", fmt::format("is {}, and part_count is 0", given.part_number));
    if (given.max_recursion_depth) options.max_recursion_depth = *given.max_recursion_depth;
    if (const auto integrator = enumerator<std::uint32_t>(given.integrator, 3, "integrator"))
        options.integrator = static_cast<Integrator>(integrator - 1);
    if (given.bounces) options.bounces = *given.bounces;
    if (given.largest_sample != 0.0f) options.largest_sample = given.largest_sample;
    if (given.planes) options.aovs = words_of(given.planes);
    if (given.checkpoint_file) options.checkpoint_file = given.checkpoint_file;
    options.checkpoint_seconds = value_or(given.checkpoint_seconds, options.checkpoint_seconds);
    if (!(options.checkpoint_seconds > 0.0))
        throw ArgumentError("checkpoint_seconds", fmt::format("is {}, expected more than 0", given.checkpoint_seconds));
    if (given.resume_file) options.resume_file = given.resume_file;
    options.verify_share = given.verify_share;
    if (!(options.verify_share >= 0.0 && options.verify_share <= 1.0))
        throw ArgumentError("verify_share", fmt::format("is {}, expected 0 to 1", given.verify_share));
    if (given.noise != 0.0) options.noise = given.noise;
    if (given.stop_after_seconds != 0.0) options.stop_after_seconds = given.stop_after_seconds;
    options.sample_order = enumerator<SampleOrder>(given.sample_order, 2, "sample_order");
    for (const castor_light_group& group :
         array<castor_light_group>(given.light_groups, given.light_group_count, "light_groups")) {
        const auto lights = array<std::uint32_t>(group.lights, group.light_count, "light_groups.lights");
        options.light_groups.push_back(
            {&require(group.name, "light_groups.name"), std::vector(lights.begin(), lights.end())});
    }
    return options;
}

/// Calls the caller's callback, and notes whether that stopped the render.
ProgressCallback progress_callback(const castor_render_options& given, bool& is_stopped) {
    if (!given.progress) return {};
    return [&is_stopped, function = given.progress, user = given.progress_user](const RenderProgress& progress) {
        std::vector<const char*> notices;
        for (const std::string& notice : progress.notices) notices.push_back(notice.c_str());
        castor_render_progress told{};
        told.size = sizeof(told);
        told.samples_done = progress.samples_done;
        told.samples_total = progress.samples_total;
        told.samples_resumed = progress.samples_resumed;
        told.rays = progress.rays;
        told.seconds = progress.seconds;
        told.notices = notices.data();
        told.notice_count = notices.size();
        told.render = &progress;
        if (function(&told, user)) return true;
        is_stopped = true;
        return false;
    };
}

}  // namespace

castor_status castor_renderer_create(const castor_scene* scene, const castor_devices* devices,
                                     const castor_renderer_options* options, castor_renderer** renderer) {
    return guarded([&] {
        make_handle(renderer, "renderer", [&] {
            const Scene& from = require(scene, "scene").scene;
            const RendererOptions made = renderer_options(options);
            return new castor_renderer(from, devices_of(devices), made);
        });
    });
}

castor_status castor_renderer_create_from_built(const castor_built_scene* built, const castor_devices* devices,
                                                const castor_renderer_options* options, castor_renderer** renderer) {
    return guarded([&] {
        make_handle(renderer, "renderer", [&] {
            const BuiltScene& from = require(built, "built").built;
            const RendererOptions made = renderer_options(options);
            return new castor_renderer(from, devices_of(devices), made);
        });
    });
}

void castor_renderer_retain(castor_renderer* renderer) {
    retain(renderer);
}
void castor_renderer_release(castor_renderer* renderer) {
    release(renderer);
}

castor_status castor_render_progress_get_film(const castor_render_progress* progress, castor_film** film) {
    return guarded([&] {
        make_handle(film, "film", [&] {
            const auto* const render = static_cast<const RenderProgress*>(require(progress, "progress").render);
            return new castor_film(require(render, "render").snapshot());
        });
    });
}

const char* castor_plane_names(void) {
    const char* told = "";
    guarded([&] {
        static const std::string names = fmt::format("{}", fmt::join(aov_names(), ","));
        told = names.c_str();
    });
    return told;
}

castor_status castor_renderer_render(castor_renderer* renderer, const castor_camera* camera,
                                     const castor_render_options* options, castor_film** film) {
    return guarded([&] {
        require(film, "film") = nullptr;
        Renderer& asked = require(renderer, "renderer").renderer;
        const Camera view = to_camera(require(camera, "camera"));
        const castor_render_options given = read_options(options);
        const RenderOptions render_options = to_render_options(given);
        bool is_stopped = false;
        try {
            *film = new castor_film(asked.render(view, render_options, progress_callback(given, is_stopped)));
        } catch (const RenderError& error) {
            if (!error.film().pixels.empty()) *film = new castor_film(error.film());
            throw;
        }
        // A film does not tell whether planes of lights are complete.
        const std::size_t groups = render_options.light_groups.size();
        const std::size_t others = render_options.aovs.size() + (groups > 0 ? groups + 1 : 0);
        const bool has_lights = (*film)->film.planes.size() > others;
        if (is_stopped && (has_lights || !(*film)->film.complete())) throw Interrupted();
    });
}

castor_status castor_renderer_get_statistics(const castor_renderer* renderer, castor_render_statistics* statistics) {
    return guarded([&] {
        const castor_renderer& asked = require(renderer, "renderer");
        const RenderStatistics found = asked.renderer.statistics();
        castor_render_statistics told{};
        told.flatten_seconds = found.flatten_seconds;
        told.build_seconds = found.build_seconds;
        told.setup_seconds = found.setup_seconds;
        told.render_seconds = found.render_seconds;
        told.rays = found.rays;
        told.samples_done = found.samples_done;
        told.samples_resumed = found.samples_resumed;
        told.triangles = found.triangles;
        told.spheres = found.spheres;
        told.planes = found.planes;
        told.nodes = found.nodes;
        told.verified_pixels = found.verification.pixels;
        told.differing_pixels = found.verification.differing_pixels;
        told.part_complete = found.part_complete;
        told.device_count = asked.device_count;
        told.denoise_seconds = found.denoise_seconds;
        told.oidn_version = found.oidn_version;
        write_struct(statistics, told, "statistics");
    });
}

castor_status castor_renderer_get_strategy(const castor_renderer* renderer, size_t i, castor_query query,
                                           castor_coherence coherence, castor_strategy* strategy) {
    return guarded([&] {
        const castor_renderer& asked = require(renderer, "renderer");
        position(i, asked.device_count, "the devices");
        require(strategy, "strategy") =
            static_cast<castor_strategy>(asked.renderer.strategy(to_coherence(coherence), to_query(query), i));
    });
}

castor_status castor_renderer_get_share(const castor_renderer* renderer, size_t i, castor_device_share* share) {
    return guarded([&] {
        const castor_renderer& asked = require(renderer, "renderer");
        get_share(asked.renderer.statistics().devices, i, asked.texts, share);
    });
}

castor_status castor_renderer_get_warning_count(const castor_renderer* renderer, size_t* count) {
    return guarded([&] { require(count, "count") = require(renderer, "renderer").renderer.warnings().size(); });
}

castor_status castor_renderer_get_warning(const castor_renderer* renderer, size_t i, castor_warning* warning) {
    return guarded([&] { get_warning(require(renderer, "renderer").renderer.warnings(), i, warning); });
}
