// A picture that several ranks render: the same bytes as by one process.
#include "render/remote_render.h"

#include <algorithm>
#include <array>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/stopwatch.h"
#include "castor/error.h"
#include "doctor/golden_picture.h"
#include "remote/memory_network.h"
#include "render/pixel_blocks.h"
#include "render/remote_piece.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

/// A scene with a little of everything, and a picture of it whose last blocks reach beyond its edges.
Scene make_scene() {
    Scene scene = doctor::golden_scene();
    scene.cameras.front().width = 150;
    scene.cameras.front().height = 76;
    return scene;
}

RenderOptions options_of(std::uint32_t samples, RenderOrder order = RenderOrder::pieces) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    options.tile_size = 32;
    options.order = order;
    options.aovs = {"depth", "normal", "primitive"};
    return options;
}

std::string host_of(std::size_t rank) {
    return "host" + std::to_string(rank);
}

Device device_of(std::size_t rank) {
    Device device = test_device();
    device.host = host_of(rank);
    return device;
}

/// A rank that renders, in a thread of its own.
class RenderingRank {
public:
    RenderingRank(MemoryNetwork& network, std::size_t rank, const Scene& scene, std::vector<RenderOptions> pictures)
        : thread_([&network, rank, scene, pictures] {
              const auto transport = network.endpoint(rank);
              RankServer server(*transport, 2.0, 60.0);
              try {
                  const Device device = device_of(rank);
                  Renderer renderer(scene, {device});
                  server.introduce({"v1", host_of(rank), "", {label(device)}, {""}});
                  for (const RenderOptions& options : pictures)
                      if (!serve_render(renderer, scene.cameras.front(), options, server)) break;
                  server.finish();
              } catch (const DeviceError&) {
                  // It was cut off.
              }
          }) {}
    ~RenderingRank() { thread_.join(); }

private:
    std::thread thread_;
};

}  // namespace

TEST_CASE("several ranks render the bytes of one process", "[remote][render]") {
    const std::size_t ranks = GENERATE(2u, 3u);
    const Scene scene = make_scene();
    const Camera& camera = scene.cameras.front();
    std::vector<RenderOptions> pictures{options_of(5), options_of(1), options_of(9, RenderOrder::progressive),
                                        options_of(20)};
    pictures.back().noise = 0.02;
    MemoryNetwork network(ranks);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    std::vector<std::unique_ptr<RenderingRank>> others;
    for (std::size_t rank = 1; rank < ranks; ++rank)
        others.push_back(std::make_unique<RenderingRank>(network, rank, scene, pictures));
    Renderer renderer(scene, {device_of(0)});
    manager.gather(60.0, [] { return true; });
    REQUIRE(manager.workers().size() == ranks - 1);
    for (const RenderOptions& options : pictures) {
        CAPTURE(ranks, options.samples_per_pixel);
        const Film together = render_together(renderer, camera, options, {}, manager);
        const RenderStatistics statistics = renderer.statistics();
        CHECK(same_bytes(together, renderer.render(camera, options)));
        REQUIRE(statistics.devices.size() == ranks);
        for (std::size_t rank = 0; rank < ranks; ++rank)
            CHECK(statistics.devices[rank].device == host_of(rank) + ": " + label(test_device()));
        std::uint64_t samples = 0;
        for (const DeviceShare& share : statistics.devices) samples += share.samples;
        CHECK(samples == statistics.samples_done);
        const std::uint64_t pixels = std::uint64_t{camera.width} * camera.height;
        if (!options.noise) CHECK(samples == pixels * options.samples_per_pixel);
        CHECK(statistics.pixels_by_samples.size() == (options.noise ? 2u : 1u));
    }
    CHECK(manager.end(60.0));
}

