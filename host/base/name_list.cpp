#include "base/name_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>

namespace castor {

std::string list_some(const std::vector<std::string>& names, std::size_t most) {
    const std::span listed = std::span(names).first(std::min(names.size(), most));
    const std::string more = names.size() > most ? fmt::format(" and {} more", names.size() - most) : "";
    return fmt::format("{}{}", fmt::join(listed, ", "), more);
}

}  // namespace castor
