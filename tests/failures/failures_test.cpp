// Every OpenCL call that the host makes fails once, at each position, on one device of two, and on the only one: the
// picture is complete and the same, or the failure is told, with the picture so far. Nothing leaks, hangs or is lost.
//
// CASTOR_TEST_EVERY_CALL: all calls, and not only the first two, the middle one and the last of each function.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "castor/error.h"
#include "castor/renderer.h"
#include "castor/tracer.h"
#include "failures/opencl_shim.h"
#include "opencl/cl.h"
#include "opencl/quirks.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "schedule/crew.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

Scene small_scene() {
    RandomSource random(5);
    Scene scene = scene_of({random_triangles(random, 6, 0.5f)});
    scene.ambient_light = {10, 10, 10};
    scene.materials.at(0) = mirror_material(glm::vec3(0.5f));
    scene.materials.at(0).ambient = {1, 1, 1};
    scene.materials.at(0).diffuse = {0.5f, 0.6f, 0.7f};
    scene.spheres.push_back({{0.2f, 0.1f, -0.5f}, 0.4f, 0, 0});
    scene.lights = {point_light({2, 3, 4}, {900, 900, 900})};
    scene.max_recursion_depth = 2;
    return scene;
}

Camera small_camera() {
    Camera camera = square_camera({0, 0, 3}, {0, 0, -1}, 0.5f, 24);
    camera.samples_per_pixel = 2;
    return camera;
}

RenderOptions small_options() {
    RenderOptions options;
    options.tile_size = 8;
    options.aovs = {"primitive", "depth"};
    return options;
}

/// Another driver for Castor: it has to sleep while it waits, and it keeps the compiled programs.
Device of_another_driver(Device device) {
    device.platform_name = "Another driver";
    return device;
}

/// The device twice, so that one can fail alone.
std::vector<Device> two_devices(bool another_driver) {
    const Device device = another_driver ? of_another_driver(test_device()) : test_device();
    return {device, device};
}

/// The device without teams, so that it works or hangs as a whole.
Device undivided(Device device) {
    device.compute_units = 1;
    return device;
}

constexpr RendererOptions kBrute{
    .strategy = Strategy::brute, .quality = TreeQuality::medium, .use_profiles = false, .deadline_seconds = 60};

/// What came of a picture.
struct Outcome {
    std::optional<Film> film;
    std::string error;     // empty: none reached the caller
    std::string failures;  // of devices that were dropped
};

Outcome render(const std::vector<Device>& devices, const RendererOptions& options = kBrute) {
    Outcome outcome;
    try {
        Renderer renderer(small_scene(), devices, options);
        try {
            outcome.film = renderer.render(small_camera(), small_options());
        } catch (const RenderError& error) {
            outcome.film = error.film();
            outcome.error = error.what();
        }
        for (const DeviceShare& share : renderer.statistics().devices) outcome.failures += share.failure;
    } catch (const DeviceError& error) {
        outcome.error = error.what();
    }
    return outcome;
}

/// What is done has the right bytes.
void check_done_pixels(const Film& film, const Film& expected) {
    REQUIRE(film.pixels.size() == expected.pixels.size());
    for (std::size_t i = 0; i < film.pixels.size(); ++i)
        if (film.done[i] && film.pixels[i] != expected.pixels[i]) FAIL("pixel " << i << " is done and differs");
}

std::vector<int> positions(int calls) {
    std::set<int> chosen;
    if (std::getenv("CASTOR_TEST_EVERY_CALL"))
        for (int i = 0; i < calls; ++i) chosen.insert(i);
    else
        chosen = {0, std::min(1, calls - 1), calls / 2, calls - 1};
    return {chosen.begin(), chosen.end()};
}

/// They wake, and find that they are not wanted.
void release_hanging_threads() {
    release_hanging_calls();
    for (int i = 0; i < 60000 && threads_left_behind() > 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    REQUIRE(threads_left_behind() == 0);
}

bool is_release(const std::string& function) {
    return function.starts_with("clRelease");
}

/// What the bindings call a function in their messages.
std::string spoken_name(const std::string& function) {
    return function.starts_with("clRetain") ? "Retain Object" : function;
}

}  // namespace

