// What Wave promises: the same sums however samples are divided, and stages that are launched for live paths alone.
#include "render/wave.h"

#include <cmath>
#include <cstring>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "base/cpu_registers.h"
#include "castor/scene.h"
#include "render/camera.h"
#include "render/pixel_blocks.h"
#include "render/programs_ahead.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/picture.h"
#include "support/textured_scene.h"
#include "trace/scene_contents.h"

namespace castor::test {

namespace {

/// A mirror floor and a mirror sphere between plain ones, on a background; a part of the picture meets nothing.
Scene mirror_scene(std::uint32_t lights) {
    Scene scene;
    scene.background = {10, 20, 30};
    scene.ambient_light = {20, 21, 22};
    Material shiny = diffuse_material({0.5f, 0.3f, 0.2f});
    shiny.ambient = glm::vec3(0.5f, 0.4f, 0.3f);
    shiny.specular = glm::vec3(0.4f);
    shiny.phong_exponent = 20.0f;
    Material polished = mirror_material({0.7f, 0.6f, 0.9f});
    polished.ambient = glm::vec3(0.1f);
    polished.diffuse = glm::vec3(0.3f);
    const std::uint32_t mirror = add_material(scene, polished), plain = add_material(scene, shiny);
    scene.spheres = {
        {{-1, 0, -5}, 1.0f, mirror, 0}, {{1.2f, -0.2f, -4}, 0.8f, plain, 0}, {{0, 1, -7}, 1.0f, mirror, 0}};
    scene.meshes = {rectangle({0, -1, -5}, {2.5f, 0, 0}, {0, 0, -3}, mirror)};
    scene.planes = {{{0, 0, 9}, {0, 0, -1}, plain, 0}};
    for (std::uint32_t i = 0; i < lights; ++i)
        scene.lights.push_back(point_light({3.0f - 2.0f * static_cast<float>(i), 3, 0}, glm::vec3(300, 200, 100)));
    return scene;
}

/// A scene on the device under test, and the settings of a picture of it.
class WaveFixture {
public:
    WaveFixture(const Scene& scene, std::uint32_t width, std::uint32_t height, std::uint32_t max_depth)
        : context_(test_device()),
          tuning_(default_tuning(context_.device())),
          contents_(build_scene(scene, {tuning_.strategies})),
          scene_(context_, contents_),
          blocks_(width, height) {
        Camera camera;
        camera.left = -0.8f, camera.right = 0.8f, camera.bottom = -0.5f, camera.top = 0.5f;
        if (!scene.cameras.empty()) camera = scene.cameras.front();
        camera.width = width, camera.height = height;
        settings_.camera = make_camera(camera, "test");
        settings_.max_depth = max_depth;
        settings_.any_reflective = true;
        settings_.features = features_of(contents_.arrays());
        settings_.background_texture = contents_.arrays().background_texture;
        shared::RenderParams& params = settings_.params;
        if (scene.background_texture) params.flags |= CASTOR_RENDER_BACKGROUND_TEXTURE;
        params.seed = 5;
        params.filter = CASTOR_FILTER_GAUSSIAN;
        params.shadow_epsilon = 1e-3f;
        params.light_count = static_cast<std::uint32_t>(scene.lights.size());
        settings_.lights = {0, scene.lights.size()};
        for (int i = 0; i < 3; ++i) {
            params.background[i] = scene.background[i];
            params.ambient[i] = scene.ambient_light[i];
        }
    }

