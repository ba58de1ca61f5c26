#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace castor {

/// How many names a message lists where a file may have any number of them.
inline constexpr std::size_t kMostNamesListed = 10;

/// Returns the names, with commas between; of more than `most` the first ones, and how many more there are:
/// "a, b and 7 more".
std::string list_some(const std::vector<std::string>& names, std::size_t most = kMostNamesListed);

}  // namespace castor
