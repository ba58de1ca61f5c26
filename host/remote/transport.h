#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "remote/bytes.h"

namespace castor {

/// What the manager and a rank tell each other. `worker` is a number among the rank's workers; `piece` is the manager's
/// number of what it ordered from that worker.
enum class MessageKind : std::uint32_t {
    // From a rank:
    hello,     // RankIntroduction: who I am
    join,      // text: I begin this job, which is described so
    ready,     // WorkerState: this worker waits for its first piece
    progress,  // uint64: so much of the piece is done; a sign of life
    result,    // WorkerState, then what the job makes of it; nothing after the state: as told, I gave the piece up
    failure,   // DeviceError: this worker can work no longer
    bye,       // I have been told the end, and end
    // From the manager:
    refusal,    // text: why you cannot take part
    piece,      // an order, as the job makes it
    give_back,  // give back what you have of the piece
    abandon,    // nobody wants the piece any more
    end,        // the job is done
    end_of_all,
    ping,  // I am alive
    // From the transport itself:
    lost,  // text: this rank cannot be reached any more
};

struct Message {
    MessageKind kind{};
    std::uint32_t job = 0, worker = 0, piece = 0;
    Bytes payload;
};

/// The time between two signs of life of one of so many ranks: `seconds`, but more where rank 0 would hear more than a
/// thousand a second, and a quarter at most of the deadline after which silence counts.
constexpr double sign_period(std::size_t rank_count, double seconds, double deadline_seconds) {
    return std::min(std::max(seconds, 1e-3 * static_cast<double>(rank_count)), deadline_seconds / 4);
}

/// What went through a process's network, as the library that carries it counts messages.
struct Traffic {
    std::uint64_t messages_received = 0, bytes_received = 0;
    std::uint64_t messages_sent = 0, bytes_sent = 0;
};

struct ReceivedMessage {
    std::size_t rank;  // that sent it
    Message message;
};

/// Carries messages between rank 0, the manager, and each of the other ranks, in order. Nothing waits: what cannot be
/// sent now is sent later, when `receive` is called. For one thread.
class Transport {
public:
    virtual ~Transport() = default;
    virtual std::size_t rank() const = 0;  // of this process
    virtual std::size_t rank_count() const = 0;
    virtual void send(std::size_t rank, Message message) = 0;
    /// Returns the next message that has come; nullopt: none.
    virtual std::optional<ReceivedMessage> receive() = 0;
    /// Nothing is sent to this rank any more, or expected from it.
    virtual void forget(std::size_t rank) = 0;
};

}  // namespace castor