    const WaveSettings& settings() const { return settings_; }
    /// Lets waves that are made later trace paths.
    void trace_paths() {
        settings_.features.traces_paths = true;
        settings_.path_tracing = PathTracing{};
    }
    /// Says as which rays waves that are made later trace those of the eye.
    void set_eye_rays(Coherence eye_rays) { settings_.eye_rays = eye_rays; }
    DeviceContext& context() { return context_; }
    const SceneArrays& arrays() const { return contents_.arrays(); }
    const Tuning& tuning() const { return tuning_; }
    /// Lets waves that are made later sum squared deviations, and what eye rays meet.
    void sum_all() {
        settings_.params.flags |= CASTOR_RENDER_DEVIATIONS;
        settings_.wants_features = true;
    }
    std::vector<std::uint32_t> codes() const {
        std::vector<std::uint32_t> codes;
        for (std::uint32_t number = 0; number < blocks_.count(); ++number) codes.push_back(blocks_.code(number));
        return codes;
    }
    /// For waves that are made later.
    void set_lanes(std::uint32_t lanes) { context_.set_lanes(lanes); }
    /// With room for `samples` samples of every pixel.
    Wave wave(std::size_t samples) { return Wave(context_, scene_, tuning_, settings_, samples * blocks_.count()); }

private:
    DeviceContext context_;
    Tuning tuning_;
    SceneContents contents_;
    DeviceScene scene_;
    PixelBlocks blocks_;
    WaveSettings settings_{};
};

template <class Vector>
bool same_bits(const std::vector<Vector>& a, const std::vector<Vector>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Vector)) == 0;
}

}  // namespace

TEST_CASE("the programs that are built ahead are those of a wave, on CPUs", "[wave][programs]") {
    const bool traces_paths = GENERATE(false, true), has_spheres = GENERATE(false, true),
               has_many_rays = GENERATE(false, true);
    CAPTURE(traces_paths, has_spheres, has_many_rays);
    Scene scene = mirror_scene(2);
    if (!has_spheres) scene.spheres.clear();
    WaveFixture fixture(scene, 8, 8, 2);
    const bool are_few = !has_many_rays && (traces_paths || has_registers_of_16());
    fixture.set_eye_rays(are_few ? Coherence::incoherent : Coherence::coherent);
    RenderOptions options;
    if (traces_paths) {
        fixture.trace_paths();
        options.integrator = Integrator::path;
    }
    Camera camera;
    camera.width = camera.height = has_many_rays ? 4096 : 16;
    if (!walks_wide_tree(fixture.tuning().strategies.closest_coherent)) return;  // other programs depend on the trees
    DeviceContext& context = fixture.context();
    const auto programs = programs_of_pictures({camera, camera}, options)(fixture.arrays(), fixture.tuning());
    for (const KernelProgram& program : programs)
        context.build_ahead(name_of_program(context, program.source), program.options);
    const std::size_t count = context.program_count();
    CHECK(count == programs.size());

    Wave wave = fixture.wave(1);
    wave.begin(fixture.codes());
    wave.trace_samples(0, 2);
    CHECK(wave.ray_count() > 128);
    CHECK(context.program_count() == count);
}

TEST_CASE("no program is built ahead for pictures that will be refused", "[wave][programs]") {
    Scene scene = mirror_scene(1);
    scene.materials.at(0).principled = PrincipledMaterial{};
    const WaveFixture fixture(scene, 8, 8, 2);
    RenderOptions options;
    options.integrator = Integrator::whitted;
    CHECK(programs_of_pictures({Camera{}}, options)(fixture.arrays(), fixture.tuning()).empty());
}

