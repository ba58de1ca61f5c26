// Renders that are interrupted and gone on with: the same bytes as at once, on other devices, in other pieces.
#include "render/checkpoint.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "base/section_file.h"
#include "castor/error.h"
#include "castor/renderer.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "render/aov.h"
#include "render/pixel_blocks.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

namespace fs = std::filesystem;

Scene scene_with_mirrors() {
    RandomSource random(17);
    Scene scene = scene_of({random_triangles(random, 40, 0.6f)});
    scene.ambient_light = {20, 20, 20};
    Material& material = scene.materials.at(0);
    material.kind = MaterialKind::mirror;
    material.ambient = {1, 1, 1};
    material.diffuse = {0.4f, 0.5f, 0.6f};
    material.mirror = {0.5f, 0.5f, 0.5f};
    scene.lights = {point_light({3, 2, 4}, {900, 800, 700})};
    scene.max_recursion_depth = 3;
    return scene;
}

Camera camera_of(std::uint32_t size) {
    return square_camera({0, 0, 3}, {0, 0, -1}, 0.5f, size);
}

RenderOptions options_of(std::uint32_t samples, std::uint32_t tile_size) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    options.tile_size = tile_size;
    options.aovs = {"depth", "primitive", "normal"};
    return options;
}

std::vector<Device> devices_of(std::size_t count) {
    return std::vector<Device>(count, test_device());
}

/// Renders until so much is done, and leaves a checkpoint of that.
void render_in_part(Renderer& renderer, const Camera& camera, RenderOptions options, const fs::path& file,
                    double share) {
    options.checkpoint_file = file;
    const Film film = renderer.render(camera, options, [&](const RenderProgress& progress) {
        CHECK(progress.notices.empty());
        return static_cast<double>(progress.samples_done) < share * static_cast<double>(progress.samples_total);
    });
    REQUIRE_FALSE(film.complete());
    REQUIRE(fs::exists(file));
}

std::uint64_t samples_of(const RenderStatistics& statistics) {
    std::uint64_t samples = 0;
    for (const DeviceShare& share : statistics.devices) samples += share.samples;
    return samples;
}

std::string refusal(Renderer& renderer, const Camera& camera, const RenderOptions& options) {
    try {
        renderer.render(camera, options);
    } catch (const SceneError& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("a render that goes on from a checkpoint has the same bytes as one at once", "[checkpoint]") {
    const Scene scene = scene_with_mirrors();
    Renderer one(scene, devices_of(1)), two(scene, devices_of(2)),
        brute(scene, devices_of(1), {.strategy = Strategy::brute});
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    const Camera camera = camera_of(52);  // its last blocks reach beyond the picture
    const std::uint32_t samples = 4000;
    const Film whole = one.render(camera, options_of(samples, 32));
    const std::uint64_t all_samples = samples_of(one.statistics());
    REQUIRE(all_samples == 52u * 52u * samples);

    render_in_part(one, camera, options_of(samples, 16), file, 0.1);
    std::uint64_t done = samples_of(one.statistics());
    const auto go_on = [&](Renderer& renderer, std::uint32_t tile_size, double share) {
        RenderOptions options = options_of(samples, tile_size);
        options.resume_file = file;
        std::uint64_t at_begin = 0;
        const auto notes_begin = [&](const RenderProgress& progress) {
            if (at_begin == 0) at_begin = progress.samples_done;
            return static_cast<double>(progress.samples_done) < share * static_cast<double>(progress.samples_total);
        };
        options.checkpoint_file = file;
        Film film = renderer.render(camera, options, notes_begin);
        CHECK(at_begin >= done);  // nothing is done again
        done += samples_of(renderer.statistics());
        return film;
    };
    REQUIRE_FALSE(go_on(two, 32, 0.4).complete());
    REQUIRE_FALSE(go_on(brute, 8, 0.6).complete());
    const Film film = go_on(two, 0, 2.0);
    CHECK(same_bytes(film, whole));
    CHECK(done == all_samples);
}

TEST_CASE("a checkpoint of a picture of one piece keeps the sums of its samples", "[checkpoint]") {
    Renderer renderer(scene_with_mirrors(), devices_of(1));
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    const Camera camera = camera_of(16);
    RenderOptions options = options_of(20000, 0);
    const Film whole = renderer.render(camera, options);
    render_in_part(renderer, camera, options, file, 0.3);
    options.resume_file = file;
    const Film so_far = renderer.render(camera, options, [](const RenderProgress&) { return false; });
    REQUIRE_FALSE(so_far.complete());
    const Checkpoint kept = load_checkpoint(file);
    std::size_t compared = 0;  // a busy machine may have cut the picture into pieces, of which some were not begun
    for (const auto& [block, partial] : kept.partial_blocks) {
        if (partial.samples < 2000) continue;
        ++compared;
        PixelBlocks(16, 16).for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
            for (std::size_t i = pixel; i < pixel + count; ++i) {
                CAPTURE(i);
                CHECK(glm::distance(so_far.pixels[i], whole.pixels[i]) <= 0.1f * glm::length(whole.pixels[i]) + 1.0f);
            }
        });
    }
    CHECK((compared > 0 || std::count(kept.film.done.begin(), kept.film.done.end(), 1) > 0));
    CHECK(same_bytes(renderer.render(camera, options), whole));
    const std::uint64_t all = 16u * 16u * 20000u;
    CHECK(samples_of(renderer.statistics()) < 0.8 * static_cast<double>(all));
}

