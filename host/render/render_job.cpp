#include "render/render_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "render/aov.h"

namespace castor {

namespace {

// Times as many as a wave takes side by side. Each is some ten commands for the driver to queue.
constexpr std::uint64_t kMostWavesInSlice = 16;

// After which a checkpoint is written without the sums of devices that are still busy.
constexpr double kLongestWaitForSums = 2.0;

std::vector<std::uint32_t> codes_of(const PixelBlocks& blocks, const Range& numbers) {
    std::vector<std::uint32_t> codes;
    for (std::uint64_t number = numbers.begin; number < numbers.end; ++number)
        codes.push_back(blocks.code(static_cast<std::uint32_t>(number)));
    return codes;
}

std::uint64_t pixels_of(const PixelBlocks& blocks, const Range& numbers) {
    std::uint64_t pixels = 0;
    for (std::uint64_t number = numbers.begin; number < numbers.end; ++number)
        pixels += blocks.pixels_in_picture(static_cast<std::uint32_t>(number));
    return pixels;
}

/// What went wrong; empty: nothing.
std::string write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint) {
    try {
        save_checkpoint(file, checkpoint);
        return "";
    } catch (const std::exception& error) {
        return fmt::format("the checkpoint is not written: {}", error.what());
    }
}

}  // namespace

RenderJob::RenderJob(Checkpoint begin, const WaveSettings& settings, std::vector<std::shared_ptr<SceneDevice>> devices,
                     const RenderOptions& options)
    : width_(begin.film.width),
      height_(begin.film.height),
      samples_per_pixel_(begin.film.samples_per_pixel),
      has_planes_(!begin.film.planes.empty()),
      blocks_(width_, height_),
      settings_(settings),
      devices_(std::move(devices)),
      tile_size_(options.tile_size),
      checkpoint_file_(options.checkpoint_file),
      checkpoint_seconds_(options.checkpoint_seconds),
      state_(std::move(begin)),
      samples_under_way_(devices_.size()),
      has_piece_(devices_.size()),
      given_sums_(devices_.size()),
      device_of_block_(blocks_.count(), kNoDevice) {
    for (const auto& device : devices_) {
        DeviceShare& share = shares_.emplace_back();
        share.device = label(device->context.device());
        share.setup_seconds = device->setup_seconds;
    }
    samples_at_begin_ = samples_done(state_);
}

void RenderJob::run(const Deadlines& deadlines, const ProgressCallback& on_progress) {
    CrewOptions options{.deadlines = deadlines};
    std::vector<WorkerFunction> workers;
    for (std::size_t i = 0; i < devices_.size(); ++i) {
        options.names.push_back(shares_[i].device);
        options.in_callers_thread.push_back(devices_[i]->context.quirks().stays_in_thread);
        workers.push_back([job = shared_from_this(), device = devices_[i]](Schedule& schedule, std::size_t worker) {
            job->render_pieces(*device, schedule, worker);
        });
    }
    options.tick = [&] {
        if (!checkpoint_file_.empty()) keep_checkpoints();
        is_stopped_ = on_progress && !on_progress(progress());
        return !is_stopped_;
    };
    options.on_drop = [&](std::size_t worker, const DeviceError& why) { drop(worker, why); };
    options.on_leave = [&](std::size_t worker) {
        {
            std::lock_guard lock(mutex_);
            ++shares_[worker].left_busy;
            forget_piece(worker);
        }
        if (!is_stopped_)
            tell(fmt::format("{} was still busy when the picture was done, and was not waited for",
                             shares_[worker].device));
    };
    std::exception_ptr unexpected;
    try {
        run_crew(std::make_shared<Schedule>(work_left(), workers.size()), workers, options);
    } catch (...) {
        unexpected = std::current_exception();
    }
    if (!checkpoint_file_.empty()) write_last_checkpoint();
    if (unexpected) std::rethrow_exception(unexpected);
    show_partial_blocks();
    if (on_progress) on_progress(progress());
}

