#include "trace/chunk_exchange.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "castor/error.h"

namespace castor {

namespace {

// Boxes grow by this share of the largest coordinates of scene and ray. Hits lie outside of their boxes by rounding
// errors alone, which are a hundredth of it (kernels/README.md, "Exactness").
constexpr double kSlack = 1e-4;

constexpr std::chrono::milliseconds kPollPeriod(1);

/// The part of a ray's line within a box that is larger by `slack`: from `entry` to `exit`.
struct Segment {
    double entry = -std::numeric_limits<double>::infinity(), exit = std::numeric_limits<double>::infinity();
    bool is_missed = false;
};

Segment segment_within(const Box& box, const Ray& ray, double slack) {
    Segment segment;
    for (int axis = 0; axis < 3; ++axis) {
        const double lower = double{box.lower[axis]} - slack, upper = double{box.upper[axis]} + slack;
        const double origin = ray.origin[axis], direction = ray.direction[axis];
        if (direction == 0.0) {
            segment.is_missed |= origin < lower || origin > upper;
            continue;
        }
        const double a = (lower - origin) / direction, b = (upper - origin) / direction;
        segment.entry = std::max(segment.entry, std::min(a, b));
        segment.exit = std::min(segment.exit, std::max(a, b));
    }
    segment.is_missed |= segment.entry > segment.exit;
    return segment;
}

double largest_coordinate(const Ray& ray) {
    return std::max({std::abs(ray.origin[0]), std::abs(ray.origin[1]), std::abs(ray.origin[2])});
}

}  // namespace

ChunkExchange::ChunkExchange(Manager& manager, std::string description, const SceneContents& contents,
                             double deadline_seconds)
    : manager_(manager), description_(std::move(description)), deadline_seconds_(deadline_seconds) {
    double largest = 0.0;
    for (const Chunk& chunk : contents.chunks)
        for (int axis = 0; axis < 3 && chunk.bounds.lower[axis] <= chunk.bounds.upper[axis]; ++axis)
            largest = std::max<double>(
                largest, std::max(std::abs(chunk.bounds.lower[axis]), std::abs(chunk.bounds.upper[axis])));
    for (const Range& chunks : divide_chunks(contents, manager.rank_count())) {
        Share share{.chunks = chunks, .boxes = {}, .slack = kSlack * largest};
        for (std::uint64_t i = chunks.begin; i < chunks.end; ++i) {
            const Chunk& chunk = contents.chunks[i];
            share.boxes.push_back(chunk.bounds);
            share.is_endless |= chunk.arrays.plane_count() > 0 || !(chunk.has_wide || chunk.has_compressed);
        }
        shares_.push_back(std::move(share));
    }
    for (std::size_t i = 0; i < manager.workers().size(); ++i) {
        Worker& worker = workers_.emplace_back();
        worker.is_dropped = manager.is_dropped(i);
        worker.share.device = manager.workers()[i].name;
    }
}

bool ChunkExchange::may_meet(std::size_t number, const Ray& ray, double t_max) const {
    const Share& share = shares_[number];
    if (ray.direction[0] == 0.0f && ray.direction[1] == 0.0f && ray.direction[2] == 0.0f) return false;  // no ray
    if (share.is_endless) return true;
    const double slack = share.slack + kSlack * largest_coordinate(ray);
    const double limit = t_max + kSlack * std::abs(t_max);
    return std::any_of(share.boxes.begin(), share.boxes.end(), [&](const Box& box) {
        const Segment segment = segment_within(box, ray, slack);
        return !(segment.is_missed || segment.entry > limit || segment.exit < ray.t_min);
    });
}

bool ChunkExchange::may_have(std::size_t number, const Ray& ray, double t) const {
    const Share& share = shares_[number];
    if (share.is_endless) return true;
    const double slack = share.slack + kSlack * largest_coordinate(ray);
    return std::any_of(share.boxes.begin(), share.boxes.end(), [&](const Box& box) {
        const Segment segment = segment_within(box, ray, slack);
        return !(segment.is_missed || segment.entry > t || segment.exit < t);
    });
}

/// Whether a worker of the rank that keeps the share is left. The caller holds the mutex.
bool ChunkExchange::is_kept(std::size_t share) const {
    for (std::size_t i = 0; i < workers_.size(); ++i)
        if (!workers_[i].is_dropped && manager_.workers()[i].rank == share) return true;
    return false;
}

std::optional<Bytes> ChunkExchange::begin(std::size_t number, const Range&) {
    std::lock_guard lock(mutex_);
    const std::size_t rank = manager_.workers()[number].rank;
    const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& pending) {
        return pending->share == rank || !is_kept(pending->share);
    });
    if (found == waiting_.end()) return std::nullopt;
    Worker& worker = workers_[number];
    worker.pending = *found;
    worker.since = Manager::Clock::now();
    waiting_.erase(found);
    return worker.pending->order;
}

