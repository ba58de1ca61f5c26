// Checkpoints of one picture joined: parts that several renders made, and any states at all.
#include "castor/merge.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "castor/error.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "render/aov.h"
#include "render/checkpoint.h"
#include "render/picture_part.h"
#include "render/pixel_blocks.h"
#include "support/catch.h"
#include "support/child_process.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kWidth = 52, kHeight = 20, kSamples = 9;  // the last blocks reach beyond the picture

/// A state in which each block has some samples by chance. What it holds depends on the block and their number alone.
Checkpoint random_state(RandomSource& random, double share_done) {
    Checkpoint state;
    state.picture = "castor test\nsamples 9\nrules r795\nplanes depth,primitive\n";
    Film& film = state.film;
    film.width = kWidth;
    film.height = kHeight;
    film.samples_per_pixel = kSamples;
    film.pixels.assign(kWidth * kHeight, glm::vec3(0.0f));
    film.done.assign(kWidth * kHeight, 0);
    film.planes = make_planes({"depth", "primitive"}, kWidth, kHeight);
    const PixelBlocks blocks(kWidth, kHeight);
    for (std::uint32_t block = 0; block < blocks.count(); ++block) {
        if (random.uniform(0.0, 1.0) < share_done) {
            blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                for (std::size_t i = pixel; i < pixel + count; ++i) {
                    film.pixels[i] = glm::vec3(static_cast<float>(i), 0.5f, 1.0f / static_cast<float>(i + 1));
                    film.done[i] = 1;
                    film.planes[0].values[i] = static_cast<float>(i) * 0.25f;
                    film.planes[1].indices[i] = static_cast<std::uint32_t>(i % 7);
                }
            });
            continue;
        }
        const auto samples = static_cast<std::uint32_t>(random.uniform(0.0, kSamples));
        if (samples == 0) continue;
        PartialBlock& partial = state.partial_blocks[block];
        partial.samples = samples;
        for (std::size_t slot = 0; slot < partial.sums.size(); ++slot)
            partial.sums[slot] = glm::vec4(static_cast<float>(block), static_cast<float>(slot * samples), 0.25f, 0.0f);
    }
    return state;
}

class Files {
public:
    fs::path write(const Checkpoint& checkpoint) {
        const fs::path file = next();
        save_checkpoint(file, checkpoint);
        return file;
    }
    fs::path merge(const std::vector<fs::path>& files) {
        const fs::path file = next();
        merge_checkpoints(files, file);
        return file;
    }
    fs::path next() { return folder_.path() / std::to_string(count_++); }

private:
    TemporaryDirectory folder_;
    int count_ = 0;
};