/// Blocks that are not done, those with equally many samples together.
std::vector<Range> RenderJob::work_left() const {
    std::vector<Range> work;
    std::uint32_t last_samples = 0;
    auto partial = state_.partial_blocks.begin();
    for (std::uint32_t number = 0; number < blocks_.count(); ++number) {
        const bool is_partial = partial != state_.partial_blocks.end() && partial->first == number;
        const std::uint32_t samples = is_partial ? (partial++)->second.samples : 0;
        const glm::uvec2 corner = blocks_.corner(number);
        if (state_.film.done[std::size_t{corner.y} * width_ + corner.x]) continue;
        if (work.empty() || work.back().end != number || samples != last_samples) work.push_back({number, number});
        work.back().end = number + 1;
        last_samples = samples;
    }
    return work;
}

void RenderJob::render_pieces(SceneDevice& device, Schedule& schedule, std::size_t worker) {
    const std::uint64_t edge = (tile_size_ ? tile_size_ : device.context.quirks().tile_size) / CASTOR_PIXEL_BLOCK;
    const std::uint64_t most_blocks = std::min<std::uint64_t>(edge * edge, blocks_.count());
    const auto device_lock = lock_for_work(device, schedule, worker);
    if (!device_lock) return;
    const Stopwatch watch;
    // Room for several samples of each pixel where the picture has few.
    const std::uint64_t own_edge = device.context.quirks().tile_size / CASTOR_PIXEL_BLOCK;
    const std::uint64_t room =
        std::min<std::uint64_t>(own_edge * own_edge, std::uint64_t{blocks_.count()} * samples_per_pixel_);
    Wave wave(device.context, device.scene, device.tuning, settings_, std::max(most_blocks, room));
    {
        std::lock_guard lock(mutex_);
        shares_[worker].setup_seconds += watch.seconds();
    }
    Pace pace(device.tuning.strategies.of(Query::closest, Coherence::coherent), device.context.device());
    // Where chunks stream, a sample takes as long for few blocks as for many.
    const bool streams = device.scene.streaming_count() > 0;
    while (const auto piece =
               schedule.take(worker, streams ? most_blocks : pace.units_in_slice(most_blocks), most_blocks))
        render_piece(wave, pace, *piece, schedule, worker);
}

void RenderJob::render_piece(Wave& wave, Pace& pace, const Range& piece, Schedule& schedule, std::size_t worker) {
    const Stopwatch watch;
    const std::vector<std::uint32_t> codes = codes_of(blocks_, piece);
    const std::uint64_t pixels = pixels_of(blocks_, piece);
    std::vector<glm::vec4> sums_before;
    std::uint32_t first_sample = 0;
    {
        std::lock_guard lock(mutex_);
        has_piece_[worker] = true;
        first_sample = samples_before(piece, sums_before);
    }
    const WaveAovs aovs = has_planes_ ? wave.trace_aovs(codes) : WaveAovs{};
    wave.begin(codes, sums_before);
    std::uint32_t samples = first_sample;
    std::uint32_t counted_samples = first_sample;  // as this device's, since others may go on from them
    const auto count_samples = [&] {
        shares_[worker].samples += pixels * (samples - std::exchange(counted_samples, samples));
    };
    const auto keep_sums = [&] {
        const std::uint32_t wanted = wanted_sums_;
        const std::vector<glm::vec4> sums = wave.sums();
        schedule.keep(worker, [&] {
            std::lock_guard lock(mutex_);
            store_sums(piece, samples, sums);
            given_sums_[worker] = wanted;
            count_samples();
            samples_under_way_[worker] = 0;
        });
    };
    bool is_wanted = true;
    while (samples < samples_per_pixel_ && is_wanted) {
        const std::uint64_t at_once = wave.samples_at_once();
        const std::uint64_t left = std::min<std::uint64_t>(samples_per_pixel_ - samples, kMostWavesInSlice * at_once);
        std::uint64_t now = std::clamp<std::uint64_t>(pace.units_in_slice(left * codes.size()) / codes.size(), 1, left);
        if (now > at_once) now -= now % at_once;
        const Stopwatch slice;
        wave.trace_samples(samples, static_cast<std::uint32_t>(now));
        samples += static_cast<std::uint32_t>(now);
        wave.wait(pace.expected_seconds(now * codes.size()));
        pace.add(now * codes.size(), slice.seconds());
        is_wanted = schedule.is_wanted(worker);
        bool wants_sums = false;
        {
            std::lock_guard lock(mutex_);
            samples_under_way_[worker] = pixels * (samples - counted_samples);
            wants_sums = given_sums_[worker] != wanted_sums_;
        }
        if (samples < samples_per_pixel_ && (wants_sums || !is_wanted)) keep_sums();
    }
    const bool is_done = samples == samples_per_pixel_;
    const std::uint64_t rays = wave.ray_count();
    const std::vector<glm::vec3> means = wave.resolve(samples);
    const auto store = [&] {
        std::lock_guard lock(mutex_);
        store_pixels(piece, means, aovs, is_done);
        DeviceShare& share = shares_[worker];
        share.tiles += is_done;
        if (is_done)
            std::fill(device_of_block_.begin() + piece.begin, device_of_block_.begin() + piece.end,
                      static_cast<std::uint16_t>(worker));
        count_samples();
        share.rays += rays;
        share.busy_seconds += watch.seconds();
    };
    const bool counts = is_done ? schedule.finish(worker, store) : schedule.keep(worker, store);
    if (counts && is_done) schedule.set_speed(worker, static_cast<double>(piece.size()) / watch.seconds());
    std::lock_guard lock(mutex_);
    samples_under_way_[worker] = 0;
    has_piece_[worker] = false;
}