std::optional<Bytes> ChunkExchange::take(std::size_t number, std::span<const std::byte> result) {
    std::lock_guard lock(mutex_);
    const auto pending = std::exchange(workers_[number].pending, nullptr);
    if (!pending || result.size() != pending->answer_bytes) {
        if (pending) waiting_.push_front(pending);
        throw DeviceError("", "", 0, "sent answers to another number of rays than asked");
    }
    DeviceShare& share = workers_[number].share;
    ++share.tiles;
    share.rays += pending->rays;
    share.busy_seconds += std::chrono::duration<double>(Manager::Clock::now() - workers_[number].since).count();
    pending->answer.assign(result.begin(), result.end());
    pending->is_answered = true;
    changed_.notify_all();
    return std::nullopt;
}

void ChunkExchange::lose(std::size_t number, const DeviceError& why) {
    manager_.drop_worker(number);
    std::lock_guard lock(mutex_);
    Worker& worker = workers_[number];
    if (worker.is_dropped) return;
    worker.is_dropped = true;
    worker.share.failure = why.what();
    if (!worker.pending) return;
    ++worker.share.retries;
    waiting_.push_front(std::exchange(worker.pending, nullptr));
}

std::vector<DeviceShare> ChunkExchange::shares() {
    std::lock_guard lock(mutex_);
    std::vector<DeviceShare> shares;
    for (const Worker& worker : workers_) shares.push_back(worker.share);
    return shares;
}

void ChunkExchange::let_serve(CrewOptions& options) {
    options.serve = [this]() -> std::vector<WorkerFailure> {
        serve();
        return {};
    };
    options.is_serve_awaited = [this] {
        std::lock_guard lock(mutex_);
        return askers_ > 0;
    };
}

/// To be called about every millisecond.
void ChunkExchange::serve() {
    for (const WorkerFailure& failure : manager_.serve()) lose(failure.worker, failure.why);
    const auto now = Manager::Clock::now();
    for (std::size_t i = 0; i < workers_.size(); ++i) {
        const bool is_late = [&] {
            std::lock_guard lock(mutex_);
            return workers_[i].pending && now - workers_[i].since > std::chrono::duration<double>(deadline_seconds_);
        }();
        if (is_late)
            lose(i, DeviceError(manager_.workers()[i].name, "", 0,
                                fmt::format("has not answered for {:g} s", deadline_seconds_)));
    }
    std::lock_guard lock(mutex_);
    if (std::all_of(workers_.begin(), workers_.end(), [](const Worker& worker) { return worker.is_dropped; })) {
        for (const auto& pending : std::exchange(waiting_, {})) pending->is_given_up = true;
        changed_.notify_all();
    }
}

void ChunkExchange::end() {
    std::lock_guard lock(mutex_);
    is_ended_ = true;
    changed_.notify_all();
}

std::vector<Bytes> ChunkExchange::ask(std::vector<Question> questions, const Answer& self) {
    std::vector<std::shared_ptr<Pending>> pendings;
    for (Question& question : questions) {
        const Range& chunks = shares_[question.share].chunks;
        for (std::uint64_t i = chunks.begin; i < chunks.end; ++i)
            question.order.chunks.push_back(static_cast<std::uint32_t>(i));
        pendings.push_back(std::make_shared<Pending>());
        pendings.back()->share = question.share;
        pendings.back()->order = bytes_of(question.order);
        pendings.back()->rays = question.order.rays.size();
        pendings.back()->answer_bytes = question.order.rays.size() * answer_bytes(question.order.question);
    }
    std::unique_lock lock(mutex_);
    waiting_.insert(waiting_.end(), pendings.begin(), pendings.end());
    ++askers_;
    for (const auto& pending : pendings)
        while (!pending->is_answered && !pending->is_given_up) {
            if (is_ended_) {
                --askers_;
                throw DeviceError("", "", 0, "the work on the picture or batch has ended");
            }
            if (std::this_thread::get_id() == serving_thread_) {
                lock.unlock();
                serve();
                std::this_thread::sleep_for(kPollPeriod);
                lock.lock();
            } else {
                changed_.wait(lock);
            }
        }
    --askers_;
    lock.unlock();
    std::vector<Bytes> answers;
    for (std::size_t i = 0; i < pendings.size(); ++i)
        answers.push_back(pendings[i]->is_answered ? std::move(pendings[i]->answer) : self(questions[i].order));
    return answers;
}

}  // namespace castor
