#include "scene/light_tree.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "castor/shared/constants.h"
#include "image/srgb.h"
#include "scene/environment_table.h"

namespace castor {

namespace {

using glm::dvec3;

constexpr double kPi = std::numbers::pi;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kBins = 12;
constexpr std::size_t kGrain = 2048;  // lights of a subtree that has a task of its own
// Of a light that gives anything, as a share of all flux, so that no device takes it for 0.
constexpr double kLeastFlux = 0x1p-90;

glm::vec3 vec3_of(const float (&v)[3]) {
    return {v[0], v[1], v[2]};
}

struct LightBox {
    dvec3 lower{kInfinity}, upper{-kInfinity};

    void extend(const dvec3& point) {
        lower = glm::min(lower, point);
        upper = glm::max(upper, point);
    }
    void extend(const LightBox& box) {
        lower = glm::min(lower, box.lower);
        upper = glm::max(upper, box.upper);
    }
    dvec3 middle() const { return 0.5 * (lower + upper); }
};

/// Directions within an angle of an axis.
struct Cone {
    dvec3 axis{0.0, 0.0, 1.0};
    double angle = -1.0;  // less than 0: none

    static Cone all() { return {{0.0, 0.0, 1.0}, kPi}; }
    double cosine() const { return angle >= kPi ? -1.0 : std::cos(angle); }
};

/// Returns a cone that has all directions of two. (PBRT-4 calls it DirectionCone::Union.)
Cone joined(const Cone& a, const Cone& b) {
    if (a.angle < b.angle) return joined(b, a);
    if (b.angle < 0.0 || a.angle >= kPi) return a;
    const double between = std::acos(std::clamp(glm::dot(a.axis, b.axis), -1.0, 1.0));
    if (between + b.angle <= a.angle) return a;
    const double angle = 0.5 * (a.angle + between + b.angle);
    const dvec3 aside = b.axis - glm::dot(a.axis, b.axis) * a.axis;
    const double length = glm::length(aside);
    if (angle >= kPi || !(length > 0.0)) return Cone::all();
    const double turn = angle - a.angle;
    return {glm::normalize(std::cos(turn) * a.axis + (std::sin(turn) / length) * aside), angle};
}

/// The same for directions that stand for their opposites, too.
Cone joined_lines(const Cone& a, Cone b) {
    if (glm::dot(a.axis, b.axis) < 0.0) b.axis = -b.axis;
    return joined(a, b);
}

/// What a node says, in double precision.
struct LightBounds {
    LightBox box;  // of lights without a place: of the ends of unit vectors along which their light travels
    Cone normals;
    double emission = 0.0;  // the further angle
    double flux = 0.0;
    bool has_both_sides = false;
    bool is_far = false;

