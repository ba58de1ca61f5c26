#include "render/rules.h"

#include <array>

#include "base/name_table.h"
#include "castor/shared/constants.h"

namespace castor {

namespace {

constexpr std::array kRuleSets = {
    Named<RuleSet>{RuleSet::r2022, "r2022"},
    Named<RuleSet>{RuleSet::r795, "r795"},
    Named<RuleSet>{RuleSet::r2020, "r2020"},
    Named<RuleSet>{RuleSet::r2018, "r2018"},
};

constexpr std::array kFilters = {
    Named<ReconstructionFilter>{ReconstructionFilter::box, "box"},
    Named<ReconstructionFilter>{ReconstructionFilter::tent, "tent"},
    Named<ReconstructionFilter>{ReconstructionFilter::gaussian, "gaussian"},
};

constexpr std::array kOrders = {
    Named<RenderOrder>{RenderOrder::pieces, "pieces"},
    Named<RenderOrder>{RenderOrder::progressive, "progressive"},
};

constexpr std::array kSampleOrders = {
    Named<SampleOrder>{SampleOrder::pixel, "pixel"},
    Named<SampleOrder>{SampleOrder::z, "z"},
};

constexpr std::array kIntegrators = {
    Named<Integrator>{Integrator::whitted, "whitted"},
    Named<Integrator>{Integrator::path, "path"},
};

constexpr std::array kLightChoices = {
    Named<LightChoice>{LightChoice::tree, "tree"},
    Named<LightChoice>{LightChoice::uniform, "uniform"},
};

}  // namespace

std::string_view to_string(RuleSet rules) {
    return name_of(kRuleSets, rules);
}
RuleSet rule_set_from_string(std::string_view word) {
    return value_of(kRuleSets, word, "rule set");
}
std::string_view to_string(Integrator integrator) {
    return name_of(kIntegrators, integrator);
}
Integrator integrator_from_string(std::string_view word) {
    return value_of(kIntegrators, word, "integrator");
}
std::string_view to_string(LightChoice choice) {
    return name_of(kLightChoices, choice);
}
LightChoice light_choice_from_string(std::string_view word) {
    return value_of(kLightChoices, word, "choice of lights");
}
std::string_view to_string(ReconstructionFilter filter) {
    return name_of(kFilters, filter);
}
ReconstructionFilter reconstruction_filter_from_string(std::string_view word) {
    return value_of(kFilters, word, "reconstruction filter");
}
std::string_view to_string(RenderOrder order) {
    return name_of(kOrders, order);
}
RenderOrder render_order_from_string(std::string_view word) {
    return value_of(kOrders, word, "order of work");
}

std::string_view to_string(SampleOrder order) {
    return name_of(kSampleOrders, order);
}
SampleOrder sample_order_from_string(std::string_view word) {
    return value_of(kSampleOrders, word, "order of samples");
}

ReconstructionFilter RenderOptions::filter_in_use() const {
    return filter.value_or(samples_per_pixel == 0 ? ReconstructionFilter::box : ReconstructionFilter::gaussian);
}

std::optional<PathTracing> RenderOptions::path_tracing_in_use(const Camera& camera) const {
    const Integrator own = camera.path_tracing ? Integrator::path : Integrator::whitted;
    if (integrator.value_or(own) != Integrator::path) return std::nullopt;
    PathTracing used = camera.path_tracing.value_or(PathTracing());
    if (bounces) used.bounces = bounces;
    if (largest_sample) used.largest_sample = *largest_sample;
    if (light_choice) used.light_choice = *light_choice;
    return used;
}

Quantization quantization(RuleSet rules) {
    return rules == RuleSet::r2022 ? Quantization::round : Quantization::truncate;
}

std::uint32_t rule_flags(RuleSet rules) {
    switch (rules) {
        case RuleSet::r2022:
            return 0;
        case RuleSet::r795:
            return CASTOR_RULE_MIRROR_CONDUCTOR | CASTOR_RULE_LAMP_AT_PIXEL_POINT | CASTOR_RENDER_CULL_BACK_FACES;
        case RuleSet::r2020:
            return CASTOR_RULE_MIRROR_ANY_MATERIAL | CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY |
                   CASTOR_RULE_HIGHLIGHT_BEHIND | CASTOR_RULE_TEXEL_IS_DIFFUSE_TERM;
        case RuleSet::r2018:
            return CASTOR_RULE_MIRROR_ANY_MATERIAL | CASTOR_RULE_MIRROR_ORIGIN_ALONG_RAY |
                   CASTOR_RULE_SHADOW_ORIGIN_ALONG_RAY;
    }
    return 0;
}

}  // namespace castor
