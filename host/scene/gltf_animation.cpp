// Samples animations of a glTF file at a time.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "castor/error.h"
#include "scene/gltf_accessor.h"
#include "scene/gltf_choice.h"
#include "scene/gltf_nodes.h"

namespace castor {

namespace {

enum class Interpolation { step, linear, cubic_spline };

/// A place between two keyframes: `share` of the way from `first` to the next one, which is `seconds` later.
struct Place {
    std::size_t first = 0;
    double share = 0.0, seconds = 0.0;
};

class Sampler {
public:
    /// Each keyframe has so many elements: one vector, or the weights of all targets; nullopt: as many as there are.
    Sampler(GltfDocument& document, const GltfValue& value, std::optional<std::size_t> elements)
        : interpolation_(read_interpolation(value)),
          parts_(interpolation_ == Interpolation::cubic_spline ? 3 : 1),
          times_(document, value.require("input")),
          values_(document, value.require("output"), values_for(elements)),
          elements_(elements.value_or(values_.count() / parts_ / std::max<std::size_t>(times_.count(), 1))) {
        times_.require_components(1, 1);
        if (times_.count() == 0) times_.reject("its accessor has no element");
    }

    bool is_spline() const { return interpolation_ == Interpolation::cubic_spline; }

    bool has_increasing_times() const {
        for (std::size_t i = 1; i < times_.count(); ++i)
            if (!(time_of(i) > time_of(i - 1))) return false;
        return true;
    }

    /// Returns the values at a time, whose elements must have so many components; nullopt: any. Rotations, of four
    /// components, are interpolated on the sphere.
    std::vector<double> at(double time, std::optional<std::size_t> required, bool is_rotation) const {
        const std::size_t components = required.value_or(values_.component_count());
        values_.require_components(components, components);
        const Place place = find(time);
        const auto read = [&](std::size_t key, std::size_t part) {
            std::vector<double> result;
            for (std::size_t e = 0; e < elements_; ++e) {
                const auto element = values_.get((key * parts_ + part) * elements_ + e);
                result.insert(result.end(), element.begin(), element.begin() + static_cast<std::ptrdiff_t>(components));
            }
            return result;
        };
        const std::size_t middle = parts_ / 2;
        std::vector<double> from = read(place.first, middle);
        if (place.share == 0.0 || interpolation_ == Interpolation::step) return from;
        const std::vector<double> to = read(place.first + 1, middle);
        if (interpolation_ == Interpolation::cubic_spline)
            return spline(from, read(place.first, 2), to, read(place.first + 1, 0), place);
        return is_rotation ? turn(from, to, place.share) : mix(from, to, place.share);
    }

private:
    std::optional<GltfAccessor::Requirement> values_for(std::optional<std::size_t> elements) const {
        if (!elements) return std::nullopt;
        return GltfAccessor::Requirement{times_.count() * parts_ * *elements, "for the times of the sampler's input"};
    }

    static Interpolation read_interpolation(const GltfValue& sampler) {
        const std::string name = sampler.text("interpolation", "LINEAR");
        if (name == "STEP") return Interpolation::step;
        if (name == "CUBICSPLINE") return Interpolation::cubic_spline;
        if (name != "LINEAR") sampler.require("interpolation").reject("is none of STEP, LINEAR and CUBICSPLINE");
        return Interpolation::linear;
    }

    double time_of(std::size_t i) const { return double{times_.get(i)[0]}; }

    Place find(double time) const {
        std::size_t low = 0, high = times_.count() - 1;
        if (time <= time_of(low)) return {low};
        if (time >= time_of(high)) return {high};
        while (high - low > 1) {  // time_of(low) <= time < time_of(high)
            const std::size_t middle = low + (high - low) / 2;
            (time_of(middle) <= time ? low : high) = middle;
        }
        const double seconds = time_of(high) - time_of(low);
        return {low, (time - time_of(low)) / seconds, seconds};
    }

    static std::vector<double> mix(std::vector<double> from, const std::vector<double>& to, double share) {
        for (std::size_t i = 0; i < from.size(); ++i) from[i] += share * (to[i] - from[i]);
        return from;
    }

    /// Shoemake 1985, "Animating Rotation with Quaternion Curves", on the shorter way.
    static std::vector<double> turn(std::vector<double> from, std::vector<double> to, double share) {
        double cosine = 0.0;
        for (std::size_t i = 0; i < 4; ++i) cosine += from[i] * to[i];
        if (cosine < 0.0)
            for (double& x : to) x = -x;
        cosine = std::abs(cosine);
        constexpr double kNearlyEqual = 0.9999;
        if (cosine > kNearlyEqual) return mix(std::move(from), to, share);
        const double angle = std::acos(cosine), sine = std::sin(angle);
        const double a = std::sin((1.0 - share) * angle) / sine, b = std::sin(share * angle) / sine;
        for (std::size_t i = 0; i < 4; ++i) from[i] = a * from[i] + b * to[i];
        return from;
    }

    static std::vector<double> spline(const std::vector<double>& from, const std::vector<double>& leaving,
                                      const std::vector<double>& to, const std::vector<double>& arriving,
                                      const Place& place) {
        const double t = place.share, t2 = t * t, t3 = t2 * t, d = place.seconds;
        std::vector<double> result(from.size());
        for (std::size_t i = 0; i < from.size(); ++i)
            result[i] = (2 * t3 - 3 * t2 + 1) * from[i] + d * (t3 - 2 * t2 + t) * leaving[i] +
                        (3 * t2 - 2 * t3) * to[i] + d * (t3 - t2) * arriving[i];
        return result;
    }

