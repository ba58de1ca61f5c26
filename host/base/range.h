#pragma once

#include <cstdint>

namespace castor {

/// Numbers [begin, end).
struct Range {
    std::uint64_t begin = 0, end = 0;

    std::uint64_t size() const { return end - begin; }
    bool operator==(const Range&) const = default;
};

}  // namespace castor