TEST_CASE("each OpenCL call of a render fails once", "[failures]") {
    const bool another_driver = GENERATE(false, true);
    const std::size_t device_count = GENERATE(1u, 2u);
    const TemporaryDirectory cache;
    const ScopedVariable cache_folder("CASTOR_CACHE_DIR", cache.path().string());
    std::vector<Device> devices = two_devices(another_driver);
    devices.resize(device_count);
    REQUIRE(render(devices).error.empty());  // fills the caches
    reset_shim();
    const Outcome expected = render(devices);
    REQUIRE(expected.film);
    REQUIRE(expected.film->complete());
    const std::map<std::string, long> objects = live_objects();
    const std::map<std::string, int> calls = shim_calls();
    CHECK(calls.size() > 20);
    int dropped = 0, told = 0;
    for (const auto& [function, count] : calls)
        for (const int call : positions(count))
            for (const bool lasts : {false, true}) {
                if (lasts && call != 0 && call != count / 2) continue;
                CAPTURE(another_driver, device_count, function, count, call, lasts);
                reset_shim({.function = function, .call = call, .status = CL_OUT_OF_RESOURCES, .lasts = lasts});
                const Outcome outcome = render(devices);
                if (!fault_happened()) continue;  // the number of calls depends on who does what
                INFO("error: " << outcome.error << "; dropped: " << outcome.failures);
                if (outcome.error.empty()) {
                    REQUIRE(outcome.film);
                    CHECK(same_bytes(*outcome.film, *expected.film));
                } else {
                    CHECK(outcome.error.find(spoken_name(function)) != std::string::npos);
                    CHECK(outcome.error.find("CL_OUT_OF_RESOURCES") != std::string::npos);
                    if (outcome.film) check_done_pixels(*outcome.film, *expected.film);
                }
                if (is_release(function)) CHECK(outcome.error.empty());
                if (device_count == 2 && !lasts) CHECK(outcome.error.empty());
                CHECK(live_objects() == objects);
                dropped += !outcome.failures.empty();
                told += !outcome.error.empty();
            }
    reset_shim();
    if (device_count == 1) CHECK(told > 20);
    CHECK(dropped > (device_count == 2 ? 20 : 0));
}

TEST_CASE("each OpenCL call of a batch fails once", "[failures]") {
    const bool another_driver = GENERATE(false, true);
    const bool are_crossings = GENERATE(false, true);
    const TemporaryDirectory cache;
    const ScopedVariable cache_folder("CASTOR_CACHE_DIR", cache.path().string());
    const std::vector<Device> devices = two_devices(another_driver);
    RandomSource random(6);
    std::vector<Ray> rays;
    for (int i = 0; i < 3000; ++i) {
        const glm::vec3 origin = random.in_box(-2, 2);
        rays.push_back(make_ray(origin, random.in_box(-1, 1) - origin, 0.0f, 100.0f));
    }
    constexpr std::size_t kLimit = 2;
    struct Answers {
        std::vector<Hit> hits;
        std::vector<std::uint8_t> occluded;
        std::vector<std::uint32_t> counts;
        std::vector<Hit> first_crossings;
        CrossingLists crossings;
        std::string error, failures;
    };
    const auto trace = [&] {
        Answers answers;
        answers.hits.resize(rays.size());
        answers.occluded.resize(rays.size());
        answers.counts.resize(rays.size());
        answers.first_crossings.resize(kLimit * rays.size());
        try {
            Tracer tracer(small_scene(), devices, {.strategy = Strategy::wide, .use_profiles = false});
            if (are_crossings) {
                tracer.list_crossings(rays, kLimit, answers.first_crossings, answers.counts);
                answers.crossings = tracer.list_all_crossings(rays).value();  // which counts them
            } else {
                tracer.closest_hit(rays, answers.hits);
                tracer.any_hit(rays, answers.occluded);
            }
            for (const DeviceShare& share : tracer.shares()) answers.failures += share.failure;
        } catch (const DeviceError& error) {
            answers.error = error.what();
        }
        return answers;
    };
    REQUIRE(trace().error.empty());
    reset_shim();
    const Answers expected = trace();
    const std::map<std::string, long> objects = live_objects();
    int dropped = 0;
    for (const auto& [function, count] : shim_calls())
        for (const int call : positions(count)) {
            CAPTURE(another_driver, are_crossings, function, count, call);
            reset_shim({.function = function, .call = call, .status = CL_OUT_OF_HOST_MEMORY, .lasts = true});
            const Answers answers = trace();
            if (!fault_happened()) continue;
            INFO("error: " << answers.error << "; dropped: " << answers.failures);
            if (answers.error.empty()) {
                CHECK(same_bytes(answers.hits, expected.hits));
                CHECK(answers.occluded == expected.occluded);
                CHECK(answers.counts == expected.counts);
                CHECK(same_bytes(answers.first_crossings, expected.first_crossings));
                CHECK(answers.crossings.first == expected.crossings.first);
                CHECK(same_bytes(answers.crossings.crossings, expected.crossings.crossings));
            } else {
                CHECK(answers.error.find(spoken_name(function)) != std::string::npos);
            }
            CHECK(live_objects() == objects);
            dropped += !answers.failures.empty();
        }
    reset_shim();
    CHECK(dropped > 10);
}

