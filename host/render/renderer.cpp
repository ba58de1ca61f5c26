#include "castor/renderer.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "castor/error.h"
#include "opencl/device_context.h"
#include "render/aov.h"
#include "render/camera.h"
#include "render/rules.h"
#include "render/wave.h"
#include "stopwatch.h"
#include "trace/device_scene.h"
#include "trace/shared_scene.h"
#include "trace/strategy.h"

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
    const shared::Geometry& geometry = arrays.geometries.front();
    params.sphere_base = geometry.triangle_count;
    params.plane_base = geometry.triangle_count + geometry.sphere_count;
    params.mesh_count = static_cast<std::uint32_t>(arrays.mesh_ranges.size());
    params.light_count = static_cast<std::uint32_t>(arrays.lights.size());
    settings.any_reflective = std::any_of(arrays.materials.begin(), arrays.materials.end(),
                                          [&](const shared::Material& m) { return can_reflect(m, params.flags); });
    return settings;
}

std::vector<Tile> make_tiles(std::uint32_t width, std::uint32_t height, std::uint32_t size) {
    std::vector<Tile> tiles;
    for (std::uint32_t y = 0; y < height; y += size)
        for (std::uint32_t x = 0; x < width; x += size)
            tiles.push_back({x, y, std::min(size, width - x), std::min(size, height - y)});
    return tiles;
}

/// `is_done`: all samples were taken.
void store_tile(Film& film, const Tile& tile, const std::vector<glm::vec3>& pixels, bool is_done) {
    for (std::size_t y = 0; y < tile.height; ++y) {
        const std::size_t row = (tile.y + y) * film.width + tile.x;
        std::copy_n(pixels.begin() + y * tile.width, tile.width, film.pixels.begin() + row);
        std::fill_n(film.done.begin() + row, tile.width, std::uint8_t{is_done});
    }
}

/// One device with the scene on it.
struct RenderDevice {
    RenderDevice(const Device& device, const PreparedScene& prepared, const Tuning& device_tuning)
        : context(device), scene(upload_scene(context, prepared)), tuning(device_tuning) {}

    DeviceContext context;
    DeviceScene scene;
    Tuning tuning;
};

/// Counts what is done and asks the caller whether to go on. Used by all feeding threads.
class ProgressReport {
public:
    ProgressReport(std::uint64_t samples_total, const ProgressCallback& callback) : callback_(callback) {
        progress_.samples_total = samples_total;
    }

    bool stopped() const { return stopped_; }
    void stop() { stopped_ = true; }
    std::uint64_t rays() const { return progress_.rays; }

    void add(std::uint64_t samples, std::uint64_t rays) {
        std::lock_guard lock(mutex_);
        progress_.samples_done += samples;
        progress_.rays += rays;
        progress_.seconds = watch_.seconds();
        if (callback_ && !stopped_ && !callback_(progress_)) stopped_ = true;
    }

private:
    const ProgressCallback& callback_;
    RenderProgress progress_;
    Stopwatch watch_;
    std::mutex mutex_;
    std::atomic<bool> stopped_ = false;
};

}  // namespace

struct Renderer::Implementation {
    Implementation(const Scene& scene, const std::vector<Device>& device_list, const RendererOptions& options)
        : Implementation(device_list, options) {
        shared = share_scene(scene, tunings, options.quality, common_allocation(device_list));
        set_up(device_list);
    }

    Implementation(const BuiltScene& scene, const std::vector<Device>& device_list, const RendererOptions& options)
        : Implementation(device_list, options) {
        shared = complete_scene(scene, tunings, options.quality, common_allocation(device_list), warnings);
        set_up(device_list);
    }

    Implementation(const std::vector<Device>& device_list, const RendererOptions& options)
        : tunings(choose_tunings(options.strategy, device_list, options.use_profiles)), warnings(warnings_of(tunings)) {
        if (device_list.empty()) throw UsageError("a Renderer needs at least one device");
    }

    void set_up(const std::vector<Device>& device_list) {
        std::lock_guard lock(shared->mutex);
        const PreparedScene& prepared = shared->prepared;
        warnings.insert(warnings.begin(), prepared.arrays.warnings.begin(), prepared.arrays.warnings.end());
        const Stopwatch setup_watch;
        for (std::size_t i = 0; i < device_list.size(); ++i)
            devices.push_back(std::make_unique<RenderDevice>(device_list[i], prepared, tunings[i].tuning));
        const SceneArrays& arrays = prepared.arrays;
        statistics.flatten_seconds = prepared.flatten_seconds;
        statistics.build_seconds = prepared.build_seconds;
        statistics.setup_seconds = setup_watch.seconds();
        statistics.triangles = arrays.triangle_count();
        statistics.spheres = arrays.sphere_count();
        statistics.planes = arrays.plane_count();
        statistics.nodes = std::max(prepared.wide.nodes.size(), prepared.compressed.nodes.size());
    }