TEST_CASE("ranks verify what others made", "[remote][render]") {
    const std::size_t ranks = GENERATE(2u, 3u);
    const double share = GENERATE(0.3, 1.0);
    const Scene scene = make_scene();
    const Camera& camera = scene.cameras.front();
    std::vector<RenderOptions> pictures{options_of(5), options_of(3)};
    for (RenderOptions& options : pictures) options.verify_share = share;
    MemoryNetwork network(ranks);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    std::vector<std::unique_ptr<RenderingRank>> others;
    for (std::size_t rank = 1; rank < ranks; ++rank)
        others.push_back(std::make_unique<RenderingRank>(network, rank, scene, pictures));
    Renderer renderer(scene, {device_of(0)});
    manager.gather(60.0, [] { return true; });
    for (const RenderOptions& options : pictures) {
        const Film together = render_together(renderer, camera, options, {}, manager);
        const RenderStatistics statistics = renderer.statistics();
        RenderOptions alone = options;
        alone.verify_share = 0.0;
        CHECK(same_bytes(together, renderer.render(camera, alone)));
        CHECK(statistics.verification.gap.empty());
        CHECK_FALSE(statistics.verification.first);
        const auto pixels = static_cast<double>(camera.width * camera.height);
        CHECK(static_cast<double>(statistics.verification.pixels) >= share * 0.9 * pixels);
        CHECK(statistics.verification.pixels <= camera.width * camera.height);
    }
    CHECK(manager.end(60.0));
}

TEST_CASE("a picture that is not verified is followed by the next one", "[remote][render]") {
    const Scene scene = make_scene();
    const Camera& camera = scene.cameras.front();
    std::vector<RenderOptions> pictures{options_of(2000), options_of(3)};
    for (RenderOptions& options : pictures) options.verify_share = 1.0;
    MemoryNetwork network(2);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    const RenderingRank other(network, 1, scene, pictures);
    Renderer renderer(scene, {device_of(0)});
    manager.gather(60.0, [] { return true; });
    CHECK_FALSE(render_together(
                    renderer, camera, pictures[0], [](const RenderProgress&) { return false; }, manager)
                    .complete());
    CHECK(renderer.statistics().verification.gap == "the picture is not complete");
    CHECK(render_together(renderer, camera, pictures[1], {}, manager).complete());
    CHECK(renderer.statistics().verification.pixels == camera.width * camera.height);
    CHECK(manager.end(60.0));
}

/// A rank whose results have a wrong bit in each block.
class LyingRank {
public:
    LyingRank(MemoryNetwork& network, const Scene& scene, const RenderOptions& options)
        : thread_([&network, scene, options] {
              const auto transport = network.endpoint(1);
              Lie lie(*transport);
              RankServer server(lie, 2.0, 60.0);
              const Device device = device_of(1);
              Renderer renderer(scene, {device});
              server.introduce({"v1", host_of(1), "", {label(device)}, {""}});
              serve_render(renderer, scene.cameras.front(), options, server);
              server.finish();
          }) {}
    ~LyingRank() { thread_.join(); }

private:
    class Lie : public Transport {
    public:
        explicit Lie(Transport& transport) : transport_(transport) {}
        std::size_t rank() const override { return transport_.rank(); }
        std::size_t rank_count() const override { return transport_.rank_count(); }
        void send(std::size_t rank, Message message) override {
            // Without planes, the means are the last of a finished result.
            if (message.kind == MessageKind::result && message.payload.size() > sizeof(WorkerState))
                message.payload[message.payload.size() - sizeof(glm::vec3) * PixelBlocks::kPixels] ^= std::byte{1};
            transport_.send(rank, std::move(message));
        }
        std::optional<ReceivedMessage> receive() override { return transport_.receive(); }
        void forget(std::size_t rank) override { transport_.forget(rank); }

    private:
        Transport& transport_;
    };

    std::thread thread_;
};

