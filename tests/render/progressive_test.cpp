// The progressive order of work: the same bytes as piece after piece, also in turns with it, and a whole picture early.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "castor/error.h"
#include "castor/renderer.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

constexpr std::uint32_t kSize = 36;  // its last blocks reach beyond the picture

Scene bright_scene() {
    RandomSource random(23);
    Scene scene = scene_of({random_triangles(random, 30, 0.6f)});
    scene.ambient_light = {20, 20, 20};
    scene.background = {7, 8, 9};
    scene.materials.at(0) = mirror_material({0.4f, 0.5f, 0.6f});
    scene.materials.at(0).ambient = {1, 1, 1};
    scene.lights = {point_light({3, 2, 4}, {900, 800, 700})};
    scene.max_recursion_depth = 2;
    return scene;
}

Camera camera() {
    return square_camera({0, 0, 3}, {0, 0, -1}, 0.5f, kSize);
}

RenderOptions options_of(RenderOrder order, std::uint32_t samples) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    options.aovs = {"depth", "primitive"};
    options.tile_size = 16;
    options.order = order;
    return options;
}

}  // namespace

TEST_CASE("a progressive render has the bytes of one piece after piece", "[renderer][progressive]") {
    const std::size_t devices = GENERATE(1u, 2u);
    const std::uint32_t samples = GENERATE(1u, 2u, 3u, 50u);
    CAPTURE(devices, samples);
    Renderer renderer(bright_scene(), std::vector<Device>(devices, test_device()));
    const Film whole = renderer.render(camera(), options_of(RenderOrder::pieces, samples));
    const std::uint64_t rays = renderer.statistics().rays;
    REQUIRE(whole.complete());
    CHECK(same_bytes(renderer.render(camera(), options_of(RenderOrder::progressive, samples)), whole));
    CHECK(renderer.statistics().samples_done == kSize * kSize * samples);
    if (devices == 1) CHECK(renderer.statistics().rays == rays);
}

TEST_CASE("a picture that stops after some time has the bytes of as many samples", "[renderer][progressive]") {
    Renderer renderer(bright_scene(), std::vector<Device>(2, test_device()));
    RenderOptions options = options_of(RenderOrder::pieces, 1u << 20);
    options.aovs = {"depth", "variance", "samples"};
    Film film;
    for (double seconds = 0.1; film.samples_per_pixel < 2; seconds *= 2.0) {
        options.stop_after_seconds = seconds;
        film = renderer.render(camera(), options);
        REQUIRE(film.complete());
        REQUIRE(renderer.statistics().part_complete);
        CHECK(renderer.statistics().samples_done == kSize * kSize * std::uint64_t{film.samples_per_pixel});
        REQUIRE(seconds < 100.0);
    }
    REQUIRE(film.samples_per_pixel < options.samples_per_pixel);
    RenderOptions whole = options;
    whole.stop_after_seconds.reset();
    whole.samples_per_pixel = film.samples_per_pixel;
    CHECK(same_bytes(renderer.render(camera(), whole), film));
    // Never more samples than are asked for.
    options.samples_per_pixel = 3;
    options.stop_after_seconds = 1e6;
    CHECK(renderer.render(camera(), options).samples_per_pixel == 3);
    const auto refuses = [&](const auto& change) {
        RenderOptions refused = options;
        change(refused);
        CHECK_THROWS_AS(renderer.render(camera(), refused), UsageError);
    };
    refuses([](RenderOptions& o) { o.stop_after_seconds = -1.0; });
    refuses([](RenderOptions& o) { o.part = PicturePart{1, 2}; });
    refuses([](RenderOptions& o) { o.checkpoint_file = "checkpoint"; });
    refuses([](RenderOptions& o) { o.resume_file = "checkpoint"; });
    refuses([](RenderOptions& o) { o.verify_share = 1.0; });
    refuses([](RenderOptions& o) { o.aovs = {"lights"}; });
}

TEST_CASE("renders in either order go on from what the other left", "[renderer][progressive][checkpoint]") {
    const RenderOrder first = GENERATE(RenderOrder::pieces, RenderOrder::progressive);
    const RenderOrder second = first == RenderOrder::pieces ? RenderOrder::progressive : RenderOrder::pieces;
    Renderer renderer(bright_scene(), std::vector<Device>(2, test_device()));
    constexpr std::uint32_t kSamples = 4000;
    const Film whole = renderer.render(camera(), options_of(RenderOrder::pieces, kSamples));
    const TemporaryDirectory folder;
    RenderOptions options = options_of(first, kSamples);
    options.checkpoint_file = folder.path() / "checkpoint";
    const Film part = renderer.render(camera(), options, [&](const RenderProgress& progress) {
        return progress.samples_done < progress.samples_total / 4;
    });
    REQUIRE_FALSE(part.complete());
    if (first == RenderOrder::progressive)  // every pixel is begun, none is done
        for (std::size_t i = 0; i < part.pixels.size(); ++i) {
            CAPTURE(i);
            CHECK(part.done[i] == 0);
            CHECK(part.pixels[i] != glm::vec3(0.0f));
        }
    const std::uint64_t done = renderer.statistics().samples_done;
    options.order = second;
    options.resume_file = options.checkpoint_file;
    CHECK(same_bytes(renderer.render(camera(), options), whole));
    CHECK(renderer.statistics().samples_resumed == done);
}

TEST_CASE("a snapshot of a render grows to the finished picture", "[renderer][progressive]") {
    Renderer renderer(bright_scene(), {test_device()});
    std::size_t begun = 0, last_begun = 0;
    Film last;
    const Film film =
        renderer.render(camera(), options_of(RenderOrder::progressive, 200), [&](const RenderProgress& progress) {
            last = progress.snapshot();
            REQUIRE(last.pixels.size() == kSize * kSize);
            REQUIRE(last.planes.size() == 2);
            begun = static_cast<std::size_t>(std::count_if(last.pixels.begin(), last.pixels.end(),
                                                           [](const auto& p) { return p != glm::vec3(0.0f); }));
            CHECK(begun >= last_begun);
            last_begun = begun;
            return true;
        });
    CHECK(begun == kSize * kSize);
    CHECK(same_bytes(last, film));
}

TEST_CASE("orders of work have names", "[renderer][progressive]") {
    for (const RenderOrder order : {RenderOrder::pieces, RenderOrder::progressive})
        CHECK(render_order_from_string(to_string(order)) == order);
    CHECK_THROWS_AS(render_order_from_string("fast"), UsageError);
}

}  // namespace castor::test
