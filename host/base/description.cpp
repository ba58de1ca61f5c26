#include "base/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace castor {

std::vector<std::string> lines_of(const std::string& description) {
    std::vector<std::string> lines;
    std::istringstream stream(description);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

std::string difference(const std::string& found, const std::string& expected, const std::string& expected_name) {
    const std::vector<std::string> a = lines_of(found), b = lines_of(expected);
    for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
        const std::string left = i < a.size() ? a[i] : "nothing", right = i < b.size() ? b[i] : "nothing";
        if (left != right) return fmt::format("it has \"{}\", {} \"{}\"", left, expected_name, right);
    }
    return "they differ";
}

}  // namespace castor
