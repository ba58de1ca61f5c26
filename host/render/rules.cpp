#include "render/rules.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "castor/error.h"
#include "castor/shared/constants.h"

namespace castor {

namespace {

constexpr std::array kRuleSets = {
    std::pair{RuleSet::r2022, std::string_view("r2022")},
    std::pair{RuleSet::r795, std::string_view("r795")},
    std::pair{RuleSet::r2020, std::string_view("r2020")},
    std::pair{RuleSet::r2018, std::string_view("r2018")},
};

constexpr std::array kFilters = {
    std::pair{ReconstructionFilter::box, std::string_view("box")},
    std::pair{ReconstructionFilter::tent, std::string_view("tent")},
    std::pair{ReconstructionFilter::gaussian, std::string_view("gaussian")},
};

template <class Table, class Value>
std::string_view name_of(const Table& table, Value value) {
    return std::find_if(table.begin(), table.end(), [&](const auto& entry) { return entry.first == value; })->second;
}

template <class Table>
auto value_of(const Table& table, std::string_view word, std::string_view what) {
    std::string known;
    for (const auto& [value, name] : table) {
        if (name == word) return value;
        known += fmt::format("{}{}", known.empty() ? "" : ", ", name);
    }
    throw UsageError(fmt::format("there is no {} \"{}\"; there are {}", what, word, known));
}

}  // namespace

std::string_view to_string(RuleSet rules) { return name_of(kRuleSets, rules); }
RuleSet rule_set_from_string(std::string_view word) { return value_of(kRuleSets, word, "rule set"); }
std::string_view to_string(ReconstructionFilter filter) { return name_of(kFilters, filter); }
ReconstructionFilter reconstruction_filter_from_string(std::string_view word) {
    return value_of(kFilters, word, "reconstruction filter");
}

ReconstructionFilter RenderOptions::filter_in_use() const {
    return filter.value_or(samples_per_pixel == 0 ? ReconstructionFilter::box : ReconstructionFilter::gaussian);
}

Quantization quantization(RuleSet rules) {
    return rules == RuleSet::r2022 ? Quantization::round : Quantization::truncate;
}

std::uint32_t rule_flags(RuleSet rules) {
    switch (rules) {
        case RuleSet::r2022: return 0;
        case RuleSet::r795: return CASTOR_RULE_MIRROR_CONDUCTOR;
        case RuleSet::r2020:
            return CASTOR_RULE_MIRROR_ANY_MATERIAL | CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY | CASTOR_RULE_HIGHLIGHT_BEHIND;
        case RuleSet::r2018:
            return CASTOR_RULE_MIRROR_ANY_MATERIAL | CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY | CASTOR_RULE_SHADOW_ORIGIN_ALONG_RAY;
    }
    return 0;
}

}  // namespace castor