TEST_CASE("the only device fails half-way through crossings, which is told", "[failures]") {
    RandomSource random(8);
    std::vector<Ray> rays;
    for (int i = 0; i < 20'000; ++i) {
        const glm::vec3 origin = random.in_box(-2, 2);
        rays.push_back(make_ray(origin, random.in_box(-1, 1) - origin, 0.0f, 100.0f));
    }
    constexpr std::size_t kLimit = 2;
    std::vector<std::uint32_t> counts(rays.size());
    std::vector<Hit> crossings(kLimit * rays.size());
    const std::function<void(Tracer&)> queries[] = {
        [&](Tracer& tracer) { tracer.count_crossings(rays, counts); },
        [&](Tracer& tracer) { tracer.list_crossings(rays, kLimit, crossings, counts); },
        [&](Tracer& tracer) { tracer.list_all_crossings(rays); },
    };
    for (const auto& query : queries) {
        const auto use = [&](const Fault& fault, bool is_expected) {
            Tracer tracer(small_scene(), {test_device()}, {.strategy = Strategy::wide, .use_profiles = false});
            reset_shim(fault);
            if (!is_expected) return query(tracer);
            try {
                query(tracer);
                FAIL("no error is told");
            } catch (const DeviceError& error) {
                CHECK(error.call() == fault.function);
                CHECK(error.code() == fault.status);
            }
            CHECK(fault_happened());
            CHECK_THROWS_WITH(query(tracer), Catch::Matchers::Contains("dropped before"));
            CHECK_FALSE(tracer.shares().at(0).failure.empty());
        };
        reset_shim();
        use({}, false);
        const std::map<std::string, int> calls = shim_calls();
        const std::map<std::string, long> objects = live_objects();
        for (const char* function : {"clEnqueueNDRangeKernel", "clEnqueueMapBuffer"}) {
            CAPTURE(function);
            use({.function = function, .call = std::min(2, calls.at(function) - 1)}, true);  // two slices are small
            CHECK(live_objects() == objects);
        }
    }
    reset_shim();
}

