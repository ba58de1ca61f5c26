#include "castor/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "base/cpu_registers.h"
#include "base/stopwatch.h"
#include "castor/error.h"
#include "castor/shared/sample_order.h"
#include "render/aov.h"
#include "render/camera.h"
#include "render/checkpoint.h"
#include "render/denoise.h"
#include "render/device_worker.h"
#include "render/light_planes.h"
#include "render/noise.h"
#include "render/oidn.h"
#include "render/programs_ahead.h"
#include "render/remote_piece.h"
#include "render/remote_render.h"
#include "render/render_job.h"
#include "render/rules.h"
#include "render/verify.h"
#include "trace/chunk_answerer.h"
#include "trace/chunk_exchange.h"
#include "trace/scene_devices.h"

namespace castor {

namespace {

void store(float (&target)[3], const glm::vec3& v) {
    for (int i = 0; i < 3; ++i) target[i] = v[i];
}

bool can_reflect(const shared::Material& material, std::uint32_t rules) {
    if (material.kind == CASTOR_MATERIAL_DIELECTRIC) return true;
    if (material.mirror[0] == 0.0f && material.mirror[1] == 0.0f && material.mirror[2] == 0.0f) return false;
    return (rules & CASTOR_RULE_MIRROR_ANY_MATERIAL) || material.kind == CASTOR_MATERIAL_MIRROR ||
           (material.kind == CASTOR_MATERIAL_CONDUCTOR && (rules & CASTOR_RULE_MIRROR_CONDUCTOR));
}

std::uint32_t filter_code(ReconstructionFilter filter) {
    switch (filter) {
        case ReconstructionFilter::box:
            return CASTOR_FILTER_BOX;
        case ReconstructionFilter::tent:
            return CASTOR_FILTER_TENT;
        case ReconstructionFilter::gaussian:
            return CASTOR_FILTER_GAUSSIAN;
    }
    return CASTOR_FILTER_GAUSSIAN;
}

bool wants(const std::vector<std::string>& aovs, std::string_view plane) {
    return std::count(aovs.begin(), aovs.end(), plane) > 0;
}

/// Throws UsageError where a picture cannot end with fewer samples than it was begun with.
void check_stop(const RenderOptions& options) {
    if (!options.stop_after_seconds) return;
    if (!(*options.stop_after_seconds >= 0.0))
        throw UsageError(fmt::format("a render cannot stop after {} seconds", *options.stop_after_seconds));
    const auto refuse = [](const char* what) {
        throw UsageError(fmt::format("a picture that stops after some time cannot be made {}", what));
    };
    if (options.part) refuse("of parts");
    if (!options.checkpoint_file.empty() || !options.resume_file.empty()) refuse("with a checkpoint");
    if (options.verify_share > 0.0) refuse("and verified");
    if (wants_light_planes(options)) refuse("with planes of lights");
}

/// Throws UsageError where blocks cannot stop at noise.
void check_noise(const RenderOptions& options, std::uint32_t samples) {
    if (!options.noise) return;
    if (!(*options.noise > 0.0) || !std::isfinite(*options.noise))
        throw UsageError(fmt::format(
            "a picture cannot stop at a noise of {}, expected a relative error above 0, such as 0.01", *options.noise));
    if (samples <= kFewestSamplesToStop)
        throw UsageError(
            fmt::format("a picture that stops at noise takes more than {} samples a pixel, and this has {}",
                        kFewestSamplesToStop, samples));
    if (wants_light_planes(options))
        throw UsageError(
            fmt::format("a picture that stops at noise has no planes \"{}\": each would stop elsewhere", kLightPlanes));
}

/// Throws UsageError where noise cannot be removed.
void check_denoising(const RenderOptions& options, std::uint32_t samples) {
    if (options.denoise && options.denoiser == Denoiser::castor && samples < 2)
        throw UsageError("denoising takes at least two samples a pixel, to know how far they differ");
}

/// Throws UsageError if a wave has no room to know what each sample is.
void check_deviations(const WaveSettings& settings) {
    const std::uint64_t terms = terms_of_sample(settings);
    if ((settings.params.flags & CASTOR_RENDER_DEVIATIONS) && terms > kMostTermsApart)
        throw UsageError(fmt::format(
            "the plane \"variance\", as stopping at noise, takes what each sample adds up apart, which is {} numbers "
            "with {} lights and {} bounces here, expected {} at most",
            terms, settings.lights.size(), settings.max_depth, kMostTermsApart));
}

/// Throws UsageError if a picture cannot be path traced so.
void check(const PathTracing& tracing) {
    if (tracing.bounces && *tracing.bounces > CASTOR_MOST_BOUNCES)
        throw UsageError(
            fmt::format("path tracing: {} bounces, expected {} at most", *tracing.bounces, CASTOR_MOST_BOUNCES));
    if (!(tracing.largest_sample > 0.0f))
        throw UsageError(
            fmt::format("path tracing: samples up to {}, expected a positive limit", tracing.largest_sample));
}

/// Returns how paths are traced, if they are: what is asked for, else what the camera says. Principled materials are
/// shaded by path tracing alone.
std::optional<PathTracing> path_tracing_of(const SceneArrays& arrays, const Camera& camera,
                                           const RenderOptions& options) {
    const bool has_principled = !arrays.principled_materials.empty();
    if (has_principled && options.integrator == Integrator::whitted)
        throw UsageError(
            "the scene has principled materials, as glTF has, which the integrator whitted does not know; expected "
            "path");
    RenderOptions used = options;
    if (has_principled) used.integrator = Integrator::path;
    return used.path_tracing_in_use(camera);
}

std::uint32_t samples_of(const Camera& camera, const RenderOptions& options) {
    return std::max(1u, options.samples_per_pixel ? options.samples_per_pixel : camera.samples_per_pixel);
}

/// Returns as which rays those of the eye are traced. PoCL compiles the kernels for coherent rays for a second or two,
/// which must be worth it. They save traced paths a twentieth of their time at most, since later bounces are not
/// coherent. Small pictures of small scenes (CASTOR_SMALL_SCENE) they save 1 to 30 ms where registers hold sixteen
/// floats, but half of their time where they hold eight.
Coherence coherence_of_eye_rays(const SceneArrays& arrays, bool traces_paths, const Camera& camera,
                                const RenderOptions& options) {
    constexpr std::uint64_t kFewPaths = std::uint64_t{1} << 22;
    constexpr std::uint64_t kFewRays = std::uint64_t{1} << 20;
    const std::uint64_t eye_rays = std::uint64_t{camera.width} * camera.height * samples_of(camera, options);
    const bool is_small = has_registers_of_16() && arrays.instances.empty() &&
                          arrays.triangle_count() + arrays.sphere_count() <= CASTOR_SMALL_SCENE;
    const bool are_few = traces_paths ? eye_rays < kFewPaths : is_small && eye_rays <= kFewRays;
    return are_few ? Coherence::incoherent : Coherence::coherent;
}

WaveSettings make_settings(const SceneArrays& arrays, const shared::Camera& camera,
                           const std::optional<PathTracing>& path_tracing, const RenderOptions& options,
                           std::uint32_t samples, const LightPass& lights) {
    WaveSettings settings{};
    settings.camera = camera;
    settings.max_depth = options.max_recursion_depth.value_or(arrays.max_recursion_depth);
    shared::RenderParams& params = settings.params;
    params.flags = rule_flags(options.rules);
    if (options.cull_back_faces) params.flags |= CASTOR_RENDER_CULL_BACK_FACES;
    if (samples == 1) params.flags |= CASTOR_RENDER_PIXEL_CENTRES;
    if (arrays.shades_both_sides) params.flags |= CASTOR_RENDER_BOTH_SIDES;
    params.seed = options.seed;
    if (options.sample_order == SampleOrder::z)
        params.flags |= (1u + static_cast<std::uint32_t>(std::bit_width(samples - 1))) << CASTOR_Z_ORDER_SHIFT;
    params.filter = filter_code(options.filter_in_use());
    store(params.background, arrays.background);
    store(params.ambient, arrays.ambient_light);
    params.shadow_epsilon = arrays.shadow_ray_epsilon;
    params.light_count = static_cast<std::uint32_t>(arrays.lights.size());
    settings.light_node_count = static_cast<std::uint32_t>(arrays.light_nodes.size());
    const auto find_range = [&](const auto& is_counted, std::uint32_t& first, std::uint32_t& end) {
        first = params.light_count;
        for (std::uint32_t i = 0; i < params.light_count; ++i) {
            if (!is_counted(arrays.lights[i])) continue;
            first = std::min(first, i);
            end = i + 1;
        }
    };
    find_range([](const auto& light) { return light.kind == CASTOR_LIGHT_ENVIRONMENT || CASTOR_IS_SUN(light); },
               settings.first_far, settings.far_end);
    settings.lights = lights.lights;
    if (!lights.others) params.flags |= CASTOR_RENDER_LIGHTS_ALONE;
    const std::vector<std::string> aovs = rendered_aovs(options);
    settings.wants_uv = wants(aovs, "uv");
    settings.wants_features = wants(aovs, "mean-albedo") || wants(aovs, "mean-normal") || wants(aovs, "mean-position");
    if (wants(aovs, "variance") || options.noise) params.flags |= CASTOR_RENDER_DEVIATIONS;
    settings.any_reflective = std::any_of(arrays.materials.begin(), arrays.materials.end(),
                                          [&](const shared::Material& m) { return can_reflect(m, params.flags); });
    settings.features = features_of(arrays);
    // No ray from within a solid reaches a light that is far away, if none passes the surface.
    find_range(
        [&](const auto& light) {
            const bool is_reached = light.kind != CASTOR_LIGHT_DIRECTIONAL || settings.features.has_matched_solids;
            return is_met_by_none(light) && is_reached;
        },
        settings.first_unmet, settings.unmet_end);
    settings.features.traces_paths = path_tracing.has_value();
    settings.features.has_light_groups = !options.light_groups.empty();
    settings.light_groups = groups_of_lights(options.light_groups, arrays.lights.size());
    for (const shared::Material& material : arrays.materials)
        if (!settings.light_groups.empty())
            settings.emission_groups.push_back(
                settings.light_groups[std::min<std::size_t>(material.light, arrays.lights.size())]);
    settings.path_tracing = path_tracing;
    if (path_tracing) settings.solid_materials = solid_materials(arrays);
    // So many samples find what is as small as their part of the pixel: it need not be mixed before it is shaded.
    settings.sample_spread = std::max(0.125f, 1.0f / std::sqrt(static_cast<float>(samples)));
    settings.background_texture = arrays.background_texture;
    if (arrays.background_texture != CASTOR_INVALID_INDEX) params.flags |= CASTOR_RENDER_BACKGROUND_TEXTURE;
    return settings;
}

/// Returns all that the pixels depend on, for Checkpoint::picture.
std::string describe_picture(std::uint64_t scene_fingerprint, const WaveSettings& settings,
                             const RenderOptions& options, std::uint32_t samples,
                             const std::vector<ToneMap>& tone_maps) {
    const shared::Camera& camera = settings.camera;
    const auto vector = [](const float(&v)[3]) { return fmt::format("{} {} {}", v[0], v[1], v[2]); };
    std::string text;
    const auto line = [&](std::string_view name, const auto& value) { text += fmt::format("{} {}\n", name, value); };
    line("castor", CASTOR_VERSION);
    line("scene", fmt::format("{:016x}", scene_fingerprint));
    line("size", fmt::format("{}x{}", camera.width, camera.height));
    line("camera position", vector(camera.position));
    line("camera corner", vector(camera.corner));
    line("camera steps", vector(camera.step_x) + ", " + vector(camera.step_y));
    line("camera t", fmt::format("{} {}", camera.t_min, camera.t_max));
    if (camera.projection == CASTOR_PROJECTION_PARALLEL) line("camera direction", vector(camera.lens_x));
    if (camera.projection == CASTOR_PROJECTION_LENS)
        line("camera lens", fmt::format("{}, {}, {}", vector(camera.lens_x), vector(camera.lens_y), camera.sharpness));
    line("samples", samples);
    if (options.noise) line("stops at noise", *options.noise);
    line("filter", to_string(options.filter_in_use()));
    line("seed", options.seed);
    if (options.sample_order != SampleOrder::pixel) line("sample order", to_string(options.sample_order));
    line("rules", to_string(options.rules));
    if (const auto& tracing = settings.path_tracing) {
        const auto limit = [](const std::optional<std::uint32_t>& value) {
            return value ? fmt::format("{}", *value) : std::string("none");
        };
        line("path tracing", fmt::format("by BRDF {}, lights {}, weights {}", tracing->samples_brdf,
                                         tracing->samples_lights, tracing->weighs));
        line("bounces", fmt::format("{}, roulette from {}", limit(tracing->bounces), limit(tracing->roulette_from)));
        line("largest sample", tracing->largest_sample);
        line("lights chosen", to_string(tracing->light_choice));
    }
    line("max depth", settings.max_depth);
    line("back faces", settings.params.flags & CASTOR_RENDER_CULL_BACK_FACES ? "culled" : "hit");
    for (const LightGroup& group : options.light_groups)
        line("light group", fmt::format("{}: {}", group.name, fmt::join(group.lights, ",")));
    line("planes", fmt::format("{}", fmt::join(rendered_aovs(options), ",")));
    if (options.denoise) line(kDenoiseLine, fmt::format("{}", fmt::join(options.aovs, ",")));
    if (options.denoise && options.denoiser != Denoiser::castor) line(kDenoiserLine, to_string(options.denoiser));
    if (!tone_maps.empty()) line("tone maps", describe(tone_maps));
    return text;
}

}  // namespace

ProgramsOfScene programs_of_pictures(const std::vector<Camera>& cameras, const RenderOptions& options) {
    return [cameras, options](const SceneArrays& arrays, const Tuning& tuning) {
        std::vector<KernelProgram> programs;
        const auto add = [&](std::vector<KernelProgram> more) {
            for (KernelProgram& program : more) programs.push_back(std::move(program));
        };
        std::set<std::pair<bool, Coherence>> kinds;  // of pictures: whether they are path traced, and their eye rays
        for (const Camera& camera : cameras) {
            RenderFeatures features = features_of(arrays);
            try {
                features.traces_paths = path_tracing_of(arrays, camera, options).has_value();
            } catch (const UsageError&) {
                return std::vector<KernelProgram>();
            }
            features.has_light_groups = !options.light_groups.empty();
            const Coherence eye_rays = coherence_of_eye_rays(arrays, features.traces_paths, camera, options);
            if (!kinds.emplace(features.traces_paths, eye_rays).second) continue;
            add({wave_program(features),
                 {features.traces_paths ? ShadePaths::kProgram : Shade::kProgram, build_options(features)}});
            if (features.has_motion) continue;  // such rays have times, and programs of their own
            if (features.traces_paths)
                add(trace_programs(arrays, tuning, {eye_rays, Coherence::incoherent}));
            else
                add(trace_programs(arrays, tuning, {eye_rays}));
        }
        return programs;
    };
}

struct Renderer::Implementation {
    template <class AnyScene>
    Implementation(const AnyScene& scene, const std::vector<Device>& device_list, const RendererOptions& options)
        : devices(scene, device_list, options),
          scene_share(options.scene_share),
          deadlines{options.deadline_seconds, options.stop_deadline_seconds} {
        std::lock_guard lock(*devices.contents().mutex);
        const SceneContents& contents = devices.contents();
        statistics.devices = devices.first_shares();
        statistics.flatten_seconds = contents.flatten_seconds;
        statistics.build_seconds = contents.build_seconds;
        statistics.setup_seconds = devices.setup_seconds();
        statistics.triangles = contents.counts.triangles;
        statistics.spheres = contents.counts.spheres;
        statistics.planes = contents.counts.planes;
        for (const Chunk& chunk : contents.chunks)
            statistics.nodes += std::max(chunk.wide_nodes.size(), chunk.compressed_nodes.size());
    }

