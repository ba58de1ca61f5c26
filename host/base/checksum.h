#pragma once

#include <cstdint>
#include <string_view>

#define XXH_INLINE_ALL  // nothing to link, and with the instructions that the program is compiled for
#include <xxhash.h>

namespace castor {

/// XXH3. Not against malice.
inline std::uint64_t checksum(std::string_view bytes) {
    return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace castor