TEST_CASE("samples side by side have the sums of samples one by one", "[wave]") {
    const std::uint32_t lights = GENERATE(0u, 1u, 3u), max_depth = GENERATE(0u, 1u, 4u);
    constexpr std::uint32_t kSamples = 21;
    CAPTURE(lights, max_depth);
    WaveFixture fixture(mirror_scene(lights), 20, 12, max_depth);  // 3 x 2 blocks, of which some lie partly outside
    const std::vector<std::uint32_t> codes = fixture.codes();

    Wave one_by_one = fixture.wave(1);
    one_by_one.begin(codes);
    for (std::uint32_t sample = 0; sample < kSamples; ++sample) one_by_one.trace_samples(sample, 1);
    const std::vector<glm::vec4> expected = one_by_one.sums();
    const std::vector<glm::vec3> expected_means = one_by_one.resolve(kSamples);
    const std::uint64_t expected_rays = one_by_one.ray_count();
    REQUIRE(expected_rays >= std::uint64_t{20 * 12} * kSamples);

    // With this much room, so many samples of two, four or all of the six blocks go side by side.
    for (const auto& [room, at_once] : {std::pair{1u, 4u}, {2u, 8u}, {3u, 16u}, {16u, 16u}}) {
        CAPTURE(room);
        Wave side_by_side = fixture.wave(room);
        side_by_side.begin(codes);
        REQUIRE(side_by_side.samples_at_once() == at_once);
        side_by_side.trace_samples(0, kSamples);
        CHECK(same_bits(side_by_side.sums(), expected));
        CHECK(same_bits(side_by_side.resolve(kSamples), expected_means));
        CHECK(side_by_side.ray_count() == expected_rays);

        // The first four samples elsewhere.
        Wave first = fixture.wave(4);
        first.begin(codes);
        first.trace_samples(0, 4);
        const std::vector<glm::vec4> sums_before = first.sums();
        CHECK_FALSE(same_bits(sums_before, expected));
        side_by_side.begin(codes, sums_before);
        side_by_side.trace_samples(4, 1);
        side_by_side.trace_samples(5, kSamples - 5);
        CHECK(same_bits(side_by_side.sums(), expected));
    }
}

TEST_CASE("deviations are those of the samples, and have the same sums side by side", "[wave][variance]") {
    constexpr std::uint32_t kSamples = 21;
    const std::uint32_t lights = GENERATE(0u, 2u), max_depth = GENERATE(0u, 3u);
    CAPTURE(lights, max_depth);
    WaveFixture plain(mirror_scene(lights), 20, 12, max_depth), fixture(mirror_scene(lights), 20, 12, max_depth);
    fixture.sum_all();
    const std::vector<std::uint32_t> codes = fixture.codes();
    const std::size_t pixels = codes.size() * PixelBlocks::kPixels;

    // One by one; and each sample alone, which gives the same terms.
    Wave one_by_one = fixture.wave(1);
    one_by_one.begin(codes);
    std::vector<std::vector<double>> luminances(pixels);
    Wave alone = plain.wave(1);
    for (std::uint32_t sample = 0; sample < kSamples; ++sample) {
        one_by_one.trace_samples(sample, 1);
        alone.begin(codes);
        alone.trace_samples(sample, 1);
        const std::vector<glm::vec4> of_sample = alone.sums();
        REQUIRE(of_sample.size() == pixels);
        for (std::size_t i = 0; i < pixels; ++i)
            luminances[i].push_back(0.2126 * of_sample[i].x + 0.7152 * of_sample[i].y + 0.0722 * of_sample[i].z);
    }
    const std::vector<glm::vec4> expected = one_by_one.sums();
    REQUIRE(expected.size() == 4 * pixels);
    bool has_noise = false;
    for (std::size_t i = 0; i < pixels; ++i) {
        double mean = 0.0, deviations = 0.0;
        for (const double luminance : luminances[i]) mean += luminance / kSamples;
        for (const double luminance : luminances[i]) deviations += (luminance - mean) * (luminance - mean);
        CAPTURE(i, mean, deviations, expected[i].w);
        // Each difference is off by a few units of the last place of the mean.
        REQUIRE(std::abs(expected[i].w - deviations) <= 1e-5 * deviations + kSamples * std::pow(1e-6 * mean, 2.0));
        has_noise |= deviations > 1.0;
    }
    CHECK(has_noise);  // of edges, at least

    Wave of_plain = plain.wave(16);
    of_plain.begin(codes);
    of_plain.trace_samples(0, kSamples);
    const std::vector<glm::vec4> without = of_plain.sums();
    for (std::size_t i = 0; i < pixels; ++i) {
        REQUIRE(glm::vec3(without[i]) == glm::vec3(expected[i]));
        REQUIRE(without[i].w == 0.0f);
    }
    for (const std::uint32_t room : {1u, 3u, 16u}) {
        CAPTURE(room);
        Wave side_by_side = fixture.wave(room);
        side_by_side.begin(codes);
        side_by_side.trace_samples(0, kSamples);
        CHECK(same_bits(side_by_side.sums(), expected));
        Wave first = fixture.wave(4);
        first.begin(codes);
        first.trace_samples(0, 5);
        side_by_side.begin(codes, first.sums());
        side_by_side.trace_samples(5, kSamples - 5);
        CHECK(same_bits(side_by_side.sums(), expected));
    }
}

