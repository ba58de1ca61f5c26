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
        device_of_.push_back(worker.device);
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
    std::lock_guard lock(mutex_);
    if (failures_.emplace(device_of_[worker], why).second)
        notices_.push_back(fmt::format("{}; the device is dropped", why.what()));
    DeviceShare& share = shares_[worker];
    share.failure = why.what();
    if (has_piece_[worker]) ++share.retries;
    has_piece_[worker] = false;
    under_way_[worker] = 0;
    last_failure_ = why;
}

std::optional<DeviceError> RenderTally::failure_of_device(std::size_t worker) const {
    std::lock_guard lock(mutex_);
    const auto found = failures_.find(device_of_[worker]);
    return found == failures_.end() ? std::nullopt : std::optional(found->second);
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

void RenderTally::tell_once(const std::string& notice) {
    std::lock_guard lock(mutex_);
    if (std::find(notices_.begin(), notices_.end(), notice) == notices_.end()) notices_.push_back(notice);
}

RenderProgress RenderTally::progress() {
    RenderProgress progress;
    progress.samples_done = progress.samples_resumed = samples_at_begin_;
    progress.seconds = watch_.seconds();
    std::lock_guard lock(mutex_);
    progress.samples_total = samples_total_;
    std::vector<DeviceShare> shares = shares_;
    for (std::size_t i = 0; i < shares.size(); ++i) {
        shares[i].samples += under_way_[i];
        progress.samples_done += shares[i].samples;
        progress.rays += shares[i].rays;
    }
    progress.devices = join_teams(shares);
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

std::vector<DeviceShare> RenderTally::shares_of_devices() const {
    std::lock_guard lock(mutex_);
    return join_teams(shares_);
}

std::vector<DeviceShare> RenderTally::join_teams(const std::vector<DeviceShare>& shares) const {
    std::vector<DeviceShare> devices;
    std::size_t teams = 0;  // of the last device
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const DeviceShare& share = shares[i];
        if (device_of_[i] == devices.size()) {
            devices.push_back(share);
            teams = 1;
            continue;
        }
        DeviceShare& device = devices.back();
        device.tiles += share.tiles;
        device.samples += share.samples;
        device.rays += share.rays;
        device.retries += share.retries;
        device.left_busy += share.left_busy;
        device.busy_seconds += (share.busy_seconds - device.busy_seconds) / static_cast<double>(++teams);
        device.setup_seconds = std::max(device.setup_seconds, share.setup_seconds);
        if (device.failure.empty()) device.failure = share.failure;
    }
    return devices;
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
