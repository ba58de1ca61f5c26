#include "render/render_job.h"

#include <algorithm>
#include <exception>
#include <functional>
#include <utility>

#include "base/stopwatch.h"

namespace castor {

namespace {

// Measuring a worker takes at most a few full waves; a render of so many is worth it.
constexpr std::uint64_t kWavesWorthMeasuring = 64;

// A pass of the progressive order takes a quarter of the samples that there are, since later ones change less.
constexpr std::uint32_t kPassDivisor = 4, kMostSamplesInPass = 16;

}  // namespace

RenderJob::RenderJob(Checkpoint begin, std::vector<PieceWorkerOffer> workers, const RenderOptions& options)
    : picture_(std::move(begin), options.part.value_or(PicturePart())),
      workers_(std::move(workers)),
      order_(options.order),
      is_part_(options.part.has_value()),
      tally_(workers_, picture_.samples_to_do(), picture_.samples_done_of_part()),
      worker_of_block_(picture_.blocks().count(), kNoWorker),
      given_sums_(workers_.size()),
      keeper_(options.checkpoint_file, options.checkpoint_seconds,
              [this](const std::string& problem) { tally_.tell(problem); }),
      is_dropped_(workers_.size()) {}

void RenderJob::run(const Deadlines& deadlines, const ProgressCallback& on_progress) {
    std::exception_ptr unexpected;
    try {
        run_passes(deadlines, on_progress);
    } catch (...) {
        unexpected = std::current_exception();
    }
    keeper_.finish();
    if (is_part_ || !picture_.film().complete()) keeper_.write(picture_.state());
    if (unexpected) std::rethrow_exception(unexpected);
    picture_.show_partial_blocks();
    if (on_progress) on_progress(progress());
}

void RenderJob::run_passes(const Deadlines& deadlines, const ProgressCallback& on_progress) {
    CrewOptions options{.deadlines = deadlines};
    for (const PieceWorkerOffer& worker : workers_) {
        options.names.push_back(worker.name);
        options.in_callers_thread.push_back(worker.stays_in_callers_thread);
    }
    options.tick = [&] {
        keeper_.tick([&](bool is_late) { return gather_sums(is_late); });
        is_stopped_ = on_progress && !on_progress(progress());
        return !is_stopped_;
    };
    options.on_drop = [&](std::size_t number, const DeviceError& why) {
        is_dropped_[number] = true;
        tally_.drop(number, why);
    };
    options.on_leave = [&](std::size_t number) { tally_.leave(number, is_stopped_); };
    while (const auto pass = next_pass()) {
        std::vector<WorkerFunction> functions;
        for (std::size_t i = 0; i < workers_.size(); ++i) {
            if (is_dropped_[i])
                functions.push_back([](Schedule&, std::size_t) {});
            else
                functions.push_back([job = shared_from_this(), pass = *pass](Schedule& schedule, std::size_t number) {
                    job->render_pieces(job->workers_[number], schedule, number, pass);
                });
        }
        const auto schedule = std::make_shared<Schedule>(pass->work, workers_.size());
        run_crew(schedule, functions, options);
        if (is_stopped_ || schedule->items_left() > 0) return;
        if (pass->samples < picture_.samples_per_pixel() && !options.tick()) return;
    }
}

std::optional<RenderJob::Pass> RenderJob::next_pass() const {
    const std::uint32_t fewest = picture_.fewest_samples();
    std::uint32_t samples = picture_.samples_per_pixel();
    if (order_ == RenderOrder::progressive)
        samples = std::min(samples, fewest + std::clamp(fewest / kPassDivisor, 1u, kMostSamplesInPass));
    std::vector<Range> work = picture_.work_left(samples);
    if (work.empty()) return std::nullopt;
    return Pass{samples, samples - fewest, std::move(work)};
}

void RenderJob::render_pieces(const PieceWorkerOffer& offer, Schedule& schedule, std::size_t number, const Pass& pass) {
    const auto is_needed = [&] { return schedule.may_have_work(number); };
    const std::unique_ptr<PieceWorker> worker = offer.make(is_needed);
    if (!worker) return;
    tally_.add_setup(number, worker->setup_seconds());
    const std::uint32_t samples_left = picture_.samples_per_pixel() - pass.samples + pass.samples_each;
    if (schedule.items_left() * samples_left >= kWavesWorthMeasuring * worker->most_blocks())
        worker->measure({0, picture_.blocks().count()}, [&] {
            schedule.is_wanted(number);  // a sign of life
            return is_needed();
        });
    schedule.set_speed(number, worker->block_samples_per_second() / pass.samples_each);
    while (const auto blocks = schedule.take(number, worker->blocks_wanted(), worker->most_blocks()))
        render_piece(*worker, *blocks, schedule, number, pass.samples);
}

void RenderJob::render_piece(PieceWorker& worker, const Range& blocks, Schedule& schedule, std::size_t number,
                             std::uint32_t samples) {
    const std::uint64_t pixels = picture_.pixels_of(blocks);
    const Stopwatch piece_watch;
    tally_.begin_piece(number);
    for (bool goes_on = true; goes_on;) {
        const Stopwatch watch;
        const PieceOrder order = picture_.order(blocks, samples);
        if (picture_.is_finished(static_cast<std::uint32_t>(blocks.begin))) break;  // by another worker, meanwhile
        std::uint32_t asked = asked_for_sums_;
        const PieceResult result = worker.render(order, [&](std::uint32_t taken) {
            tally_.set_under_way(number, pixels * (taken - order.begin.samples));
            asked = asked_for_sums_;
            goes_on = schedule.is_wanted(number);
            return goes_on && given_sums_[number] == asked;
        });
        const bool is_finished = result.state.samples == samples;
        const auto store = [&] {
            picture_.join(result.state, result.planes);
            given_sums_[number] = asked;
            if (result.state.samples == picture_.samples_per_pixel())
                std::fill(worker_of_block_.begin() + static_cast<std::ptrdiff_t>(blocks.begin),
                          worker_of_block_.begin() + static_cast<std::ptrdiff_t>(blocks.end),
                          static_cast<std::uint16_t>(number));
            tally_.count(number, pixels * (result.state.samples - order.begin.samples), result.rays, watch.seconds(),
                         is_finished);
        };
        const bool counts = is_finished ? schedule.finish(number, store) : schedule.keep(number, store);
        if (counts && is_finished)
            schedule.set_speed(number, static_cast<double>(blocks.size()) / piece_watch.seconds());
        goes_on = goes_on && counts && !is_finished;
    }
    tally_.end_piece(number);
}

/// Asks all workers for the sums of their pieces. Returns the state once all that have a piece gave them, or it is
/// late.
std::optional<Checkpoint> RenderJob::gather_sums(bool is_late) {
    if (!gathering_) gathering_ = ++asked_for_sums_;
    for (std::size_t i = 0; i < workers_.size() && !is_late; ++i)
        if (tally_.has_piece(i) && given_sums_[i] < *gathering_) return std::nullopt;
    gathering_.reset();
    return picture_.copy();
}

RenderProgress RenderJob::progress() {
    RenderProgress progress = tally_.progress();
    progress.snapshot = [this] { return snapshot(); };
    return progress;
}

/// Copies the film, and asks the workers for what they have, so that the next snapshot shows more.
Film RenderJob::snapshot() {
    ++asked_for_sums_;
    return picture_.snapshot();
}

}  // namespace castor
