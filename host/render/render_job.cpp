#include "render/render_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <span>
#include <utility>

#include "base/stopwatch.h"
#include "render/remote_piece.h"
#include "render/wave.h"
#include "trace/chunk_exchange.h"

namespace castor {

namespace {

/// Workers of this process, and after them those of others.
std::vector<PieceWorkerOffer> with_remote(std::vector<PieceWorkerOffer> workers, const Manager* manager) {
    std::size_t device = workers.empty() ? 0 : workers.back().device + 1;
    if (manager)
        for (const RemoteWorker& worker : manager->workers())
            workers.push_back({.name = worker.name, .make = {}, .host = worker.host, .device = device++});
    return workers;
}

// A pass of the progressive order takes a quarter of the samples that there are, since later ones change less.
constexpr std::uint32_t kPassDivisor = 4, kMostSamplesInPass = 16;

}  // namespace

/// A piece that a worker has, from the first order for it to the result that finishes it, or until it is not wanted.
class RenderJob::PieceInWork {
public:
    PieceInWork(RenderJob& job, std::shared_ptr<Schedule> schedule, std::size_t worker,
                std::shared_ptr<const Pass> pass, const Range& places)
        : job_(job),
          schedule_(std::move(schedule)),
          worker_(worker),
          pass_(std::move(pass)),
          blocks_(std::span(pass_->work.blocks).subspan(places.begin, places.size())) {
        job_.tally_.begin_piece(worker_);
    }
    PieceInWork(const PieceInWork&) = delete;
    PieceInWork& operator=(const PieceInWork&) = delete;

    /// The worker has the piece no more, and not because it failed.
    void end() { job_.tally_.end_piece(worker_); }

    /// Returns the order to go on with; nullopt: there is nothing more to do.
    std::optional<PieceOrder> next_order() {
        if (!goes_on_) return std::nullopt;
        watch_ = {};
        auto order = job_.picture_.order(blocks_, pass_->samples);
        if (!order) return std::nullopt;  // done meanwhile
        order_ = *order;
        asked_ = job_.asked_for_sums_;
        return order;
    }
    const PieceOrder& order() const { return order_; }

    /// Told how many samples are taken.
    Answer progress(std::uint64_t samples) {
        if (const auto failure = job_.tally_.failure_of_device(worker_)) throw *failure;
        if (samples > order_.begin.samples)
            job_.tally_.set_under_way(worker_, job_.picture_.pixels_of(blocks_) * (samples - order_.begin.samples));
        asked_ = job_.asked_for_sums_;
        goes_on_ = schedule_->is_wanted(worker_);
        if (!goes_on_ && !schedule_->is_stopped()) return Answer::abandon;
        return goes_on_ && job_.given_sums_[worker_] == asked_ ? Answer::go_on : Answer::give_back;
    }

