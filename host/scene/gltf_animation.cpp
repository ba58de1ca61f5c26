// Samples animations of a glTF file at a time.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <set>
#include <string>

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
    /// Each keyframe has so many elements: one vector, or the weights of all targets.
    Sampler(GltfDocument& document, const GltfValue& value, std::size_t elements)
        : interpolation_(read_interpolation(value)),
          parts_(interpolation_ == Interpolation::cubic_spline ? 3 : 1),
          elements_(elements),
          times_(document, value.require("input")),
          values_(
              document, value.require("output"),
              GltfAccessor::Requirement{times_.count() * parts_ * elements_, "for the times of the sampler's input"}) {
        times_.require_components(1, 1);
        if (times_.count() == 0) times_.reject("its accessor has no element");
    }

    bool has_increasing_times() const {
        for (std::size_t i = 1; i < times_.count(); ++i)
            if (!(time_of(i) > time_of(i - 1))) return false;
        return true;
    }

    /// Returns the values at a time, whose elements must have so many components. Rotations, of four components, are
    /// interpolated on the sphere.
    std::vector<double> at(double time, std::size_t components) const {
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
        return components == 4 ? turn(from, to, place.share) : mix(from, to, place.share);
    }

private:
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
    std::size_t parts_, elements_;  // of a keyframe: the value, between two tangents of a spline
    GltfAccessor times_, values_;
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

/// `checked` are the accessors whose times are known to increase, or are warned of.
void apply_channel(GltfDocument& document, const GltfValue& animation, const GltfValue& channel, double time,
                   std::set<std::uint64_t>& checked, std::vector<GltfPose>& poses) {
    const GltfValue target = channel.require("target");
    const auto node = target.find("node");
    if (!node) return;  // of an extension
    const std::size_t number = node->index_of("nodes");
    GltfPose& pose = poses[number];
    const GltfValue samplers = animation.require("samplers"), index = channel.require("sampler");
    if (index.whole() >= samplers.size())
        index.reject(fmt::format("{} is no index of samplers, of which there are {}", index.whole(), samplers.size()));
    const GltfValue path = target.require("path");
    constexpr std::array kPaths = {"weights", "rotation", "translation", "scale"};
    if (std::find(kPaths.begin(), kPaths.end(), path.text()) == kPaths.end())
        return document.warn_at(path.path(), fmt::format("\"{}\" is not animated", path.text().substr(0, 40)));
    const bool moves_weights = path.text() == "weights";
    const GltfValue used = samplers.at(index.whole());
    const Sampler sampler(document, used,
                          moves_weights ? target_count(document, document.element("nodes", number)) : 1);
    if (checked.insert(used.require("input").whole()).second && !sampler.has_increasing_times())
        document.warn_at(used.path(), "the times of its keyframes do not increase");
    if (moves_weights) {
        const std::vector<double> weights = sampler.at(time, 1);
        pose.weights.emplace(weights.begin(), weights.end());
    } else if (path.text() == "rotation") {
        const std::vector<double> q = sampler.at(time, 4);
        const glm::dvec4 rotation(q[0], q[1], q[2], q[3]);
        if (!(glm::length(rotation) > 0.0)) channel.reject("its rotation is (0, 0, 0, 0) at that time");
        pose.rotation = glm::normalize(rotation);
        pose.matrix.reset();
    } else {
        const std::vector<double> v = sampler.at(time, 3);
        (path.text() == "scale" ? pose.scale : pose.translation) = {v[0], v[1], v[2]};
        pose.matrix.reset();
    }
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

void animate_gltf(GltfDocument& document, double time_seconds, const std::optional<std::string>& animation,
                  std::vector<GltfPose>& poses) {
    const std::size_t count = document.count("animations");
    const std::vector<std::size_t> chosen = find_animations(document, animation.value_or(count > 0 ? "1" : "all"));
    if (count == 0) document.warn("has no animation: every time shows the same");
    if (count > 1 && !animation)
        document.warn(fmt::format("has {} animations, of which the first is shown; --animation chooses others", count));
    std::set<std::uint64_t> checked;
    for (const std::size_t i : chosen) {
        const GltfValue applied = document.element("animations", i), channels = applied.require("channels");
        for (std::size_t k = 0; k < channels.size(); ++k)
            apply_channel(document, applied, channels.at(k), time_seconds, checked, poses);
    }
}

}  // namespace castor
