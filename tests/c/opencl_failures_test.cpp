// OpenCL calls fail under the C interface: it tells a device error with the call and its code, or another device does
// the work; nothing leaks, and the handles can be released.
#include <CL/cl.h>

#include <algorithm>
#include <cstring>
#include <map>

#include "c/session.h"
#include "failures/opencl_shim.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

/// What came of using Castor from C, from the beginning to the end.
struct Outcome {
    castor_status status = CASTOR_STATUS_DONE;  // the first that was not done
    std::string message, call;
    int code = 0;
    std::vector<castor_hit> hits;
    std::vector<float> pixels;
};

Outcome use_castor() {
    Outcome outcome;
    castor_devices* devices = nullptr;
    castor_scene* scene = nullptr;
    castor_tracer* tracer = nullptr;
    castor_renderer* renderer = nullptr;
    castor_film* film = nullptr;
    make_test_scene(&scene);
    const auto step = [&](auto&& call) {
        if (outcome.status != CASTOR_STATUS_DONE) return;
        outcome.status = call();
        if (outcome.status == CASTOR_STATUS_DONE) return;
        auto error = sized<castor_error>();
        castor_get_last_error(&error);
        outcome.message = error.message;
        outcome.call = error.call;
        outcome.code = error.code;
    };
    const std::vector<castor_ray> rays = test_rays();
    std::vector<castor_hit> hits(rays.size());
    const castor_camera camera = test_camera();
    auto tracer_options = sized<castor_tracer_options>();
    auto renderer_options = sized<castor_renderer_options>();
    tracer_options.strategy = renderer_options.strategy = CASTOR_STRATEGY_BRUTE;
    step([&] { return select_test_devices(&devices); });
    step([&] { return castor_tracer_create(scene, devices, &tracer_options, &tracer); });
    step([&] { return castor_tracer_closest_hit(tracer, rays.data(), rays.size(), hits.data(), nullptr); });
    if (outcome.status == CASTOR_STATUS_DONE) outcome.hits = hits;
    step([&] { return castor_renderer_create(scene, devices, &renderer_options, &renderer); });
    step([&] { return castor_renderer_render(renderer, &camera, nullptr, &film); });
    if (film && outcome.status == CASTOR_STATUS_DONE) {
        auto info = sized<castor_film_info>();
        done(castor_film_get_info(film, &info));
        outcome.pixels.assign(info.pixels, info.pixels + std::size_t{3} * info.width * info.height);
    }
    castor_devices_release(devices);
    castor_scene_release(scene);
    castor_tracer_release(tracer);
    castor_renderer_release(renderer);
    castor_film_release(film);
    return outcome;
}

}  // namespace

TEST_CASE("OpenCL calls that fail under the C interface are told, and nothing leaks", "[c]") {
    const TemporaryDirectory cache;
    const ScopedVariable cache_folder("CASTOR_CACHE_DIR", cache.path().string());
    REQUIRE(use_castor().message.empty());  // fills the caches
    reset_shim();
    const Outcome expected = use_castor();
    REQUIRE(expected.status == CASTOR_STATUS_DONE);
    const std::map<std::string, int> calls = shim_calls();
    const std::map<std::string, long> objects = live_objects();
    CHECK(calls.size() > 20);
    int told = 0;
    for (const auto& [function, count] : calls)
        for (const int call : {0, count - 1}) {
            CAPTURE(function, call);
            reset_shim({.function = function, .call = call, .status = CL_OUT_OF_RESOURCES, .lasts = true});
            const Outcome outcome = use_castor();
            if (!fault_happened()) continue;  // the number of calls depends on who does what
            INFO(castor_status_string(outcome.status) << ": " << outcome.message);
            if (outcome.status == CASTOR_STATUS_DONE) {
                CHECK(std::memcmp(outcome.hits.data(), expected.hits.data(),
                                  expected.hits.size() * sizeof(castor_hit)) == 0);
                CHECK(outcome.pixels == expected.pixels);
            } else {
                CHECK(outcome.status == CASTOR_STATUS_DEVICE_ERROR);
                CHECK(outcome.message.find("CL_OUT_OF_RESOURCES") != std::string::npos);
                told += outcome.code == CL_OUT_OF_RESOURCES && outcome.call == function;
            }
            CHECK(live_objects() == objects);
        }
    reset_shim();
    CHECK(told > 15);
}

}  // namespace castor::test
