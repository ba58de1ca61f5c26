#include "remote/rank_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace castor {

namespace {

constexpr std::chrono::milliseconds kPollPeriod(1);

// How often a busy worker gives a sign of life, at most.
constexpr double kProgressSeconds = 0.25;

// How long workers have to notice that their job is over.
constexpr double kEndSeconds = 5.0;

}  // namespace

/// Orders for one worker, and what it answers: between its thread and the one that uses the transport.
class RankServer::Mailbox {
public:
    struct Order {
        std::uint32_t piece;
        Bytes bytes;
    };

    explicit Mailbox(double seconds) : progress_seconds(seconds) {}

    const double progress_seconds;  // between two signs of life

    // For the worker's thread.

    std::optional<Order> wait_for_order(const std::function<void()>& poll) {
        std::unique_lock lock(mutex_);
        while (!order_ && !is_over_) {
            if (poll) {
                lock.unlock();
                poll();
                std::this_thread::sleep_for(kPollPeriod);
                lock.lock();
            } else {
                changed_.wait(lock);
            }
        }
        if (is_over_) return std::nullopt;
        return std::exchange(order_, std::nullopt);
    }
    void post(MessageKind kind, std::uint32_t piece, Bytes payload) {
        std::lock_guard lock(mutex_);
        outbox_.push_back({.kind = kind, .piece = piece, .payload = std::move(payload)});
    }
    bool is_over() const {
        std::lock_guard lock(mutex_);
        return is_over_;
    }
    bool is_abandoned(std::uint32_t piece) const {
        std::lock_guard lock(mutex_);
        return is_over_ || abandoned_ == piece;
    }
    bool is_asked_back(std::uint32_t piece) const {
        std::lock_guard lock(mutex_);
        return is_over_ || abandoned_ == piece || asked_back_ == piece;
    }
    void set_ended() {
        std::lock_guard lock(mutex_);
        has_ended_ = true;
    }

    // For the other thread.

    void deliver(Order order) {
        std::lock_guard lock(mutex_);
        order_ = std::move(order);
        changed_.notify_one();
    }
    void ask_back(std::uint32_t piece) {
        std::lock_guard lock(mutex_);
        asked_back_ = piece;
    }
    void abandon(std::uint32_t piece) {
        std::lock_guard lock(mutex_);
        abandoned_ = piece;
    }
    void end() {
        std::lock_guard lock(mutex_);
        is_over_ = true;
        changed_.notify_one();
    }
    bool has_ended() const {
        std::lock_guard lock(mutex_);
        return has_ended_;
    }
    std::deque<Message> take_posts() {
        std::lock_guard lock(mutex_);
        return std::exchange(outbox_, {});
    }

private:
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<Order> order_;
    std::deque<Message> outbox_;
    std::uint32_t asked_back_ = 0, abandoned_ = 0;  // numbers of pieces; 0: none
    bool is_over_ = false, has_ended_ = false;
};

RankServer::RankServer(Transport& transport, double deadline_seconds, double manager_deadline_seconds)
    : transport_(transport), deadline_seconds_(deadline_seconds), manager_deadline_seconds_(manager_deadline_seconds) {}

void RankServer::introduce(const RankIntroduction& introduction) {
    transport_.send(0, {.kind = MessageKind::hello, .payload = bytes_of(introduction)});
}

bool RankServer::serve(const std::string& description, const std::vector<OrderedWorkerOffer>& offers) {
    ++job_;
    since_sign_ = {};
    transport_.send(0, {.kind = MessageKind::join, .job = job_, .payload = bytes_of_text(description)});
    mailboxes_.clear();
    const double progress_seconds = sign_period(transport_.rank_count(), kProgressSeconds, deadline_seconds_);
    for (std::size_t i = 0; i < offers.size(); ++i) mailboxes_.push_back(std::make_shared<Mailbox>(progress_seconds));
    for (std::size_t i = 0; i < offers.size(); ++i)
        if (!offers[i].stays_in_callers_thread)
            std::thread([mailbox = mailboxes_[i], offer = offers[i]] { run(mailbox, offer, {}); }).detach();
    try {
        for (std::size_t i = 0; i < offers.size(); ++i)
            if (offers[i].stays_in_callers_thread) run(mailboxes_[i], offers[i], [this] { poll(); });
        for (poll(); !is_job_over(); poll()) std::this_thread::sleep_for(kPollPeriod);
    } catch (...) {
        end_workers();
        throw;
    }
    end_workers();
    return !is_all_ended_;
}

