#include "part.h"

#include <fmt/format.h>

#include <charconv>

#include "castor/error.h"

namespace castor::cli {

Part parse_part(const std::string& text) {
    Part part;
    const char* const end = text.data() + text.size();
    const auto [slash, number_error] = std::from_chars(text.data(), end, part.number);
    if (number_error == std::errc() && slash != end && *slash == '/') {
        const auto [last, count_error] = std::from_chars(slash + 1, end, part.count);
        if (count_error == std::errc() && last == end && part.number >= 1 && part.number <= part.count) return part;
    }
    throw UsageError(fmt::format("--part: \"{}\" is not i/n with i from 1 to n, such as 2/8", text));
}

}  // namespace castor::cli