TEST_CASE("a device that is busy when a batch is done is not waited for, and has its part of later ones",
          "[failures]") {
    RandomSource random(9);
    std::vector<Ray> rays;
    for (int i = 0; i < 20000; ++i) {
        const glm::vec3 origin = random.in_box(-2, 2);
        rays.push_back(make_ray(origin, random.in_box(-1, 1) - origin, 0.0f, 100.0f));
    }
    reset_shim();
    Tracer tracer(
        small_scene(), two_devices(false),
        {.strategy = Strategy::wide, .use_profiles = false, .deadline_seconds = 60, .stop_deadline_seconds = 0.1});
    std::vector<Hit> expected(rays.size());
    Tracer(small_scene(), {test_device()}, {.strategy = Strategy::wide, .use_profiles = false})
        .closest_hit(rays, expected);
    const auto trace = [&] {
        std::vector<Hit> hits(rays.size());
        tracer.closest_hit(rays, hits);
        CHECK(same_bytes(hits, expected));
    };
    const auto times_left_busy = [&] {
        std::vector<std::uint64_t> times;
        for (const DeviceShare& share : tracer.shares()) {
            CHECK(share.failure.empty());
            times.push_back(share.left_busy);
        }
        return times;
    };
    reset_shim({.function = "clEnqueueNDRangeKernel", .call = 0, .hangs = true});
    trace();
    CHECK(fault_happened());
    CHECK(threads_left_behind() == 1);
    const std::vector<std::uint64_t> times = times_left_busy();
    REQUIRE(times.size() == 2);
    REQUIRE(times[0] + times[1] == 1);
    const std::size_t busy = times[1];
    trace();  // without the device, nor any wait for it
    CHECK(threads_left_behind() == 1);
    CHECK(times_left_busy() == times);
    CHECK(tracer.shares()[busy].rays == 0);
    release_hanging_threads();
    reset_shim();
    for (int i = 0; i < 500 && tracer.shares()[busy].rays == 0; ++i) trace();
    CHECK(tracer.shares()[busy].rays > 0);
    CHECK(times_left_busy() == times);
}

TEST_CASE(
    "a device that is busy when a picture is done is not used before it has ended, and has its part of later ones",
    "[failures]") {
    reset_shim();
    RendererOptions renderer_options = kBrute;
    renderer_options.stop_deadline_seconds = 0.1;
    const std::vector<Device> devices(2, undivided(test_device()));
    Renderer renderer(small_scene(), devices, renderer_options);
    const Outcome expected = render(devices);
    REQUIRE(expected.film);
    reset_shim({.function = "clEnqueueNDRangeKernel", .call = 0, .hangs = true});
    CHECK(same_bytes(renderer.render(small_camera(), small_options()), *expected.film));
    CHECK(fault_happened());
    CHECK(threads_left_behind() == 1);
    const std::vector<DeviceShare> shares = renderer.statistics().devices;
    REQUIRE(shares.size() == 2);
    REQUIRE(shares[0].left_busy + shares[1].left_busy == 1);
    const std::size_t busy = shares[1].left_busy;
    const auto render_again = [&] {
        CHECK(same_bytes(renderer.render(small_camera(), small_options()), *expected.film));
        const DeviceShare share = renderer.statistics().devices.at(busy);
        CHECK(share.failure.empty());
        return share;
    };
    const DeviceShare share = render_again();  // without the device, nor any wait for it
    CHECK(share.rays == 0);
    CHECK(share.left_busy == 0);
    CHECK(threads_left_behind() == 1);
    release_hanging_threads();
    reset_shim();
    bool has_part = false;
    for (int i = 0; i < 500 && !has_part; ++i) has_part = render_again().rays > 0;
    CHECK(has_part);
}