template <class Error>
std::string refusal(const std::vector<fs::path>& files) {
    try {
        merge_checkpoints(files);
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

Scene small_scene() {
    RandomSource random(5);
    Scene scene = scene_of({random_triangles(random, 30, 0.6f)});
    scene.ambient_light = {20, 20, 20};
    Material& material = scene.materials.at(0);
    material.ambient = {1, 1, 1};
    material.diffuse = {0.4f, 0.5f, 0.6f};
    scene.lights = {point_light({3, 2, 4}, {900, 800, 700})};
    return scene;
}

}  // namespace

TEST_CASE("each block of a picture is in one of its parts, and parts are alike", "[merge]") {
    for (const std::uint32_t blocks : {1u, 5u, 16u, 100u, 16384u})
        for (const std::uint32_t count : {1u, 2u, 3u, 8u, 50u}) {
            CAPTURE(blocks, count);
            std::vector<std::uint32_t> sizes(count);
            for (std::uint32_t block = 0; block < blocks; ++block) {
                std::uint32_t owners = 0;
                for (std::uint32_t number = 1; number <= count; ++number)
                    if (is_of_part(block, blocks, {number, count})) {
                        ++owners;
                        ++sizes[number - 1];
                    }
                REQUIRE(owners == 1);
            }
            const auto [least, most] = std::minmax_element(sizes.begin(), sizes.end());
            CHECK(*most - *least <= std::max(1u, *most / 8));
        }
}

TEST_CASE("merging checkpoints of a picture is commutative, associative and idempotent", "[merge]") {
    RandomSource random(11);
    Files files;
    for (int round = 0; round < 10; ++round) {
        CAPTURE(round);
        const fs::path a = files.write(random_state(random, 0.2)), b = files.write(random_state(random, 0.5)),
                       c = files.write(random_state(random, 0.1));
        const std::string all = file_contents(files.merge({a, b, c}));
        CHECK((file_contents(files.merge({b, a})) == file_contents(files.merge({a, b}))));
        CHECK((file_contents(files.merge({c, b, a})) == all));
        CHECK((file_contents(files.merge({files.merge({a, b}), c})) == all));
        CHECK((file_contents(files.merge({a, files.merge({b, c})})) == all));
        CHECK((file_contents(files.merge({a, a, a})) == file_contents(a)));
        CHECK((file_contents(files.merge({files.merge({a, b, c}), b})) == all));
    }
}

TEST_CASE("a merged picture has the more samples of each block", "[merge]") {
    RandomSource random(12);
    Files files;
    const Checkpoint a = random_state(random, 0.3), b = random_state(random, 0.3);
    const MergedPicture merged = merge_checkpoints({files.write(a), files.write(b)});
    CHECK(merged.rules == RuleSet::r795);
    CHECK(merged.samples() == kWidth * kHeight * kSamples);
    CHECK(merged.film.planes.size() == 2);
    const PixelBlocks blocks(kWidth, kHeight);
    const auto samples_of = [](const Checkpoint& state, std::uint32_t block, std::size_t pixel) {
        if (state.film.done[pixel]) return kSamples;
        const auto partial = state.partial_blocks.find(block);
        return partial == state.partial_blocks.end() ? 0 : partial->second.samples;
    };
    std::uint64_t samples = 0;
    for (std::uint32_t block = 0; block < blocks.count(); ++block)
        blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
            for (std::size_t i = pixel; i < pixel + count; ++i) {
                const std::uint32_t most = std::max(samples_of(a, block, i), samples_of(b, block, i));
                samples += most;
                CHECK(merged.film.done[i] == (most == kSamples));
                if (most > 0 && most < kSamples)
                    CHECK(merged.film.pixels[i].x == static_cast<float>(block) / static_cast<float>(most));
                if (most == kSamples) CHECK(merged.film.planes[1].indices[i] == i % 7);
            }
        });
    CHECK(merged.samples_done == samples);
}

TEST_CASE("two files with other bits of as many samples are a found error", "[merge]") {
    RandomSource random(13);
    Files files;
    const Checkpoint good = random_state(random, 1.0);
    const fs::path first = files.write(random_state(random, 0.0)), second = files.write(good);
    Checkpoint bad = good;
    bad.film.pixels[kWidth * 3 + 17].y = 0.75f;
    const fs::path third = files.write(bad);
    const std::string error = refusal<DeviceError>({first, second, third});
    CAPTURE(error);
    CHECK(error.find("1 pixels have equally many samples in two files, and other values; the first is (17, 3), G: 0.5 "
                     "from " +
                     second.string() + ", 0.75 from " + third.string()) != std::string::npos);
    bad = good;
    bad.film.planes[1].indices[5] = 99;
    CHECK(refusal<DeviceError>({second, files.write(bad)}).find("(5, 0), primitive.") != std::string::npos);

    Checkpoint partial = random_state(random, 0.0);
    REQUIRE_FALSE(partial.partial_blocks.empty());
    partial.partial_blocks.begin()->second.samples = 3;
    Checkpoint other = partial;
    other.partial_blocks.begin()->second.sums[0].z = 0.5f;
    const std::string sums = refusal<DeviceError>({files.write(partial), files.write(other)});
    CAPTURE(sums);
    CHECK(sums.find("and other sums of samples; the first is (") != std::string::npos);
    CHECK(sums.find(", B: 0.25 from ") != std::string::npos);
    other.partial_blocks.begin()->second.samples = 4;  // another number of samples: they cannot be compared
    CHECK(refusal<DeviceError>({files.write(partial), files.write(other)}).empty());
}

