// Where features meet: a scene with all of them has the same bytes however it is rendered.
#include <filesystem>
#include <string>
#include <vector>

#include "castor/built_scene.h"
#include "castor/merge.h"
#include "castor/renderer.h"
#include "render/aov.h"
#include "support/busy_scene.h"
#include "support/catch.h"
#include "support/everything_scene.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

RenderOptions with_planes() {
    RenderOptions options;
    options.samples_per_pixel = 3;
    options.aovs = eye_planes();
    options.tile_size = 16;
    return options;
}

Film expected_film() {
    const Scene scene = everything_scene();
    return Renderer(scene, {test_device()}).render(scene.cameras[0], with_planes());
}

/// Takes one path a work-item, as on a GPU.
Device in_one_lane() {
    Device device = test_device();
    device.type = DeviceType::gpu;
    return device;
}

}  // namespace

TEST_CASE("a scene with all there is has the same bytes with every strategy, tile and device", "[everything]") {
    const Scene scene = everything_scene();
    const Camera& camera = scene.cameras[0];
    const RenderOptions options = with_planes();
    const Film expected = expected_film();
    REQUIRE(all_finite(expected));
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        CHECK(same_bytes(Renderer(scene, {test_device()}, {.strategy = strategy}).render(camera, options), expected));
    }
    CHECK(same_bytes(Renderer(scene, {in_one_lane()}, {.strategy = Strategy::simt}).render(camera, options), expected));
    Renderer two(scene, {test_device(), test_device()});
    for (const std::uint32_t tile_size : {8u, 4096u}) {
        CAPTURE(tile_size);
        RenderOptions tiles = options;
        tiles.tile_size = tile_size;
        CHECK(same_bytes(two.render(camera, tiles), expected));
    }
    const Device whole = test_device();
    if (whole.type != DeviceType::cpu || whole.compute_units < 2) return;
    RenderOptions tiles = options;
    tiles.tile_size = 8;
    CHECK(same_bytes(Renderer(scene, select_devices(std::to_string(whole.index) + "/2")).render(camera, tiles),
                     expected));
}

TEST_CASE("a scene with all there is has the same bytes from a file, in chunks, in parts and resumed",
          "[everything][chunks][checkpoint][merge]") {
    const Scene scene = everything_scene();
    const Camera& camera = scene.cameras[0];
    const RenderOptions options = with_planes();
    const Film expected = expected_film();
    const TemporaryDirectory folder;
    BuiltScene(scene, {test_device()}).save(folder.path() / "scene.castor");
    Renderer saved(load_built_scene(folder.path() / "scene.castor"), {test_device()});
    CHECK(same_bytes(saved.render(camera, options), expected));
    Renderer cut(scene, {with_little_memory(100 << 10)});
    CHECK(same_bytes(cut.render(camera, options), expected));

    std::vector<std::filesystem::path> parts;
    for (const std::uint32_t number : {1u, 2u}) {
        parts.push_back(folder.path() / ("part" + std::to_string(number)));
        RenderOptions part = options;
        part.part = PicturePart{number, 2};
        part.checkpoint_file = parts.back();
        part.tile_size = 8;
        saved.render(camera, part);
    }
    CHECK(same_bytes(merge_checkpoints(parts).film, expected));
    RenderOptions rest = options;
    rest.resume_file = parts[1];
    CHECK(same_bytes(saved.render(camera, rest), expected));
    CHECK(saved.statistics().samples_resumed > 0);
}

}  // namespace castor::test
