#include "schedule/schedule.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace castor {

namespace {

// The time that the last pieces take: shorter ones cost more than the unevenness that they avoid.
constexpr double kShortestPieceSeconds = 0.005;

// How often a worker without work checks whether another has become slow.
constexpr std::chrono::milliseconds kIdlePeriod(5);

double seconds_between(std::chrono::steady_clock::time_point begin, std::chrono::steady_clock::time_point end) {
    return std::chrono::duration<double>(end - begin).count();
}

}  // namespace

Schedule::Schedule(const std::vector<Range>& work, std::size_t worker_count, std::function<Clock::time_point()> now)
    : now_(std::move(now)), workers_(worker_count), alive_(worker_count) {
    for (Worker& worker : workers_) worker.last_sign = now_();
    for (const Range& range : work) {
        if (range.size() == 0) continue;
        queue_.push_back(range);
        queued_items_ += range.size();
    }
    items_left_ = queued_items_;
}

void Schedule::set_sign_hook(std::size_t worker, std::function<void()> hook) {
    std::lock_guard lock(mutex_);
    workers_[worker].sign_hook = std::move(hook);
}

std::optional<Range> Schedule::take(std::size_t worker, std::uint64_t most_items, std::uint64_t most_copied) {
    std::unique_lock lock(mutex_);
    Worker& self = workers_[worker];
    for (;;) {
        if (self.sign_hook) {
            lock.unlock();
            self.sign_hook();
            lock.lock();
        }
        if (const auto piece = piece_for(worker, most_items, most_copied)) return piece;
        if (stopped_ || self.dropped || items_left_ == 0) return std::nullopt;
        changed_.wait_for(lock, kIdlePeriod);
    }
}

std::optional<Range> Schedule::try_take(std::size_t worker, std::uint64_t most_items, std::uint64_t most_copied) {
    std::lock_guard lock(mutex_);
    return piece_for(worker, most_items, most_copied);
}

/// Returns what `take` does if there is a piece now.
std::optional<Range> Schedule::piece_for(std::size_t worker, std::uint64_t most_items, std::uint64_t most_copied) {
    Worker& self = workers_[worker];
    let_go(self);
    self.idle = true;
    if (stopped_ || self.dropped || items_left_ == 0) return std::nullopt;
    if (!queue_.empty()) {
        Range& next = queue_.front();
        const std::uint64_t size = std::max<std::uint64_t>(1, std::min({next.size(), most_items, fair_share(self)}));
        self.piece = std::make_shared<Piece>();
        self.piece->range = {next.begin, next.begin + size};
        self.piece->begin = now_();
        self.piece->items_per_second = self.items_per_second;
        hand_out(self.piece);
        next.begin += size;
        queued_items_ -= size;
        if (next.size() == 0) queue_.pop_front();
    } else if (auto piece = piece_worth_copying(worker, most_copied)) {
        self.piece = std::move(piece);
        ++self.piece->workers;
    } else {
        return std::nullopt;
    }
    self.idle = false;
    self.last_sign = now_();
    return self.piece->range;
}

void Schedule::hand_out(const std::shared_ptr<Piece>& piece) {
    piece->place = handed_out_.size();
    handed_out_.push_back(piece);
}

void Schedule::take_back(Piece& piece) {
    const std::size_t place = piece.place;
    handed_out_.back()->place = place;
    std::swap(handed_out_[place], handed_out_.back());
    handed_out_.pop_back();
}

/// Returns half of what the worker would do of the rest if all went on as fast as now; the other half evens out errors
/// of that estimate.
std::uint64_t Schedule::fair_share(const Worker& worker) const {
    if (alive_ <= 1) return queued_items_;
    if (worker.items_per_second <= 0.0) return queued_items_ / (2 * alive_);
    const double all = std::max(speed_of_alive_, worker.items_per_second);
    const double share = 0.5 * static_cast<double>(queued_items_) * worker.items_per_second / all;
    return static_cast<std::uint64_t>(std::max(share, worker.items_per_second * kShortestPieceSeconds));
}

/// Returns the piece that would be finished last, if this worker alone would finish it sooner.
std::shared_ptr<Schedule::Piece> Schedule::piece_worth_copying(std::size_t worker, std::uint64_t most_items) const {
    const double own_speed = workers_[worker].items_per_second;
    if (own_speed <= 0.0) return nullptr;
    const Clock::time_point now = now_();
    std::shared_ptr<Piece> latest;
    double latest_seconds = 0.0;
    for (const std::shared_ptr<Piece>& piece : handed_out_) {
        if (piece->workers > 1 || piece->range.size() > most_items) continue;
        const auto size = static_cast<double>(piece->range.size());
        const double expected = piece->items_per_second > 0.0 ? size / piece->items_per_second : 0.0;
        const double elapsed = seconds_between(piece->begin, now);
        const bool is_overdue = elapsed > 2 * expected;  // nobody knows when it will be done
        const double left = is_overdue ? std::numeric_limits<double>::infinity() : expected - elapsed;
        if (size / own_speed >= left || left <= latest_seconds) continue;
        latest = piece;
        latest_seconds = left;
    }
    return latest;
}