TEST_CASE("checkpoints of other pictures, and what is no checkpoint, are refused", "[merge]") {
    RandomSource random(14);
    Files files;
    const Checkpoint state = random_state(random, 0.5);
    const fs::path good = files.write(state);
    Checkpoint other = state;
    other.picture = "castor test\nsamples 9\nrules r2022\nplanes depth,primitive\n";
    const fs::path of_other_rules = files.write(other);
    const std::string error = refusal<SceneError>({good, of_other_rules});
    CAPTURE(error);
    CHECK(error.find(of_other_rules.string()) != std::string::npos);
    CHECK(error.find("it has \"rules r2022\", " + good.string() + " \"rules r795\"") != std::string::npos);
    CHECK_THROWS_AS(merge_checkpoints({}), UsageError);
    CHECK_THROWS_AS(merge_checkpoints({good, files.next()}), SceneError);
    CHECK_THROWS_AS(merge_checkpoints({good}, "/no such folder/merged"), FileError);
    for (const char* const picture : {"castor test\nplanes depth,primitive\n", "rules new\nplanes depth,primitive\n",
                                      "rules r795\nplanes depth,colour\n", "rules r795\n"}) {
        CAPTURE(picture);
        other.picture = picture;
        CHECK_THROWS_AS(merge_checkpoints({files.write(other)}), SceneError);
    }
}

TEST_CASE("parts that several renderers made are the whole picture together", "[merge]") {
    const Scene scene = small_scene();
    Renderer wide(scene, {test_device()}), brute(scene, {test_device(), test_device()}, {.strategy = Strategy::brute});
    const Camera camera = square_camera({0, 0, 3}, {0, 0, -1}, 0.5f, 100);
    RenderOptions options;
    options.samples_per_pixel = 4;
    options.aovs = {"depth", "normal"};
    const Film whole = wide.render(camera, options);
    REQUIRE(whole.complete());
    Files files;
    for (const std::uint32_t count : {1u, 2u, 3u, 200u}) {
        CAPTURE(count);
        std::vector<fs::path> parts;
        std::uint64_t samples = 0;
        for (std::uint32_t number = count; number >= 1; --number) {
            if (count == 200 && number > 3 && number % 64 > 0) continue;
            Renderer& renderer = number % 2 ? wide : brute;
            RenderOptions of_part = options;
            of_part.part = PicturePart{number, count};
            of_part.checkpoint_file = parts.emplace_back(files.next());
            const Film film = renderer.render(camera, of_part);
            CHECK(film.complete() == (count == 1));
            CHECK(renderer.statistics().part_complete);
            samples += renderer.statistics().samples_done;
        }
        const MergedPicture merged = merge_checkpoints(parts);
        CHECK(merged.samples_done == samples);
        if (count < 200)
            CHECK(same_bytes(merged.film, whole));
        else
            CHECK_FALSE(merged.film.complete());
    }
    // A part goes on where it was, and what others have done stays.
    const fs::path so_far = files.next();
    RenderOptions of_part = options;
    of_part.checkpoint_file = so_far;
    for (const std::uint32_t number : {3u, 1u, 2u}) {
        of_part.part = PicturePart{number, 3};
        wide.render(camera, of_part);
        CHECK(wide.statistics().part_complete);
        of_part.resume_file = so_far;
    }
    CHECK(wide.statistics().samples_done == 100u * 100u * 4u);
    CHECK(same_bytes(merge_checkpoints({so_far}).film, whole));
    for (const PicturePart& part : {PicturePart{0, 3}, PicturePart{4, 3}, PicturePart{1, 0}}) {
        of_part.part = part;
        CHECK_THROWS_AS(wide.render(camera, of_part), UsageError);
    }
}

}  // namespace castor::test
