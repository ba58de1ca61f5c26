#include "castor/renderer.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>

#include <fmt/format.h>

#include "castor/error.h"
#include "render/aov.h"
#include "render/camera.h"
#include "render/checkpoint.h"
#include "render/render_device.h"
#include "render/render_job.h"
#include "render/rules.h"
#include "render/verify.h"
#include "stopwatch.h"

namespace castor {

namespace {

void store(float (&target)[3], const glm::vec3& v) {
    for (int i = 0; i < 3; ++i) target[i] = v[i];
}

bool can_reflect(const shared::Material& material, std::uint32_t rules) {
    if (material.mirror[0] == 0.0f && material.mirror[1] == 0.0f && material.mirror[2] == 0.0f) return false;
    return (rules & CASTOR_RULE_MIRROR_ANY_MATERIAL) || material.kind == CASTOR_MATERIAL_MIRROR ||
           (material.kind == CASTOR_MATERIAL_CONDUCTOR && (rules & CASTOR_RULE_MIRROR_CONDUCTOR));
}

std::uint32_t filter_code(ReconstructionFilter filter) {
    switch (filter) {
        case ReconstructionFilter::box: return CASTOR_FILTER_BOX;
        case ReconstructionFilter::tent: return CASTOR_FILTER_TENT;
        case ReconstructionFilter::gaussian: return CASTOR_FILTER_GAUSSIAN;
    }
    return CASTOR_FILTER_GAUSSIAN;
}

WaveSettings make_settings(const SceneArrays& arrays, const shared::Camera& camera, const RenderOptions& options,
                           std::uint32_t samples) {
    WaveSettings settings{};
    settings.camera = camera;
    settings.max_depth = options.max_recursion_depth.value_or(arrays.max_recursion_depth);
    shared::RenderParams& params = settings.params;
    params.flags = rule_flags(options.rules);
    if (options.cull_back_faces) params.flags |= CASTOR_RENDER_CULL_BACK_FACES;
    if (samples == 1) params.flags |= CASTOR_RENDER_PIXEL_CENTRES;
    params.seed = options.seed;
    params.filter = filter_code(options.filter_in_use());
    store(params.background, arrays.background);
    store(params.ambient, arrays.ambient_light);
    params.shadow_epsilon = arrays.shadow_ray_epsilon;
    params.light_count = static_cast<std::uint32_t>(arrays.lights.size());
    settings.any_reflective = std::any_of(arrays.materials.begin(), arrays.materials.end(),
                                          [&](const shared::Material& m) { return can_reflect(m, params.flags); });
    return settings;
}

/// All that the pixels depend on, for Checkpoint::picture.
std::string describe_picture(std::uint64_t scene_fingerprint, const WaveSettings& settings, const RenderOptions& options, std::uint32_t samples) {
    const shared::Camera& camera = settings.camera;
    const auto vector = [](const float (&v)[3]) { return fmt::format("{} {} {}", v[0], v[1], v[2]); };
    std::string text;
    const auto line = [&](std::string_view name, const auto& value) { text += fmt::format("{} {}\n", name, value); };
    line("castor", CASTOR_VERSION);
    line("scene", fmt::format("{:016x}", scene_fingerprint));
    line("size", fmt::format("{}x{}", camera.width, camera.height));
    line("camera position", vector(camera.position));
    line("camera corner", vector(camera.corner));
    line("camera steps", vector(camera.step_x) + ", " + vector(camera.step_y));
    line("camera t", fmt::format("{} {}", camera.t_min, camera.t_max));
    line("samples", samples);
    line("filter", to_string(options.filter_in_use()));
    line("seed", options.seed);
    line("rules", to_string(options.rules));
    line("max depth", settings.max_depth);
    line("back faces", options.cull_back_faces ? "culled" : "hit");
    line("planes", fmt::format("{}", fmt::join(options.aovs, ",")));
    return text;
}

}  // namespace

struct Renderer::Implementation {
    Implementation(const Scene& scene, const std::vector<Device>& device_list, const RendererOptions& options)
        : Implementation(device_list, options) {
        shared = share_scene(scene, tunings, options.quality, limits_of(device_list));
        set_up(device_list);
    }

    Implementation(const BuiltScene& scene, const std::vector<Device>& device_list, const RendererOptions& options)
        : Implementation(device_list, options) {
        shared = complete_scene(scene, tunings, options.quality, limits_of(device_list), warnings);
        set_up(device_list);
    }

    Implementation(const std::vector<Device>& device_list, const RendererOptions& options)
        : tunings(choose_tunings(options.strategy, device_list, options.use_profiles)),
          deadline_seconds(options.deadline_seconds),
          stop_deadline_seconds(options.stop_deadline_seconds),
          warnings(warnings_of(tunings)) {
        if (device_list.empty()) throw UsageError("a Renderer needs at least one device");
    }

    /// A device that fails is left out, unless none is left.
    void set_up(const std::vector<Device>& device_list) {
        std::lock_guard lock(shared->mutex);
        const PreparedScene& prepared = shared->prepared;
        const std::vector<Warning>& scene_warnings = prepared.arrays().warnings;
        warnings.insert(warnings.begin(), scene_warnings.begin(), scene_warnings.end());
        const Stopwatch setup_watch;
        std::optional<DeviceError> last_failure;
        for (std::size_t i = 0; i < device_list.size(); ++i) {
            DeviceShare& share = statistics.devices.emplace_back();
            share.device = label(device_list[i]);
            try {
                devices.push_back(std::make_shared<RenderDevice>(device_list[i], shared, tunings[i].tuning));
                share.setup_seconds = devices.back()->setup_seconds;
            } catch (...) {
                last_failure = current_device_error(share.device);
                devices.push_back(nullptr);
                share.failure = last_failure->what();
                warnings.push_back({"", 0, fmt::format("{}; the device is dropped", last_failure->what())});
            }
        }
        if (has_no_device()) throw *last_failure;
        statistics.flatten_seconds = prepared.flatten_seconds;
        statistics.build_seconds = prepared.build_seconds;
        statistics.setup_seconds = setup_watch.seconds();
        statistics.triangles = prepared.counts.triangles;
        statistics.spheres = prepared.counts.spheres;
        statistics.planes = prepared.counts.planes;
        for (const SceneChunk& chunk : prepared.chunks)
            statistics.nodes += std::max(chunk.wide.nodes.size(), chunk.compressed.nodes.size());
    }