TEST_CASE("fewer blocks than a wave has room for take more samples at once", "[wave]") {
    constexpr std::uint32_t kSamples = 50;
    WaveFixture fixture(mirror_scene(1), 32, 24, 2);
    Wave wave = fixture.wave(4);
    const std::vector<std::uint32_t> all = fixture.codes();
    REQUIRE(all.size() == 12);
    wave.begin(all);
    for (std::uint32_t sample = 0; sample < kSamples; ++sample) wave.trace_samples(sample, 1);
    const std::vector<glm::vec4> expected = wave.sums();
    for (const auto& [few, at_once] : {std::pair{1u, 32u}, {2u, 16u}, {5u, 16u}, {12u, 16u}}) {
        CAPTURE(few);
        wave.begin({all.data(), few});
        CHECK(wave.samples_at_once() == at_once);
        wave.trace_samples(0, kSamples);
        const std::vector<glm::vec4> sums = wave.sums();
        REQUIRE(sums.size() == few * PixelBlocks::kPixels);
        CHECK(std::memcmp(sums.data(), expected.data(), sums.size() * sizeof(glm::vec4)) == 0);
    }
}

TEST_CASE("planes that are asked for first leave the samples as they are", "[wave]") {
    WaveFixture fixture(mirror_scene(2), 20, 12, 2);
    const std::vector<std::uint32_t> codes = fixture.codes();
    Wave wave = fixture.wave(3);
    wave.begin(codes);
    wave.trace_samples(0, 5);
    const std::vector<glm::vec4> expected = wave.sums();
    const WaveAovs aovs = wave.trace_aovs(codes);
    CHECK(aovs.position_depth.size() == 4 * codes.size() * PixelBlocks::kPixels);
    wave.begin(codes);
    wave.trace_samples(0, 5);
    CHECK(same_bits(wave.sums(), expected));
}

TEST_CASE("a wave renders one picture after another", "[wave]") {
    const Scene scene = mirror_scene(2);
    WaveFixture shallow(scene, 24, 16, 0), deep(scene, 24, 16, 3);
    const std::vector<std::uint32_t> codes = deep.codes();
    Wave expected = deep.wave(1), wave = shallow.wave(4);
    expected.begin(codes);
    expected.trace_samples(0, 6);
    wave.begin(codes);
    wave.trace_samples(0, 6);
    CHECK_FALSE(same_bits(wave.sums(), expected.sums()));
    wave.set_picture(deep.settings());
    wave.begin(codes);
    wave.trace_samples(0, 6);
    CHECK(same_bits(wave.sums(), expected.sums()));
}

TEST_CASE("stages are launched for live paths alone", "[wave]") {
    // Without lights every path has one ray a bounce; 40 x 24 pixels are whole blocks.
    const bool branches = GENERATE(false, true);
    Scene scene = mirror_scene(0);
    if (branches) scene.materials[scene.spheres[0].material].kind = MaterialKind::dielectric;
    CAPTURE(branches);
    WaveFixture fixture(scene, 40, 24, 5);
    for (const std::size_t at_once : {1u, 4u}) {
        CAPTURE(at_once);
        Wave wave = fixture.wave(at_once);
        wave.begin(fixture.codes());
        wave.trace_samples(0, 4);
        const std::uint64_t eye_rays = 4 * 40 * 24;
        CHECK(wave.launched_paths() == wave.ray_count());
        CHECK(wave.launched_paths() > eye_rays);
        CHECK(wave.launched_paths() < 4 * eye_rays);
    }
}

