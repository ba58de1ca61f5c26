#pragma once

#include <cstdint>
#include <string>

namespace castor::cli {

/// What --part names: the number-th of count parts, from 1 on.
struct Part {
    std::uint32_t number = 1, count = 1;
};

/// Reads "i/n". Throws UsageError for anything else, and where i is not in 1 ... n.
Part parse_part(const std::string& text);

}  // namespace castor::cli