TEST_CASE("every checkpoint that is written under way can be gone on from", "[checkpoint]") {
    const Scene scene = scene_with_mirrors();
    Renderer renderer(scene, devices_of(2));
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    const Camera camera = camera_of(64);
    RenderOptions options = options_of(2000, 24);
    const Film whole = renderer.render(camera, options);
    options.checkpoint_file = file;
    options.checkpoint_seconds = 0.0;
    int copies = 0;
    CHECK(same_bytes(renderer.render(camera, options,
                                     [&](const RenderProgress&) {
                                         if (copies < 6 && fs::exists(file))
                                             fs::copy_file(file, folder.path() / std::to_string(copies++));
                                         return true;
                                     }),
                     whole));
    CHECK(copies >= 1);
    Renderer other(scene, devices_of(1));
    for (int i = 0; i < copies; ++i) {
        CAPTURE(i);
        RenderOptions resumed = options_of(2000, 0);
        resumed.resume_file = folder.path() / std::to_string(i);
        CHECK(same_bytes(other.render(camera, resumed), whole));
        CHECK(samples_of(other.statistics()) < 64u * 64u * 2000u);
    }
}

TEST_CASE("a checkpoint that cannot be written is told of, and the picture is made", "[checkpoint]") {
    Renderer renderer(scene_with_mirrors(), devices_of(1));
    const TemporaryDirectory folder;
    RenderOptions options = options_of(8000, 16);
    const Film whole = renderer.render(camera_of(32), options);
    options.checkpoint_seconds = 0.0;
    const std::pair<fs::path, std::string> cases[] = {
        {folder.path() / "no such folder" / "checkpoint", "No such file or directory"},
        {"/dev/full", "No space left on device"}};
    for (const auto& [file, reason] : cases) {
        options.checkpoint_file = file;
        std::vector<std::string> told;
        const Film film = renderer.render(camera_of(32), options, [&](const RenderProgress& progress) {
            told.insert(told.end(), progress.notices.begin(), progress.notices.end());
            return true;
        });
        CHECK(same_bytes(film, whole));
        REQUIRE_FALSE(told.empty());
        CHECK(told.front().find("the checkpoint is not written: ") == 0);
        CHECK(told.front().find(reason) != std::string::npos);
        CHECK(renderer.statistics().notices == told);
    }
}

TEST_CASE("a checkpoint of another picture is refused with what is different", "[checkpoint]") {
    const Scene scene = scene_with_mirrors();
    Renderer renderer(scene, devices_of(1));
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    const Camera camera = camera_of(32);
    RenderOptions options = options_of(2000, 8);
    options.seed = 3;
    render_in_part(renderer, camera, options, file, 0.3);
    options.resume_file = file;
    struct Change {
        const char* expected;
        void (*change)(RenderOptions&, Camera&);
    };
    const Change changes[] = {
        {"it has \"seed 3\", this one \"seed 4\"", [](RenderOptions& o, Camera&) { o.seed = 4; }},
        {"it has \"samples 2000\", this one \"samples 2001\"",
         [](RenderOptions& o, Camera&) { o.samples_per_pixel = 2001; }},
        {"it has \"size 32x32\", this one \"size 32x40\"", [](RenderOptions&, Camera& c) { c.height = 40; }},
        {"this one \"camera position 0 0.5 3\"", [](RenderOptions&, Camera& c) { c.position.y = 0.5f; }},
        {"this one \"rules r2018\"", [](RenderOptions& o, Camera&) { o.rules = RuleSet::r2018; }},
        {"this one \"filter box\"", [](RenderOptions& o, Camera&) { o.filter = ReconstructionFilter::box; }},
        {"this one \"max depth 1\"", [](RenderOptions& o, Camera&) { o.max_recursion_depth = 1; }},
        {"this one \"back faces culled\"", [](RenderOptions& o, Camera&) { o.cull_back_faces = true; }},
        {"this one \"planes depth\"", [](RenderOptions& o, Camera&) { o.aovs = {"depth"}; }},
    };
    for (const Change& change : changes) {
        RenderOptions other = options;
        Camera other_camera = camera;
        change.change(other, other_camera);
        const std::string found = refusal(renderer, other_camera, other);
        INFO(found);
        CHECK(found.find(file.string()) == 0);
        CHECK(found.find(change.expected) != std::string::npos);
    }
    Scene moved = scene;
    moved.meshes.at(0).positions.at(5).x += 1e-6f;
    Renderer of_another_scene(moved, devices_of(1));
    CHECK(refusal(of_another_scene, camera, options).find("it has \"scene ") != std::string::npos);
}

