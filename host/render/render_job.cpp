#include "render/render_job.h"

#include <algorithm>

#include <fmt/format.h>

#include "render/aov.h"
#include "schedule/crew.h"

namespace castor {

namespace {

// Until a device's speed is known.
constexpr std::uint64_t kFirstBlocks = 16;

// Each is some ten commands for the driver to queue.
constexpr std::uint64_t kMostSamplesInSlice = 16;

std::vector<std::uint32_t> codes_of(const PixelBlocks& blocks, const Range& numbers) {
    std::vector<std::uint32_t> codes;
    for (std::uint64_t number = numbers.begin; number < numbers.end; ++number) codes.push_back(blocks.code(static_cast<std::uint32_t>(number)));
    return codes;
}

std::uint64_t pixels_of(const PixelBlocks& blocks, const Range& numbers) {
    std::uint64_t pixels = 0;
    for (std::uint64_t number = numbers.begin; number < numbers.end; ++number) pixels += blocks.pixels_in_picture(static_cast<std::uint32_t>(number));
    return pixels;
}

}  // namespace

RenderJob::RenderJob(Film film, const WaveSettings& settings, std::vector<std::shared_ptr<RenderDevice>> devices, std::uint32_t tile_size)
    : film_(std::move(film)),
      blocks_(film_.width, film_.height),
      settings_(settings),
      devices_(std::move(devices)),
      tile_size_(tile_size),
      samples_under_way_(devices_.size()) {
    for (const auto& device : devices_) {
        DeviceShare& share = shares_.emplace_back();
        share.device = label(device->context.device());
        share.setup_seconds = device->setup_seconds;
    }
}

void RenderJob::run(double deadline_seconds, const ProgressCallback& on_progress) {
    CrewOptions options{.deadline_seconds = deadline_seconds};
    std::vector<WorkerFunction> workers;
    for (std::size_t i = 0; i < devices_.size(); ++i) {
        options.names.push_back(shares_[i].device);
        workers.push_back([job = shared_from_this(), device = devices_[i]](Schedule& schedule, std::size_t worker) {
            job->render_pieces(*device, schedule, worker);
        });
    }
    if (on_progress) options.tick = [&] { return on_progress(progress()); };
    options.on_drop = [&](std::size_t worker, const DeviceError& why) { drop(worker, why); };
    const auto schedule = std::make_shared<Schedule>(std::vector<Range>{{0, blocks_.count()}}, workers.size());
    run_crew(schedule, workers, options);
    if (on_progress) on_progress(progress());
}

void RenderJob::render_pieces(RenderDevice& device, Schedule& schedule, std::size_t worker) {
    const std::uint64_t edge = (tile_size_ ? tile_size_ : device.context.profile().tile_size) / CASTOR_PIXEL_BLOCK;
    const std::uint64_t most_blocks = std::min<std::uint64_t>(edge * edge, blocks_.count());
    const Stopwatch watch;
    Wave wave(device.context, device.scene, device.tuning, settings_, most_blocks);
    {
        std::lock_guard lock(mutex_);
        shares_[worker].setup_seconds += watch.seconds();
    }
    Pace pace;
    while (const auto piece = schedule.take(worker, pace.units_in_slice(most_blocks, kFirstBlocks))) render_piece(wave, pace, *piece, schedule, worker);
}

void RenderJob::render_piece(Wave& wave, Pace& pace, const Range& piece, Schedule& schedule, std::size_t worker) {
    const Stopwatch watch;
    const std::vector<std::uint32_t> codes = codes_of(blocks_, piece);
    const std::uint64_t pixels = pixels_of(blocks_, piece);
    const WaveAovs aovs = film_.planes.empty() ? WaveAovs{} : wave.trace_aovs(codes);
    wave.begin(codes);
    std::uint32_t samples = 0;
    bool is_wanted = true;
    while (samples < film_.samples_per_pixel && is_wanted) {
        const std::uint64_t left = std::min<std::uint64_t>(film_.samples_per_pixel - samples, kMostSamplesInSlice);
        const std::uint64_t now = std::clamp<std::uint64_t>(pace.units_in_slice(left * codes.size(), codes.size()) / codes.size(), 1, left);
        const Stopwatch slice;
        for (std::uint64_t i = 0; i < now; ++i) wave.trace_sample(samples++);
        wave.wait(pace.expected_seconds(now * codes.size()));
        pace.add(now * codes.size(), slice.seconds());
        is_wanted = schedule.is_wanted(worker);
        std::lock_guard lock(mutex_);
        samples_under_way_[worker] = pixels * samples;
    }
    const bool is_done = samples == film_.samples_per_pixel;
    const std::uint64_t rays = wave.ray_count();
    const std::vector<glm::vec3> means = wave.resolve(samples);
    const auto store_it = [&] {
        std::lock_guard lock(mutex_);
        store(piece, means, aovs, is_done);
        DeviceShare& share = shares_[worker];
        share.tiles += is_done;
        share.samples += pixels * samples;
        share.rays += rays;
        share.busy_seconds += watch.seconds();
    };
    const bool counts = is_done ? schedule.finish(worker, store_it) : schedule.keep(worker, store_it);
    if (counts && is_done) schedule.set_speed(worker, static_cast<double>(piece.size()) / watch.seconds());
    std::lock_guard lock(mutex_);
    samples_under_way_[worker] = 0;
}

void RenderJob::store(const Range& piece, const std::vector<glm::vec3>& means, const WaveAovs& aovs, bool is_done) {
    for (std::uint64_t number = piece.begin; number < piece.end; ++number)
        blocks_.for_each_row(static_cast<std::uint32_t>(number), number - piece.begin, [&](std::size_t pixel, std::size_t slot, std::uint32_t count) {
            std::copy_n(means.begin() + slot, count, film_.pixels.begin() + pixel);
            std::fill_n(film_.done.begin() + pixel, count, std::uint8_t{is_done});
        });
    if (!film_.planes.empty()) store_aovs(film_, blocks_, piece, aovs);
}

RenderProgress RenderJob::progress() {
    RenderProgress progress;
    progress.samples_total = std::uint64_t{film_.width} * film_.height * film_.samples_per_pixel;
    progress.seconds = watch_.seconds();
    std::lock_guard lock(mutex_);
    progress.devices = shares_;
    for (std::size_t i = 0; i < shares_.size(); ++i) {
        progress.devices[i].samples += samples_under_way_[i];
        progress.samples_done += progress.devices[i].samples;
        progress.rays += shares_[i].rays;
    }
    // Two devices may be at the same piece.
    progress.samples_done = std::min(progress.samples_done, progress.samples_total);
    progress.notices = std::exchange(notices_, {});
    return progress;
}

void RenderJob::drop(std::size_t worker, const DeviceError& why) {
    std::lock_guard lock(mutex_);
    DeviceShare& share = shares_[worker];
    share.failure = why.what();
    if (samples_under_way_[worker] > 0) ++share.retries;
    samples_under_way_[worker] = 0;
    notices_.push_back(fmt::format("{}; the device is dropped", why.what()));
    last_failure_ = why;
}

}  // namespace castor