TEST_CASE("a rank that sends wrong pixels is found out", "[remote][render]") {
    const Scene scene = make_scene();
    const Camera& camera = scene.cameras.front();
    RenderOptions options = options_of(20);
    options.aovs.clear();
    options.verify_share = 1.0;
    MemoryNetwork network(2);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    const LyingRank other(network, scene, options);
    Renderer renderer(scene, {device_of(0)});
    manager.gather(60.0, [] { return true; });
    render_together(renderer, camera, options, {}, manager);
    const Verification verification = renderer.statistics().verification;
    CHECK(verification.gap.empty());
    CHECK(verification.differing_pixels > 0);
    REQUIRE(verification.first);
    CHECK(verification.first->channel == "R");
    std::array<std::string, 2> makers = verification.first->devices;
    std::sort(makers.begin(), makers.end());
    CHECK(makers[0].starts_with("host0: "));
    CHECK(makers[1].starts_with("host1: "));
    CHECK(manager.end(60.0));
}

TEST_CASE("a rank that is cut off in a picture takes nothing with it", "[remote][render]") {
    const Scene scene = make_scene();
    const Camera& camera = scene.cameras.front();
    const RenderOptions options = options_of(64);
    MemoryNetwork network(3);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    RendererOptions limits;
    limits.deadline_seconds = 2.0;
    Renderer renderer(scene, {test_device()}, limits);
    const Film alone = renderer.render(camera, options);  // which compiles the kernels, too
    // Its thread ends when the network goes.
    auto cut_off = std::make_unique<RenderingRank>(network, 1, scene, std::vector{options});
    RenderingRank good(network, 2, scene, {options});
    manager.gather(60.0, [] { return true; });
    const Film film = render_together(
        renderer, camera, options,
        [&](const RenderProgress& progress) {
            if (progress.samples_done > 0) network.cut(1);
            return true;
        },
        manager);
    CHECK(film.complete());
    CHECK(same_bytes(film, alone));
    network.mend(1);
    CHECK(manager.end(60.0));
}

TEST_CASE("orders and results of pieces survive their way as bytes, and nothing else is taken for them", "[remote]") {
    PieceOrder order;
    order.begin.blocks = {3, 5};  // two that are no neighbours
    order.begin.samples = 2;
    order.begin.sums.assign(128, glm::vec4(1.5f));
    order.samples = 4;
    const Bytes bytes = bytes_of(order);
    const PieceOrder read = order_of(bytes);
    CHECK(read.begin.blocks == order.begin.blocks);
    CHECK(read.begin.sums == order.begin.sums);
    for (std::size_t length = 0; length < bytes.size(); length += 7)
        CHECK_THROWS_AS(order_of(std::span(bytes).first(length)), DeviceError);

    PieceResult result;
    result.state = {{3, 5}, 4, {}, std::vector<glm::vec3>(128, glm::vec3(0.25f))};
    result.rays = 77;
    CHECK_FALSE(result_of(bytes_of(result), order, 4).met_most_passed);
    result.met_most_passed = true;
    CHECK(result_of(bytes_of(result), order, 4).met_most_passed);
    CHECK(result_of(bytes_of(result), order, 4).state.means == result.state.means);
    CHECK(result_of(bytes_of(result), order, 4).rays == 77);
    const auto is_refused = [&](const auto& change) {
        PieceResult other = result;
        change(other);
        CHECK_THROWS_AS(result_of(bytes_of(other), order, 4), DeviceError);
    };
    is_refused([](PieceResult& other) { other.state.blocks = {3, 4, 5}; });
    is_refused([](PieceResult& other) { other.state.blocks = {4, 5}; });
    is_refused([](PieceResult& other) { other.state.samples = 5; });
    is_refused([](PieceResult& other) { other.state.samples = 1; });
    is_refused([](PieceResult& other) { other.state.samples = 3; });  // means where there should be sums
    is_refused([](PieceResult& other) { other.state.means.pop_back(); });
    is_refused([](PieceResult& other) { other.planes.emplace(); });
}

}  // namespace castor::test
