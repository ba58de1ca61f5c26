#include "number_check.h"

#include <fmt/format.h>

#include <limits>
#include <string>

namespace castor::cli {

namespace {

/// `description`: for the help. `expected`: what a message says of other values.
CLI::Validator check_of_number(double least, double most, const std::string& description, const std::string& expected) {
    const auto check = [=](const std::string& word) {
        double value = 0.0;
        const bool is_good = CLI::detail::lexical_cast(word, value) && value >= least && value <= most;
        return is_good ? std::string() : fmt::format("{} is not {}", word, expected);
    };
    return {check, description};
}

}  // namespace

CLI::Validator number_in(double least, double most) {
    return check_of_number(least, most, fmt::format("FLOAT in [{:g} - {:g}]", least, most),
                           fmt::format("a number from {:g} to {:g}", least, most));
}

CLI::Validator finite_number() {
    constexpr double kMost = std::numeric_limits<double>::max();
    return check_of_number(-kMost, kMost, "FINITE", "a finite number");
}

CLI::Validator positive_float() {
    using Limits = std::numeric_limits<float>;
    return check_of_number(double{Limits::min()}, double{Limits::max()}, "POSITIVE",
                           "a positive number that 32 bits hold");
}

}  // namespace castor::cli
