#pragma once

#include <cstdint>
#include <string>

namespace castor {

/// What one device did of work that several share.
struct DeviceShare {
    std::string device;           // its name
    std::uint64_t tiles = 0;      // pieces of the picture or batch that it finished
    std::uint64_t samples = 0;    // of a picture: of these, and of the piece that it is at
    std::uint64_t rays = 0;       // of all kinds, traced for these pieces
    std::uint64_t retries = 0;    // pieces that it had when it was dropped: others do them again
    std::uint64_t left_busy = 0;  // how often it was still busy when all was done or to stop, and was not waited for
    double busy_seconds = 0.0;   // from taking pieces to having their results, without those that others finished first
    double setup_seconds = 0.0;  // programs and uploads
    std::string failure;         // why it was dropped; empty: it was not
};

}  // namespace castor
