#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "castor/error.h"
#include "remote/bytes.h"

namespace castor {

/// How a rank introduces itself.
struct RankIntroduction {
    std::string version;  // of Castor, and all else that must be equal
    std::string host;
    std::string failure;               // why it cannot work; empty: it can
    std::vector<std::string> workers;  // their names, unlike those of other hosts
    std::vector<std::string> faults;   // why a worker is not to be trusted, one a worker; empty: it is
    std::vector<std::string> warnings{};
};

Bytes bytes_of(const RankIntroduction& introduction);
RankIntroduction introduction_of(std::span<const std::byte> bytes);

/// What the manager must know of a worker to give it pieces.
struct WorkerState {
    double setup_seconds = 0.0;
    double items_per_second = 0.0;   // 0: not known yet
    std::uint64_t items_wanted = 1;  // at most, for the next piece
    std::uint64_t most_items = 1;    // of any piece
};

Bytes bytes_of(const DeviceError& failure);
/// `name`: who failed, for a message that does not say it.
DeviceError failure_of(const std::string& name, std::span<const std::byte> bytes);

Bytes bytes_of_text(std::string_view text);
std::string text_of(std::span<const std::byte> bytes);

}  // namespace castor
