#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "castor/built_scene.h"
#include "castor/error.h"
#include "remote/memory_network.h"
#include "render/remote_render.h"
#include "support/busy_scene.h"
#include "support/catch.h"
#include "support/picture.h"
#include "trace/scene_contents.h"

namespace castor::test {

// A scene that several ranks divide, which are threads here.

inline constexpr std::uint64_t kLittleMemory = 150 << 10;  // half of it is for the scene: a third of the busy scene

inline BuiltScene divided(const Scene& scene, Strategy strategy, std::size_t shares,
                          std::uint64_t memory = kLittleMemory) {
    std::vector<Warning> warnings;
    return divide_scene(BuiltScene(scene, {test_device()}, {strategy}), {with_little_memory(memory)}, {strategy},
                        shares, warnings);
}

/// Another rank, which keeps its share of the scene in a device's little memory; in a thread of its own.
class Keeper {
public:
    template <class User, class Options, class Serve>
    Keeper(MemoryNetwork& network, std::size_t rank, const BuiltScene& scene, Strategy strategy, const User*,
           const Options*, Serve serve, std::uint64_t memory = kLittleMemory)
        : thread_([=, &network] {
              const auto transport = network.endpoint(rank);
              RankServer server(*transport, 2.0, 60.0);
              try {
                  Options options{.strategy = strategy};
                  options.scene_share = {static_cast<std::uint32_t>(rank),
                                         static_cast<std::uint32_t>(network.rank_count())};
                  User user(scene, {with_little_memory(memory)}, options);
                  server.introduce({"v1", "host" + std::to_string(rank), "", {"device"}, {""}});
                  serve(user, server);
                  server.finish();
              } catch (const DeviceError&) {
                  // It was cut off.
              }
          }) {}
    ~Keeper() { thread_.join(); }

private:
    std::thread thread_;
};

inline std::unique_ptr<Keeper> rendering_keeper(MemoryNetwork& network, std::size_t rank, const BuiltScene& scene,
                                                Strategy strategy, const RenderOptions& options,
                                                std::uint64_t memory = kLittleMemory) {
    const Camera camera = scene.description().cameras.front();
    return std::make_unique<Keeper>(
        network, rank, scene, strategy, static_cast<Renderer*>(nullptr), static_cast<RendererOptions*>(nullptr),
        [=](Renderer& renderer, RankServer& server) { serve_render(renderer, camera, options, server); }, memory);
}

inline RendererOptions leaders_options(Strategy strategy, std::size_t ranks) {
    RendererOptions options{.strategy = strategy};
    options.scene_share = {0, static_cast<std::uint32_t>(ranks)};
    return options;
}

/// Renders a scene that so many ranks divide.
inline void check_divided(const Scene& scene, Strategy strategy, std::size_t ranks, const RenderOptions& options,
                          const Film& expected, std::uint64_t memory = kLittleMemory) {
    const BuiltScene built = divided(scene, strategy, ranks, memory);
    REQUIRE(contents_of(built).chunks.size() > ranks);
    MemoryNetwork network(ranks);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    std::vector<std::unique_ptr<Keeper>> keepers;
    for (std::size_t rank = 1; rank < ranks; ++rank)
        keepers.push_back(rendering_keeper(network, rank, built, strategy, options, memory));
    Renderer renderer(built, {with_little_memory(memory)}, leaders_options(strategy, ranks));
    manager.gather(60.0, [] { return true; });
    REQUIRE(manager.workers().size() == ranks - 1);
    const Film film = render_together(renderer, scene.cameras.front(), options, {}, manager);
    CHECK(film.complete());
    CHECK(same_bytes(film, expected));
    const RenderStatistics statistics = renderer.statistics();
    REQUIRE(statistics.devices.size() == ranks);
    for (const DeviceShare& share : statistics.devices) {
        CHECK(share.failure.empty());
        CHECK(share.rays > 0);
    }
    CHECK(manager.end(60.0));
}

}  // namespace castor::test
