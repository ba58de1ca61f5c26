#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "remote/manager.h"
#include "remote/protocol.h"
#include "remote/transport.h"
#include "schedule/schedule.h"

namespace castor::test {

/// What a simulated cluster is like. Times are in seconds of a clock that runs as fast as it can.
struct ClusterModel {
    std::size_t workers = 16;
    std::uint64_t items = 10000;
    double mean_seconds = 100.0;    // that all workers take together, if none dies
    double speed_spread = 0.5;      // speeds are 1 ± this, evenly
    double noise = 0.1;             // a piece takes 1 ± this of what its worker's speed says
    double dying_share = 0.0;       // of the workers, at an even time within mean_seconds
    double stalling_share = 0.0;    // stand still once, for up to stall_seconds
    double straggling_share = 0.0;  // become five times slower, at an even time
    double stall_seconds = 10.0;
    double latency_seconds = 100e-6;
    double bytes_per_second = 1.25e9;  // of rank 0's network, both ways
    double bytes_per_item = 64 * 12;   // a block's pixels
    double message_seconds = 18e-6;    // of rank 0's processor for a message, sent or received
    double byte_seconds = 0.2e-9;      // and for each of its bytes
    double deadline_seconds = 10.0;
    double piece_seconds = 10.0;  // that a worker wants a piece to take at most
    std::uint32_t seed = 1;
};

struct ClusterOutcome {
    double seconds = 0.0;
    double ideal_seconds = 0.0;  // if all were busy as long as they lived
    double busy_share = 0.0;     // of rank 0's processor
    std::uint64_t messages = 0;
    std::uint64_t item_results = 0;  // items in all results: more than there are where work was done twice
    std::uint64_t dropped = 0;
    std::vector<std::uint8_t> times_done;  // of each item
    double efficiency() const { return ideal_seconds / seconds; }
};

/// Ranks with one worker each, of which only the behaviour is simulated: the Manager and the Schedule are the real
/// ones.
class SimulatedCluster : public Transport, RemoteJob {
public:
    explicit SimulatedCluster(const ClusterModel& model)
        : model_(model), random_(model.seed), ranks_(model.workers + 1), outcome_() {
        outcome_.times_done.resize(model.items);
        const double mean_speed =
            static_cast<double>(model.items) / (model.mean_seconds * static_cast<double>(model.workers));
        for (std::size_t rank = 1; rank < ranks_.size(); ++rank) {
            Rank& self = ranks_[rank];
            self.speed = mean_speed * (1.0 + model.speed_spread * (2.0 * uniform() - 1.0));
            if (uniform() < model.dying_share) self.death = model.mean_seconds * uniform();
            if (uniform() < model.stalling_share) {
                self.stall_begin = model.mean_seconds * uniform();
                self.stall_end = self.stall_begin + model.stall_seconds * uniform();
            }
            if (uniform() < model.straggling_share) self.slow_from = model.mean_seconds * uniform();
        }
    }

    ClusterOutcome run() {
        const auto clock = [this] {
            return Schedule::Clock::time_point(
                std::chrono::duration_cast<Schedule::Clock::duration>(std::chrono::duration<double>(now_)));
        };
        const auto schedule = std::make_shared<Schedule>(std::vector<Range>{{0, model_.items}}, model_.workers, clock);
        schedule_ = schedule.get();
        Manager manager(*this, "1", clock);
        for (std::size_t rank = 1; rank < ranks_.size(); ++rank)
            arrive(0.0, rank,
                   {.kind = MessageKind::hello, .payload = bytes_of(RankIntroduction{"1", "host", "", {"w"}, {""}})});
        deliver();
        manager.gather_now();
        manager.begin_job(*this);
        manager.begin_schedule(schedule, 0);
        for (std::size_t rank = 1; rank < ranks_.size(); ++rank) {
            arrive(1e-3 * uniform(), rank,
                   {.kind = MessageKind::join, .job = 1, .payload = bytes_of_text(description())});
            arrive(2e-3, rank, {.kind = MessageKind::ready, .job = 1, .payload = state_of(rank)});
        }
        const auto drop = [&](std::size_t worker) {
            schedule->drop(worker);
            manager.drop_worker(worker);
            ++outcome_.dropped;
        };
        double next_check = 1.0;
        while (schedule->items_left() > 0 && outcome_.dropped < model_.workers) {
            deliver();
            busy_now_ = 0.0;
            for (const WorkerFailure& failure : manager.serve()) drop(failure.worker);
            busy_ += busy_now_;
            now_ += std::max(1e-3, busy_now_);
            if (now_ < next_check) continue;
            next_check = now_ + 0.5;
            for (const std::size_t worker : schedule->silent_workers(model_.deadline_seconds)) drop(worker);
        }
        manager.serve();
        manager.end_job();
        outcome_.seconds = now_;
        outcome_.busy_share = busy_ / now_;
        outcome_.ideal_seconds = ideal_seconds();
        return outcome_;
    }

private:
    static constexpr double kNever = 1e30;

