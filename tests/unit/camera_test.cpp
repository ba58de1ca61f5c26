#include "render/camera.h"

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/scene.h"
#include "support/catch.h"

namespace castor {

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("a camera that makes no picture is refused with its line", "[camera]") {
    struct Case {
        std::function<void(Camera&)> damage;
        std::string reason;
    };
    const std::vector<Case> cases{
        {[](Camera& c) { c.width = 0; }, "the resolution is 0x512"},
        {[](Camera& c) { c.position.x = kNan; }, "the position (nan, 0, 0) is not finite"},
        {[](Camera& c) { c.gaze = glm::vec3(0); }, "the gaze (0, 0, 0) is no direction"},
        {[](Camera& c) {
             c.up = {0, 0, 2};
         },
         "up (0, 0, 2) is parallel to gaze"},
        {[](Camera& c) { c.right = -1; }, "is empty"},
        {[](Camera& c) { c.distance = 0; }, "the image plane's distance is 0"},
        {[](Camera& c) { c.t_min = kInfinity, c.t_max = 1; }, "are no interval"},
        {[](Camera& c) { c.aperture_size = -1; }, "the aperture size is -1"},
        {[](Camera& c) { c.aperture_size = kNan; }, "the aperture size is nan"},
        {[](Camera& c) { c.focus_distance = 0; }, "the focus distance is 0"},
        {[](Camera& c) { c.focus_distance = kInfinity; }, "the focus distance is inf"},
        {[](Camera& c) { c.tone_maps[0].tone_operator = static_cast<ToneOperator>(5); }, "operator is none of"},
        {[](Camera& c) { c.tone_maps[0].key = 0; }, "key is 0"},
        {[](Camera& c) { c.tone_maps[0].key = kNan; }, "key is nan"},
        {[](Camera& c) { c.tone_maps[0].burn_percent = 101; }, "burns 101 percent"},
        {[](Camera& c) { c.tone_maps[0].burn_percent = kNan; }, "burns nan percent"},
        {[](Camera& c) { c.tone_maps[0].saturation = -1; }, "saturation is -1"},
        {[](Camera& c) { c.tone_maps[0].gamma = 0; }, "gamma is 0"},
    };
    for (const Case& one : cases) {
        CAPTURE(one.reason);
        Camera camera;
        camera.line = 7;
        camera.tone_maps.resize(1);
        CHECK_NOTHROW(make_camera(camera, "scene.xml"));
        one.damage(camera);
        try {
            make_camera(camera, "scene.xml");
            FAIL_CHECK("no error");
        } catch (const SceneError& error) {
            CHECK(error.line() == 7);
            CHECK_THAT(error.reason(), Catch::Contains(one.reason));
        }
    }
}

TEST_CASE("the gamma of a tone map with the curve of sRGB does not matter", "[camera]") {
    Camera camera;
    camera.tone_maps.resize(1);
    camera.tone_maps[0].is_srgb = true;
    camera.tone_maps[0].gamma = 0;
    CHECK_NOTHROW(make_camera(camera, "scene.xml"));
}

}  // namespace castor