TEST_CASE("the event of a query is complete only when all answers are, in whatever order the launches end",
          "[failures]") {
    reset_shim();
    const Strategy strategy = GENERATE(Strategy::brute, Strategy::simt);
    CAPTURE(to_string(strategy));
    // Brute force over so many triangles takes several passes; both strategies take several launches.
    RandomSource random(12);
    const std::size_t triangles = strategy == Strategy::brute ? 70'000 : 6;
    const std::size_t count = 100'000;
    Tracer tracer(scene_of({random_triangles(random, triangles, 0.01f)}), {test_device()},
                  {.strategy = strategy, .use_profiles = false});
    // All but one in a thousand are over before they begin.
    std::vector<Ray> rays(count, make_ray({0, 0, 9}, {0, 0, 1}, 1.0f, 0.0f));
    for (std::size_t i = 0; i < count; i += 1000) rays[i] = make_ray({0, 0, 0}, random.direction(), 0.0f, 100.0f);
    std::vector<Hit> expected(count);
    tracer.closest_hit(rays, expected);

    const cl::Context context(tracer.context(), true);
    const cl::Device device = context.getInfo<CL_CONTEXT_DEVICES>().at(0);
    const cl::CommandQueue in_order(context, device),
        any_order(context, device, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE);
    const cl::Buffer ray_buffer(context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, count * sizeof(Ray), rays.data());
    const cl::Buffer hit_buffer(context, CL_MEM_READ_WRITE, count * sizeof(Hit));
    in_order.enqueueFillBuffer(hit_buffer, cl_uchar{0x55}, 0, count * sizeof(Hit));
    in_order.finish();
    const int launches = [&] {
        reset_shim();
        tracer.closest_hit(any_order(), ray_buffer(), hit_buffer(), 0, count);
        any_order.finish();
        return shim_calls().at("clEnqueueNDRangeKernel");
    }();
    REQUIRE(launches > 1);
    for (const int delayed : {0, launches - 2, launches - 1}) {
        CAPTURE(launches, delayed);
        in_order.enqueueFillBuffer(hit_buffer, cl_uchar{0x55}, 0, count * sizeof(Hit));
        in_order.finish();
        cl::UserEvent delay(context);
        reset_shim({.function = "clEnqueueNDRangeKernel", .call = delayed, .delay = delay()});
        cl_event event = nullptr;
        tracer.closest_hit(any_order(), ray_buffer(), hit_buffer(), 0, count, &event);
        const cl::Event complete(event, false);
        REQUIRE(fault_happened());
        any_order.flush();
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        CHECK(complete.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() != CL_COMPLETE);
        delay.setStatus(CL_COMPLETE);
        complete.wait();
        std::vector<Hit> found(count);
        in_order.enqueueReadBuffer(hit_buffer, CL_TRUE, 0, count * sizeof(Hit), found.data());
        CHECK(same_bytes(found, expected));
    }
    reset_shim();
}

TEST_CASE("a platform or a device that cannot be asked is told of, and hides no other", "[failures]") {
    const std::map<std::string, long> objects = live_objects();
    reset_shim();
    const std::vector<Device> all = list_devices();
    REQUIRE_FALSE(all.empty());
    const std::map<std::string, int> calls = shim_calls();
    for (const char* function : {"clGetPlatformInfo", "clGetDeviceIDs", "clGetDeviceInfo"})
        for (int call = 0; call < calls.at(function); ++call)
            for (const bool lasts : {false, true}) {
                reset_shim({.function = function, .call = call, .status = CL_OUT_OF_HOST_MEMORY, .lasts = lasts});
                CAPTURE(function, call, lasts);
                std::vector<std::string> problems;
                const std::vector<Device> devices = list_devices(&problems);
                CHECK(fault_happened());
                REQUIRE_FALSE(problems.empty());
                if (!lasts) CHECK(problems.size() == 1);
                CHECK(problems[0].find(function) != std::string::npos);
                CHECK(problems[0].find("CL_OUT_OF_HOST_MEMORY") != std::string::npos);
                // Only what belongs to one platform is missing.
                std::set<cl_platform_id> touched;
                for (const Device& device : all)
                    if (std::none_of(devices.begin(), devices.end(),
                                     [&](const Device& other) { return other.id == device.id; }))
                        touched.insert(device.platform);
                CHECK(touched.size() <= 1);
                for (std::size_t i = 0; i < devices.size(); ++i) CHECK(devices[i].index == i);
                CHECK(live_objects() == objects);
            }
    // Where nothing is left, that is said, and why.
    if (all.size() == 1) {
        reset_shim({.function = "clGetDeviceInfo", .call = 0, .status = CL_OUT_OF_HOST_MEMORY, .lasts = true});
        CHECK_THROWS_WITH(select_devices(), Catch::Matchers::Contains("no OpenCL device can be used") &&
                                                Catch::Matchers::Contains("CL_OUT_OF_HOST_MEMORY"));
    }
    reset_shim({.function = "clGetPlatformIDs", .call = 0, .status = CL_OUT_OF_HOST_MEMORY});
    CHECK_THROWS_WITH(list_devices(), Catch::Matchers::Contains("CL_OUT_OF_HOST_MEMORY"));
    reset_shim();
}