    struct Rank {
        double speed = 1.0;  // items a second
        double death = kNever, stall_begin = kNever, stall_end = kNever, slow_from = kNever;
        std::uint32_t piece = 0;  // that it is at; 0: none
        Range range;
        double begin = 0.0;
        double abandoned_at = kNever;
    };
    struct Event {
        double time;
        std::uint64_t number;  // of equal times the first one made comes first
        std::function<void()> action;
        bool operator<(const Event& other) const {
            return std::pair(time, number) > std::pair(other.time, other.number);
        }
    };

    double uniform() { return static_cast<double>(random_() >> 8) * 0x1p-24; }
    void at(double time, std::function<void()> action) { events_.push({time, event_count_++, std::move(action)}); }
    /// Lets everything happen that has happened by now.
    void deliver() {
        while (!events_.empty() && events_.top().time <= now_) {
            const auto action = events_.top().action;
            events_.pop();
            action();
        }
    }

    // Rank 0's end of the network.

    std::size_t rank() const override { return 0; }
    std::size_t rank_count() const override { return ranks_.size(); }
    void forget(std::size_t) override {}
    std::optional<ReceivedMessage> receive() override {
        if (arrived_.empty()) return std::nullopt;
        ReceivedMessage next = std::move(arrived_.front());
        arrived_.pop_front();
        const bool is_result = next.message.kind == MessageKind::result;
        pay(is_result ? model_.bytes_per_item * static_cast<double>(items_of(next.message)) : 0.0);
        return next;
    }
    void send(std::size_t to, Message message) override {
        pay(0.0);
        at(now_ + model_.latency_seconds, [this, to, message = std::move(message)] { take(to, message); });
    }
    void pay(double bytes) {
        ++outcome_.messages;
        busy_now_ += model_.message_seconds + bytes * model_.byte_seconds;
    }
    static std::uint64_t items_of(const Message& message) {
        ByteReader reader(message.payload);
        reader.take<WorkerState>();
        return reader.rest().empty() ? 0 : reader.take<Range>().size();
    }
    /// A message of a rank that leaves it at `time` reaches rank 0, whose network carries one after the other.
    void arrive(double time, std::size_t from, Message message) {
        const bool is_result = message.kind == MessageKind::result;
        const double bytes = is_result ? model_.bytes_per_item * static_cast<double>(items_of(message)) : 100.0;
        at(time, [this, from, bytes, message = std::move(message)] {
            if (now_ >= ranks_[from].death) return;
            network_free_ = std::max(network_free_, now_) + bytes / model_.bytes_per_second;
            at(network_free_ + model_.latency_seconds, [this, from, message] { arrived_.push_back({from, message}); });
        });
    }

    // The ranks.

