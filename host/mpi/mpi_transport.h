#pragma once

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "remote/transport.h"

namespace castor::mpi {

/// Messages over MPI. A message is a head of fixed size, with its payload where that is small; else the payload follows
/// as a second one. Each process has a receive posted for each of those that it hears, by name: a receive from any
/// source fails in some libraries once one is dead. All calls return at once.
class MpiTransport : public Transport {
public:
    /// `communicator`: of all ranks, for this transport alone; errors must return.
    explicit MpiTransport(MPI_Comm communicator);

    std::size_t rank() const override { return rank_; }
    std::size_t rank_count() const override { return rank_count_; }
    void send(std::size_t rank, Message message) override;
    std::optional<ReceivedMessage> receive() override;
    void forget(std::size_t rank) override;

    /// Returns whether all that was sent has left this process.
    bool all_sent();
    /// Takes back the receives that are posted, before MPI is finalised. Nothing may be under way.
    void close();
    const Traffic& traffic() const { return traffic_; }  // so far

private:
    struct Head {
        std::uint32_t kind, job, worker, piece;
        std::uint64_t payload_bytes;
    };
    static constexpr std::size_t kInlineBytes = 1000;
    static constexpr int kHeadTag = 1, kPayloadTag = 2;

    /// What is being sent; lives until MPI is done with it.
    struct Outgoing {
        std::size_t rank;
        Bytes bytes;
    };
    /// What is being received from one rank.
    struct Incoming {
        std::size_t rank;
        Bytes head;
        Message message;
        bool has_head = false;
    };

    void post_head(std::size_t place);
    void post_send(std::size_t rank, Bytes bytes, int tag);
    void poll_receives();
    void poll_sends();
    void take(std::size_t place, const MPI_Status& status);
    void lose(std::size_t rank, int error);

    MPI_Comm communicator_;
    std::size_t rank_ = 0, rank_count_ = 1;
    std::vector<Incoming> incoming_;
    std::vector<MPI_Request> receives_;  // one each of incoming_
    std::vector<std::unique_ptr<Outgoing>> outgoing_;
    std::vector<MPI_Request> sends_;                     // one each of outgoing_
    std::vector<bool> forgotten_;                        // by rank
    std::vector<std::unique_ptr<Outgoing>> never_sent_;  // to forgotten ranks: MPI may still read it
    std::deque<ReceivedMessage> received_;
    Traffic traffic_;
};

}  // namespace castor::mpi