    /// A picture that is not begun, and who can work on it.
    struct Plan {
        Checkpoint begin;
        std::vector<std::size_t> in_use;          // numbers of devices
        std::vector<PieceWorkerOffer> workers;    // of these devices, whose places in `in_use` they name
        std::shared_ptr<ChunkExchange> exchange;  // with those who keep the other chunks, if there are any
    };
    /// `manager`: of other processes; null: there are none, or, where this one `serves`, one of them manages. It knows
    /// of devices and not of teams.
    Plan plan(const Camera& camera, const RenderOptions& options, Manager* manager, bool serves,
              const LightPass& lights);
    Film render(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress,
                Manager* manager);
    Film render_passes(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress,
                       Manager* manager);
    void remove_noise(Film& film, const Oidn* oidn);
    void remove_noise_on_devices(Film& film);
    Film render_pass(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress,
                     Manager* manager, const LightPass& lights);
    bool serve(const Camera& camera, const RenderOptions& options, RankServer& server);
    void add_to_statistics(const RenderStatistics& before);
    void take_statistics(RenderJob& job, const std::vector<std::size_t>& in_use, double seconds,
                         const Verification& verification, ChunkExchange* exchange);

    SceneDevices<RenderDevice> devices;
    SceneShare scene_share;
    Deadlines deadlines;
    RenderStatistics statistics;
    std::mutex mutex;  // one render at a time
    std::mutex statistics_mutex;
};

Renderer::Implementation::Plan Renderer::Implementation::plan(const Camera& camera, const RenderOptions& options,
                                                              Manager* manager, bool serves, const LightPass& lights) {
    const bool is_alone = !manager && !serves;
    const shared::Camera device_camera = make_camera(camera, devices.contents().description.file);
    if (options.tile_size % CASTOR_PIXEL_BLOCK != 0 || options.tile_size > 4096)
        throw UsageError(
            fmt::format("the tile size {} is not a multiple of {} up to 4096", options.tile_size, CASTOR_PIXEL_BLOCK));
    const PicturePart part = options.part.value_or(PicturePart());
    if (part.number < 1 || part.number > part.count)
        throw UsageError(fmt::format("there is no part {} of {}; parts are 1 to {}", part.number, part.count,
                                     std::max(part.count, 1u)));
    if (options.part && options.verify_share > 0.0)
        throw UsageError("a part of a picture cannot be verified; merging compares what parts have in common");
    if (options.verify_share > 0.0 && !scene_share.is_whole())
        throw UsageError("a picture of a scene that several processes divide cannot be verified: none has all of it");
    if (options.verify_share > 0.0 && is_alone && devices.size() < 2)
        throw UsageError("to verify a picture takes two devices, and there is one");

    check_light_planes(options, is_alone);
    check_stop(options);

    Plan plan;
    Film& film = plan.begin.film;
    film.width = camera.width;
    film.height = camera.height;
    film.samples_per_pixel = samples_of(camera, options);
    const std::size_t pixels = std::size_t{film.width} * film.height;
    film.pixels.assign(pixels, glm::vec3(0.0f));
    film.done.assign(pixels, 0);
    film.planes = make_planes(rendered_aovs(options), film.width, film.height);
    check_denoising(options, film.samples_per_pixel);
    check_noise(options, film.samples_per_pixel);

    const SceneContents& contents = devices.contents();
    const std::optional<PathTracing> path_tracing = path_tracing_of(contents.arrays(), camera, options);
    if (path_tracing) check(*path_tracing);
    if (path_tracing && wants_light_planes(options))
        throw UsageError(fmt::format("the planes \"{}\" cannot be made of path-traced pictures", kLightPlanes));
    check_light_groups(options, contents.arrays().lights.size());
    if (!path_tracing && !options.light_groups.empty())
        throw UsageError("groups of lights are for path-traced pictures; others have the planes \"lights\"");
    WaveSettings settings =
        make_settings(contents.arrays(), device_camera, path_tracing, options, film.samples_per_pixel, lights);
    check_deviations(settings);
    settings.eye_rays = coherence_of_eye_rays(contents.arrays(), path_tracing.has_value(), camera, options);
    {
        std::lock_guard statistics_lock(statistics_mutex);
        statistics.eye_rays = settings.eye_rays;
    }
    plan.begin.picture =
        describe_picture(contents.fingerprint, settings, options, film.samples_per_pixel, camera.tone_maps);
    if (manager && !scene_share.is_whole())
        settings.exchange = plan.exchange = std::make_shared<ChunkExchange>(
            *manager, plan.begin.picture + describe_division(contents, scene_share), contents, deadlines.seconds);
    plan.in_use = devices.in_use();
    const PixelBlocks blocks(film.width, film.height);
    for (std::size_t number = 0; number < plan.in_use.size(); ++number)
        for (PieceWorkerOffer& offer : offers_of(devices.at(plan.in_use[number]), number, !serves, settings, blocks,
                                                 film.samples_per_pixel, options.tile_size))
            plan.workers.push_back(std::move(offer));
    return plan;
}

Film Renderer::Implementation::render(const Camera& camera, const RenderOptions& options,
                                      const ProgressCallback& on_progress, Manager* manager) {
    std::lock_guard lock(mutex);
    if (!options.denoise && !wants(options.aovs, kNoisyPlane))
        return render_passes(camera, options, on_progress, manager);
    const bool removes_noise = options.denoise && !options.part;
    std::optional<Oidn> oidn;
    if (removes_noise && options.denoiser == Denoiser::oidn) oidn.emplace();  // or it throws, before hours of work
    try {
        Film film = render_passes(camera, options, on_progress, manager);
        finish_denoised(film, options.aovs, [&](Film& complete) {
            if (removes_noise) remove_noise(complete, oidn ? &*oidn : nullptr);
        });
        return film;
    } catch (const RenderError& error) {
        Film film = error.film();
        finish_denoised(film, options.aovs, [](Film&) {});
        throw RenderError(error, std::move(film));
    }
}

/// Removes noise by Open Image Denoise, if it is given, or on the devices. Throws RenderError with the noisy film.
void Renderer::Implementation::remove_noise(Film& film, const Oidn* oidn) {
    const Stopwatch watch;
    try {
        oidn ? oidn->denoise(film) : remove_noise_on_devices(film);
    } catch (const DeviceError& error) {
        throw RenderError(error, film);
    }
    std::lock_guard statistics_lock(statistics_mutex);
    statistics.denoise_seconds = watch.seconds();
    statistics.oidn_version = oidn ? oidn->version() : 0;
}

/// Removes noise on the first device that can.
void Renderer::Implementation::remove_noise_on_devices(Film& film) {
    std::optional<DeviceError> failure = DeviceError("", "", 0, "no device is left to remove noise");
    for (const std::size_t number : devices.in_use()) {
        const std::shared_ptr<RenderDevice> device = devices.at(number);
        const auto device_lock = lock_for_work(device->mutex, [] { return true; });
        try {
            with_device_errors(*device, [&] { denoise(film, device->context); });
            failure.reset();
            break;
        } catch (const DeviceError& error) {
            failure = error;
        }
    }
    if (failure) throw *failure;
}

Film Renderer::Implementation::render_passes(const Camera& camera, const RenderOptions& options,
                                             const ProgressCallback& on_progress, Manager* manager) {
    const LightPasses passes(devices.contents().description.lights);
    if (!wants_light_planes(options)) return render_pass(camera, options, on_progress, manager, passes.pass(0));
    bool goes_on = true;
    const auto watched = [&](const RenderProgress& progress) {
        return goes_on = goes_on && (!on_progress || on_progress(progress));
    };
    Film film = render_pass(camera, options, passes.progress_of(0, watched, {}, nullptr), manager, passes.pass(0));
    goes_on = goes_on && statistics.part_complete;
    const std::size_t eye_planes = film.planes.size();
    for (FilmPlane& plane : passes.planes(film)) film.planes.push_back(std::move(plane));
    RenderOptions light_options = options;
    light_options.aovs.clear();
    light_options.denoise = false;
    std::size_t number = 1;
    for (; number < passes.count() && goes_on; ++number) {
        const RenderStatistics before = statistics;
        try {
            const Film light = render_pass(camera, light_options, passes.progress_of(number, watched, before, &film),
                                           manager, passes.pass(number));
            std::memcpy(film.planes[eye_planes + number - 1].values.data(), light.pixels.data(),
                        light.pixels.size() * sizeof(glm::vec3));
        } catch (const RenderError& error) {
            add_to_statistics(before);
            throw RenderError(error, std::move(film));
        }
        add_to_statistics(before);
        goes_on = goes_on && statistics.part_complete;
    }
    if (number < passes.count()) {
        std::lock_guard statistics_lock(statistics_mutex);
        statistics.part_complete = false;
    }
    return film;
}

/// Adds to the statistics of the last render those of the same picture's renders before it.
void Renderer::Implementation::add_to_statistics(const RenderStatistics& before) {
    std::lock_guard statistics_lock(statistics_mutex);
    add_passes(statistics, before);
}

Film Renderer::Implementation::render_pass(const Camera& camera, const RenderOptions& options,
                                           const ProgressCallback& on_progress, Manager* manager,
                                           const LightPass& lights) {
    const Stopwatch watch;
    auto [begin, in_use, workers, exchange] = plan(camera, options, manager, false, lights);
    if (!options.resume_file.empty()) begin = load_checkpoint(options.resume_file, begin);
    // Who keeps chunks answers rays, and gets no pieces of the picture.
    const auto job = std::make_shared<RenderJob>(std::move(begin), workers, options, exchange ? nullptr : manager);
    Film& finished = job->picture().film();
    if (workers.empty() && (exchange || !manager)) {
        take_statistics(*job, in_use, 0.0, {}, nullptr);
        throw RenderError(DeviceError("", "", 0, "all devices of this renderer were dropped before"),
                          std::move(finished));
    }
    {
        std::optional<ChunkExchangeTurn> turn;
        if (exchange) turn.emplace(*exchange);
        job->run(deadlines, on_progress, exchange.get());
    }
    const double seconds = watch.seconds();
    Verification verification;
    if (options.verify_share > 0.0) verification = verify(*job, workers, options, deadlines, on_progress, manager);
    take_statistics(*job, in_use, seconds, verification, exchange.get());
    const auto failure = job->tally().last_failure();
    if (failure && !statistics.part_complete && !job->is_stopped()) throw RenderError(*failure, std::move(finished));
    return std::move(finished);
}

bool Renderer::Implementation::serve(const Camera& camera, const RenderOptions& options, RankServer& server) {
    std::lock_guard lock(mutex);
    const LightPasses passes(devices.contents().description.lights);
    const Plan picture = plan(camera, options, nullptr, true, passes.pass(0));
    const Film& film = picture.begin.film;
    std::vector<OrderedWorkerOffer> offers;
    if (!scene_share.is_whole()) {
        for (const std::size_t i : picture.in_use) offers.push_back(chunk_answerer_offer(devices.at(i)));
        return server.serve(picture.begin.picture + describe_division(devices.contents(), scene_share), offers);
    }
    for (const PieceWorkerOffer& worker : picture.workers)
        offers.push_back(ordered(worker, PixelBlocks(film.width, film.height).count(), film.samples_per_pixel));
    for (int jobs = options.verify_share > 0.0 ? 1 + kVerificationJobs : 1; jobs > 0; --jobs)
        if (!server.serve(picture.begin.picture, offers)) return false;
    return true;
}

/// Takes the statistics of a render, and releases the devices that were dropped in it.
void Renderer::Implementation::take_statistics(RenderJob& job, const std::vector<std::size_t>& in_use, double seconds,
                                               const Verification& verification, ChunkExchange* exchange) {
    std::lock_guard statistics_lock(statistics_mutex);
    statistics.render_seconds = seconds;
    statistics.denoise_seconds = 0.0;
    statistics.oidn_version = 0;
    statistics.rays = 0;
    statistics.samples_done = job.picture().samples_done();
    statistics.samples_resumed = job.tally().samples_at_begin();
    statistics.pixels_by_samples = job.picture().pixels_by_samples();
    statistics.part_complete = job.picture().samples_done_of_part() == job.picture().samples_to_do();
    statistics.notices = job.tally().notices();
    statistics.verification = verification;
    statistics.devices.resize(devices.size());
    for (DeviceShare& share : statistics.devices) {
        DeviceShare nothing;
        nothing.device = share.device;
        nothing.failure = share.failure;
        share = nothing;
    }
    const std::vector<DeviceShare> shares = job.tally().shares_of_devices();
    for (std::size_t i = 0; i < in_use.size(); ++i) {
        statistics.devices[in_use[i]] = shares[i];
        if (!shares[i].failure.empty()) devices.drop(in_use[i]);
    }
    const auto first_remote = shares.begin() + static_cast<std::ptrdiff_t>(in_use.size());
    statistics.devices.insert(statistics.devices.end(), first_remote, shares.end());
    for (const DeviceShare& share : shares) statistics.rays += share.rays;
    if (!exchange) return;
    const std::vector<DeviceShare> others = exchange->shares();
    statistics.devices.insert(statistics.devices.end(), others.begin(), others.end());
}

Renderer::Renderer(const Scene& scene, const std::vector<Device>& devices, const RendererOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Renderer::Renderer(const BuiltScene& scene, const std::vector<Device>& devices, const RendererOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

Film Renderer::render(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress) {
    return implementation_->render(camera, options, on_progress, nullptr);
}

Film render_together(Renderer& renderer, const Camera& camera, const RenderOptions& options,
                     const ProgressCallback& on_progress, Manager& manager) {
    return renderer.implementation_->render(camera, options, on_progress, &manager);
}

bool serve_render(Renderer& renderer, const Camera& camera, const RenderOptions& options, RankServer& server) {
    return renderer.implementation_->serve(camera, options, server);
}

const std::vector<Warning>& Renderer::warnings() const {
    return implementation_->devices.warnings();
}
RenderStatistics Renderer::statistics() const {
    std::lock_guard lock(implementation_->statistics_mutex);
    return implementation_->statistics;
}
Strategy Renderer::strategy(Coherence hint, Query query, std::size_t device_index) const {
    return implementation_->devices.tuning(device_index).strategies.of(query, hint);
}

}  // namespace castor