    Bytes state_of(std::size_t rank) {
        const auto items = static_cast<std::uint64_t>(std::max(1.0, ranks_[rank].speed * model_.piece_seconds));
        return ByteWriter().add(WorkerState{0.0, ranks_[rank].speed, items, 2 * items}).take();
    }
    double speed_at(const Rank& rank, double time) const {
        return time >= rank.slow_from ? rank.speed / 5.0 : rank.speed;
    }
    void take(std::size_t number, const Message& message) {
        Rank& self = ranks_[number];
        if (now_ >= self.death) return;
        if (message.kind == MessageKind::piece) {
            self.piece = message.piece;
            self.range = ByteReader(message.payload).take<Range>();
            self.begin = now_;
            self.abandoned_at = kNever;
            double end = now_ + static_cast<double>(self.range.size()) / speed_at(self, now_) *
                                    (1.0 + model_.noise * (2.0 * uniform() - 1.0));
            if (now_ < self.stall_end && end > self.stall_begin)
                end += self.stall_end - std::max(now_, self.stall_begin);
            progress_later(number, message.piece);
            at(end, [this, number, piece = message.piece] { finish(number, piece, true); });
        } else if (message.kind == MessageKind::abandon && message.piece == self.piece) {
            finish(number, message.piece, false);
        }
    }
    void progress_later(std::size_t number, std::uint32_t piece) {
        const double next = now_ + sign_period(ranks_.size(), 0.25, model_.deadline_seconds);
        at(next, [this, number, piece] {
            Rank& self = ranks_[number];
            if (self.piece != piece || now_ >= self.death) return;
            if (now_ < self.stall_begin || now_ >= self.stall_end)
                arrive(now_, number,
                       {.kind = MessageKind::progress,
                        .job = 1,
                        .piece = piece,
                        .payload = ByteWriter().add(std::uint64_t{1}).take()});
            progress_later(number, piece);
        });
    }
    void finish(std::size_t number, std::uint32_t piece, bool is_done) {
        Rank& self = ranks_[number];
        if (self.piece != piece || now_ >= self.death) return;
        self.piece = 0;
        Bytes payload = state_of(number);
        if (is_done) {
            const Bytes range = ByteWriter().add(self.range).take();
            payload.insert(payload.end(), range.begin(), range.end());
        }
        arrive(now_, number, {.kind = MessageKind::result, .job = 1, .piece = piece, .payload = payload});
    }

    // The job, as the manager sees it.

    const std::string& description() const override { return description_; }
    void ready(std::size_t worker, const WorkerState& state) override {
        schedule_->set_speed(worker, state.items_per_second);
    }
    std::optional<Bytes> begin(std::size_t worker, const Range& piece) override {
        ranks_[worker + 1].range = piece;
        begun_.resize(std::max(begun_.size(), worker + 1));
        begun_[worker] = now_;
        return ByteWriter().add(piece).take();
    }
    Answer progress(std::size_t worker, std::uint64_t) override {
        return schedule_->is_wanted(worker) ? Answer::go_on : Answer::abandon;
    }
    std::optional<Bytes> take(std::size_t worker, std::span<const std::byte> result) override {
        const auto range = ByteReader(result).take<Range>();
        outcome_.item_results += range.size();
        schedule_->finish(worker, [&] {
            for (std::uint64_t item = range.begin; item < range.end; ++item) ++outcome_.times_done[item];
        });
        schedule_->set_speed(worker, static_cast<double>(range.size()) / (now_ - begun_[worker]));
        return std::nullopt;
    }
    void end(std::size_t) override {}

    /// The time at which the workers, as they lived and stood still, could have done all.
    double ideal_seconds() const {
        double time = 0.0, done = 0.0;
        for (const double step = model_.mean_seconds / 2000; done < static_cast<double>(model_.items); time += step)
            for (std::size_t rank = 1; rank < ranks_.size(); ++rank) {
                const Rank& self = ranks_[rank];
                const bool stands = time >= self.stall_begin && time < self.stall_end;
                if (time < self.death && !stands) done += step * speed_at(self, time);
            }
        return time;
    }

    const ClusterModel model_;
    std::mt19937 random_;
    std::vector<Rank> ranks_;
    std::priority_queue<Event> events_;
    std::uint64_t event_count_ = 0;
    std::deque<ReceivedMessage> arrived_;
    double now_ = 0.0, network_free_ = 0.0, busy_ = 0.0, busy_now_ = 0.0;
    Schedule* schedule_ = nullptr;
    std::vector<double> begun_;
    std::string description_ = "the picture";
    ClusterOutcome outcome_;
};

}  // namespace castor::test
