#include <algorithm>
#include <cmath>
#include <sstream>

#include "castor/shared/constants.h"
#include "scene/scene_limits.h"
#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

struct Words {
    bool importance_sampling = false, next_event_estimation = false, russian_roulette = false, balance = false;
};

Words read_params(XmlDocument& document, pugi::xml_node element) {
    Words words;
    if (!element) return words;
    std::istringstream text(read_string(document, element));
    for (std::string word; text >> word;) {
        if (equals_ignoring_case(word, "ImportanceSampling"))
            words.importance_sampling = true;
        else if (equals_ignoring_case(word, "NextEventEstimation"))
            words.next_event_estimation = true;
        else if (equals_ignoring_case(word, "RussianRoulette"))
            words.russian_roulette = true;
        else if (equals_ignoring_case(word, "MIS_BALANCE"))
            words.balance = true;
        else
            document.warn(element, fmt::format("<RendererParams>: \"{}\" is ignored: ImportanceSampling, "
                                               "NextEventEstimation, RussianRoulette and MIS_BALANCE are known",
                                               xml_excerpt(word)));
    }
    return words;
}

std::uint32_t read_min_depth(XmlDocument& document, pugi::xml_node camera) {
    const std::int64_t depth = read_integer(document, camera, "MinRecursionDepth", 0);
    check_child(document, depth >= 0 && depth <= kMaxRecursionDepth, camera, "MinRecursionDepth",
                "a number of 0 to 65535 bounces");
    return static_cast<std::uint32_t>(depth);
}

void warn_without(XmlDocument& document, pugi::xml_node camera, const char* name, const char* what) {
    if (const pugi::xml_node child = camera.child(name); child && !read_string(document, child).empty())
        document.warn(child, fmt::format("<{}> is ignored: the camera's picture is not {}", name, what));
}

}  // namespace

std::optional<PathTracing> read_path_tracing(XmlDocument& document, pugi::xml_node camera,
                                             std::uint32_t max_recursion_depth) {
    const pugi::xml_node renderer = camera.child("Renderer");
    const std::string name = renderer ? read_string(document, renderer) : std::string();
    if (!equals_ignoring_case(name, "PathTracing")) {
        if (!name.empty() && !equals_ignoring_case(name, "DirectLighting"))
            document.warn(renderer,
                          fmt::format("<Renderer>: \"{}\" is ignored: DirectLighting and PathTracing are known",
                                      xml_excerpt(name)));
        for (const char* unused : {"RendererParams", "MinRecursionDepth", "SplittingFactor", "SampleMaxVal"})
            warn_without(document, camera, unused, "path traced");
        return std::nullopt;
    }
    const Words words = read_params(document, camera.child("RendererParams"));
    PathTracing tracing;
    tracing.samples_brdf = words.importance_sampling;
    tracing.samples_lights = words.next_event_estimation || words.balance;
    tracing.weighs = words.balance;
    tracing.roulette_from.reset();
    // A ray to a light is one more bounce.
    tracing.bounces = std::min(max_recursion_depth + (tracing.samples_lights ? 1u : 0u), CASTOR_MOST_BOUNCES);
    const std::uint32_t min_depth = read_min_depth(document, camera);
    if (words.russian_roulette) {
        tracing.roulette_from = min_depth;
        tracing.bounces.reset();
    } else {
        warn_without(document, camera, "MinRecursionDepth", "made with RussianRoulette");
    }
    tracing.largest_sample = read_float(document, camera, "SampleMaxVal", tracing.largest_sample);
    check_child(document, tracing.largest_sample > 0.0f, camera, "SampleMaxVal", "a positive number");
    if (read_integer(document, camera, "SplittingFactor", 1) != 1)
        document.warn(camera.child("SplittingFactor"),
                      "<SplittingFactor> is ignored: a path has one ray at each bounce; more samples do the same");
    return tracing;
}

}  // namespace castor
