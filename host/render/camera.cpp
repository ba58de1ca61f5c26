#include "render/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "base/vec3.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr std::uint32_t kLargestResolution = 65536;

// Bounds of the image plane's distance and window. Between them the square of a direction is an ordinary float.
constexpr float kSmallestDistance = 1e-15f;
constexpr float kLargestExtent = 1e15f;

// Says no to NaN, too.
bool is_extent(float x) {
    return std::abs(x) <= kLargestExtent;
}

void store(float (&target)[3], const glm::dvec3& v) {
    for (int i = 0; i < 3; ++i) target[i] = static_cast<float>(v[i]);
}

void check(const Camera& camera, const std::string& file) {
    const auto require = [&](bool condition, const std::string& reason) {
        if (!condition) throw SceneError(file, camera.line, "camera: " + reason);
    };
    require(camera.width > 0 && camera.height > 0 && camera.width <= kLargestResolution &&
                camera.height <= kLargestResolution,
            fmt::format("the resolution is {}x{}; each must be between 1 and {}", camera.width, camera.height,
                        kLargestResolution));
    require(is_finite(camera.position) && std::max({std::abs(camera.position.x), std::abs(camera.position.y),
                                                    std::abs(camera.position.z)}) <= CASTOR_MAX_COORDINATE,
            fmt::format("the position {} is not finite, or farther than {} out", text(camera.position),
                        CASTOR_MAX_COORDINATE));
    require(is_finite(camera.gaze) && camera.gaze != glm::vec3(0.0f),
            fmt::format("the gaze {} is no direction", text(camera.gaze)));
    require(is_finite(camera.up) && camera.up != glm::vec3(0.0f),
            fmt::format("the up vector {} is no direction", text(camera.up)));
    const std::string window = fmt::format("the image plane's window l={} r={} b={} t={}", camera.left, camera.right,
                                           camera.bottom, camera.top);
    require(is_extent(camera.left) && is_extent(camera.right) && is_extent(camera.bottom) && is_extent(camera.top),
            fmt::format("{} is not finite, or reaches farther than {:g}", window, kLargestExtent));
    require(camera.left != camera.right && camera.bottom != camera.top, window + " is empty");
    require(camera.distance >= kSmallestDistance && camera.distance <= kLargestExtent,
            fmt::format("the image plane's distance is {}; it must be between {:g} and {:g}", camera.distance,
                        kSmallestDistance, kLargestExtent));
    require(camera.aperture_size >= 0.0f && camera.aperture_size <= CASTOR_MAX_COORDINATE,
            fmt::format("the aperture size is {}; it must be between 0 and {:g}", camera.aperture_size,
                        CASTOR_MAX_COORDINATE));
    require(!camera.is_orthographic || camera.aperture_size == 0.0f,
            "parallel rays have no lens: the aperture size must be 0");
    require(camera.t_min <= camera.t_max,
            fmt::format("t_min {} and t_max {} are no interval", camera.t_min, camera.t_max));
    require(camera.focus_distance >= kSmallestDistance && camera.focus_distance <= kLargestExtent,
            fmt::format("the focus distance is {}; it must be between {:g} and {:g}", camera.focus_distance,
                        kSmallestDistance, kLargestExtent));
    for (const ToneMap& tone_map : camera.tone_maps) {
        const auto is_positive = [](float x) { return x > 0.0f && std::isfinite(x); };
        require(static_cast<unsigned>(tone_map.tone_operator) <= static_cast<unsigned>(ToneOperator::agx),
                "a tone map's operator is none of photographic, ACES, filmic and linear");
        require(is_positive(tone_map.key), fmt::format("a tone map's key is {}; it must be positive", tone_map.key));
        require(tone_map.burn_percent >= 0.0f && tone_map.burn_percent <= 100.0f,
                fmt::format("a tone map burns {} percent; it must be between 0 and 100", tone_map.burn_percent));
        require(tone_map.saturation >= 0.0f && std::isfinite(tone_map.saturation),
                fmt::format("a tone map's saturation is {}; it must be at least 0", tone_map.saturation));
        require(tone_map.is_srgb || is_positive(tone_map.gamma),
                fmt::format("a tone map's gamma is {}; it must be positive", tone_map.gamma));
    }
}

}  // namespace

shared::Camera make_camera(const Camera& camera, const std::string& scene_file) {
    check(camera, scene_file);
    const glm::dvec3 w = -glm::normalize(glm::dvec3(camera.gaze));
    const glm::dvec3 up = glm::normalize(glm::dvec3(camera.up));
    const glm::dvec3 right = glm::cross(up, w);
    constexpr double kSmallestSine = 1e-7;  // a float's resolution of a direction
    if (glm::length(right) < kSmallestSine)
        throw SceneError(scene_file, camera.line,
                         fmt::format("camera: up {} is parallel to gaze {}", text(camera.up), text(camera.gaze)));
    const glm::dvec3 u = glm::normalize(right) * (camera.left_handed ? -1.0 : 1.0);
    const glm::dvec3 v = glm::cross(w, glm::normalize(right));

    shared::Camera result{};
    store(result.position, camera.position);
    const glm::dvec3 forward = camera.is_orthographic ? glm::dvec3(0.0) : -w * double(camera.distance);
    store(result.corner, forward + u * double(camera.left) + v * double(camera.top));
    store(result.step_x, u * ((double(camera.right) - camera.left) / camera.width));
    store(result.step_y, v * ((double(camera.top) - camera.bottom) / camera.height));
    result.t_min = std::max(camera.t_min, 1e-30f);  // the eye's own point does not count
    result.t_max = camera.t_max;
    result.width = camera.width;
    result.height = camera.height;
    if (camera.is_orthographic) {
        result.projection = CASTOR_PROJECTION_PARALLEL;
        store(result.lens_x, -w * double(camera.distance));
        return result;
    }
    if (camera.aperture_size == 0.0f) return result;
    result.projection = CASTOR_PROJECTION_LENS;
    store(result.lens_x, u * double(camera.aperture_size));
    store(result.lens_y, v * double(camera.aperture_size));
    result.sharpness = static_cast<float>(double(camera.distance) / double(camera.focus_distance));
    return result;
}

}  // namespace castor
