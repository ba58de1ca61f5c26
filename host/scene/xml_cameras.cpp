#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec3.hpp>

#include "scene/scene_limits.h"
#include "scene/xml_numbers.h"
#include "scene/xml_parts.h"

namespace castor {

namespace {

enum class CameraType { window, look_at };

/// Returns whether gaze and up are far enough from parallel that rounding does not decide the orientation of the
/// picture.
bool has_orientation(const Camera& camera) {
    constexpr double kSmallestSine = 1e-6;
    const glm::dvec3 gaze = glm::normalize(glm::dvec3(camera.gaze)), up = glm::normalize(glm::dvec3(camera.up));
    return glm::length(glm::cross(gaze, up)) > kSmallestSine;
}

void read_orientation(XmlDocument& document, pugi::xml_node element, Camera& camera) {
    camera.position = require_vec3(document, element, "Position");
    if (element.child("GazePoint")) {
        const glm::dvec3 point = require_vec3(document, element, "GazePoint");
        camera.gaze = glm::vec3(point - glm::dvec3(camera.position));
        check_child(document, camera.gaze != glm::vec3(0.0f), element, "GazePoint",
                    "a point other than the camera's position");
    } else {
        camera.gaze = require_direction(document, element, "Gaze");
    }
    camera.up = require_direction(document, element, "Up");
    check_child(document, has_orientation(camera), element, "Up", "a direction that is not parallel to the gaze");
}

void read_resolution(XmlDocument& document, pugi::xml_node element, Camera& camera) {
    const auto [width, height] =
        read_numbers<std::int64_t, 2>(document, require_child(document, element, "ImageResolution"));
    const auto valid = [](std::int64_t pixels) { return pixels >= 1 && pixels <= kMaxImageResolution; };
    check_child(document, valid(width) && valid(height), element, "ImageResolution",
                "a width and a height of 1 to 65536 pixels");
    camera.width = static_cast<std::uint32_t>(width);
    camera.height = static_cast<std::uint32_t>(height);
}

void read_near_plane(XmlDocument& document, pugi::xml_node element, Camera& camera) {
    const auto [left, right, bottom, top] =
        read_numbers<float, 4>(document, require_child(document, element, "NearPlane"));
    check_child(document, left != right && bottom != top, element, "NearPlane",
                "left right bottom top, with left other than right and bottom other than top");
    camera.left = left;
    camera.right = right;
    camera.bottom = bottom;
    camera.top = top;
}

void read_field_of_view(XmlDocument& document, pugi::xml_node element, Camera& camera) {
    const float degrees = require_float(document, element, "FovY");
    check_child(document, degrees > 0.0f && degrees < 180.0f, element, "FovY", "an angle between 0 and 180 degrees");
    const double top = double{camera.distance} * std::tan(glm::radians(double{degrees}) / 2.0);
    const double right = top * camera.width / camera.height;
    camera.top = static_cast<float>(top);
    camera.right = static_cast<float>(right);
    camera.bottom = -camera.top;
    camera.left = -camera.right;
    check_child(document,
                camera.top > 0.0f && std::isfinite(camera.top) && camera.right > 0.0f && std::isfinite(camera.right),
                element, "FovY", "an angle whose window on the image plane is neither empty nor infinite");
}

void read_range(XmlDocument& document, pugi::xml_node element, Camera& camera) {
    camera.t_min = read_float(document, element, "TMin", camera.t_min);
    camera.t_max = read_float(document, element, "TMax", camera.t_max);
    check_child(document, camera.t_min >= 0.0f, element, "TMin", "a number of at least 0");
    check_child(document, camera.t_max >= camera.t_min, element, "TMax", "a number of at least TMin");
}

void warn_unused(XmlDocument& document, pugi::xml_node element, const char* name, const char* reason) {
    if (const pugi::xml_node child = element.child(name))
        document.warn(child, fmt::format("<{}> is ignored: {}", name, reason));
}

void read_lens(XmlDocument& document, pugi::xml_node element, Camera& camera) {
    camera.aperture_size = read_float(document, element, "ApertureSize", camera.aperture_size);
    check_child(document, camera.aperture_size >= 0.0f, element, "ApertureSize", "a number of at least 0");
    if (camera.aperture_size > 0.0f) require_child(document, element, "FocusDistance");
    camera.focus_distance = read_float(document, element, "FocusDistance", camera.focus_distance);
    check_child(document, camera.focus_distance > 0.0f, element, "FocusDistance", "a positive number");
}

/// Moves the eye and turns the axes, which are made perpendicular again afterwards.
void move(XmlDocument& document, pugi::xml_node element, const XmlTransforms& transforms, Camera& camera) {
    if (!element.child("Transformations")) return;
    const glm::dmat4 matrix = transforms.of(element);
    camera.position = glm::vec3(matrix * glm::dvec4(camera.position, 1.0));
    camera.gaze = glm::vec3(glm::dmat3(matrix) * glm::dvec3(camera.gaze));
    camera.up = glm::vec3(glm::dmat3(matrix) * glm::dvec3(camera.up));
    if (camera.gaze == glm::vec3(0.0f) || camera.up == glm::vec3(0.0f) || !has_orientation(camera))
        document.fail(element.child("Transformations"),
                      "the transformations leave <Camera> no gaze and upward direction");
}

Camera read_camera(XmlDocument& document, pugi::xml_node element, const XmlTransforms& transforms,
                   std::uint32_t max_recursion_depth) {
    document.expect_attributes(element, {"type", "handedness"});
    // What has a field of view and no window has the type that uses it.
    const bool has_view = element.child("FovY") && !element.child("NearPlane");
    const auto type =
        read_word_attribute(document, element, "type", has_view ? CameraType::look_at : CameraType::window,
                            {{"lookAt", CameraType::look_at}});
    document.expect_children(element,
                             {"Position",
                              "Gaze",
                              "GazePoint",
                              "Up",
                              "NearPlane",
                              "FovY",
                              "NearDistance",
                              "ImageResolution",
                              "ImageName",
                              "NumSamples",
                              "TMin",
                              "TMax",
                              "Transformations",
                              "FocusDistance",
                              "ApertureSize",
                              "Renderer",
                              "RendererParams",
                              "MinRecursionDepth",
                              "SplittingFactor",
                              "SampleMaxVal",
                              "Scissor2"},
                             {"Tonemap"});
    warn_unused(document, element, "Scissor2", "the whole picture is made");
    warn_unused(document, element, type == CameraType::window ? "FovY" : "NearPlane",
                "the camera is not of the type that uses it");
    if (element.child("GazePoint")) warn_unused(document, element, "Gaze", "the camera has a <GazePoint>");

    Camera camera;
    camera.line = document.line(element);
    camera.left_handed =
        read_word_attribute(document, element, "handedness", false, {{"right", false}, {"left", true}});
    read_orientation(document, element, camera);
    move(document, element, transforms, camera);
    read_lens(document, element, camera);
    read_resolution(document, element, camera);
    // With a field of view the distance is only the unit of TMin and TMax.
    camera.distance = type == CameraType::look_at ? read_float(document, element, "NearDistance", 1.0f)
                                                  : require_float(document, element, "NearDistance");
    check_child(document, camera.distance > 0.0f, element, "NearDistance", "a positive number");
    if (type == CameraType::window)
        read_near_plane(document, element, camera);
    else
        read_field_of_view(document, element, camera);
    read_range(document, element, camera);
    const std::int64_t samples = read_integer(document, element, "NumSamples", 1);
    check_child(document, samples >= 1 && samples <= kMaxSamplesPerPixel, element, "NumSamples",
                "a number of 1 to 1048576 samples");
    camera.samples_per_pixel = static_cast<std::uint32_t>(samples);
    if (const pugi::xml_node name = element.child("ImageName")) camera.image_name = read_string(document, name);
    camera.tone_maps = read_tone_maps(document, element);
    camera.path_tracing = read_path_tracing(document, element, max_recursion_depth);
    return camera;
}

}  // namespace

void read_cameras(XmlDocument& document, const XmlTransforms& transforms, Scene& scene) {
    for (const pugi::xml_node container : document.root().children("Cameras")) {
        document.expect_attributes(container);
        document.expect_children(container, {}, {"Camera"});
        for (const pugi::xml_node element : container.children("Camera"))
            scene.cameras.push_back(read_camera(document, element, transforms, scene.max_recursion_depth));
    }
}

}  // namespace castor