TEST_CASE("where a driver does not take the host's memory, it gets a copy", "[failures]") {
    const std::vector<Device> devices = two_devices(false);
    if (!devices[0].unified_memory) return;  // which gets copies anyway
    reset_shim();
    const Outcome expected = render(devices);
    REQUIRE(expected.film);
    reset_shim({.function = "clCreateBuffer", .status = CL_INVALID_HOST_PTR, .flags = CL_MEM_USE_HOST_PTR});
    const Outcome outcome = render(devices);
    CHECK(fault_happened());
    CHECK(outcome.error.empty());
    CHECK(outcome.failures.empty());
    REQUIRE(outcome.film);
    CHECK(same_bytes(*outcome.film, *expected.film));
    reset_shim();
}

TEST_CASE("kernels are launched in groups that the device allows for them", "[failures]") {
    const Strategy strategy = GENERATE(Strategy::brute, Strategy::simt, Strategy::wide);
    CAPTURE(to_string(strategy));
    RendererOptions options = kBrute;
    options.strategy = strategy;
    std::vector<Device> devices = two_devices(false);
    devices.resize(1);
    reset_shim();
    const Outcome expected = render(devices, options);
    REQUIRE(expected.film);
    for (const std::size_t most : {1u, 24u}) {
        limit_groups(most);
        const Outcome outcome = render(devices, options);
        limit_groups(0);
        CHECK(outcome.error.empty());
        REQUIRE(outcome.film);
        CHECK(same_bytes(*outcome.film, *expected.film));
    }
}

TEST_CASE("a command that ends with an error is seen, whoever waits", "[failures]") {
    const TemporaryDirectory cache;
    const ScopedVariable cache_folder("CASTOR_CACHE_DIR", cache.path().string());
    const std::vector<Device> devices = two_devices(true);
    const Outcome expected = render(devices);
    REQUIRE(expected.film);
    for (const int call : {0, 3}) {
        reset_shim({.function = "clGetEventInfo", .call = call, .status = -9999, .of_command = true});
        const Outcome outcome = render(devices);
        CAPTURE(call, outcome.error, outcome.failures);
        CHECK(fault_happened());
        CHECK(outcome.error.empty());
        CHECK(outcome.failures.find("-9999") != std::string::npos);
        CHECK(same_bytes(*outcome.film, *expected.film));
    }
    reset_shim();
}

TEST_CASE("a device that hangs is dropped after its deadline, and the others finish the picture", "[failures]") {
    const std::vector<Device> devices = two_devices(false);
    const Outcome expected = render(devices);
    REQUIRE(expected.film);
    RendererOptions options = kBrute;
    options.deadline_seconds = 3;
    for (const char* function : {"clFinish", "clEnqueueNDRangeKernel", "clEnqueueReadBuffer"}) {
        CAPTURE(function);
        reset_shim({.function = function, .call = 1, .hangs = true});
        const Outcome outcome = render(devices, options);
        CHECK(fault_happened());
        CHECK(outcome.error.empty());
        CHECK(outcome.failures.find("has not answered for 3 s") != std::string::npos);
        CHECK(same_bytes(*outcome.film, *expected.film));
        CHECK(threads_left_behind() == 1);
        release_hanging_threads();
    }
    reset_shim();
    CHECK(same_bytes(*render(devices).film, *expected.film));
}

TEST_CASE("a device that hangs alone ends the render with what is done", "[failures]") {
    RendererOptions options = kBrute;
    options.deadline_seconds = 2;
    const std::vector<Device> devices{undivided(test_device())};
    const Outcome expected = render(devices);
    reset_shim({.function = "clFinish", .call = 8, .hangs = true});
    const Outcome outcome = render(devices, options);
    CHECK(fault_happened());
    CHECK(outcome.error.find("has not answered for 2 s") != std::string::npos);
    REQUIRE(outcome.film);
    CHECK_FALSE(outcome.film->complete());
    CHECK(std::count(outcome.film->done.begin(), outcome.film->done.end(), 1) > 0);
    check_done_pixels(*outcome.film, *expected.film);
    release_hanging_threads();
    reset_shim();
}