    Film render(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress);
    void render_tiles(RenderDevice& device, const WaveSettings& settings, const std::vector<Tile>& tiles,
                      std::atomic<std::size_t>& next_tile, Film& film, ProgressReport& report);

    std::vector<TuningInUse> tunings;
    std::vector<Warning> warnings;
    std::shared_ptr<SharedScene> shared;
    RenderStatistics statistics;
    std::vector<std::unique_ptr<RenderDevice>> devices;
    std::mutex mutex;  // one render at a time
    std::mutex statistics_mutex;
};

void Renderer::Implementation::render_tiles(RenderDevice& device, const WaveSettings& settings,
                                            const std::vector<Tile>& tiles, std::atomic<std::size_t>& next_tile, Film& film,
                                            ProgressReport& report) {
    Wave wave(device.context, device.scene, device.tuning, settings, tiles.front());  // none is larger
    for (std::size_t i = next_tile++; i < tiles.size() && !report.stopped(); i = next_tile++) {
        const Tile& tile = tiles[i];
        if (!film.planes.empty()) castor::store_tile(film, tile, wave.trace_aovs(tile));
        wave.begin_tile(tile);
        const std::uint64_t pixels = std::uint64_t{tile.width} * tile.height;
        std::uint32_t samples = 0;
        for (; samples < film.samples_per_pixel && !report.stopped(); ++samples) {
            wave.trace_sample(samples);
            report.add(pixels, 0);
        }
        report.add(0, wave.ray_count());
        // A tile that was stopped shows what it has.
        if (samples > 0) store_tile(film, tile, wave.resolve(samples), samples == film.samples_per_pixel);
    }
}

Film Renderer::Implementation::render(const Camera& camera, const RenderOptions& options, const ProgressCallback& on_progress) {
    std::lock_guard lock(mutex);
    const Stopwatch watch;
    const shared::Camera device_camera = make_camera(camera, shared->prepared.description.file);
    const std::uint32_t tile_size = options.tile_size ? options.tile_size : devices.front()->context.profile().tile_size;
    if (tile_size % CASTOR_PIXEL_BLOCK != 0 || tile_size > 4096)
        throw UsageError(fmt::format("the tile size {} is not a multiple of {} up to 4096", tile_size, CASTOR_PIXEL_BLOCK));

    Film film;
    film.width = camera.width;
    film.height = camera.height;
    film.samples_per_pixel = std::max(1u, options.samples_per_pixel ? options.samples_per_pixel : camera.samples_per_pixel);
    const std::size_t pixels = std::size_t{film.width} * film.height;
    film.pixels.assign(pixels, glm::vec3(0.0f));
    film.done.assign(pixels, 0);
    film.planes = make_planes(options.aovs, film.width, film.height);

    const WaveSettings settings = make_settings(shared->prepared.arrays, device_camera, options, film.samples_per_pixel);
    const std::vector<Tile> tiles = make_tiles(film.width, film.height, tile_size);
    ProgressReport report(std::uint64_t{pixels} * film.samples_per_pixel, on_progress);
    std::atomic<std::size_t> next_tile = 0;
    std::vector<std::exception_ptr> failures(devices.size());
    const auto feed = [&](std::size_t i) {
        try {
            render_tiles(*devices[i], settings, tiles, next_tile, film, report);
        } catch (...) {
            failures[i] = std::current_exception();
            report.stop();
        }
    };
    {
        std::vector<std::jthread> feeders;
        for (std::size_t i = 1; i < devices.size(); ++i) feeders.emplace_back(feed, i);
        feed(0);
    }
    for (const std::exception_ptr& failure : failures)
        if (failure) std::rethrow_exception(failure);
    {
        std::lock_guard statistics_lock(statistics_mutex);
        statistics.render_seconds = watch.seconds();
        statistics.rays = report.rays();
    }
    return film;
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
Strategy Renderer::strategy(Coherence hint, Query query) const { return implementation_->tunings.front().tuning.strategies.of(query, hint); }

}  // namespace castor