TEST_CASE("samples with many terms are not traced side by side", "[wave]") {
    // The terms of six bounces with 63 lights are those for which 12 slots have memory.
    WaveFixture deep(mirror_scene(63), 8, 8, 5);
    Wave wave = deep.wave(24);
    wave.begin(deep.codes());
    CHECK(wave.samples_at_once() == 2);
    WaveFixture endless(mirror_scene(3), 8, 8, std::numeric_limits<std::uint32_t>::max());
    Wave alone = endless.wave(1000);
    alone.begin(endless.codes());
    CHECK(alone.samples_at_once() == 1);
}

TEST_CASE("a wave has the same sums and rays for one lane and for sixteen", "[wave][oclgrind_vectors]") {
    if (test_device().platform_name == "rusticl") return;  // it compiles for minutes what has vectors
    Scene scene = mirror_scene(2);
    Light spot, sun;
    spot.kind = Light::Kind::spot;
    spot.spot = {.position = {0, 3, -4}, .direction = {0, -1, -0.2f}, .intensity = glm::vec3(400)};
    sun.kind = Light::Kind::directional;
    sun.directional = {.direction = {0.3f, -0.8f, -0.5f}, .radiance = glm::vec3(40)};
    scene.lights.push_back(spot);
    scene.lights.push_back(sun);
    const auto small = [](std::size_t full, std::size_t least) {
        return static_cast<std::uint32_t>(test_size(full, least));
    };
    const std::uint32_t width = small(45, 9), height = small(27, 5), samples = small(6, 1);
    WaveFixture fixture(scene, width, height, 2);
    const auto sums_and_rays = [&](std::uint32_t lanes, std::size_t samples_at_once) {
        fixture.set_lanes(lanes);
        Wave wave = fixture.wave(samples_at_once);
        wave.begin(fixture.codes());
        wave.trace_samples(0, samples);
        return std::pair(wave.sums(), wave.ray_count());
    };
    for (std::size_t samples_at_once = 1; samples_at_once <= samples; samples_at_once += 2) {
        CAPTURE(samples_at_once);
        const auto [one_sums, one_rays] = sums_and_rays(1, samples_at_once);
        const auto [sums, rays] = sums_and_rays(16, samples_at_once);
        CHECK(same_bits(one_sums, sums));
        CHECK(one_rays == rays);
        CHECK(rays > 2 * std::uint64_t{width} * height * samples);
    }
}

TEST_CASE("paths have the same sums and rays for one lane and for sixteen", "[wave][path][oclgrind_vectors]") {
    if (test_device().platform_name == "rusticl") return;  // it compiles for minutes what has vectors
    const auto width = static_cast<std::uint32_t>(test_size(45, 9)),
               height = static_cast<std::uint32_t>(test_size(27, 5));
    Scene scene = mirror_scene(2);
    scene.planes.push_back({{0, 0, -20}, {0, 0, 1}, 1, 0});  // the path of the first slot goes on, as all do
    SECTION("without more") {}
    SECTION("with veils, which paths and shadow rays pass by chance") {
        Material veil;
        veil.principled = PrincipledMaterial{.alpha = 0.4f, .alpha_mode = AlphaMode::blend};
        const std::uint32_t number = add_material(scene, veil);
        for (const float z : {-1.5f, -1.7f, -2.0f})
            scene.meshes.push_back(rectangle({0, 0, z}, {2, 0, 0}, {0, 2, 0}, number));
    }
    WaveFixture fixture(scene, width, height, 2);
    fixture.trace_paths();
    const auto sums_and_rays = [&](std::uint32_t lanes) {
        fixture.set_lanes(lanes);
        Wave wave = fixture.wave(1);
        wave.begin(fixture.codes());
        wave.trace_samples(0, 1);
        return std::pair(wave.sums(), wave.ray_count());
    };
    const auto [one_sums, one_rays] = sums_and_rays(1);
    const auto [sums, rays] = sums_and_rays(16);
    CHECK(same_bits(one_sums, sums));
    CHECK(one_rays == rays);
    CHECK(rays > 2 * std::uint64_t{width} * height);
}