    void join(const LightBounds& other) {
        if (normals.angle < 0.0) {
            *this = other;
            return;
        }
        box.extend(other.box);
        has_both_sides = has_both_sides || other.has_both_sides;
        normals = has_both_sides ? joined_lines(normals, other.normals) : joined(normals, other.normals);
        emission = std::max(emission, other.emission);
        flux += other.flux;
    }
};

double brightness(const float (&color)[3]) {
    return (std::abs(double{color[0]}) + std::abs(double{color[1]}) + std::abs(double{color[2]})) / 3.0;
}

void set_mesh(LightBounds& bounds, const shared::Light& light, std::span<const shared::Emitter> emitters) {
    bounds.normals.angle = -1.0;
    for (const shared::Emitter& emitter : emitters) {
        const dvec3 corner(vec3_of(emitter.corner)), u(vec3_of(emitter.edge_u)), v(vec3_of(emitter.edge_v));
        bounds.box.extend(corner);
        bounds.box.extend(corner + u);
        bounds.box.extend(corner + v);
        const dvec3 normal = glm::cross(u, v);
        const double length = glm::length(normal);
        if (length > 0.0) bounds.normals = joined_lines(bounds.normals, {normal / length, 0.0});
    }
    if (bounds.normals.angle < 0.0) bounds.normals = Cone::all();
    bounds.emission = 0.5 * kPi;
    bounds.has_both_sides = true;
    const double cosine = std::max(0.0, bounds.normals.cosine());
    bounds.flux = brightness(light.intensity) * double{light.size} * 0.5 * (1.0 + cosine);
}

void set_sphere(LightBounds& bounds, const shared::Light& light, const shared::Instance* instance) {
    dvec3 center(vec3_of(light.position)), half(light.size);
    if (instance) {
        const dvec3 in_object = center;
        for (int row = 0; row < 3; ++row) {
            const float(&m)[4] = instance->to_world[row];
            const dvec3 linear(m[0], m[1], m[2]);
            center[row] = glm::dot(linear, in_object) + double{m[3]};
            half[row] = double{light.size} * glm::length(linear);
        }
    }
    bounds.box = {center - half, center + half};
    const double disc = kPi / 3.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
    bounds.flux = brightness(light.intensity) * disc;
}

LightBounds bounds_of(const SceneArrays& arrays, const shared::Light& light, std::span<const Image> images) {
    LightBounds bounds;
    const dvec3 position(vec3_of(light.position)), direction(vec3_of(light.direction));
    bounds.normals = Cone::all();
    bounds.flux = brightness(light.intensity);
    switch (light.kind) {
        case CASTOR_LIGHT_DIRECTIONAL:
            bounds.is_far = true;
            bounds.normals = {glm::normalize(direction), std::acos(1.0 - double{light.size})};
            bounds.box.extend(bounds.normals.axis);
            return bounds;
        case CASTOR_LIGHT_ENVIRONMENT:
            bounds.is_far = true;
            bounds.box.extend(bounds.normals.axis);
            bounds.flux = kPi * mean_radiance(images[light.first], light.mapping == CASTOR_ENVIRONMENT_PROBE
                                                                       ? EnvironmentMapping::probe
                                                                       : EnvironmentMapping::latlong);
            return bounds;
        case CASTOR_LIGHT_SPOT: {
            // Where the light is dimmed it counts less the farther out it is, to nothing at a right angle.
            const double coverage = std::acos(std::clamp(double{light.cos_coverage}, -1.0, 1.0));
            const double falloff = std::acos(std::clamp(double{light.cos_falloff}, -1.0, 1.0));
            bounds.emission = std::clamp(coverage - falloff, 0.0, 0.5 * kPi);
            bounds.normals = {glm::normalize(direction), coverage - bounds.emission};
            bounds.box.extend(position);
            return bounds;
        }
        case CASTOR_LIGHT_AREA: {
            const dvec3 normal = glm::normalize(direction), tangent = glm::normalize(dvec3(vec3_of(light.tangent)));
            const double half = 0.5 * double{light.size};
            const dvec3 u = half * tangent, v = half * glm::cross(normal, tangent);
            for (const dvec3& corner : {u + v, u - v, v - u, -u - v}) bounds.box.extend(position + corner);
            bounds.normals = {normal, 0.0};
            bounds.emission = 0.5 * kPi;
            bounds.has_both_sides = true;
            bounds.flux *= 4.0 * half * half;
            return bounds;
        }
        case CASTOR_LIGHT_MESH:
            if (light.count > 0)
                set_mesh(bounds, light, std::span(arrays.emitters).subspan(light.first, light.count));
            else
                bounds.flux = 0.0;
            break;
        case CASTOR_LIGHT_SPHERE:
            set_sphere(bounds, light, light.first != 0 ? &arrays.instances[light.first] : nullptr);
            break;
        default:
            bounds.box.extend(position);
            return bounds;
    }
    if (bounds.box.lower.x > bounds.box.upper.x) bounds.box.extend(position);
    bounds.box.extend(LightBox{bounds.box.lower + direction, bounds.box.upper + direction});  // its motion
    return bounds;
}

/// The measure of the directions to which a node sends light (Conty Estevez, Kulla 2018, equation 1).
double measure_of_directions(const LightBounds& bounds) {
    const double o = bounds.normals.angle, w = std::min(o + bounds.emission, kPi);
    return 2.0 * kPi * (1.0 - std::cos(o)) +
           0.5 * kPi * (2.0 * w * std::sin(o) - std::cos(o - 2.0 * w) - 2.0 * o * std::sin(o) + std::cos(o));
}

double cost_of(const LightBounds& bounds) {
    const dvec3 diagonal = bounds.box.upper - bounds.box.lower;
    return bounds.flux * glm::dot(diagonal, diagonal) * measure_of_directions(bounds);
}

/// Returns the mean of a picture's channels as linear values.
double mean_of_srgb(const Image& image) {
    std::array<std::size_t, 256> counts{};
    for (const std::uint8_t byte : image.bytes) ++counts[byte];
    double sum = 0.0;
    for (std::size_t byte = 0; byte < counts.size(); ++byte)
        sum += static_cast<double>(counts[byte]) * double{linear_of_srgb(static_cast<std::uint8_t>(byte))};
    return image.bytes.empty() ? 1.0 : sum / static_cast<double>(image.bytes.size());
}

struct Split {
    double cost = kInfinity;
    int axis = -1;
    std::size_t bin = 0;  // the first one of the second half
};

class Builder {
public:
    Builder(SceneArrays& arrays, std::span<const Image> images) : arrays_(arrays), of_light_(arrays.lights.size()) {
        tbb::parallel_for(std::size_t{0}, of_light_.size(),
                          [&](std::size_t i) { of_light_[i] = bounds_of(arrays, arrays.lights[i], images); });
        std::vector<double> means(images.size(), -1.0);
        for (std::size_t i = 0; i < of_light_.size(); ++i) {
            const std::uint32_t principled = arrays.lights[i].principled;
            if (principled == CASTOR_INVALID_INDEX) continue;
            const std::uint32_t texture = arrays.principled_materials[principled].texture[CASTOR_SLOT_EMISSION];
            const std::uint32_t image = arrays.textures[texture].image;
            if (means[image] < 0.0) means[image] = mean_of_srgb(images[image]);
            of_light_[i].flux *= means[image];
        }
        double total = 0.0;
        for (const LightBounds& bounds : of_light_) total += bounds.flux;
        for (LightBounds& bounds : of_light_)
            if (bounds.flux > 0.0) bounds.flux = std::max(bounds.flux / total, kLeastFlux);
    }