TEST_CASE("a checkpoint that contradicts itself is refused", "[checkpoint]") {
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    Checkpoint good;
    good.picture = "size 12x9\n";
    good.film.width = 12;
    good.film.height = 9;
    good.film.samples_per_pixel = 5;
    good.film.pixels.resize(12 * 9);
    good.film.done.assign(12 * 9, 0);
    good.partial_blocks[1].samples = 2;
    const auto refusal_of = [&](const auto& spoil) -> std::string {
        Checkpoint bad = good;
        spoil(bad);
        save_checkpoint(file, bad);
        try {
            load_checkpoint(file, good);
        } catch (const SceneError& error) {
            return error.what();
        }
        return "";
    };
    CHECK(refusal_of([](Checkpoint&) {}).empty());
    CHECK(summarize_checkpoint(file).samples_done == 4 * 8 * 2);
    CHECK(refusal_of([](Checkpoint& c) { c.film.done.assign(12 * 9, 1); }).find("that are not done") !=
          std::string::npos);
    CHECK(refusal_of([](Checkpoint& c) {
              c.partial_blocks[1].samples = 5;
          }).find("has in element 0 5 samples, expected 1 to 4") != std::string::npos);
    CHECK(refusal_of([](Checkpoint& c) {
              c.partial_blocks[1].samples = 0;
          }).find("has in element 0 0 samples, expected 1 to 4") != std::string::npos);
    CHECK(refusal_of([](Checkpoint& c) {
              c.partial_blocks[4].samples = 1;
          }).find("the block 4, expected blocks below 4") != std::string::npos);
    CHECK(refusal_of([](Checkpoint& c) { c.film.samples_per_pixel = 6; }).find("its size is not that of its picture") !=
          std::string::npos);
    CHECK(refusal_of([](Checkpoint& c) {
              c = Checkpoint{.picture = c.picture, .film = {}, .partial_blocks = {}};
          }).find("expected 1 to 65536 pixels") != std::string::npos);
}

TEST_CASE("a checkpoint without the pixels of its done blocks is refused", "[checkpoint]") {
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    const std::string picture = "size 12x9\n";
    const std::uint32_t size[] = {12, 9, 5};
    const auto refusal_of = [&](const std::vector<std::uint8_t>& done, std::size_t pixel_count) -> std::string {
        const std::vector<glm::vec3> pixels(pixel_count);
        write_section_file(file, kCheckpointFile,
                           {{"checkpoint of a picture", {"bytes", 1}, std::as_bytes(std::span(picture))},
                            {"size", {"uint", 4}, std::as_bytes(std::span(size))},
                            {"done blocks", {"uchar", 1}, std::as_bytes(std::span(done))},
                            {"pixels of done blocks", {"float3", 12}, std::as_bytes(std::span(pixels))},
                            {"partial blocks", {"uint", 4}, {}},
                            {"samples of partial blocks", {"uint", 4}, {}},
                            {"sums of partial blocks", {"float4", 16}, {}},
                            {"stopped blocks", {"uint", 4}, {}},
                            {"samples of stopped blocks", {"uint", 4}, {}}});
        try {
            summarize_checkpoint(file);
        } catch (const SceneError& error) {
            return error.what();
        }
        return "";
    };
    CHECK(refusal_of({1, 0, 0, 0}, 64).empty());
    CHECK(refusal_of({0, 0, 0, 1}, 4).empty());  // the corner that is cut
    CHECK(refusal_of({1, 0, 0, 0}, 63).find("pixels of done blocks has 63 elements, expected 64") != std::string::npos);
    CHECK(refusal_of({1, 1, 1, 1}, 64).find("has 64 elements, expected 108") != std::string::npos);
    CHECK(refusal_of({1, 2, 0, 0}, 96).find("done blocks has in element 1 the flag 2, expected 0 or 1") !=
          std::string::npos);
    CHECK(refusal_of({1, 0, 0}, 64).find("done blocks has 3 elements, expected 4") != std::string::npos);
}