/// Of each pixel of the piece; and their sums, none if there are no samples.
std::uint32_t RenderJob::samples_before(const Range& piece, std::vector<glm::vec4>& sums) {
    const auto first = state_.partial_blocks.find(static_cast<std::uint32_t>(piece.begin));
    if (first == state_.partial_blocks.end()) return 0;
    const std::uint32_t samples = first->second.samples;
    auto partial = first;
    for (std::uint64_t number = piece.begin; number < piece.end; ++number, ++partial)
        sums.insert(sums.end(), partial->second.sums.begin(), partial->second.sums.end());
    return samples;
}

void RenderJob::store_pixels(const Range& piece, const std::vector<glm::vec3>& means, const WaveAovs& aovs,
                             bool is_done) {
    for (std::uint64_t number = piece.begin; number < piece.end; ++number) {
        blocks_.for_each_row(static_cast<std::uint32_t>(number), number - piece.begin,
                             [&](std::size_t pixel, std::size_t slot, std::uint32_t count) {
                                 std::copy_n(means.begin() + slot, count, state_.film.pixels.begin() + pixel);
                                 std::fill_n(state_.film.done.begin() + pixel, count, std::uint8_t{is_done});
                             });
        if (is_done) state_.partial_blocks.erase(static_cast<std::uint32_t>(number));
    }
    if (has_planes_) store_aovs(state_.film, blocks_, piece, aovs);
}

void RenderJob::store_sums(const Range& piece, std::uint32_t samples, const std::vector<glm::vec4>& sums) {
    for (std::uint64_t number = piece.begin; number < piece.end; ++number) {
        PartialBlock& block = state_.partial_blocks[static_cast<std::uint32_t>(number)];
        if (block.samples >= samples) continue;  // another device at the same piece was farther
        block.samples = samples;
        std::copy_n(sums.begin() + (number - piece.begin) * PixelBlocks::kPixels, PixelBlocks::kPixels,
                    block.sums.begin());
    }
}