    void build() {
        std::vector<std::uint32_t> order, far;
        for (std::uint32_t i = 0; i < of_light_.size(); ++i) (of_light_[i].is_far ? far : order).push_back(i);
        const std::size_t placed = order.size();
        order.insert(order.end(), far.begin(), far.end());
        arrays_.light_nodes.resize(2 * order.size() - 1);
        const std::span<std::uint32_t> all(order);
        if (placed == 0 || placed == order.size()) {
            write(0, all, 1, 0, 0);
        } else {
            const LightBounds bounds = write_pair(1, all.first(placed), all.subspan(placed), 0, 0);
            store(0, bounds, 1);
        }
    }

private:
    /// Writes the tree over some lights to node `at` and those from `free` on. `trail` leads there, down `level` nodes.
    LightBounds write(std::uint32_t at, std::span<std::uint32_t> lights, std::uint32_t free, std::uint32_t level,
                      std::uint32_t trail) {
        if (lights.size() == 1) {
            const LightBounds& bounds = of_light_[lights[0]];
            arrays_.lights[lights[0]].trail = trail;
            store(at, bounds, lights[0]);
            arrays_.light_nodes[at].flags |= CASTOR_LIGHT_NODE_LEAF;
            return bounds;
        }
        const std::size_t half = divide(lights, CASTOR_LIGHT_LEVELS - level - 1);
        const LightBounds bounds = write_pair(free, lights.first(half), lights.subspan(half), level, trail);
        store(at, bounds, free);
        return bounds;
    }

    /// Writes two trees, their roots to nodes `free` and `free` + 1.
    LightBounds write_pair(std::uint32_t free, std::span<std::uint32_t> first, std::span<std::uint32_t> second,
                           std::uint32_t level, std::uint32_t trail) {
        LightBounds of_first, of_second;
        const auto write_first = [&] { of_first = write(free, first, free + 2, level + 1, trail); };
        const auto write_second = [&] {
            const auto behind = static_cast<std::uint32_t>(free + 2 * first.size());
            of_second = write(free + 1, second, behind, level + 1, trail | 1u << level);
        };
        if (first.size() + second.size() >= kGrain) {
            tbb::parallel_invoke(write_first, write_second);
        } else {
            write_first();
            write_second();
        }
        // Of the root of both kinds nothing is read but its children.
        if (of_first.is_far != of_second.is_far) return of_first;
        of_first.join(of_second);
        return of_first;
    }