    void take(const PieceResult& result) {
        const PieceState& state = result.state;
        if (result.met_most_passed)
            job_.tally_.tell_once(
                fmt::format("more than {} surfaces that rays pass lie one behind the other: the next one is "
                            "taken as opaque",
                            kMostPassed));
        if (result.met_most_scattered)
            job_.tally_.tell_once(fmt::format(
                "paths were scattered more than {} times within a solid, and ended: it is darker than it should be",
                kMostScattered));
        const bool is_finished = state.samples == pass_->samples;
        const auto store = [&] {
            job_.picture_.join(state, result.planes);
            job_.given_sums_[worker_] = asked_;
            for (const std::uint32_t block : blocks_)
                job_.worker_of_block_[block] = static_cast<std::uint16_t>(worker_);
            job_.tally_.set_samples_total(job_.picture_.samples_to_do());
            job_.tally_.count(worker_, job_.picture_.pixels_of(blocks_) * (state.samples - order_.begin.samples),
                              result.rays, watch_.seconds(), is_finished);
        };
        const bool counts = is_finished ? schedule_->finish(worker_, store) : schedule_->keep(worker_, store);
        if (counts && is_finished)
            schedule_->set_speed(worker_, static_cast<double>(blocks_.size()) / piece_watch_.seconds());
        goes_on_ = goes_on_ && counts && !is_finished;
    }

private:
    RenderJob& job_;
    const std::shared_ptr<Schedule> schedule_;
    const std::size_t worker_;
    const std::shared_ptr<const Pass> pass_;
    const std::span<const std::uint32_t> blocks_;  // of the pass
    const Stopwatch piece_watch_;
    Stopwatch watch_;  // since the last order
    PieceOrder order_;
    std::uint32_t asked_ = 0;  // value of asked_for_sums_ that the next result answers
    bool goes_on_ = true;
};

RenderJob::RenderJob(Checkpoint begin, std::vector<PieceWorkerOffer> workers, const RenderOptions& options,
                     Manager* manager, const std::vector<bool>& is_left_out)
    : picture_(std::move(begin), options.part.value_or(PicturePart()), options.noise),
      manager_(manager),
      local_workers_(workers.size()),
      workers_(with_remote(std::move(workers), manager)),
      order_(options.stop_after_seconds ? RenderOrder::progressive : options.order),
      stop_after_seconds_(options.stop_after_seconds),
      // Open Image Denoise, which comes afterwards, might end the process.
      keeps_all_(options.part || (options.denoise && options.denoiser == Denoiser::oidn)),
      tally_(workers_, picture_.samples_to_do(), picture_.samples_done_of_part()),
      worker_of_block_(picture_.blocks().count(), kNoWorker),
      given_sums_(workers_.size()),
      keeper_(options.checkpoint_file, options.checkpoint_seconds,
              [this](const std::string& problem) { tally_.tell(problem); }),
      is_dropped_(is_left_out.empty() ? std::vector<bool>(workers_.size()) : is_left_out),
      remote_pieces_(workers_.size()) {}

RenderJob::~RenderJob() = default;

void RenderJob::run(const Deadlines& deadlines, const ProgressCallback& on_progress, ChunkExchange* exchange) {
    std::exception_ptr unexpected;
    try {
        run_passes(deadlines, on_progress, exchange);
    } catch (...) {
        unexpected = std::current_exception();
    }
    keeper_.finish();
    if (keeps_all_ || !picture_.film().complete()) keeper_.write(picture_.state());
    if (unexpected) std::rethrow_exception(unexpected);
    picture_.show_partial_blocks();
    if (on_progress) on_progress(progress());
}

void RenderJob::run_passes(const Deadlines& deadlines, const ProgressCallback& on_progress, ChunkExchange* exchange) {
    CrewOptions options{.deadlines = deadlines};
    if (exchange) exchange->let_serve(options);
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
        if (number < local_workers_) return;
        manager_->drop_worker(number - local_workers_);
        remote_pieces_[number].reset();
    };
    options.on_leave = [&](std::size_t number) { tally_.leave(number, is_stopped_); };
    std::optional<RemoteTurn> turn;
    if (manager_) {
        options.serve = [&] { return manager_->serve(); };
        turn.emplace(*manager_, static_cast<RemoteJob&>(*this));
        for (std::size_t i = 0; i < manager_->workers().size(); ++i)
            if (manager_->is_dropped(i)) is_dropped_[local_workers_ + i] = true;
    }
    while (const auto pass = next_pass()) {
        schedule_ = std::make_shared<Schedule>(pass->work.ranges, workers_.size());
        pass_ = pass;
        std::vector<WorkerFunction> functions;
        for (std::size_t i = 0; i < workers_.size(); ++i) {
            if (is_dropped(i))
                functions.push_back([](Schedule&, std::size_t) {});
            else if (i >= local_workers_)
                functions.push_back(nullptr);
            else
                functions.push_back(
                    [job = shared_from_this(), schedule = schedule_, pass](Schedule&, std::size_t number) {
                        job->render_pieces(job->workers_[number], schedule, number, pass);
                    });
        }
        if (manager_) manager_->begin_schedule(schedule_, local_workers_);
        run_crew(schedule_, functions, options);
        if (is_stopped_ || schedule_->items_left() > 0) return;
        if (stop_after_seconds_ && watch_.seconds() >= *stop_after_seconds_ &&
            pass->samples < picture_.samples_per_pixel())
            return picture_.finish_with(pass->samples);
        if (pass->samples < picture_.samples_per_pixel() && !options.tick()) return;
    }
}

