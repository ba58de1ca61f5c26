// A scene that several ranks divide among them: the same pictures and hits as where one has all of it.
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "castor/built_scene.h"
#include "castor/error.h"
#include "render/remote_render.h"
#include "support/busy_scene.h"
#include "support/catch.h"
#include "support/divided_scene.h"
#include "support/everything_scene.h"
#include "support/picture.h"
#include "trace/chunk_order.h"
#include "trace/remote_batch.h"
#include "trace/scene_contents.h"

namespace castor::test {
namespace {

RenderOptions with_planes(std::uint32_t samples) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    options.aovs = eye_planes();
    options.tile_size = 16;
    return options;
}

}  // namespace

TEST_CASE("a picture does not tell that ranks divide the scene", "[remote][render][chunks]") {
    const Strategy strategy = GENERATE(Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet);
    const std::size_t ranks = GENERATE(2u, 3u, 4u);
    CAPTURE(to_string(strategy), ranks);
    const Scene scene = busy_scene();
    const RenderOptions options = with_planes(3);
    check_divided(scene, strategy, ranks, options,
                  Renderer(scene, {test_device()}).render(scene.cameras.front(), options));
}

TEST_CASE("a picture of a scene with textures and motion does not tell that ranks divide it",
          "[remote][render][chunks][everything]") {
    constexpr std::size_t kRanks = 3;
    const Scene scene = everything_scene();
    RenderOptions options = with_planes(3);
    options.cull_back_faces = GENERATE(false, true);
    CAPTURE(options.cull_back_faces);
    const Film expected = Renderer(scene, {test_device()}).render(scene.cameras.front(), options);
    check_divided(scene, Strategy::wide, kRanks, options, expected);
}

TEST_CASE("hits do not tell that ranks divide the scene", "[remote][tracer][chunks]") {
    const Strategy strategy = GENERATE(Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet);
    CAPTURE(to_string(strategy));
    constexpr std::size_t kRanks = 3;
    const Scene scene = busy_scene();
    const BuiltScene built = divided(scene, strategy, kRanks);
    std::vector<Ray> rays = some_rays();
    rays[7].direction[0] = rays[7].direction[1] = rays[7].direction[2] = 0.0f;
    rays[8].origin[1] = std::numeric_limits<float>::quiet_NaN();
    for (float& component : rays[9].direction) component *= 1e-36f;
    for (float& component : rays[10].direction) component *= 1e36f;
    for (std::size_t i = 11; i < 400; ++i) rays[i].t_max = 0.01f * static_cast<float>(i);
    for (std::size_t i = 400; i < 500; ++i) rays[i].t_min = 0.02f * static_cast<float>(i - 390);
    std::vector<Hit> expected(rays.size()), hits(rays.size());
    std::vector<std::uint8_t> expected_occluded(rays.size()), occluded(rays.size());
    Tracer brute(scene, {test_device()}, {Strategy::brute});
    brute.closest_hit(rays, expected);
    brute.any_hit(rays, expected_occluded);
    MemoryNetwork network(kRanks);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    std::vector<std::unique_ptr<Keeper>> keepers;
    for (std::size_t rank = 1; rank < kRanks; ++rank)
        keepers.push_back(
            std::make_unique<Keeper>(network, rank, built, strategy, static_cast<Tracer*>(nullptr),
                                     static_cast<TracerOptions*>(nullptr), [](Tracer& tracer, RankServer& server) {
                                         for (const Query query : {Query::closest, Query::any})
                                             if (!serve_trace(tracer, query, 0, Coherence::incoherent, server)) break;
                                     }));
    TracerOptions options{.strategy = strategy};
    options.scene_share = {0, kRanks};
    Tracer tracer(built, {with_little_memory(kLittleMemory)}, options);
    manager.gather(60.0, [] { return true; });
    CHECK(trace_together(tracer, rays, hits, Coherence::incoherent, {}, manager));
    CHECK(trace_together(tracer, rays, occluded, Coherence::incoherent, {}, manager));
    CHECK(std::memcmp(hits.data(), expected.data(), rays.size() * sizeof(Hit)) == 0);
    CHECK(occluded == expected_occluded);
    REQUIRE(tracer.shares().size() == kRanks);
    for (const DeviceShare& share : tracer.shares()) CHECK(share.rays > 0);
    // Rays that meet no box of a share do not travel there.
    CHECK(tracer.shares()[1].rays < 2 * rays.size());
    CHECK(manager.end(60.0));
}

