// Whatever a stored profile says within tuning_space, hits and pictures are the same bits.
#include "trace/tuning.h"

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "castor/tracer.h"
#include "reference/meshes.h"
#include "reference/nasty_scenes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"
#include "test_paths.h"
#include "trace/profile_file.h"
#include "trace/strategy.h"

namespace castor::test {
namespace {

constexpr Coherence kHints[] = {Coherence::incoherent, Coherence::coherent};

Scene scene_of_everything() {
    RandomSource random(41);
    Scene scene = scene_of({random_triangles(random, 400, 0.3f)});
    for (int i = 0; i < 20; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.05f, 0.3f), 0, 0});
    scene.planes.push_back({{0, -1, 0}, {0, 1, 0}, 0, 0});
    return scene;
}

/// No multiple of any batch or group, in bundles and not.
std::vector<Ray> mixed_rays() {
    RandomSource random(42);
    std::vector<Ray> rays;
    glm::vec3 origin(0);
    for (std::size_t i = 0; i < test_size(9'001); ++i) {
        if (i % 16 == 0 || i > 5'000) origin = random.in_box(-2, 2);
        rays.push_back(make_ray(origin, random.in_box(-1, 1) * (i > 5'000 ? 1.0f : 0.1f) - origin, 0.0f,
                                i % 4 ? std::numeric_limits<float>::infinity() : random.uniform_float(0, 2)));
    }
    return rays;
}

struct Answers {
    std::vector<Hit> hits;
    std::vector<std::uint8_t> occluded;
};

Answers trace(Tracer& tracer, const std::vector<Ray>& rays, Coherence hint) {
    Answers answers{std::vector<Hit>(rays.size()), std::vector<std::uint8_t>(rays.size(), 0xff)};
    tracer.closest_hit(rays, answers.hits, hint);
    tracer.any_hit(rays, answers.occluded, hint);
    return answers;
}

/// Enough tunings that each number has each of its values, and each kind of ray each strategy.
std::vector<Tuning> every_value(const TuningSpace& space) {
    std::size_t count = space.strategies.size();
    for (const TuningNumber& number : space.numbers) count = std::max(count, number.allowed.size());
    std::vector<Tuning> tunings(count);
    for (std::size_t i = 0; i < count; ++i) {
        std::size_t kind_index = 0;
        for (const auto& [kind, name] : kRayKindsOfChoice)
            tunings[i].strategies.*kind = space.strategies[(i + kind_index++) % space.strategies.size()];
        for (const TuningNumber& number : space.numbers)
            tunings[i].*number.value = number.allowed[i % number.allowed.size()];
    }
    return tunings;
}

}  // namespace

TEST_CASE("every value that can be tuned gives the hits of brute force", "[tuning]") {
    const TemporaryDirectory directory;
    const ScopedVariable folder("CASTOR_PROFILE_DIR", directory.path().string());
    const Device device = test_device();
    const Scene scene = scene_of_everything();
    const std::vector<Ray> rays = mixed_rays();
    Tracer brute(scene, {device}, {Strategy::brute});
    const Answers expected = trace(brute, rays, Coherence::incoherent);
    CHECK(std::count_if(expected.hits.begin(), expected.hits.end(),
                        [](const Hit& hit) { return hit.primitive != CASTOR_INVALID_INDEX; }) > 1000);

    for (const Tuning& tuning : every_value(tuning_space(device))) {
        write_profile(profile_file(device), device, tuning);
        INFO(profile_text(device, tuning));
        Tracer tracer(scene, {device});
        CHECK(tracer.warnings().empty());
        for (const Coherence hint : kHints) {
            CHECK(tracer.strategy(hint) == tuning.strategies.of(Query::closest, hint));
            CHECK(tracer.strategy(hint, Query::any) == tuning.strategies.of(Query::any, hint));
            const Answers found = trace(tracer, rays, hint);
            CHECK(std::memcmp(found.hits.data(), expected.hits.data(), rays.size() * sizeof(Hit)) == 0);
            CHECK(found.occluded == expected.occluded);
        }
    }
}

TEST_CASE("bundles give the hits of brute force, whatever the registers of a CPU hold", "[tuning]") {
    const Device device = test_device();
    Scene scene = scene_of_everything();
    if (GENERATE(false, true)) scene.spheres.clear();  // kernels for triangles alone
    std::vector<Ray> rays = mixed_rays();
    RandomSource random(43);
    const std::vector<Ray> bundles = reference::bundles_about(rays, random, 1.0f);
    rays.insert(rays.end(), bundles.begin(), bundles.end());
    Tracer brute(scene, {device}, {Strategy::brute});
    const Answers expected = trace(brute, rays, Coherence::incoherent);
    for (const char* const options : {"-Werror -DCASTOR_REGISTERS_OF_16=0", "-Werror -DCASTOR_REGISTERS_OF_16=1"}) {
        CAPTURE(options, scene.spheres.size());
        const ScopedVariable variable("CASTOR_BUILD_OPTIONS", options);
        Tracer tracer(scene, {device}, {Strategy::packet});
        const Answers found = trace(tracer, rays, Coherence::coherent);
        CHECK(std::memcmp(found.hits.data(), expected.hits.data(), rays.size() * sizeof(Hit)) == 0);
        CHECK(found.occluded == expected.occluded);
    }
}

TEST_CASE("a tuning's numbers reach the kernels", "[tuning]") {
    const Device device = test_device();
    Tuning tuning = default_tuning(device);
    tuning.wide_lanes = 12;
    tuning.wide_batch = 32;
    for (const Strategy strategy : {Strategy::wide, Strategy::packet}) {
        tuning.strategies = StrategyChoice::all(strategy);
        const SceneContents contents = build_scene(scene_of_everything(), {tuning.strategies});
        // A program that compiles unless it gets them.
        const std::string name = "trace_" + std::string(to_string(strategy)) + ".cl";
        const kernels::SourceTable sources = {
            {name, "#if CASTOR_WIDE_LANES == 12 && CASTOR_WIDE_BATCH == 32\n#error \"there they are\"\n#endif\n"}};
        DeviceContext context(device, sources);
        const DeviceScene scene(context, contents);
        TraceKernels kernels(context, scene, tuning);
        const auto rays = TraceKernels::RayBuffers::records(context.make_buffer(sizeof(Ray), "rays"));
        const auto hits = make_column<columns::hits>(context, 1);
        CHECK_THROWS_WITH(kernels.closest_hit(context.queue(), scene, rays, hits, 0, 1, 0, Coherence::coherent),
                          Catch::Matchers::Contains("there they are"));
    }
}

TEST_CASE("a work-group larger than the device allows is made smaller", "[tuning]") {
    const Device device = test_device();
    Tuning tuning = default_tuning(device);
    tuning.strategies = StrategyChoice::all(Strategy::simt);
    tuning.local_size = 1u << 20;
    const SceneContents contents = build_scene(scene_of_everything(), {tuning.strategies});
    DeviceContext context(device);
    const DeviceScene scene(context, contents);
    TraceKernels kernels(context, scene, tuning);
    const std::vector<Ray> rays = mixed_rays();
    const cl::Buffer ray_buffer = context.make_buffer(rays.size() * sizeof(Ray), "rays");
    const auto hit_buffer = make_column<columns::hits>(context, rays.size());
    context.write(ray_buffer, rays.data(), rays.size() * sizeof(Ray));
    kernels.closest_hit(context.queue(), scene, TraceKernels::RayBuffers::records(ray_buffer), hit_buffer, 0,
                        rays.size(), 0, Coherence::coherent);
    std::vector<Hit> hits(rays.size());
    context.read(hit_buffer, hits.data(), rays.size() * sizeof(Hit));
    Tracer tracer(scene_of_everything(), {device});
    CHECK(std::memcmp(hits.data(), trace(tracer, rays, Coherence::coherent).hits.data(), rays.size() * sizeof(Hit)) ==
          0);
}

TEST_CASE("a picture does not tell which profile was in use, and a wrong one is a warning", "[tuning]") {
    const TemporaryDirectory directory;
    const ScopedVariable folder("CASTOR_PROFILE_DIR", directory.path().string());
    const Device device = test_device();
    Scene scene = load_scene(CASTOR_SOURCE_DIR "/scenes/mirrors.xml");
    Camera camera = scene.cameras.at(0);
    camera.width = camera.height = 40;
    const RenderOptions options{.samples_per_pixel = 2};
    Renderer plain(scene, {device}, {.use_profiles = false});
    const Film expected = plain.render(camera, options);

    const Tuning odd = every_value(tuning_space(device)).at(1);
    write_profile(profile_file(device), device, odd);
    Renderer tuned(scene, {device});
    CHECK(tuned.strategy() == odd.strategies.closest_coherent);
    CHECK(tuned.strategy(Coherence::incoherent, Query::any) == odd.strategies.any_incoherent);
    CHECK(tuned.warnings().size() == plain.warnings().size());
    CHECK(tuned.render(camera, options).pixels == expected.pixels);

    directory.write("profiles/" + profile_file(device).filename().string(), "{");
    Renderer warned(scene, {device, device});
    REQUIRE(warned.warnings().size() == plain.warnings().size() + 1);
    CHECK(warned.warnings().back().file == profile_file(device).string());
    CHECK(warned.render(camera, options).pixels == expected.pixels);
    CHECK(Tracer(scene, {device}).warnings().back().text.find("damaged") != std::string::npos);
    CHECK(Tracer(scene, {device}, {.use_profiles = false}).warnings().size() == plain.warnings().size());
}

}  // namespace castor::test
