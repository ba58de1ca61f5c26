#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

#include "castor/error.h"

namespace castor {

/// A table of names is an array of these, each value and each name once.
template <class Value>
using Named = std::pair<Value, std::string_view>;

/// The name of a value that is in the table.
template <class Table, class Value>
std::string_view name_of(const Table& table, Value value) {
    return std::find_if(table.begin(), table.end(), [&](const auto& entry) { return entry.first == value; })->second;
}

/// The value of a name. Throws UsageError for any other word: "there is no `what` "word"; there are" and all names.
template <class Table>
auto value_of(const Table& table, std::string_view word, std::string_view what) {
    std::string known;
    for (const auto& [value, name] : table) {
        if (name == word) return value;
        known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
    }
    throw UsageError(fmt::format("there is no {} \"{}\"; there are {}", what, word, known));
}

}  // namespace castor
