#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/box.h"
#include "base/range.h"
#include "castor/device_share.h"
#include "remote/manager.h"
#include "trace/chunk_order.h"
#include "trace/scene_contents.h"

namespace castor {

/// Lets the processes that keep a scene's chunks answer rays of this one, which is the first of them and manages the
/// others. Rank r of the manager keeps the r-th share. Where a rank is lost, another one answers for it, which brings
/// the chunks to its devices when they are needed; where all are lost, the asking device itself.
class ChunkExchange : public RemoteJob {
public:
    /// Answers an order on the asking device.
    using Answer = std::function<Bytes(const ChunkOrder& order)>;

    /// `description`: see RemoteJob. A worker that does not answer for `deadline_seconds` is dropped.
    ChunkExchange(Manager& manager, std::string description, const SceneContents& contents, double deadline_seconds);

    // For the thread that runs the crew, and made the object.

    Manager& manager() { return manager_; }
    /// Has a crew let this exchange serve those who ask.
    void let_serve(CrewOptions& options);
    /// Nothing is asked any more; who still waits for an answer gets a DeviceError.
    void end();

    // For any thread.

    std::size_t share_count() const { return shares_.size(); }
    const Range& chunks_of(std::size_t share) const { return shares_[share].chunks; }
    /// Whether the ray may have a hit up to `t_max` in the share's chunks. Never false where it has.
    bool may_meet(std::size_t share, const Ray& ray, double t_max) const;
    /// Whether a hit may be one of the share's chunks: `t` is in the caller's units.
    bool may_have(std::size_t share, const Ray& ray, double t) const;

    struct Question {
        std::size_t share;
        ChunkOrder order;  // its chunks are filled in
    };
    /// Returns the answers, one a question, when all are there. `self`: see above.
    std::vector<Bytes> ask(std::vector<Question> questions, const Answer& self);

    /// Returns what the others did so far, one a worker of the manager: `tiles` counts orders. Their failures too.
    std::vector<DeviceShare> shares();

    // RemoteJob
    const std::string& description() const override { return description_; }
    void ready(std::size_t, const WorkerState&) override {}
    std::optional<Bytes> begin(std::size_t worker, const Range&) override;
    RemoteJob::Answer progress(std::size_t, std::uint64_t) override { return RemoteJob::Answer::go_on; }
    std::optional<Bytes> take(std::size_t worker, std::span<const std::byte> result) override;
    void end(std::size_t) override {}

private:
    struct Share {
        Range chunks;
        std::vector<Box> boxes;   // of its chunks, a little larger than what may be hit
        bool is_endless = false;  // a chunk has planes, or no box
        double slack = 0.0;       // of the boxes' coordinates
    };
    struct Pending {
        std::size_t share;
        Bytes order;
        std::size_t rays, answer_bytes;
        Bytes answer;
        bool is_answered = false, is_given_up = false;
    };
    struct Worker {
        bool is_dropped = false;
        DeviceShare share;
        std::shared_ptr<Pending> pending;  // what it answers
        Manager::Clock::time_point since{};
    };

    void serve();
    void lose(std::size_t worker, const DeviceError& why);
    bool is_kept(std::size_t share) const;

    Manager& manager_;
    const std::string description_;
    const double deadline_seconds_;
    const std::thread::id serving_thread_ = std::this_thread::get_id();
    std::vector<Share> shares_;

    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<Worker> workers_;  // as the manager's
    std::deque<std::shared_ptr<Pending>> waiting_;
    std::size_t askers_ = 0;  // who wait for answers
    bool is_ended_ = false;
};

/// Lets the manager's workers answer for as long as this lives.
class ChunkExchangeTurn {
public:
    explicit ChunkExchangeTurn(ChunkExchange& exchange) : exchange_(exchange), turn_(exchange.manager(), exchange) {
        exchange.manager().begin_orders();
    }
    ~ChunkExchangeTurn() { exchange_.end(); }
    ChunkExchangeTurn(const ChunkExchangeTurn&) = delete;
    ChunkExchangeTurn& operator=(const ChunkExchangeTurn&) = delete;

private:
    ChunkExchange& exchange_;
    RemoteTurn turn_;
};

}  // namespace castor
