#pragma once

#include <string>
#include <vector>

namespace castor {

// A description tells all that a result in a file depends on, a line each: its name, a blank, its value.

std::vector<std::string> lines_of(const std::string& description);

/// Tells the first line in which two descriptions differ. `expected_name`: what is expected, for people.
std::string difference(const std::string& found, const std::string& expected, const std::string& expected_name);

}  // namespace castor