std::shared_ptr<const RenderJob::Pass> RenderJob::next_pass() const {
    const std::uint32_t fewest = picture_.fewest_samples();
    std::uint32_t samples = picture_.next_check(fewest);
    if (order_ == RenderOrder::progressive)
        samples = std::min(samples, fewest + std::clamp(fewest / kPassDivisor, 1u, kMostSamplesInPass));
    BlocksLeft work = picture_.work_left(samples);
    if (work.blocks.empty()) return nullptr;
    return std::make_shared<Pass>(Pass{samples, samples - fewest, std::move(work)});
}

void RenderJob::render_pieces(const PieceWorkerOffer& offer, const std::shared_ptr<Schedule>& schedule,
                              std::size_t number, const std::shared_ptr<const Pass>& pass) {
    const auto is_needed = [&] { return schedule->may_have_work(number); };
    const std::unique_ptr<PieceWorker> worker = offer.make(is_needed);
    if (!worker) return;
    tally_.add_setup(number, worker->setup_seconds());
    const std::uint32_t samples_left = picture_.samples_per_pixel() - pass->samples + pass->samples_each;
    if (is_worth_measuring(*worker, schedule->items_left() * samples_left / workers_.size()))
        worker->measure({0, picture_.blocks().count()}, [&] {
            schedule->is_wanted(number);  // a sign of life
            return is_needed();
        });
    schedule->set_speed(number, worker->block_samples_per_second() / pass->samples_each);
    while (const auto places = schedule->take(number, worker->blocks_wanted(), worker->most_blocks())) {
        if (const auto failure = tally_.failure_of_device(number)) throw *failure;
        PieceInWork piece(*this, schedule, number, pass, *places);
        while (const auto order = piece.next_order())
            piece.take(worker->render(*order,
                                      [&](std::uint32_t samples) { return piece.progress(samples) == Answer::go_on; }));
        piece.end();
    }
}

void RenderJob::ready(std::size_t worker, const WorkerState& state) {
    tally_.add_setup(worker, state.setup_seconds);
    schedule_->set_speed(worker, state.items_per_second / pass_->samples_each);
}

std::optional<Bytes> RenderJob::begin(std::size_t worker, const Range& places) {
    auto& piece = remote_pieces_[worker];
    piece.reset();
    piece = std::make_unique<PieceInWork>(*this, schedule_, worker, pass_, places);
    return bytes_of_next(*piece);
}

std::optional<Bytes> RenderJob::bytes_of_next(PieceInWork& piece) {
    const auto order = piece.next_order();
    return order ? std::optional(bytes_of(*order)) : std::nullopt;
}

RemoteJob::Answer RenderJob::progress(std::size_t worker, std::uint64_t samples) {
    const auto& piece = remote_pieces_[worker];
    return piece ? piece->progress(samples) : Answer::abandon;
}

std::optional<Bytes> RenderJob::take(std::size_t worker, std::span<const std::byte> result) {
    auto& piece = remote_pieces_[worker];
    if (!piece) return std::nullopt;
    piece->take(result_of(result, piece->order(), picture_.samples_per_pixel()));
    return bytes_of_next(*piece);
}

void RenderJob::end(std::size_t worker) {
    if (remote_pieces_[worker]) remote_pieces_[worker]->end();
    remote_pieces_[worker].reset();
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
