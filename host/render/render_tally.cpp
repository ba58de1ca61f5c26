#include "render/render_tally.h"

#include <fmt/format.h>

#include <algorithm>

namespace castor {

RenderTally::RenderTally(const std::vector<PieceWorkerOffer>& workers, std::uint64_t samples_total,
                         std::uint64_t samples_at_begin)
    : samples_at_begin_(samples_at_begin),
      samples_total_(samples_total),
      under_way_(workers.size()),
      has_piece_(workers.size()) {
    for (const PieceWorkerOffer& worker : workers) {
        DeviceShare& share = shares_.emplace_back();
        share.device = worker.name;
        share.setup_seconds = worker.setup_seconds;
    }
}

void RenderTally::add_setup(std::size_t worker, double seconds) {
    std::lock_guard lock(mutex_);
    shares_[worker].setup_seconds += seconds;
}

void RenderTally::begin_piece(std::size_t worker) {
    std::lock_guard lock(mutex_);
    has_piece_[worker] = true;
}

void RenderTally::set_under_way(std::size_t worker, std::uint64_t samples) {
    std::lock_guard lock(mutex_);
    under_way_[worker] = samples;
}

void RenderTally::set_samples_total(std::uint64_t samples) {
    std::lock_guard lock(mutex_);
    samples_total_ = samples;
}

bool RenderTally::has_piece(std::size_t worker) const {
    std::lock_guard lock(mutex_);
    return has_piece_[worker];
}

void RenderTally::count(std::size_t worker, std::uint64_t samples, std::uint64_t rays, double seconds,
                        bool ends_piece) {
    std::lock_guard lock(mutex_);
    DeviceShare& share = shares_[worker];
    share.tiles += ends_piece;
    share.samples += samples;
    share.rays += rays;
    share.busy_seconds += seconds;
    under_way_[worker] = 0;
}

void RenderTally::end_piece(std::size_t worker) {
    std::lock_guard lock(mutex_);
    has_piece_[worker] = false;
    under_way_[worker] = 0;
}

void RenderTally::drop(std::size_t worker, const DeviceError& why) {
    tell(fmt::format("{}; the device is dropped", why.what()));
    std::lock_guard lock(mutex_);
    DeviceShare& share = shares_[worker];
    share.failure = why.what();
    if (has_piece_[worker]) ++share.retries;
    has_piece_[worker] = false;
    under_way_[worker] = 0;
    last_failure_ = why;
}

void RenderTally::leave(std::size_t worker, bool is_stopped) {
    end_piece(worker);
    std::lock_guard lock(mutex_);
    ++shares_[worker].left_busy;
    if (!is_stopped)
        notices_.push_back(
            fmt::format("{} was still busy when the picture was done, and was not waited for", shares_[worker].device));
}

void RenderTally::set_failure(std::size_t worker, const std::string& failure) {
    std::lock_guard lock(mutex_);
    shares_[worker].failure = failure;
}

void RenderTally::tell(const std::string& notice) {
    std::lock_guard lock(mutex_);
    notices_.push_back(notice);
}

RenderProgress RenderTally::progress() {
    RenderProgress progress;
    progress.samples_done = progress.samples_resumed = samples_at_begin_;
    progress.seconds = watch_.seconds();
    std::lock_guard lock(mutex_);
    progress.samples_total = samples_total_;
    progress.devices = shares_;
    for (std::size_t i = 0; i < shares_.size(); ++i) {
        progress.devices[i].samples += under_way_[i];
        progress.samples_done += progress.devices[i].samples;
        progress.rays += shares_[i].rays;
    }
    // Two workers may have the same piece.
    progress.samples_done = std::min(progress.samples_done, samples_total_);
    progress.notices.assign(notices_.begin() + static_cast<std::ptrdiff_t>(told_notices_), notices_.end());
    told_notices_ = notices_.size();
    return progress;
}

std::vector<DeviceShare> RenderTally::shares() const {
    std::lock_guard lock(mutex_);
    return shares_;
}

std::vector<std::string> RenderTally::notices() const {
    std::lock_guard lock(mutex_);
    return notices_;
}

std::optional<DeviceError> RenderTally::last_failure() const {
    std::lock_guard lock(mutex_);
    return last_failure_;
}

}  // namespace castor