    bool has_no_device() const {
        return std::all_of(devices.begin(), devices.end(), [](const auto& device) { return device == nullptr; });
    }

    Film render(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress);
    void take_statistics(const RenderJob& job, double seconds, const Verification& verification);

    std::vector<TuningInUse> tunings;
    double deadline_seconds, stop_deadline_seconds;
    std::vector<Warning> warnings;
    std::shared_ptr<SharedScene> shared;
    RenderStatistics statistics;
    std::vector<std::shared_ptr<RenderDevice>> devices;  // null: dropped
    std::mutex mutex;  // one render at a time
    std::mutex statistics_mutex;
};

Film Renderer::Implementation::render(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress) {
    std::lock_guard lock(mutex);
    const Stopwatch watch;
    const shared::Camera device_camera = make_camera(camera, shared->prepared.description.file);
    if (options.tile_size % CASTOR_PIXEL_BLOCK != 0 || options.tile_size > 4096)
        throw UsageError(fmt::format("the tile size {} is not a multiple of {} up to 4096", options.tile_size, CASTOR_PIXEL_BLOCK));

    Checkpoint begin;
    Film& film = begin.film;
    film.width = camera.width;
    film.height = camera.height;
    film.samples_per_pixel = std::max(1u, options.samples_per_pixel ? options.samples_per_pixel : camera.samples_per_pixel);
    const std::size_t pixels = std::size_t{film.width} * film.height;
    film.pixels.assign(pixels, glm::vec3(0.0f));
    film.done.assign(pixels, 0);
    film.planes = make_planes(options.aovs, film.width, film.height);

    const WaveSettings settings = make_settings(shared->prepared.arrays(), device_camera, options, film.samples_per_pixel);
    std::vector<std::shared_ptr<RenderDevice>> in_use;
    for (const auto& device : devices)
        if (device) in_use.push_back(device);
    if (options.verify_share > 0.0 && in_use.size() < 2) throw UsageError("to verify a picture takes two devices, and there is one");
    begin.picture = describe_picture(shared->prepared.fingerprint, settings, options, film.samples_per_pixel);
    if (!options.resume_file.empty()) begin = load_checkpoint(options.resume_file, begin);
    const auto job = std::make_shared<RenderJob>(std::move(begin), settings, in_use, options);
    if (has_no_device()) throw RenderError(DeviceError("", "", 0, "all devices of this renderer were dropped before"), std::move(job->film()));
    job->run(deadline_seconds, stop_deadline_seconds, on_progress);
    const double seconds = watch.seconds();
    Verification verification;
    if (options.verify_share > 0.0 && job->film().complete()) {
        const bool is_whole = std::all_of(job->shares().begin(), job->shares().end(), [](const DeviceShare& share) { return share.failure.empty(); });
        if (is_whole) {
            verification = verify(*job, settings, in_use, options, deadline_seconds, on_progress);
        } else {
            job->tell("the picture is not verified, since a device was dropped");
            if (on_progress) on_progress(job->progress());
        }
    }
    take_statistics(*job, seconds, verification);
    if (has_no_device() && !job->film().complete() && !job->is_stopped()) throw RenderError(*job->last_failure(), std::move(job->film()));
    return std::move(job->film());
}

/// And lets go the devices that were dropped.
void Renderer::Implementation::take_statistics(const RenderJob& job, double seconds, const Verification& verification) {
    std::lock_guard statistics_lock(statistics_mutex);
    statistics.render_seconds = seconds;
    statistics.rays = 0;
    statistics.resumed_samples = job.samples_at_begin();
    statistics.notices = job.notices();
    statistics.verification = verification;
    auto share = job.shares().begin();
    for (std::size_t i = 0; i < devices.size(); ++i) {
        if (!devices[i]) {
            DeviceShare nothing;
            nothing.device = statistics.devices[i].device;
            nothing.failure = statistics.devices[i].failure;
            statistics.devices[i] = nothing;
            continue;
        }
        statistics.devices[i] = *share++;
        statistics.rays += statistics.devices[i].rays;
        if (!statistics.devices[i].failure.empty()) devices[i] = nullptr;
    }
}

Renderer::Renderer(const Scene& scene, const std::vector<Device>& devices, const RendererOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Renderer::Renderer(const BuiltScene& scene, const std::vector<Device>& devices, const RendererOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

Film Renderer::render(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress) {
    return implementation_->render(camera, options, on_progress);
}

const std::vector<Warning>& Renderer::warnings() const { return implementation_->warnings; }
RenderStatistics Renderer::statistics() const {
    std::lock_guard lock(implementation_->statistics_mutex);
    return implementation_->statistics;
}
Strategy Renderer::strategy(Coherence hint, Query query, std::size_t device_index) const {
    return implementation_->tunings.at(device_index).tuning.strategies.of(query, hint);
}

}  // namespace castor