TEST_CASE("what a team that hangs does not do, the other teams of its device do", "[failures]") {
    if (device_quirks(test_device()).teams < 2) {
        WARN("skipped: the device has no teams");
        return;
    }
    RendererOptions options = kBrute;
    options.deadline_seconds = 2;
    const std::vector<Device> devices{test_device()};
    const Outcome expected = render({undivided(test_device())});
    REQUIRE(expected.film);
    reset_shim({.function = "clFinish", .call = 8, .hangs = true});
    const Outcome outcome = render(devices, options);
    CHECK(fault_happened());
    CHECK(outcome.error.empty());
    REQUIRE(outcome.film);
    CHECK(same_bytes(*outcome.film, *expected.film));
    release_hanging_threads();
    reset_shim();
}

TEST_CASE("a driver that does not divide a device into teams is told of, and the picture is the same", "[failures]") {
    if (device_quirks(test_device()).teams < 2) {
        WARN("skipped: the device has no teams");
        return;
    }
    const Outcome expected = render({test_device()});
    REQUIRE(expected.film);
    reset_shim({.function = "clCreateContext", .call = 0});
    Renderer renderer(small_scene(), {test_device()}, kBrute);
    CHECK(fault_happened());
    CHECK(std::any_of(renderer.warnings().begin(), renderer.warnings().end(), [](const Warning& warning) {
        return warning.text.find("its cores render together") != std::string::npos;
    }));
    CHECK(same_bytes(renderer.render(small_camera(), small_options()), *expected.film));
    reset_shim();
}

TEST_CASE("a picture that two devices make differently is found out", "[failures]") {
    Scene scene = small_scene();
    scene.materials.at(0).kind = MaterialKind::plain;
    scene.materials.at(0).mirror = glm::vec3(0.0f);
    Renderer renderer(scene, two_devices(false), kBrute);
    RenderOptions options = small_options();
    options.aovs.clear();
    options.verify_share = 1.0;
    const Film expected = renderer.render(small_camera(), options);
    CHECK(renderer.statistics().verification.pixels == 24 * 24);
    CHECK_FALSE(renderer.statistics().verification.first);
    options.verify_share = 0.01;  // something is compared in the smallest picture
    renderer.render(small_camera(), options);
    CHECK(renderer.statistics().verification.pixels > 0);
    CHECK(renderer.statistics().verification.gap.empty());
    RenderOptions long_options = options;
    long_options.samples_per_pixel = 20000;
    CHECK_FALSE(renderer.render(small_camera(), long_options, [](const RenderProgress&) { return false; }).complete());
    CHECK(renderer.statistics().verification.gap == "the picture is not complete");
    options.verify_share = 0.0;
    renderer.render(small_camera(), options);
    CHECK(renderer.statistics().verification.pixels == 0);
    options.verify_share = 1.0;
    // Each piece has two reads, of the number of its rays and of its pixels; the devices take turns as they come.
    // The bit is not always one that the picture has: of a number of rays, or of a piece that the other device finished
    // first.
    int found = 0;
    for (int attempt = 0; attempt < 6 || (found == 0 && attempt < 100); ++attempt) {
        const int call = attempt % 6;
        CAPTURE(attempt, call);
        reset_shim({.function = "clEnqueueReadBuffer", .call = call, .corrupts = true});
        const Film wrong = renderer.render(small_camera(), options);
        REQUIRE(fault_happened());
        const Verification verification = renderer.statistics().verification;
        reset_shim();
        CHECK(verification.pixels == 24 * 24);
        std::vector<std::size_t> different;
        for (std::size_t i = 0; i < wrong.pixels.size(); ++i)
            if (wrong.pixels[i] != expected.pixels[i]) different.push_back(i);
        CHECK(verification.differing_pixels == different.size());
        CHECK(verification.first.has_value() == !different.empty());
        if (different.empty()) continue;
        ++found;
        REQUIRE(different.size() == 1);
        REQUIRE(verification.first);
        CHECK(verification.first->y * 24 + verification.first->x == different[0]);
        CHECK(verification.first->channel == "R");
        CHECK(verification.first->distance == 1);
        CHECK(verification.first->values[0] == wrong.pixels[different[0]].x);
        CHECK(verification.first->values[1] == expected.pixels[different[0]].x);
    }
    CHECK(found > 0);
}

