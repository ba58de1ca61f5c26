#pragma once

#include <CLI/CLI.hpp>

namespace castor::cli {

// Checks of options whose values are numbers. CLI11's own ranges let NaN pass.

/// A number in [least, most].
CLI::Validator number_in(double least, double most);
CLI::Validator finite_number();
/// A number above 0 that a float holds.
CLI::Validator positive_float();

}  // namespace castor::cli