/// Pixels that are not done get the means of the samples that there are.
void RenderJob::show_partial_blocks() {
    std::lock_guard lock(mutex_);
    for (const auto& [number, block] : state_.partial_blocks)
        blocks_.for_each_row(number, 0,
                             [&, &partial = block](std::size_t pixel, std::size_t slot, std::uint32_t count) {
                                 for (std::uint32_t i = 0; i < count; ++i)
                                     state_.film.pixels[pixel + i] =
                                         glm::vec3(partial.sums[slot + i]) / static_cast<float>(partial.samples);
                             });
}

std::vector<DeviceShare> RenderJob::shares() const {
    std::lock_guard lock(mutex_);
    return shares_;
}

std::vector<std::string> RenderJob::notices() const {
    std::lock_guard lock(mutex_);
    return notices_;
}

std::uint64_t RenderJob::samples_in_film() const {
    std::lock_guard lock(mutex_);
    return samples_done(state_);
}

RenderProgress RenderJob::progress() {
    RenderProgress progress;
    progress.samples_total = std::uint64_t{width_} * height_ * samples_per_pixel_;
    progress.samples_done = progress.samples_resumed = samples_at_begin_;
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
    progress.notices.assign(notices_.begin() + static_cast<std::ptrdiff_t>(told_notices_), notices_.end());
    told_notices_ = notices_.size();
    return progress;
}

void RenderJob::drop(std::size_t worker, const DeviceError& why) {
    tell(fmt::format("{}; the device is dropped", why.what()));
    std::lock_guard lock(mutex_);
    DeviceShare& share = shares_[worker];
    share.failure = why.what();
    if (has_piece_[worker]) ++share.retries;
    forget_piece(worker);
    last_failure_ = why;
}

/// What the worker made of its piece, but for what is stored already, is lost.
void RenderJob::forget_piece(std::size_t worker) {
    has_piece_[worker] = false;
    samples_under_way_[worker] = 0;
}

void RenderJob::tell(const std::string& notice) {
    std::lock_guard lock(mutex_);
    notices_.push_back(notice);
}

void RenderJob::set_failure(std::size_t device, const std::string& failure) {
    std::lock_guard lock(mutex_);
    shares_[device].failure = failure;
}

/// First all devices are asked for the sums of what they are at, then what there is is copied, and a thread of its own
/// writes it.
void RenderJob::keep_checkpoints() {
    if (writing_.valid()) {
        if (writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
        tell_of_checkpoint(writing_.get());
        since_checkpoint_ = {};
    }
    if (since_checkpoint_.seconds() < checkpoint_seconds_) return;
    try {
        begin_checkpoint();
    } catch (const std::exception& error) {  // no memory for the copy, or no thread
        tell_of_checkpoint(fmt::format("the checkpoint is not written: {}", error.what()));
        since_checkpoint_ = {};
    }
}

void RenderJob::begin_checkpoint() {
    if (!is_waiting_for_sums_) ++wanted_sums_;
    is_waiting_for_sums_ = true;
    Checkpoint copy;
    {
        std::lock_guard lock(mutex_);
        const bool is_late = since_checkpoint_.seconds() > checkpoint_seconds_ + kLongestWaitForSums;
        for (std::size_t i = 0; i < devices_.size() && !is_late; ++i)
            if (samples_under_way_[i] > 0 && given_sums_[i] != wanted_sums_) return;
        copy = state_;
    }
    is_waiting_for_sums_ = false;
    writing_ = std::async(std::launch::async, [file = checkpoint_file_, checkpoint = std::move(copy)] {
        return write_checkpoint(file, checkpoint);
    });
}

/// Once, until it is another one. Empty: there is none.
void RenderJob::tell_of_checkpoint(const std::string& problem) {
    if (!problem.empty() && problem != last_problem_) tell(problem + "; the render goes on");
    last_problem_ = problem;
}

/// Of what is not complete.
void RenderJob::write_last_checkpoint() {
    if (writing_.valid()) tell_of_checkpoint(writing_.get());
    std::unique_lock lock(mutex_);
    if (state_.film.complete()) return;
    const std::string problem = write_checkpoint(checkpoint_file_, state_);
    lock.unlock();
    if (!problem.empty()) tell(problem);
}

}  // namespace castor
