#include "remote/manager.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "base/description.h"
#include "base/name_list.h"

namespace castor {

namespace {

// How often ranks hear that the manager is alive.
constexpr double kPingSeconds = 1.0, kLongestPingSeconds = 10.0;

// So many workers in a row that find no piece tell that there is none for others either, until later.
constexpr std::size_t kMostMisses = 8;

constexpr std::chrono::milliseconds kPollPeriod(1);

}  // namespace

Manager::Manager(Transport& transport, std::string version, std::function<Clock::time_point()> now)
    : transport_(transport), version_(std::move(version)), now_(std::move(now)), ranks_(transport.rank_count()) {
    ranks_[0].is_known = ranks_[0].said_bye = true;
}

std::string Manager::name_of(std::size_t rank) const {
    const std::string& host = ranks_[rank].host;
    return host.empty() ? fmt::format("rank {}", rank) : fmt::format("{} (rank {})", host, rank);
}

bool Manager::gather_now() {
    take_messages();
    return std::all_of(ranks_.begin(), ranks_.end(), [](const Rank& rank) { return rank.is_known || rank.is_dropped; });
}

void Manager::gather(double seconds, const std::function<bool()>& go_on) {
    const auto end = now_() + std::chrono::duration<double>(seconds);
    while (!gather_now() && now_() < end && go_on()) {
        ping();
        std::this_thread::sleep_for(kPollPeriod);
    }
    for (std::size_t rank = 0; rank < ranks_.size(); ++rank)
        if (!ranks_[rank].is_known && !ranks_[rank].is_dropped)
            drop(rank, fmt::format("has not introduced itself within {:g} s", seconds));
    number_by_rank();
    tell_warnings();
}

/// Tells each warning once, with the hosts that have it.
void Manager::tell_warnings() {
    constexpr std::size_t kMostNames = 4;
    for (const auto& [warning, hosts] : std::exchange(hosts_of_warnings_, {}))
        notices_.push_back(fmt::format("{}: {}", list_some(hosts, kMostNames), warning));
}

/// Gives the workers numbers in the order of their ranks, and not of their introductions.
void Manager::number_by_rank() {
    std::vector<RemoteWorker> workers;
    std::vector<WorkerPlace> places;
    for (Rank& rank : ranks_)
        for (std::size_t& worker : rank.workers) {
            workers.push_back(workers_[worker]);
            places.push_back(places_[worker]);
            worker = workers.size() - 1;
        }
    workers_ = std::move(workers);
    places_ = std::move(places);
}

void Manager::take_messages() {
    while (const auto received = transport_.receive()) take(*received);
}

void Manager::take(const ReceivedMessage& received) {
    if (ranks_[received.rank].is_dropped) return;
    try {
        sort_out(received);
    } catch (const DeviceError& error) {
        drop(received.rank, error.what());
    }
}

void Manager::sort_out(const ReceivedMessage& received) {
    const auto& [rank, message] = received;
    switch (message.kind) {
        case MessageKind::hello:
            introduce(rank, introduction_of(message.payload));
            break;
        case MessageKind::bye:
            ranks_[rank].said_bye = true;
            break;
        case MessageKind::lost:
            drop(rank, text_of(message.payload));
            break;
        default:
            if (ranks_[rank].is_excluded) break;
            if (message.job > job_number_)
                early_.push_back(received);
            else if (message.job == job_number_ && job_)
                take_of_job(rank, message);
    }
}

void Manager::take_of_job(std::size_t rank, const Message& message) {
    if (message.kind == MessageKind::join) return join(rank, text_of(message.payload));
    if (message.worker >= ranks_[rank].workers.size())
        throw DeviceError("", "", 0, fmt::format("spoke of its worker {}, which it has not", message.worker));
    const std::size_t worker = ranks_[rank].workers[message.worker];
    WorkerPlace& place = places_[worker];
    if (place.phase == Phase::dropped) return;
    switch (message.kind) {
        case MessageKind::ready:
            place.state = ByteReader(message.payload).take<WorkerState>();
            place.phase = Phase::idle;
            idle_.push_back(worker);
            tell_ready(worker);
            break;
        case MessageKind::progress:
            if (message.piece != place.piece || place.is_abandoned || place.has_left) break;
            switch (job_->progress(first_worker_ + worker, ByteReader(message.payload).take<std::uint64_t>())) {
                case RemoteJob::Answer::go_on:
                    break;
                case RemoteJob::Answer::give_back:
                    if (!place.is_asked) send(worker, MessageKind::give_back);
                    place.is_asked = true;
                    break;
                case RemoteJob::Answer::abandon:
                    send(worker, MessageKind::abandon);
                    place.is_abandoned = true;
                    break;
            }
            break;
        case MessageKind::result:
            take_result(worker, message);
            break;
        case MessageKind::failure:
            fail(worker, failure_of(workers_[worker].name, message.payload));
            break;
        default:
            throw DeviceError("", "", 0, "sent a message that only rank 0 sends");
    }
}

void Manager::introduce(std::size_t number, const RankIntroduction& introduction) {
    Rank& rank = ranks_[number];
    rank.host = introduction.host;
    rank.is_known = true;
    if (introduction.version != version_)
        return refuse(number,
                      fmt::format("it is of another version: {}, and here is {}", introduction.version, version_));
    for (const std::string& warning : introduction.warnings) hosts_of_warnings_[warning].push_back(name_of(number));
    if (!introduction.failure.empty()) return exclude(number, introduction.failure);
    for (std::uint32_t i = 0; i < introduction.workers.size(); ++i) {
        const std::string& name = introduction.workers[i];
        rank.workers.push_back(workers_.size());
        workers_.push_back({number, i, name, introduction.host});
        places_.emplace_back();
        if (introduction.faults[i].empty()) continue;
        places_.back().phase = Phase::dropped;
        notices_.push_back(fmt::format("{} is not used: {}", name, introduction.faults[i]));
    }
}

void Manager::join(std::size_t rank, const std::string& description) {
    if (description == job_->description()) return;
    refuse(rank, "its picture or batch is another one: " +
                     difference(description, job_->description(), "and that of rank 0 has"));
}

void Manager::refuse(std::size_t rank, const std::string& reason) {
    transport_.send(rank, {.kind = MessageKind::refusal, .payload = bytes_of_text(reason)});
    exclude(rank, "is refused: " + reason);
}

/// None of a rank's workers gets work any more. It is still told the end.
void Manager::exclude(std::size_t number, const std::string& reason) {
    ranks_[number].is_excluded = true;
    const DeviceError why(name_of(number), "", 0, reason);
    bool is_told = false;
    for (const std::size_t worker : ranks_[number].workers) {
        if (places_[worker].phase == Phase::dropped) continue;
        if (job_ && !places_[worker].has_left) {
            fail(worker, why);
            is_told = true;
        } else {
            drop_worker(worker);
        }
    }
    if (!is_told) notices_.push_back(fmt::format("{}; it is dropped", why.what()));
}

/// A rank cannot be reached, or sends nonsense.
void Manager::drop(std::size_t rank, const std::string& reason) {
    if (ranks_[rank].is_dropped) return;
    ranks_[rank].is_dropped = true;
    exclude(rank, reason);
    transport_.forget(rank);
}

void Manager::fail(std::size_t worker, const DeviceError& why) {
    failures_.push_back({first_worker_ + worker, why});
    drop_worker(worker);
}

void Manager::drop_worker(std::size_t worker) {
    places_[worker].phase = Phase::dropped;
}

void Manager::begin_job(RemoteJob& job) {
    job_ = &job;
    ++job_number_;
    idle_.clear();
    for (WorkerPlace& place : places_)
        if (place.phase != Phase::dropped) place = {};
}

void Manager::begin_schedule(std::shared_ptr<Schedule> schedule, std::size_t first_worker) {
    schedule_ = std::move(schedule);
    first_worker_ = first_worker;
    for (std::size_t worker = 0; worker < places_.size(); ++worker)
        places_[worker].has_left = is_dropped(worker) || !job_->takes_part(first_worker_ + worker);
    for (std::size_t worker = 0; worker < places_.size(); ++worker)
        if (places_[worker].phase == Phase::idle || places_[worker].phase == Phase::busy) tell_ready(worker);
    for (const ReceivedMessage& received : std::exchange(early_, {})) take(received);
}

void Manager::tell_ready(std::size_t worker) {
    job_->ready(first_worker_ + worker, places_[worker].state);
    places_[worker].state.setup_seconds = 0.0;  // is told once
}

std::vector<WorkerFailure> Manager::serve() {
    take_messages();
    if (!schedule_)
        give_orders();
    else if (schedule_->is_stopped() || schedule_->items_left() == 0)
        end_work();
    else
        give_work();
    ping();
    return std::exchange(failures_, {});
}

void Manager::give_work() {
    std::size_t misses = 0, next = 0;
    while (next < idle_.size() && misses < kMostMisses) {
        const std::size_t worker = idle_[next];
        const WorkerPlace& place = places_[worker];
        std::optional<Range> piece;
        if (place.phase == Phase::idle && !place.has_left) {
            piece = schedule_->try_take(first_worker_ + worker, place.state.items_wanted, place.state.most_items);
            if (!piece) {
                ++misses;
                ++next;
                continue;
            }
        }
        idle_[next] = idle_.back();
        idle_.pop_back();
        if (piece) begin(worker, *piece);
    }
    std::rotate(idle_.begin(), idle_.begin() + static_cast<std::ptrdiff_t>(next), idle_.end());
}

/// The same where there is no schedule.
void Manager::give_orders() {
    for (const std::size_t worker : std::exchange(idle_, {}))
        if (places_[worker].phase == Phase::idle) begin(worker, {});
}

void Manager::begin(std::size_t worker, const Range& piece) {
    if (auto first = job_->begin(first_worker_ + worker, piece)) return order(worker, std::move(*first));
    job_->end(first_worker_ + worker);
    idle_.push_back(worker);
}

void Manager::order(std::size_t worker, Bytes payload) {
    WorkerPlace& place = places_[worker];
    place.phase = Phase::busy;
    place.is_asked = place.is_abandoned = false;
    ++place.piece;
    send(worker, MessageKind::piece, std::move(payload));
}

void Manager::send(std::size_t worker, MessageKind kind, Bytes payload) {
    transport_.send(workers_[worker].rank, {.kind = kind,
                                            .job = job_number_,
                                            .worker = workers_[worker].number,
                                            .piece = places_[worker].piece,
                                            .payload = std::move(payload)});
}

void Manager::take_result(std::size_t worker, const Message& message) {
    WorkerPlace& place = places_[worker];
    if (place.phase != Phase::busy || message.piece != place.piece) return;
    ByteReader reader(message.payload);
    place.state = reader.take<WorkerState>();
    std::optional<Bytes> next;
    if (!place.is_abandoned && !place.has_left && !reader.rest().empty())
        next = job_->take(first_worker_ + worker, reader.rest());
    if (next) return order(worker, std::move(*next));
    job_->end(first_worker_ + worker);
    place.phase = Phase::idle;
    idle_.push_back(worker);
}

/// All work is done, or is to stop: lets workers leave the schedule, those with a piece once they gave it back if it
/// counts.
void Manager::end_work() {
    const bool is_done = schedule_->items_left() == 0;
    for (std::size_t worker = 0; worker < places_.size(); ++worker) {
        WorkerPlace& place = places_[worker];
        if (place.has_left || place.phase == Phase::dropped) continue;
        if (place.phase == Phase::busy && !place.is_abandoned) {
            if (!is_done) {
                if (!place.is_asked) send(worker, MessageKind::give_back);
                place.is_asked = true;
                continue;
            }
            send(worker, MessageKind::abandon);
            place.is_abandoned = true;
        }
        job_->end(first_worker_ + worker);
        schedule_->leave(first_worker_ + worker);
        place.has_left = true;
    }
}

void Manager::ping() {
    const Clock::time_point now = now_();
    if (now - last_ping_ <
        std::chrono::duration<double>(sign_period(ranks_.size(), kPingSeconds, 4 * kLongestPingSeconds)))
        return;
    last_ping_ = now;
    for (std::size_t rank = 1; rank < ranks_.size(); ++rank)
        if (!ranks_[rank].is_dropped) transport_.send(rank, {.kind = MessageKind::ping, .payload = {}});
}

void Manager::end_job() {
    for (std::size_t rank = 1; rank < ranks_.size(); ++rank)
        if (!ranks_[rank].is_dropped)
            transport_.send(rank, {.kind = MessageKind::end, .job = job_number_, .payload = {}});
    job_ = nullptr;
    schedule_.reset();
}

void Manager::skip_job() {
    ++job_number_;
    end_job();
}

bool Manager::end(double seconds) {
    for (std::size_t rank = 1; rank < ranks_.size(); ++rank)
        if (!ranks_[rank].is_dropped) transport_.send(rank, {.kind = MessageKind::end_of_all, .payload = {}});
    const auto all = [&](auto&& is_true) { return std::all_of(ranks_.begin(), ranks_.end(), is_true); };
    const auto deadline = now_() + std::chrono::duration<double>(seconds);
    while (!all([](const Rank& rank) { return rank.said_bye || rank.is_dropped; }) && now_() < deadline) {
        take_messages();
        std::this_thread::sleep_for(kPollPeriod);
    }
    return all([](const Rank& rank) { return rank.said_bye; });
}

}  // namespace castor