TEST_CASE("a wave has the same sums for one lane and for sixteen where a scene has textures", "[wave][textures]") {
    if (test_device().platform_name == "rusticl") return;  // it compiles for minutes what has vectors
    WaveFixture fixture(textured_scene(), 45, 27, 2);
    const auto sums = [&](std::uint32_t lanes) {
        fixture.set_lanes(lanes);
        Wave wave = fixture.wave(2);
        wave.begin(fixture.codes());
        wave.trace_samples(0, 2);
        return wave.sums();
    };
    CHECK(same_bits(sums(1), sums(16)));
}

TEST_CASE("paths that branch have the same sums however they are traced", "[wave][glass]") {
    Scene scene = mirror_scene(2);
    Material glass;
    glass.kind = MaterialKind::dielectric;
    glass.refraction_index = 1.4f;
    glass.absorption = {0.1f, 0.3f, 0.6f};
    glass.roughness = 0.05f;
    const std::uint32_t pane = add_material(scene, glass);
    scene.spheres.push_back({{0.3f, 0.2f, -2.5f}, 0.7f, pane, 0});
    scene.spheres.push_back({{0.3f, 0.2f, -2.5f}, 0.3f, pane, 0});
    const std::uint32_t max_depth = GENERATE(1u, 5u, 40u);
    constexpr std::uint32_t kSamples = 6;
    CAPTURE(max_depth);
    WaveFixture fixture(scene, 21, 13, max_depth);
    Wave expected = fixture.wave(1);
    expected.begin(fixture.codes());
    for (std::uint32_t sample = 0; sample < kSamples; ++sample) expected.trace_samples(sample, 1);
    for (const std::uint32_t lanes : {1u, 16u}) {
        if (lanes > 1 && test_device().platform_name == "rusticl")
            continue;  // it compiles for minutes what has vectors
        fixture.set_lanes(lanes);
        for (const std::size_t room : {1u, 8u}) {
            CAPTURE(lanes, room);
            Wave wave = fixture.wave(room);
            wave.begin(fixture.codes());
            wave.trace_samples(0, 2);
            const std::vector<glm::vec4> sums_before = wave.sums();
            wave.begin(fixture.codes(), sums_before);
            wave.trace_samples(2, kSamples - 2);
            CHECK(same_bits(wave.sums(), expected.sums()));
        }
    }
}

TEST_CASE("where trees of rays are deep, fewer samples are traced side by side", "[wave][glass]") {
    Scene scene = mirror_scene(0);
    Material glass;
    glass.kind = MaterialKind::dielectric;
    add_material(scene, glass);
    const auto samples_at_once = [&](std::uint32_t max_depth) {
        WaveFixture fixture(scene, 8, 8, max_depth);
        Wave wave = fixture.wave(64);
        wave.begin(fixture.codes());
        return wave.samples_at_once();
    };
    CHECK(samples_at_once(0) == 64);
    CHECK(samples_at_once(5) == 32);  // the children of a queue need two places each
    CHECK(samples_at_once(18) == 8);
    CHECK(samples_at_once(65535) == 1);
    CHECK(wave_bytes(1, 65535) - wave_bytes(2, 0) > 2 * 64ull * 65535 * 84 - 100'000);
    CHECK(wave_bytes(1, 5) == wave_bytes(2, 0));
}

}  // namespace castor::test