TEST_CASE("another picture needs no new kernels and buffers where those of the last one suit it", "[failures]") {
    reset_shim();
    // One worker: of two teams, one may find no piece left in the first picture, and makes its buffers later. One
    // sample: how many are traced side by side, with a kernel and a buffer for their terms, depends on the pace.
    const std::vector<Device> devices{undivided(test_device())};
    Renderer renderer(small_scene(), devices, kBrute);
    RenderOptions options = small_options();
    options.aovs.clear();
    options.samples_per_pixel = 1;
    renderer.render(small_camera(), options);
    CHECK(shim_calls().at("clCreateKernel") > 5);
    CHECK(shim_calls().at("clCreateBuffer") > 5);
    const auto made_by = [&](const Camera& camera) {
        reset_shim();
        const Film film = renderer.render(camera, options);
        std::set<std::string> made;
        for (const auto& [function, count] : shim_calls())
            if (function.starts_with("clCreate") || function.starts_with("clBuild")) made.insert(function);
        CHECK(shim_calls().at("clEnqueueNDRangeKernel") > 0);
        CHECK(same_bytes(film, Renderer(small_scene(), devices, kBrute).render(camera, options)));
        return made;
    };
    const std::set<std::string> nothing;
    Camera camera = small_camera();
    CHECK(made_by(camera) == nothing);
    camera.position = {0.1f, 0.2f, 2.8f};
    CHECK(made_by(camera) == nothing);
    camera.width = camera.height = 40;
    CHECK(made_by(camera) == nothing);
    options.max_recursion_depth = 1;
    CHECK(made_by(camera) == nothing);
    const std::uint32_t tile_size = std::exchange(options.tile_size, 0);
    camera.width = camera.height = 160;
    CHECK(made_by(camera).count("clCreateBuffer") == 1);
    options.tile_size = tile_size;
    CHECK(made_by(camera) == nothing);
    reset_shim();
}

TEST_CASE("a dropped device stays dropped, and is told of", "[failures]") {
    const std::vector<Device> devices = two_devices(false);
    Renderer renderer(small_scene(), devices, kBrute);
    const Film expected = renderer.render(small_camera(), small_options());
    reset_shim({.function = "clEnqueueNDRangeKernel", .call = 3});
    std::vector<std::string> notices;
    RenderOptions options = small_options();
    options.verify_share = 1.0;
    const Film film = renderer.render(small_camera(), options, [&](const RenderProgress& progress) {
        notices.insert(notices.end(), progress.notices.begin(), progress.notices.end());
        return true;
    });
    CHECK(same_bytes(film, expected));
    REQUIRE(notices.size() == 1);
    CHECK(notices[0].find("clEnqueueNDRangeKernel failed with CL_OUT_OF_RESOURCES") != std::string::npos);
    CHECK(renderer.statistics().verification.gap == "a device was dropped");
    CHECK(renderer.statistics().verification.pixels == 0);
    reset_shim();
    CHECK(same_bytes(renderer.render(small_camera(), small_options()), expected));
    const RenderStatistics statistics = renderer.statistics();
    const bool first_is_dropped = !statistics.devices.at(0).failure.empty();
    CHECK(first_is_dropped != !statistics.devices.at(1).failure.empty());
    CHECK(statistics.devices.at(first_is_dropped ? 0 : 1).tiles == 0);
    CHECK(statistics.devices.at(first_is_dropped ? 1 : 0).tiles > 0);
}

}  // namespace castor::test