void RankServer::run(const std::shared_ptr<Mailbox>& mailbox, const OrderedWorkerOffer& offer,
                     const std::function<void()>& poll) {
    std::exception_ptr of_poll;
    const auto poll_safely = [&] {
        if (!poll || of_poll) return;
        try {
            poll();
        } catch (...) {
            of_poll = std::current_exception();
            mailbox->end();
        }
    };
    const std::function<void()> while_waiting = poll ? std::function<void()>(poll_safely) : nullptr;
    try {
        const auto worker = offer.make([&] {
            poll_safely();
            return !mailbox->is_over();
        });
        if (worker) mailbox->post(MessageKind::ready, 0, ByteWriter().add(worker->state()).take());
        while (worker) {
            const auto order = mailbox->wait_for_order(while_waiting);
            if (!order) break;
            Stopwatch since_progress;
            const Bytes result = worker->work(order->bytes, [&](std::uint64_t done) {
                poll_safely();
                if (since_progress.seconds() > mailbox->progress_seconds) {
                    mailbox->post(MessageKind::progress, order->piece, ByteWriter().add(done).take());
                    since_progress = {};
                }
                return !mailbox->is_asked_back(order->piece);
            });
            Bytes answer = ByteWriter().add(worker->state()).take();
            if (!mailbox->is_abandoned(order->piece)) answer.insert(answer.end(), result.begin(), result.end());
            mailbox->post(MessageKind::result, order->piece, std::move(answer));
        }
    } catch (const DeviceError& error) {
        mailbox->post(MessageKind::failure, 0, bytes_of(error));
    } catch (const std::exception& error) {
        mailbox->post(MessageKind::failure, 0, bytes_of(DeviceError("", "", 0, error.what())));
    }
    mailbox->set_ended();
    if (of_poll) std::rethrow_exception(of_poll);
}

void RankServer::poll() {
    for (std::uint32_t worker = 0; worker < mailboxes_.size(); ++worker)
        for (Message& message : mailboxes_[worker]->take_posts()) {
            message.job = job_;
            message.worker = worker;
            transport_.send(0, std::move(message));
        }
    while (const auto received = transport_.receive()) {
        since_sign_ = {};
        take(received->message);
    }
    if (since_sign_.seconds() <= manager_deadline_seconds_) return;
    is_manager_gone_ = true;
    throw DeviceError("", "", 0, fmt::format("rank 0 has not answered for {:g} s", manager_deadline_seconds_));
}

void RankServer::take(const Message& message) {
    const auto mailbox_of = [&]() -> Mailbox* {
        return message.job == job_ && message.worker < mailboxes_.size() ? mailboxes_[message.worker].get() : nullptr;
    };
    switch (message.kind) {
        case MessageKind::refusal:
            throw DeviceError("", "", 0, "rank 0 refuses this rank: " + text_of(message.payload));
        case MessageKind::lost:
            is_manager_gone_ = true;
            throw DeviceError("", "", 0, "rank 0 is lost: " + text_of(message.payload));
        case MessageKind::piece:
            if (Mailbox* mailbox = mailbox_of()) mailbox->deliver({message.piece, message.payload});
            break;
        case MessageKind::give_back:
            if (Mailbox* mailbox = mailbox_of()) mailbox->ask_back(message.piece);
            break;
        case MessageKind::abandon:
            if (Mailbox* mailbox = mailbox_of()) mailbox->abandon(message.piece);
            break;
        case MessageKind::end:
            ended_jobs_ = message.job;
            break;
        case MessageKind::end_of_all:
            is_all_ended_ = true;
            break;
        default:  // ping
            break;
    }
    if (is_job_over())
        for (const auto& mailbox : mailboxes_) mailbox->end();
}

void RankServer::end_workers() {
    for (const auto& mailbox : mailboxes_) mailbox->end();
    const auto have_ended = [&] {
        return std::all_of(mailboxes_.begin(), mailboxes_.end(),
                           [](const auto& mailbox) { return mailbox->has_ended(); });
    };
    for (const Stopwatch watch; !have_ended() && watch.seconds() < kEndSeconds;)
        std::this_thread::sleep_for(kPollPeriod);
    has_left_workers_behind_ |= !have_ended();
    mailboxes_.clear();
}

void RankServer::finish() {
    if (is_manager_gone_) return;
    job_ = ended_jobs_ + 1;
    since_sign_ = {};
    for (poll(); !is_all_ended_; poll()) std::this_thread::sleep_for(kPollPeriod);
    transport_.send(0, {.kind = MessageKind::bye, .payload = {}});
    poll();
}

}  // namespace castor