    /// Puts lights in an order in which those of the first half come first, and returns how many these are. Each half
    /// fits a tree of so many levels below its root.
    std::size_t divide(std::span<std::uint32_t> lights, std::uint32_t levels) const {
        LightBox middles;
        for (const std::uint32_t light : lights) middles.extend(of_light_[light].box.middle());
        const dvec3 extent = middles.upper - middles.lower;
        const int longest = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        if (extent[longest] > 0.0) {
            Split best;
            for (int axis = 0; axis < 3; ++axis) {
                if (!(extent[axis] > 0.0)) continue;
                const Split split = best_split(lights, middles, axis, extent[longest] / extent[axis]);
                if (split.cost < best.cost) best = split;
            }
            if (best.axis >= 0) {
                const auto is_first = [&](std::uint32_t light) { return bin_of(light, middles, best.axis) < best.bin; };
                const auto second = std::stable_partition(lights.begin(), lights.end(), is_first);
                const auto half = static_cast<std::size_t>(second - lights.begin());
                const std::size_t most = std::max(half, lights.size() - half);
                if (static_cast<std::uint32_t>(std::bit_width(most - 1)) <= levels) return half;
            }
        }
        const auto is_before = [&](std::uint32_t a, std::uint32_t b) {
            const double of_a = of_light_[a].box.middle()[longest], of_b = of_light_[b].box.middle()[longest];
            return of_a < of_b || (of_a == of_b && a < b);
        };
        const std::size_t half = lights.size() / 2;
        std::nth_element(lights.begin(), lights.begin() + static_cast<std::ptrdiff_t>(half), lights.end(), is_before);
        // In an order that no implementation of the standard library decides.
        std::sort(lights.begin(), lights.begin() + static_cast<std::ptrdiff_t>(half));
        std::sort(lights.begin() + static_cast<std::ptrdiff_t>(half), lights.end());
        return half;
    }

    std::size_t bin_of(std::uint32_t light, const LightBox& middles, int axis) const {
        const double part =
            (of_light_[light].box.middle()[axis] - middles.lower[axis]) / (middles.upper[axis] - middles.lower[axis]);
        return std::min(static_cast<std::size_t>(part * kBins), kBins - 1);
    }

    Split best_split(std::span<const std::uint32_t> lights, const LightBox& middles, int axis, double slimness) const {
        std::array<LightBounds, kBins> bins;
        for (LightBounds& bin : bins) bin.normals.angle = -1.0;
        for (const std::uint32_t light : lights) bins[bin_of(light, middles, axis)].join(of_light_[light]);
        std::array<double, kBins> cost_before{};  // of all lights in earlier bins
        LightBounds before = bins[0];
        for (std::size_t bin = 1; bin < kBins; ++bin) {
            cost_before[bin] = before.normals.angle < 0.0 ? kInfinity : cost_of(before);
            if (bins[bin].normals.angle >= 0.0) before.join(bins[bin]);
        }
        Split best;
        LightBounds behind;
        behind.normals.angle = -1.0;
        for (std::size_t bin = kBins - 1; bin > 0; --bin) {
            if (bins[bin].normals.angle >= 0.0) behind.join(bins[bin]);
            if (behind.normals.angle < 0.0) continue;
            const double cost = slimness * (cost_before[bin] + cost_of(behind));
            if (cost < best.cost) best = {cost, axis, bin};
        }
        return best;
    }

