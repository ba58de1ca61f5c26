#include "mpi_transport.h"

#include <fmt/format.h>

#include <climits>
#include <cstring>
#include <utility>

#include "castor/error.h"
#include "remote/protocol.h"

namespace castor::mpi {

namespace {

std::string text_of_error(int error) {
    char text[MPI_MAX_ERROR_STRING] = "";
    int length = 0;
    MPI_Error_string(error, text, &length);
    return std::string(text, static_cast<std::size_t>(length));
}

}  // namespace

MpiTransport::MpiTransport(MPI_Comm communicator) : communicator_(communicator) {
    int rank = 0, count = 1;
    MPI_Comm_rank(communicator_, &rank);
    MPI_Comm_size(communicator_, &count);
    rank_ = static_cast<std::size_t>(rank);
    rank_count_ = static_cast<std::size_t>(count);
    forgotten_.resize(rank_count_);
    for (std::size_t other = 0; other < rank_count_; ++other)
        if (other != rank_ && (rank_ == 0 || other == 0))
            incoming_.push_back({.rank = other, .head = {}, .message = {}});
    receives_.resize(incoming_.size(), MPI_REQUEST_NULL);
    for (std::size_t place = 0; place < incoming_.size(); ++place) post_head(place);
}

void MpiTransport::post_head(std::size_t place) {
    Incoming& incoming = incoming_[place];
    incoming.has_head = false;
    incoming.head.resize(sizeof(Head) + kInlineBytes);
    MPI_Irecv(incoming.head.data(), static_cast<int>(incoming.head.size()), MPI_BYTE, static_cast<int>(incoming.rank),
              kHeadTag, communicator_, &receives_[place]);
}

void MpiTransport::post_send(std::size_t rank, Bytes bytes, int tag) {
    auto& outgoing = outgoing_.emplace_back(std::make_unique<Outgoing>(Outgoing{rank, std::move(bytes)}));
    sends_.push_back(MPI_REQUEST_NULL);
    ++traffic_.messages_sent;
    traffic_.bytes_sent += outgoing->bytes.size();
    const int error = MPI_Isend(outgoing->bytes.data(), static_cast<int>(outgoing->bytes.size()), MPI_BYTE,
                                static_cast<int>(rank), tag, communicator_, &sends_.back());
    if (error != MPI_SUCCESS) lose(rank, error);
}

void MpiTransport::send(std::size_t rank, Message message) {
    if (forgotten_[rank]) return;
    if (message.payload.size() > INT_MAX)
        throw DeviceError("", "", 0, fmt::format("a message of {} bytes is too long for MPI", message.payload.size()));
    const Head head{static_cast<std::uint32_t>(message.kind), message.job, message.worker, message.piece,
                    message.payload.size()};
    Bytes bytes(sizeof(Head));
    std::memcpy(bytes.data(), &head, sizeof(Head));
    const bool is_inline = message.payload.size() <= kInlineBytes;
    if (is_inline) bytes.insert(bytes.end(), message.payload.begin(), message.payload.end());
    post_send(rank, std::move(bytes), kHeadTag);
    if (!is_inline) post_send(rank, std::move(message.payload), kPayloadTag);
}

std::optional<ReceivedMessage> MpiTransport::receive() {
    if (received_.empty()) {
        poll_sends();
        poll_receives();
    }
    if (received_.empty()) return std::nullopt;
    ReceivedMessage next = std::move(received_.front());
    received_.pop_front();
    return next;
}

void MpiTransport::poll_receives() {
    const int count = static_cast<int>(receives_.size());
    std::vector<int> places(receives_.size());
    std::vector<MPI_Status> statuses(receives_.size());
    int done = 0;
    if (MPI_Testsome(count, receives_.data(), &done, places.data(), statuses.data()) == MPI_SUCCESS) {
        for (int i = 0; i < done; ++i) take(static_cast<std::size_t>(places[i]), statuses[i]);  // UNDEFINED is negative
        return;
    }
    // Libraries differ in how they tell which of several failed.
    for (std::size_t place = 0; place < incoming_.size(); ++place) {
        int is_done = 0;
        MPI_Status status;
        const int error = MPI_Test(&receives_[place], &is_done, &status);
        if (error != MPI_SUCCESS)
            lose(incoming_[place].rank, error);
        else if (is_done && receives_[place] == MPI_REQUEST_NULL && !forgotten_[incoming_[place].rank])
            take(place, status);
    }
}

void MpiTransport::take(std::size_t place, const MPI_Status& status) {
    Incoming& incoming = incoming_[place];
    int count = 0;
    MPI_Get_count(&status, MPI_BYTE, &count);
    const auto bytes = static_cast<std::size_t>(count);
    ++traffic_.messages_received;
    traffic_.bytes_received += bytes;
    if (!incoming.has_head) {
        Head head{};
        if (bytes < sizeof(Head)) return lose(incoming.rank, MPI_ERR_TRUNCATE);
        std::memcpy(&head, incoming.head.data(), sizeof(Head));
        incoming.message = {static_cast<MessageKind>(head.kind), head.job, head.worker, head.piece, {}};
        if (head.payload_bytes > kInlineBytes) {
            if (head.payload_bytes > INT_MAX) return lose(incoming.rank, MPI_ERR_COUNT);
            incoming.has_head = true;
            incoming.message.payload.resize(head.payload_bytes);
            MPI_Irecv(incoming.message.payload.data(), static_cast<int>(head.payload_bytes), MPI_BYTE,
                      static_cast<int>(incoming.rank), kPayloadTag, communicator_, &receives_[place]);
            return;
        }
        if (bytes != sizeof(Head) + head.payload_bytes) return lose(incoming.rank, MPI_ERR_TRUNCATE);
        const auto payload = incoming.head.begin() + sizeof(Head);
        incoming.message.payload.assign(payload, payload + static_cast<std::ptrdiff_t>(head.payload_bytes));
    }
    received_.push_back({incoming.rank, std::move(incoming.message)});
    post_head(place);
}

void MpiTransport::poll_sends() {
    for (std::size_t place = 0; place < outgoing_.size();) {
        int done = 0;
        const std::size_t rank = outgoing_[place]->rank;
        const int error = MPI_Test(&sends_[place], &done, MPI_STATUS_IGNORE);
        if (error != MPI_SUCCESS) return lose(rank, error);
        if (!done) {
            ++place;
            continue;
        }
        outgoing_[place] = std::move(outgoing_.back());
        outgoing_.pop_back();
        sends_[place] = sends_.back();
        sends_.pop_back();
    }
}

bool MpiTransport::all_sent() {
    poll_sends();
    return outgoing_.empty();
}

void MpiTransport::close() {
    for (MPI_Request& receive : receives_) {
        if (receive == MPI_REQUEST_NULL) continue;
        MPI_Cancel(&receive);
        MPI_Wait(&receive, MPI_STATUS_IGNORE);
    }
}

void MpiTransport::lose(std::size_t rank, int error) {
    if (forgotten_[rank]) return;
    received_.push_back(
        {rank,
         {.kind = MessageKind::lost, .payload = bytes_of_text("cannot be reached any more: " + text_of_error(error))}});
    forget(rank);
}

void MpiTransport::forget(std::size_t rank) {
    forgotten_[rank] = true;
    // What is posted stays posted, and its buffer stays where it is: cancelling waits in some libraries.
    for (std::size_t place = 0; place < incoming_.size(); ++place)
        if (incoming_[place].rank == rank) receives_[place] = MPI_REQUEST_NULL;
    for (std::size_t place = 0; place < outgoing_.size();) {
        if (outgoing_[place]->rank != rank) {
            ++place;
            continue;
        }
        never_sent_.push_back(std::move(outgoing_[place]));
        outgoing_[place] = std::move(outgoing_.back());
        outgoing_.pop_back();
        sends_[place] = sends_.back();
        sends_.pop_back();
    }
}

}  // namespace castor::mpi
