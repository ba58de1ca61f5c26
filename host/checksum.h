#pragma once

#include <cstdint>
#include <string_view>

namespace castor {

/// FNV-1a. Not against malice.
inline std::uint64_t checksum(std::string_view bytes) {
    std::uint64_t hash = 14695981039346656037u;
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * 1099511628211u;
    return hash;
}

}  // namespace castor