    void store(std::uint32_t at, const LightBounds& bounds, std::uint32_t first) {
        shared::LightNode& node = arrays_.light_nodes[at];
        node = {};
        node.first = first;
        node.flags =
            (bounds.has_both_sides ? CASTOR_LIGHT_NODE_BOTH_SIDES : 0u) | (bounds.is_far ? CASTOR_LIGHT_NODE_FAR : 0u);
        node.flux = static_cast<float>(bounds.flux);
        for (int i = 0; i < 3; ++i) node.axis[i] = static_cast<float>(bounds.normals.axis[i]);
        node.cos_normals = static_cast<float>(bounds.normals.cosine());
        constexpr double kMargin = 1e-3;  // for what devices round
        node.cos_emission = static_cast<float>(std::max(0.0, std::cos(bounds.emission) - kMargin));
        if (bounds.is_far) return;
        const glm::vec3 center(bounds.box.middle());
        const dvec3 half = glm::max(bounds.box.upper - dvec3(center), dvec3(center) - bounds.box.lower);
        for (int i = 0; i < 3; ++i) node.center[i] = center[i];
        node.radius = static_cast<float>(glm::length(half) * (1.0 + 0x1p-22));
    }

    SceneArrays& arrays_;
    std::vector<LightBounds> of_light_;
};

}  // namespace

void build_light_tree(SceneArrays& arrays, std::span<const Image> images) {
    arrays.light_nodes.clear();
    for (shared::Light& light : arrays.lights) light.trail = 0;
    if (arrays.lights.size() >= 2) Builder(arrays, images).build();
}

std::string problem_of_light_tree(const SceneArrays& arrays) {
    const std::size_t light_count = arrays.lights.size();
    const auto& nodes = arrays.light_nodes;
    const std::size_t node_count = light_count < 2 ? 0 : 2 * light_count - 1;
    if (nodes.size() != node_count)
        return fmt::format("{} elements, expected {} for {} lights", nodes.size(), node_count, light_count);
    if (node_count == 0) return "";
    for (std::size_t i = 0; i < node_count; ++i) {
        const shared::LightNode& node = nodes[i];
        const auto is_cosine = [](float x) { return x >= -1.0f && x <= 1.0f; };
        const auto is_usual = [](const glm::vec3& v) {
            const glm::vec3 most(4.0f * CASTOR_MAX_COORDINATE);
            return glm::all(glm::lessThanEqual(glm::abs(v), most));
        };
        if (!is_usual(vec3_of(node.center)) || !is_usual(vec3_of(node.axis)) ||
            !(node.radius >= 0.0f && node.radius <= 8.0f * CASTOR_MAX_COORDINATE) || !is_cosine(node.cos_normals) ||
            !is_cosine(node.cos_emission))
            return fmt::format("in element {} a centre, radius, axis or cosine that is out of range", i);
        if (!(node.flux >= 0.0f && node.flux <= 2.0f))
            return fmt::format("in element {} the flux {}, expected 0 to 2", i, node.flux);
        const bool is_leaf = node.flags & CASTOR_LIGHT_NODE_LEAF;
        if (is_leaf ? node.first >= light_count : node.first <= i || node.first >= node_count - 1)
            return fmt::format(
                "in element {} the {} {}, expected {}", i, is_leaf ? "light" : "first child", node.first,
                is_leaf ? fmt::format("one of {}", light_count) : fmt::format("{} to {}", i + 1, node_count - 2));
    }
    struct Place {
        std::uint32_t node, level, trail;
    };
    std::vector<Place> left{{0, 0, 0}};
    std::vector<bool> seen(node_count), has_light(light_count);
    while (!left.empty()) {
        const Place at = left.back();
        left.pop_back();
        const shared::LightNode& node = nodes[at.node];
        if (seen[at.node]) return fmt::format("an element {} to which two ways lead", at.node);
        seen[at.node] = true;
        if (node.flags & CASTOR_LIGHT_NODE_LEAF) {
            if (has_light[node.first]) return fmt::format("the light {} twice", node.first);
            has_light[node.first] = true;
            if (arrays.lights[node.first].trail != at.trail)
                return fmt::format("the light {} at the end of another trail than the light says", node.first);
            continue;
        }
        if (at.level == CASTOR_LIGHT_LEVELS)
            return fmt::format("more than {} levels below the root", CASTOR_LIGHT_LEVELS);
        left.push_back({node.first, at.level + 1, at.trail});
        left.push_back({node.first + 1, at.level + 1, at.trail | 1u << at.level});
    }
    const auto missing = std::find(has_light.begin(), has_light.end(), false);
    if (missing != has_light.end()) return fmt::format("no way to the light {}", missing - has_light.begin());
    return "";
}

}  // namespace castor