TEST_CASE("a checkpoint has the pixels and planes of its blocks, and no others", "[checkpoint]") {
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    Checkpoint whole;
    whole.picture = "size 100x75\n";
    Film& film = whole.film;
    film.width = 100;
    film.height = 75;
    film.samples_per_pixel = 4;
    RandomSource random(5);
    const std::size_t pixels = 100 * 75;
    for (std::size_t i = 0; i < pixels; ++i) film.pixels.push_back(random.in_box(0.0f, 1.0f));
    film.done.assign(pixels, 0);
    film.planes = make_planes({"normal", "primitive"}, film.width, film.height);
    for (float& value : film.planes[0].values) value = random.uniform_float(0.0f, 1.0f);
    for (std::uint32_t& index : film.planes[1].indices) index = random.below(1000);
    const PixelBlocks blocks(film.width, film.height);
    std::vector<std::uint8_t> is_begun(pixels);
    const std::uint32_t every = GENERATE(1u, 3u, 1000u);
    for (std::uint32_t block = 0; block < blocks.count(); ++block)
        blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
            for (std::size_t i = pixel; i < pixel + count; ++i) {
                film.done[i] = block % every == 0;
                is_begun[i] = film.done[i] || block % every == 1;
            }
        });
    for (std::uint32_t block = 1; block < blocks.count() && every > 1; block += every)
        whole.partial_blocks[block].samples = 1 + block % 3;

    save_checkpoint(file, whole);
    Checkpoint expected = whole;
    expected.film.planes = make_planes({"normal", "primitive"}, film.width, film.height);
    const std::vector<FilmPlane> nothing = expected.film.planes;
    const Checkpoint found = load_checkpoint(file, expected);
    CHECK(found.film.done == film.done);
    CHECK(found.partial_blocks.size() == whole.partial_blocks.size());
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
        wrong += found.film.pixels[i] != (film.done[i] ? film.pixels[i] : glm::vec3(0.0f));
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
            wrong += found.film.planes[0].values[c] != (is_begun[i] ? film.planes : nothing)[0].values[c];
        wrong += found.film.planes[1].indices[i] != (is_begun[i] ? film.planes : nothing)[1].indices[i];
    }
    CHECK(wrong == 0);
    constexpr std::size_t kBytesOfPixel = 12 + 12 + 4, kMostOfHeads = 16 * kSectionPageBytes;
    const auto begun = static_cast<std::size_t>(std::count(is_begun.begin(), is_begun.end(), 1));
    CHECK(fs::file_size(file) <= begun * kBytesOfPixel + whole.partial_blocks.size() * 1032 + kMostOfHeads);
}

TEST_CASE("a checkpoint that is damaged, cut short, missing or something else is refused", "[checkpoint]") {
    Renderer renderer(scene_with_mirrors(), devices_of(1));
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "checkpoint";
    RenderOptions options = options_of(2000, 8);
    render_in_part(renderer, camera_of(32), options, file, 0.3);
    options.resume_file = file;
    std::ifstream stream(file, std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(stream), {}};
    const auto refusal_of = [&](const std::string& bytes) {
        std::ofstream(file, std::ios::binary) << bytes;
        return refusal(renderer, camera_of(32), options);
    };
    for (std::size_t place = 0; place < good.size(); place += good.size() / 23) {
        std::string damaged = good;
        damaged[place] = static_cast<char>(damaged[place] ^ 0x10);
        CAPTURE(place);
        CHECK(refusal_of(damaged).find(file.string()) == 0);
    }
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{100}, good.size() / 2, good.size() - 1})
        CHECK_FALSE(refusal_of(good.substr(0, size)).empty());
    CHECK_FALSE(refusal_of("P6 2 2 255 ").empty());
    fs::remove(file);
    CHECK(refusal(renderer, camera_of(32), options).find("No such file") != std::string::npos);
}

}  // namespace castor::test