bool Schedule::is_wanted(std::size_t worker) {
    Worker& self = workers_[worker];
    if (self.sign_hook) self.sign_hook();
    std::lock_guard lock(mutex_);
    self.last_sign = now_();
    return !stopped_ && !self.dropped && self.piece && !self.piece->done;
}

bool Schedule::may_have_work(std::size_t worker) const {
    std::lock_guard lock(mutex_);
    return !stopped_ && !workers_[worker].dropped && items_left_ > 0;
}

void Schedule::set_speed(std::size_t worker, double items_per_second) {
    std::lock_guard lock(mutex_);
    Worker& self = workers_[worker];
    if (self.left || self.dropped) return;
    speed_of_alive_ += items_per_second - self.items_per_second;
    self.items_per_second = items_per_second;
    if (self.piece && self.piece->workers == 1) self.piece->items_per_second = items_per_second;
}

bool Schedule::finish(std::size_t worker, const std::function<void()>& store) {
    return this->store(worker, store, true);
}
bool Schedule::keep(std::size_t worker, const std::function<void()>& store) {
    return this->store(worker, store, false);
}

bool Schedule::store(std::size_t worker, const std::function<void()>& store, bool ends_piece) {
    std::shared_ptr<Piece> piece;
    {
        std::lock_guard lock(mutex_);
        piece = workers_[worker].piece;
    }
    if (!piece) return false;
    std::lock_guard piece_lock(piece->mutex);
    {
        std::lock_guard lock(mutex_);
        if (workers_[worker].dropped || piece->done) return false;
    }
    store();
    std::lock_guard lock(mutex_);
    workers_[worker].last_sign = now_();
    if (ends_piece) {
        piece->done = true;
        take_back(*piece);
        items_left_ -= piece->range.size();
        if (items_left_ == 0) changed_.notify_all();
    }
    return true;
}

/// Takes the piece from the worker, and returns it to the queue if no other worker has it and it is not done.
void Schedule::let_go(Worker& worker) {
    if (!worker.piece) return;
    if (--worker.piece->workers == 0 && !worker.piece->done) {
        take_back(*worker.piece);
        queue_.push_front(worker.piece->range);
        queued_items_ += worker.piece->range.size();
        changed_.notify_all();
    }
    worker.piece.reset();
}

/// The worker takes no more pieces.
void Schedule::part_with(Worker& worker) {
    let_go(worker);
    if (!worker.left && !worker.dropped) {
        --alive_;
        speed_of_alive_ -= worker.items_per_second;
    }
    changed_.notify_all();
}

void Schedule::leave(std::size_t worker) {
    std::lock_guard lock(mutex_);
    part_with(workers_[worker]);
    workers_[worker].left = true;
}

bool Schedule::drop(std::size_t worker) {
    std::shared_ptr<Piece> piece;
    {
        std::lock_guard lock(mutex_);
        piece = workers_[worker].piece;
    }
    std::unique_lock<std::mutex> piece_lock;
    if (piece) {
        piece_lock = std::unique_lock(piece->mutex, std::try_to_lock);
        if (!piece_lock) return false;
    }
    std::lock_guard lock(mutex_);
    if (workers_[worker].piece != piece) return false;  // it has gone on
    part_with(workers_[worker]);
    workers_[worker].dropped = true;
    return true;
}

void Schedule::stop() {
    std::lock_guard lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
}

bool Schedule::is_stopped() const {
    std::lock_guard lock(mutex_);
    return stopped_;
}

void Schedule::excuse(double seconds) {
    std::lock_guard lock(mutex_);
    for (Worker& worker : workers_)
        worker.last_sign += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

bool Schedule::wait_for_all(double seconds) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] {
        return std::all_of(workers_.begin(), workers_.end(),
                           [](const Worker& worker) { return worker.left || worker.dropped; });
    });
}

std::vector<std::size_t> Schedule::silent_workers(double seconds) {
    std::lock_guard lock(mutex_);
    const Clock::time_point now = now_();
    std::vector<std::size_t> silent;
    for (std::size_t i = 0; i < workers_.size(); ++i) {
        const Worker& worker = workers_[i];
        if (!worker.left && !worker.dropped && !worker.idle && !worker.sign_hook &&
            seconds_between(worker.last_sign, now) > seconds)
            silent.push_back(i);
    }
    return silent;
}

bool Schedule::is_dropped(std::size_t worker) const {
    std::lock_guard lock(mutex_);
    return workers_[worker].dropped;
}

std::uint64_t Schedule::items_left() const {
    std::lock_guard lock(mutex_);
    return items_left_;
}

}  // namespace castor
