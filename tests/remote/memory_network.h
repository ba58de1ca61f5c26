#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "remote/transport.h"

namespace castor::test {

/// Carries messages between threads of this process, each of which is a rank.
class MemoryNetwork {
public:
    explicit MemoryNetwork(std::size_t rank_count) : queues_(rank_count), is_cut_(rank_count) {}

    std::unique_ptr<Transport> endpoint(std::size_t rank) { return std::make_unique<Endpoint>(*this, rank); }
    /// From now on nothing comes from this rank, or reaches it, and nobody is told.
    void cut(std::size_t rank) {
        std::lock_guard lock(mutex_);
        is_cut_[rank] = true;
    }
    /// Nothing that was lost comes back.
    void mend(std::size_t rank) {
        std::lock_guard lock(mutex_);
        is_cut_[rank] = false;
    }
    std::size_t rank_count() const { return queues_.size(); }

private:
    class Endpoint : public Transport {
    public:
        Endpoint(MemoryNetwork& network, std::size_t rank) : network_(network), rank_(rank) {}
        std::size_t rank() const override { return rank_; }
        std::size_t rank_count() const override { return network_.rank_count(); }
        void send(std::size_t to, Message message) override {
            std::lock_guard lock(network_.mutex_);
            if (!network_.is_cut_[rank_] && !network_.is_cut_[to])
                network_.queues_[to].push_back({rank_, std::move(message)});
        }
        std::optional<ReceivedMessage> receive() override {
            std::lock_guard lock(network_.mutex_);
            auto& queue = network_.queues_[rank_];
            if (queue.empty()) return std::nullopt;
            ReceivedMessage next = std::move(queue.front());
            queue.pop_front();
            return next;
        }
        void forget(std::size_t) override {}

    private:
        MemoryNetwork& network_;
        std::size_t rank_;
    };

    std::mutex mutex_;
    std::vector<std::deque<ReceivedMessage>> queues_;  // of messages to each rank
    std::vector<bool> is_cut_;
};

}  // namespace castor::test
