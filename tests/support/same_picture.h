#pragma once

#include <cstdint>

#include "castor/built_scene.h"
#include "castor/renderer.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {

/// Checks that the scene's first camera shows the same bytes however a device does the work.
inline void check_every_way(const Scene& scene, const RenderOptions& options, const Film& expected) {
    const Camera& camera = scene.cameras.front();
    const Device device = test_device();
    Renderer renderer(scene, {device});
    for (const std::uint32_t tile_size : {8u, 4096u}) {
        CAPTURE(tile_size);
        RenderOptions tiled = options;
        tiled.tile_size = tile_size;
        CHECK(same_bytes(renderer.render(camera, tiled), expected));
    }
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        CHECK(same_bytes(Renderer(scene, {device}, {strategy}).render(camera, options), expected));
    }
    Device in_one_lane = device;
    in_one_lane.type = DeviceType::gpu;
    CHECK(same_bytes(Renderer(scene, {in_one_lane}, {.strategy = Strategy::simt}).render(camera, options), expected));
    const TemporaryDirectory folder;
    BuiltScene(scene, {device}).save(folder.path() / "scene");
    CHECK(same_bytes(Renderer(load_built_scene(folder.path() / "scene"), {device}).render(camera, options), expected));
}

}  // namespace castor::test
