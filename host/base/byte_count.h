#pragma once

#include <cstdint>
#include <string>

namespace castor {

/// "1.5 GiB", "12 KiB", "7 bytes".
std::string byte_count(std::uint64_t bytes);

}  // namespace castor