TEST_CASE("where ranks with chunks are lost, others bring these to their devices", "[remote][render][chunks]") {
    const bool are_all_lost = GENERATE(false, true);
    CAPTURE(are_all_lost);
    const Scene scene = busy_scene();
    const RenderOptions options = with_planes(8);
    const BuiltScene built = divided(scene, Strategy::wide, 3);
    // Which compiles the kernels, too.
    const Film expected = Renderer(built, {with_little_memory(kLittleMemory)}, {.strategy = Strategy::wide})
                              .render(scene.cameras.front(), options);
    MemoryNetwork network(3);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    // The threads of those that are cut off end when the network goes.
    std::vector<std::unique_ptr<Keeper>> keepers;
    for (const std::size_t rank : {1u, 2u})
        keepers.push_back(rendering_keeper(network, rank, built, Strategy::wide, options));
    RendererOptions limits = leaders_options(Strategy::wide, 3);
    limits.deadline_seconds = 2.0;
    Renderer renderer(built, {with_little_memory(kLittleMemory)}, limits);
    manager.gather(60.0, [] { return true; });
    const Film film = render_together(
        renderer, scene.cameras.front(), options,
        [&](const RenderProgress& progress) {
            if (progress.samples_done > 0) network.cut(1);
            if (progress.samples_done > 0 && are_all_lost) network.cut(2);
            return true;
        },
        manager);
    CHECK(film.complete());
    CHECK(same_bytes(film, expected));
    CHECK_FALSE(renderer.statistics().devices[1].failure.empty());
    CHECK(renderer.statistics().devices[2].failure.empty() != are_all_lost);
    network.mend(1);
    network.mend(2);
    manager.end(60.0);
}

TEST_CASE("chunks are divided evenly, and neighbours stay together", "[chunks]") {
    SceneContents contents;
    contents.chunks.resize(11);
    for (std::size_t i = 0; i < contents.chunks.size(); ++i)
        contents.chunks[i].arrays.vertex_position.resize(1000 * (1 + i % 3));
    for (const std::size_t count : {1u, 2u, 3u, 5u, 11u, 14u}) {
        CAPTURE(count);
        const std::vector<Range> ranges = divide_chunks(contents, count);
        REQUIRE(ranges.size() == count);
        CHECK(ranges.front().begin == 0);
        CHECK(ranges.back().end == contents.chunks.size());
        for (std::size_t i = 0; i < count; ++i) {
            std::size_t vertices = 0;
            for (std::size_t k = ranges[i].begin; k < ranges[i].end; ++k)
                vertices += contents.chunks[k].arrays.vertex_position.size();
            if (i > 0) CHECK(ranges[i].begin == ranges[i - 1].end);
            CHECK(vertices <= 21000 / count + 3000);
            if (count <= contents.chunks.size()) CHECK(ranges[i].size() > 0);
        }
    }
}

TEST_CASE("a scene of one triangle is not divided", "[chunks]") {
    RandomSource random(3);
    const BuiltScene scene(scene_of({random_triangles(random, 1, 0.3f)}), {test_device()});
    std::vector<Warning> warnings;
    CHECK_THROWS_AS(divide_scene(scene, {test_device()}, {}, 3, warnings), SceneError);
}

TEST_CASE("orders for chunks survive their way as bytes, and nothing else is taken for them", "[remote]") {
    ChunkOrder order{.question = ChunkQuestion::surface,
                     .flags = 1,
                     .hint = Coherence::coherent,
                     .chunks = {2, 4},
                     .rays = some_rays(),
                     .hits = {}};
    order.hits.resize(order.rays.size());
    const Bytes bytes = bytes_of(order);
    const ChunkOrder read = chunk_order_of(bytes, 5);
    CHECK(read.question == order.question);
    CHECK(read.chunks == order.chunks);
    CHECK(std::memcmp(read.rays.data(), order.rays.data(), order.rays.size() * sizeof(Ray)) == 0);
    CHECK_THROWS_AS(chunk_order_of(bytes, 4), DeviceError);
    for (std::size_t length = 0; length < bytes.size(); length += 977)
        CHECK_THROWS_AS(chunk_order_of(std::span(bytes).first(length), 5), DeviceError);
    order.hits.pop_back();
    CHECK_THROWS_AS(chunk_order_of(bytes_of(order), 5), DeviceError);
    order.hits.clear();
    CHECK_THROWS_AS(chunk_order_of(bytes_of(order), 5), DeviceError);
    order.question = ChunkQuestion::any;
    CHECK_NOTHROW(chunk_order_of(bytes_of(order), 5));
    order.times.resize(order.rays.size(), 0.5f);
    CHECK(chunk_order_of(bytes_of(order), 5).times == order.times);
    order.times.pop_back();
    CHECK_THROWS_AS(chunk_order_of(bytes_of(order), 5), DeviceError);
    order.times.clear();
    order.hits.resize(order.rays.size());
    order.question = ChunkQuestion::passed;
    CHECK_THROWS_AS(chunk_order_of(bytes_of(order), 5), DeviceError);
    order.path_slots.assign(order.rays.size(), 2 * 2 * CASTOR_BLOCK_SLOTS - 1);
    order.pixel_blocks = {0, 8};
    order.wave.sample_shift = 1;
    CHECK(chunk_order_of(bytes_of(order), 5).path_slots == order.path_slots);
    ++order.path_slots.back();  // in a third block
    CHECK_THROWS_AS(chunk_order_of(bytes_of(order), 5), DeviceError);
    order.path_slots.clear();
    order.question = ChunkQuestion::closest;
    order.chunks.clear();
    CHECK_THROWS_AS(chunk_order_of(bytes_of(order), 5), DeviceError);
}

}  // namespace castor::test