    Interpolation interpolation_;
    std::size_t parts_;  // of a keyframe: the value, between two tangents of a spline
    GltfAccessor times_, values_;
    std::size_t elements_;  // of a part
};

/// Returns the number of morph targets of a node's mesh, of its first primitive.
std::size_t target_count(const GltfDocument& document, const GltfValue& node) {
    const auto mesh = node.find("mesh");
    if (!mesh) return 0;
    const GltfValue primitives = document.element("meshes", mesh->index_of("meshes")).require("primitives");
    if (primitives.size() == 0) return 0;
    const auto targets = primitives.at(0).find("targets");
    return targets ? targets->size() : 0;
}

/// What a channel moves.
struct Target {
    std::string pointer;                    // a JSON pointer
    std::optional<std::size_t> elements;    // of a keyframe; nullopt: as many as there are
    std::optional<std::size_t> components;  // of each; nullopt: any number
    bool is_rotation = false;
};

/// Returns the target of a channel; nullopt where it is of an extension that is not read, or is warned of.
std::optional<Target> read_target(GltfDocument& document, const GltfValue& value) {
    const GltfValue path = value.require("path");
    const auto node = value.find("node");
    if (path.text() == "pointer") {  // KHR_animation_pointer
        const auto extension = value.find_extension("KHR_animation_pointer");
        if (!extension) return std::nullopt;
        const GltfValue pointer = extension->require("pointer");
        const std::string& text = pointer.text();
        constexpr std::array kRoots = {"/nodes/", "/meshes/", "/materials/", "/cameras/", "/extensions/"};
        if (std::ranges::none_of(kRoots, [&](const char* root) { return text.starts_with(root); })) {
            document.warn_at(pointer.path(), fmt::format("\"{}\" is not animated", text.substr(0, 40)));
            return std::nullopt;
        }
        if (text.starts_with("/nodes/") && text.ends_with("/rotation")) return Target{text, 1, 4, true};
        return Target{text, text.ends_with("/weights") ? std::nullopt : std::optional<std::size_t>(1), std::nullopt};
    }
    if (!node) return std::nullopt;
    const std::size_t number = node->index_of("nodes");
    const std::string pointer = fmt::format("/nodes/{}/{}", number, path.text());
    if (path.text() == "weights") return Target{pointer, target_count(document, document.element("nodes", number)), 1};
    if (path.text() == "rotation") return Target{pointer, 1, 4, true};
    if (path.text() == "translation" || path.text() == "scale") return Target{pointer, 1, 3};
    document.warn_at(path.path(), fmt::format("\"{}\" is not animated", path.text().substr(0, 40)));
    return std::nullopt;
}

/// Returns numbers as the JSON of what a pointer names. Flags are numbers in an animation.
nlohmann::json json_of(const std::vector<double>& values, std::string_view pointer) {
    if (values.size() > 1 || pointer.ends_with("/weights")) return values;
    if (pointer.ends_with("/visible") || pointer.ends_with("/doubleSided")) return values.at(0) != 0.0;
    return values.at(0);
}

/// `checked` are the accessors whose times are known to increase, or are warned of.
void apply_channel(GltfDocument& document, const GltfValue& animation, const GltfValue& channel, double time,
                   std::set<std::uint64_t>& checked) {
    const auto target = read_target(document, channel.require("target"));
    if (!target) return;
    const GltfValue samplers = animation.require("samplers"), index = channel.require("sampler");
    if (index.whole() >= samplers.size())
        index.reject(fmt::format("{} is no index of samplers, of which there are {}", index.whole(), samplers.size()));
    const GltfValue used = samplers.at(index.whole());
    const Sampler sampler(document, used, target->elements);
    if (checked.insert(used.require("input").whole()).second && !sampler.has_increasing_times())
        document.warn_at(used.path(), "the times of its keyframes do not increase");
    const std::vector<double> values = sampler.at(time, target->components, target->is_rotation);
    if (target->is_rotation && std::ranges::all_of(values, [](double x) { return x == 0.0; }))
        channel.reject("its rotation is (0, 0, 0, 0) at that time");
    if (!document.set(target->pointer, json_of(values, target->pointer)))
        return document.warn_at(channel.path(), "moves what the file does not have");
    if (sampler.is_spline()) document.limit(target->pointer);
    const std::size_t member = target->pointer.rfind('/');
    const std::string_view name = std::string_view(target->pointer).substr(member);
    if (target->pointer.starts_with("/nodes/") && (name == "/translation" || name == "/rotation" || name == "/scale"))
        document.set(target->pointer.substr(0, member) + "/matrix", std::nullopt);
}

/// Returns the indices of the animations that a word means: see LoadOptions::animation.
std::vector<std::size_t> find_animations(const GltfDocument& document, const std::string& word) {
    if (word != "all")
        return choose_gltf_elements(document, document.root().find("animations"), word, "animation", "\"all\", ");
    std::vector<std::size_t> all(document.count("animations"));
    std::iota(all.begin(), all.end(), std::size_t{0});
    return all;
}

}  // namespace

void animate_gltf(GltfDocument& document, double time_seconds, const std::optional<std::string>& animation) {
    const std::size_t count = document.count("animations");
    const std::vector<std::size_t> chosen = find_animations(document, animation.value_or(count > 0 ? "1" : "all"));
    if (count == 0) document.warn("has no animation: every time shows the same");
    if (count > 1 && !animation)
        document.warn(fmt::format("has {} animations, of which the first is shown; --animation chooses others", count));
    std::set<std::uint64_t> checked;
    for (const std::size_t i : chosen) {
        const GltfValue applied = document.element("animations", i), channels = applied.require("channels");
        for (std::size_t k = 0; k < channels.size(); ++k)
            apply_channel(document, applied, channels.at(k), time_seconds, checked);
    }
}

}  // namespace castor
