// What Renderer promises beside the right picture: the same bytes however the work is cut, cancellation, planes,
// errors.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <string>
#include <vector>

#include "castor/built_scene.h"
#include "castor/error.h"
#include "castor/scene_io.h"
#include "castor/tracer.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "render/camera.h"
#include "render/pixel_blocks.h"
#include "render/render_arguments.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"

namespace castor::test {

namespace {

namespace fs = std::filesystem;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// All primitives, lights of all kinds, mirrors, flat and smooth meshes; mesh and material numbers differ.
Scene busy_scene() {
    Scene scene;
    scene.background = {10, 20, 30};
    scene.ambient_light = {20, 20, 20};
    Material shiny = diffuse_material({0.5f, 0.3f, 0.2f});
    shiny.ambient = glm::vec3(0.5f);
    shiny.specular = glm::vec3(0.4f);
    shiny.phong_exponent = 20.0f;
    const std::uint32_t mirror = add_material(scene, mirror_material(glm::vec3(0.7f)));
    const std::uint32_t plain = add_material(scene, shiny);
    scene.planes = {{{0, -1, 0}, {0, 1, 0}, plain, 0}};
    scene.spheres = {{{-1, 0, -5}, 1.0f, mirror, 0}, {{1.2f, -0.2f, -4}, 0.8f, plain, 0}};
    Mesh smooth = rectangle({0, 1, -7}, {2, 0, 0}, {0, 1, 0.5f}, mirror);
    compute_smooth_normals(smooth);
    scene.meshes = {rectangle({0, -0.5f, -3}, {0.4f, 0, 0.2f}, {0, 0.4f, 0}, plain), smooth};
    Light spot;
    spot.kind = Light::Kind::spot;
    spot.spot = {{0, 4, -3}, {0, -1, -0.3f}, glm::vec3(900), 1.2f, 0.8f};
    scene.lights = {point_light({3, 3, 0}, glm::vec3(800, 700, 600)), directional_light({1, -2, -1}, glm::vec3(60)),
                    spot};
    return scene;
}

Camera busy_camera(std::uint32_t width = 70, std::uint32_t height = 45) {
    Camera camera;
    camera.left = -0.8f, camera.right = 0.8f, camera.bottom = -0.5f, camera.top = 0.5f;
    camera.width = width;
    camera.height = height;
    return camera;
}

RenderOptions all_planes(std::uint32_t samples = 1) {
    RenderOptions options;
    options.samples_per_pixel = samples;
    options.aovs = eye_planes();
    return options;
}

const FilmPlane& plane(const Film& film, const std::string& name) {
    const auto found =
        std::find_if(film.planes.begin(), film.planes.end(), [&](const FilmPlane& p) { return p.name == name; });
    REQUIRE(found != film.planes.end());
    return *found;
}

glm::vec3 vector_at(const FilmPlane& plane, std::size_t pixel) {
    return {plane.values.at(3 * pixel), plane.values.at(3 * pixel + 1), plane.values.at(3 * pixel + 2)};
}

/// A camera for what lies before the eye at the origin, on the plane z = -1: `size` pixels of edge 1, from (0, 0) to
/// the right and down.
Camera pixel_camera(std::uint32_t size) {
    Camera camera;
    camera.left = 0, camera.top = 0;
    camera.right = static_cast<float>(size), camera.bottom = -camera.right;
    camera.width = camera.height = size;
    return camera;
}

}  // namespace

TEST_CASE("a picture is the same bytes whatever the tiles, the strategy, the run, the object and the devices",
          "[renderer]") {
    const Scene scene = busy_scene();
    const Device device = test_device();
    const std::uint32_t samples = GENERATE(1u, 3u);
    Renderer renderer(scene, {device});
    const Film expected = renderer.render(busy_camera(), all_planes(samples));
    REQUIRE(expected.complete());
    REQUIRE(all_finite(expected));
    CHECK(same_bytes(renderer.render(busy_camera(), all_planes(samples)), expected));
    for (const std::uint32_t tile_size : {8u, 40u, 64u, 4096u}) {
        CAPTURE(tile_size);
        RenderOptions options = all_planes(samples);
        options.tile_size = tile_size;
        CHECK(same_bytes(renderer.render(busy_camera(), options), expected));
    }
    for (const Strategy strategy : {Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        Renderer other(scene, {device}, {strategy});
        CHECK(other.strategy() == strategy);
        CHECK(same_bytes(other.render(busy_camera(), all_planes(samples)), expected));
    }
    RenderOptions small_tiles = all_planes(samples);
    small_tiles.tile_size = 8;  // so that both have something to do
    CHECK(same_bytes(Renderer(scene, {device, device}).render(busy_camera(), small_tiles), expected));
}

TEST_CASE("a picture does not tell whether teams of a device's compute units render it", "[renderer]") {
    const Scene scene = busy_scene();
    const Device device = test_device();
    Device undivided = device;
    undivided.compute_units = 1;
    RenderOptions options = all_planes(3);
    options.tile_size = 8;  // so that all teams have something to do
    Renderer by_teams(scene, {device}), by_all(scene, {undivided});
    CHECK(same_bytes(by_teams.render(busy_camera(), options), by_all.render(busy_camera(), options)));
    const RenderStatistics teams = by_teams.statistics(), all = by_all.statistics();
    REQUIRE(teams.devices.size() == 1);  // a device is told of once, whatever teams it has
    CHECK(teams.devices[0].tiles >= all.devices[0].tiles);
    CHECK(teams.devices[0].samples == all.devices[0].samples);
    CHECK(teams.devices[0].rays == all.devices[0].rays);
    CHECK(teams.rays == all.rays);
}

TEST_CASE("a picture does not depend on those made before it", "[renderer]") {
    Renderer renderer(busy_scene(), {test_device()});
    Camera other = busy_camera(33, 20);
    other.position = {0.5f, 0.5f, 1};
    RenderOptions other_options;
    other_options.samples_per_pixel = 2;
    other_options.rules = RuleSet::r2018;
    const Film first = renderer.render(busy_camera());
    const Film second = renderer.render(other, other_options);
    CHECK(same_bytes(renderer.render(other, other_options), second));
    CHECK(same_bytes(renderer.render(busy_camera()), first));
}

TEST_CASE("a sample of a pixel does not depend on the other pixels of the picture", "[renderer]") {
    // The left upper corner alone, with the same step between pixels, has the same bytes.
    Renderer renderer(busy_scene(), {test_device()});
    RenderOptions options;
    options.samples_per_pixel = 4;
    Camera whole = pixel_camera(32), corner = pixel_camera(8);
    for (Camera* camera : {&whole, &corner}) {
        camera->position = {0, 0, 2};
        camera->distance = 32;
    }
    const Film large = renderer.render(whole, options), small = renderer.render(corner, options);
    for (std::size_t y = 0; y < 8; ++y) {
        for (std::size_t x = 0; x < 8; ++x) {
            CAPTURE(x, y);
            REQUIRE(small.pixels[8 * y + x] == large.pixels[32 * y + x]);
        }
    }
}

TEST_CASE("the seed changes the samples, not what they converge to", "[renderer]") {
    Renderer renderer(busy_scene(), {test_device()});
    RenderOptions options;
    options.samples_per_pixel = 4;
    const Film one = renderer.render(busy_camera(), options);
    options.seed = 1;
    const Film other = renderer.render(busy_camera(), options);
    CHECK_FALSE(same_bytes(one, other));
    options.samples_per_pixel = 1;  // through the centres: no seed
    const Film centres = renderer.render(busy_camera(), options);
    options.seed = 2;
    CHECK(same_bytes(renderer.render(busy_camera(), options), centres));
}

TEST_CASE("one sample goes through the pixel's centre", "[renderer]") {
    // On the plane z = -1 pixel (i, j) of pixel_camera covers [i, i+1) x (-j-1, -j].
    Scene scene;
    scene.planes = {{{0, 0, -1}, {0, 0, 1}, add_material(scene, ambient_material(glm::vec3(1))), 0}};
    const Film film = Renderer(scene, {test_device()}).render(pixel_camera(16), all_planes());
    for (std::uint32_t j = 0; j < 16; ++j) {
        for (std::uint32_t i = 0; i < 16; ++i) {
            CAPTURE(i, j);
            REQUIRE(vector_at(plane(film, "position"), 16 * j + i) == glm::vec3(i + 0.5f, -(j + 0.5f), -1.0f));
        }
    }
}

TEST_CASE("a left-handed camera mirrors the picture", "[renderer]") {
    Renderer renderer(busy_scene(), {test_device()});
    Camera camera = busy_camera(32, 20);
    const Film right = renderer.render(camera, all_planes());
    camera.left_handed = true;
    const Film left = renderer.render(camera, all_planes());
    for (std::size_t y = 0; y < 20; ++y) {
        for (std::size_t x = 0; x < 32; ++x) {
            REQUIRE(plane(left, "primitive").indices[32 * y + x] == plane(right, "primitive").indices[32 * y + 31 - x]);
        }
    }
}

TEST_CASE("without a filter, a camera's own samples have the box and others the gaussian", "[renderer]") {
    Scene scene;
    scene.background = glm::vec3(200, 100, 50);
    scene.materials.resize(1);
    scene.spheres.push_back({.center = {0, 0, -4}, .radius = 1, .material = 0});
    Camera camera;
    camera.width = camera.height = 16;
    camera.samples_per_pixel = 4;
    Renderer renderer(scene, {test_device()});
    const auto pixels = [&](RenderOptions options) { return renderer.render(camera, options).pixels; };
    const auto box = pixels({.samples_per_pixel = 4, .filter = ReconstructionFilter::box});
    const auto gaussian = pixels({.samples_per_pixel = 4, .filter = ReconstructionFilter::gaussian});
    CHECK(box != gaussian);
    CHECK(pixels({}) == box);
    CHECK(pixels({.samples_per_pixel = 4}) == gaussian);
}

TEST_CASE("the box filter's mean of a half covered pixel is its coverage", "[renderer]") {
    // A bright half plane begins at x = 4 + c: the box sees 1 - c of pixel 4. The samples of a pixel are a (0, m, 2)
    // net, one in each of 16 columns, so that a c of whole sixteenths comes out exactly.
    Scene scene;
    const double c = GENERATE(0.25, 0.5, 0.6875);
    const float edge = static_cast<float>(4 + c);
    scene.meshes = {
        rectangle({edge + 50, 0, -1}, {50, 0, 0}, {0, 50, 0}, add_material(scene, ambient_material(glm::vec3(1))))};
    scene.ambient_light = glm::vec3(160);
    RenderOptions options;
    options.samples_per_pixel = 16;
    options.filter = ReconstructionFilter::box;
    const Film film = Renderer(scene, {test_device()}).render(pixel_camera(8), options);
    for (std::size_t j = 0; j < 8; ++j) {
        CAPTURE(c, j);
        CHECK(film.pixels[8 * j + 3].x == 0.0f);
        CHECK(film.pixels[8 * j + 4].x == Approx(160 * (1 - c)));
        CHECK(film.pixels[8 * j + 5].x == 160.0f);
    }
}

TEST_CASE("the mean over samples converges to the covered part as the filter weighs it", "[renderer]") {
    // A bright half plane begins at an edge d to the left of the pixel's centre: the pixel becomes F(d), F the filter's
    // distribution function along x. box: d + 1/2; tent: 1 - (1 - d)^2 / 2 for d > 0; Gaussian of sigma 1/2: (1 + erf(d
    // / (sigma sqrt 2))) / 2 (the cut at 4 sigma takes e^-8). 64 samples in each of 64 rows; a stratified mean of one
    // pixel is off by about 1/64, that of 64 rows by less than 1/200.
    Scene scene;
    scene.ambient_light = glm::vec3(1);
    const double d = GENERATE(0.125, 0.4);
    const float edge = static_cast<float>(4.5 - d);
    scene.meshes = {
        rectangle({edge + 50, 0, -1}, {50, 0, 0}, {0, 100, 0}, add_material(scene, ambient_material(glm::vec3(1))))};
    Camera camera = pixel_camera(64);
    camera.right = 8;
    camera.width = 8;
    Renderer renderer(scene, {test_device()});
    const auto mean = [&](ReconstructionFilter filter) {
        RenderOptions options;
        options.samples_per_pixel = 64;
        options.filter = filter;
        const Film film = renderer.render(camera, options);
        double sum = 0;
        for (std::size_t j = 0; j < 64; ++j) sum += film.pixels[8 * j + 4].x;
        return sum / 64;
    };
    CAPTURE(d);
    CHECK(mean(ReconstructionFilter::box) == Approx(d + 0.5).margin(0.005));
    CHECK(mean(ReconstructionFilter::tent) == Approx(1 - 0.5 * (1 - d) * (1 - d)).margin(0.005));
    CHECK(mean(ReconstructionFilter::gaussian) == Approx(0.5 * (1 + std::erf(d * std::sqrt(2.0)))).margin(0.005));
}

namespace {

/// Where the samples of an 8-bit-edged tile lie relative to their pixels' centres: [pixel][sample], as the kernel
/// generate_rays makes them.
class SamplePositions {
public:
    static constexpr std::uint32_t kSize = 64;

    std::vector<std::vector<glm::dvec2>> operator()(std::uint32_t filter, std::uint32_t samples, std::uint32_t seed) {
        Kernel<GenerateRays> kernel(context_);
        const std::size_t count = std::size_t{kSize} * kSize;
        const auto origin = make_column<columns::ray_origin_tmin>(context_, count);
        const auto direction = make_column<columns::ray_direction_tmax>(context_, count);
        const auto counts = make_column<columns::ray_counts>(context_, count);
        context_.fill_zero(counts, 4 * count);
        const PixelBlocks blocks(kSize, kSize);
        std::vector<cl_uint> codes;
        for (std::uint32_t block = 0; block < blocks.count(); ++block) codes.push_back(blocks.code(block));
        const auto pixel_blocks = make_column<columns::pixel_blocks>(context_, codes.size());
        context_.write(pixel_blocks, codes.data(), 4 * codes.size());
        // The direction is (x, y, -1), with (x, y) the point of the image.
        const shared::Camera camera{{0, 0, 0},  0,     {0, 0, -1}, kInfinity, {1, 0, 0}, kSize,
                                    {0, -1, 0}, kSize, {},         0,         {},        0};
        shared::RenderParams params{};
        params.path_count = params.pixel_count = kSize * kSize;
        params.filter = filter;
        params.seed = seed;
        std::vector<std::vector<glm::dvec2>> positions(count);
        std::vector<glm::vec4> directions(count);
        for (params.sample = 0; params.sample < samples; ++params.sample) {
            kernel.enqueue(count, {.params = params,
                                   .camera = camera,
                                   .pixel_blocks = pixel_blocks,
                                   .ray_origin_tmin = origin,
                                   .ray_direction_tmax = direction,
                                   .ray_counts = counts});
            context_.read(direction, directions.data(), 16 * count);
            for (const glm::vec4& d : directions) {
                // Slots are numbered in blocks, along a Z curve, and samples may stray into other pixels; the order of
                // slots is enough here.
                const std::size_t slot = &d - directions.data(), block = slot / 64;
                const glm::dvec2 within(PixelBlocks::on_curve(static_cast<std::uint32_t>(slot % 64)));
                const glm::dvec2 centre = glm::dvec2(block % 8 * 8, block / 8 * 8) + within + 0.5;
                positions[slot].push_back(glm::dvec2(d.x, d.y) - centre);
            }
        }
        return positions;
    }

private:
    DeviceContext context_{test_device()};
};

}  // namespace

TEST_CASE("samples have the filter's mean, second moments and reach", "[renderer][samples]") {
    // Second moments along an axis: box 1/12; tent 1/6; Gaussian sigma^2 (1 - 8 e^-8 / (1 - e^-8)) = 0.249329 with the
    // cut at r = 4 sigma. 65536 samples: five standard errors of independent samples would be 0.01 for means and
    // moments; stratified ones do better.
    struct Case {
        std::uint32_t filter;
        double second_moment, reach;
    };
    const Case one = GENERATE(Case{CASTOR_FILTER_BOX, 1.0 / 12, 0.5}, Case{CASTOR_FILTER_TENT, 1.0 / 6, 1.0},
                              Case{CASTOR_FILTER_GAUSSIAN, 0.249329, 2.0});
    CAPTURE(one.filter);
    glm::dvec2 sum(0), squares(0);
    double product = 0, reach = 0;
    std::size_t count = 0;
    for (const auto& pixel : SamplePositions()(one.filter, 16, 7)) {
        for (const glm::dvec2& p : pixel) {
            sum += p;
            squares += p * p;
            product += p.x * p.y;
            reach = std::max(
                reach, one.filter == CASTOR_FILTER_GAUSSIAN ? glm::length(p) : std::max(std::abs(p.x), std::abs(p.y)));
            ++count;
        }
    }
    REQUIRE(count == 65536);
    for (int axis = 0; axis < 2; ++axis) {
        CHECK(std::abs(sum[axis] / count) < 0.003);
        CHECK(std::abs(squares[axis] / count - one.second_moment) < 0.003);
    }
    CHECK(std::abs(product / count) < 0.003);
    CHECK(reach <= one.reach + 1e-5);  // positions near 64 are floats with steps of 4e-6
    CHECK(reach > 0.9 * one.reach);
}

TEST_CASE("the samples of a pixel are spread evenly, and differ between pixels and seeds", "[renderer][samples]") {
    // A (0, 4, 2) net: each of the 16 cells of the 16 x 1, 8 x 2, 4 x 4, 2 x 8 and 1 x 16 grids holds one of 16
    // samples. Steps of 4e-6 at the far end may move a sample over a cell's border, so the pixels near the origin are
    // looked at.
    SamplePositions positions;
    const auto pixels = positions(CASTOR_FILTER_BOX, 32, 0);
    for (std::size_t slot = 0; slot < 64; ++slot) {
        for (const std::size_t first : {0, 16}) {  // every power of two of consecutive samples
            for (int columns = 1; columns <= 16; columns *= 2) {
                const int rows = 16 / columns;
                std::vector<int> cells(16, 0);
                for (std::size_t i = first; i < first + 16; ++i) {
                    const glm::dvec2 p = pixels[slot][i] + 0.5;
                    const int column = std::clamp(static_cast<int>(p.x * columns), 0, columns - 1);
                    const int row = std::clamp(static_cast<int>(p.y * rows), 0, rows - 1);
                    ++cells[row * columns + column];
                }
                CAPTURE(slot, first, columns);
                REQUIRE(cells == std::vector<int>(16, 1));
            }
        }
    }
    const auto reseeded = positions(CASTOR_FILTER_BOX, 1, 1);
    std::size_t like_neighbour = 0, like_reseeded = 0;
    for (std::size_t slot = 0; slot + 1 < pixels.size(); ++slot) {
        like_neighbour += glm::length(pixels[slot][0] - pixels[slot + 1][0]) < 0.001;
        like_reseeded += glm::length(pixels[slot][0] - reseeded[slot][0]) < 0.001;
    }
    CHECK(like_neighbour < 5);  // by chance one in 300 000
    CHECK(like_reseeded < 5);
}

TEST_CASE("a render that is cancelled keeps what is done, and says which pixels are", "[renderer]") {
    const Device device = test_device();
    const std::size_t devices = GENERATE(1u, 2u);
    Renderer renderer(busy_scene(), std::vector<Device>(devices, device));
    const double share_wanted = GENERATE(0.0, 0.2, 0.5);
    RenderOptions options;
    options.tile_size = 16;
    Film whole, part;
    int calls_after = 0;
    // A fast device may finish before it is stopped, or with what it was at then: then it gets more to do.
    for (std::uint32_t samples = 64; samples == 64 || (part.complete() && samples <= 65536); samples *= 4) {
        options.samples_per_pixel = samples;
        whole = renderer.render(busy_camera(), options);
        REQUIRE(whole.complete());
        bool stopped = false;
        calls_after = 0;
        part = renderer.render(busy_camera(), options, [&](const RenderProgress& progress) {
            calls_after += stopped;
            stopped = stopped || static_cast<double>(progress.samples_done) >=
                                     share_wanted * static_cast<double>(progress.samples_total);
            return !stopped;
        });
    }
    CAPTURE(devices, share_wanted, options.samples_per_pixel);
    CHECK(calls_after == 1);  // the one that tells how much there is
    REQUIRE(part.pixels.size() == whole.pixels.size());
    std::size_t done = 0, begun = 0;  // no pixel of this scene is black
    for (std::size_t i = 0; i < part.pixels.size(); ++i) {
        CAPTURE(i);
        if (part.done[i]) REQUIRE(part.pixels[i] == whole.pixels[i]);
        done += part.done[i];
        begun += !part.done[i] && part.pixels[i] != glm::vec3(0.0f);
    }
    CHECK_FALSE(part.complete());
    CHECK(all_finite(part));
    CHECK(begun <= devices * 16 * 16);  // what a device was at has the mean of the samples so far
    if (share_wanted > 0) CHECK(done > 0);
    const std::uint64_t samples = renderer.statistics().samples_done;
    CHECK(samples >= options.samples_per_pixel * done);
    CHECK(samples <= options.samples_per_pixel * (done + devices * 16 * 16));
    if (done + begun > 0) CHECK(samples > 0);
    CHECK(same_bytes(renderer.render(busy_camera(), options), whole));  // and the next is whole again
}

TEST_CASE("progress grows to the total, and statistics count what was done", "[renderer]") {
    const Device device = test_device();
    const std::size_t devices = GENERATE(1u, 2u);
    CAPTURE(devices);
    Renderer renderer(busy_scene(), std::vector<Device>(devices, device));
    RenderOptions options;
    options.samples_per_pixel = 100;
    options.tile_size = 24;
    std::vector<RenderProgress> reports;
    renderer.render(busy_camera(), options, [&](const RenderProgress& progress) {
        reports.push_back(progress);
        return true;
    });
    REQUIRE(reports.size() >= 2);
    for (std::size_t i = 0; i < reports.size(); ++i) {
        CHECK(reports[i].samples_total == 70u * 45u * 100u);
        CHECK(reports[i].devices.size() == devices);
        CHECK(reports[i].notices.empty());
        if (i == 0) continue;
        CHECK(reports[i].rays >= reports[i - 1].rays);
        CHECK(reports[i].seconds >= reports[i - 1].seconds);
    }
    CHECK(reports.back().samples_done == reports.back().samples_total);
    const RenderStatistics statistics = renderer.statistics();
    CHECK(statistics.rays == reports.back().rays);
    CHECK(statistics.rays > reports.back().samples_total);  // eye rays, and shadow and mirror rays
    CHECK(statistics.triangles == 4);
    CHECK(statistics.spheres == 2);
    CHECK(statistics.planes == 1);
    CHECK(statistics.render_seconds > 0);
    CHECK(statistics.samples_done == reports.back().samples_total);
    CHECK(statistics.samples_resumed == 0);
    REQUIRE(statistics.devices.size() == devices);
    std::uint64_t samples = 0, rays = 0;
    for (const DeviceShare& share : statistics.devices) {
        CHECK(share.device == device.name);
        CHECK(share.failure.empty());
        CHECK(share.retries == 0);
        CHECK(share.busy_seconds <= statistics.render_seconds);
        CHECK((share.tiles > 0) == (share.samples > 0));
        samples += share.samples;
        rays += share.rays;
    }
    CHECK(samples == reports.back().samples_total);
    CHECK(rays == statistics.rays);
}

TEST_CASE("a picture is whole also where its verification is stopped", "[renderer]") {
    Renderer renderer(busy_scene(), {test_device(), test_device()});
    RenderOptions options;
    options.samples_per_pixel = 64;
    const Film expected = renderer.render(busy_camera(), options);
    options.verify_share = 1.0;
    RenderProgress last;
    bool is_again = false;
    const Film film = renderer.render(busy_camera(), options, [&](const RenderProgress& progress) {
        is_again =
            is_again || progress.samples_done < last.samples_done || progress.seconds < last.seconds;  // it counts anew
        last = progress;
        return !is_again;
    });
    CHECK(is_again);
    CHECK(film.complete());
    CHECK(same_bytes(film, expected));
    CHECK(renderer.statistics().samples_done == 70u * 45u * 64u);
}

TEST_CASE("a callback's exception leaves the render, and the renderer goes on", "[renderer]") {
    struct Stop {};
    Renderer renderer(busy_scene(), {test_device()});
    CHECK_THROWS_AS(renderer.render(busy_camera(), {}, [](const RenderProgress&) -> bool { throw Stop(); }), Stop);
    CHECK(renderer.render(busy_camera()).complete());
}

TEST_CASE("planes tell what the eye rays through the pixels' centres meet, as Tracer finds it", "[renderer][aov]") {
    const Scene scene = busy_scene();
    const Camera camera = busy_camera();
    const Film film = Renderer(scene, {test_device()}).render(camera, all_planes(2));
    REQUIRE(film.planes.size() == eye_planes().size());

    // The same rays, by the formula that shared/types.h gives, with the kernel's order of operations.
    const shared::Camera c = make_camera(camera, "");
    std::vector<Ray> rays;
    for (std::uint32_t j = 0; j < camera.height; ++j) {
        for (std::uint32_t i = 0; i < camera.width; ++i) {
            glm::vec3 d;
            for (int a = 0; a < 3; ++a)
                d[a] = std::fma(i + 0.5f, c.step_x[a], std::fma(-(j + 0.5f), c.step_y[a], c.corner[a]));
            rays.push_back(make_ray(camera.position, d, c.t_min, c.t_max));
        }
    }
    std::vector<Hit> hits(rays.size());
    Tracer(scene, {test_device()}).closest_hit(rays, hits);

    const std::uint32_t materials[] = {1, 1, 0, 0, 0, 1, 1};  // of the triangles, the spheres and the plane
    std::size_t misses = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const Hit& hit = hits[i];
        INFO("pixel " << i << ", " << to_text(rays[i]));
        REQUIRE(plane(film, "primitive").indices[i] == hit.primitive);
        REQUIRE(plane(film, "instance").indices[i] == hit.instance);
        REQUIRE(plane(film, "t").values[i] == hit.t);
        REQUIRE(plane(film, "barycentric").values[2 * i] == hit.u);
        REQUIRE(plane(film, "barycentric").values[2 * i + 1] == hit.v);
        const glm::vec3 position = vector_at(plane(film, "position"), i), normal = vector_at(plane(film, "normal"), i);
        const float depth = plane(film, "depth").values[i];
        if (hit.primitive == CASTOR_INVALID_INDEX) {
            ++misses;
            REQUIRE(hit.t == kInfinity);
            REQUIRE(depth == kInfinity);
            REQUIRE(position == glm::vec3(0.0f));
            REQUIRE(normal == glm::vec3(0.0f));
            REQUIRE(vector_at(plane(film, "albedo"), i) == glm::vec3(0.0f));
            REQUIRE(plane(film, "material").indices[i] == CASTOR_INVALID_INDEX);
            continue;
        }
        REQUIRE(plane(film, "material").indices[i] == materials[hit.primitive]);
        REQUIRE(vector_at(plane(film, "albedo"), i) == scene.materials[materials[hit.primitive]].diffuse);
        const glm::dvec3 direction(direction_of(rays[i])),
            expected = glm::dvec3(camera.position) + double(hit.t) * direction;
        // A point's error is that of t: a few 1e-7 of the distance, more at grazing angles.
        REQUIRE(glm::length(glm::dvec3(position) - expected) < 1e-5 * glm::length(expected));
        REQUIRE(depth == Approx(hit.t * glm::length(direction)).epsilon(1e-5));
        glm::dvec3 expected_normal(0, 1, 0);
        if (hit.primitive < 4) {
            const Mesh& mesh = scene.meshes[hit.primitive / 2];
            const glm::uvec3 corner = mesh.triangles[hit.primitive % 2];
            const glm::dvec3 p0(mesh.positions[corner.x]);
            expected_normal = glm::normalize(
                glm::cross(glm::dvec3(mesh.positions[corner.y]) - p0, glm::dvec3(mesh.positions[corner.z]) - p0));
        } else if (hit.primitive < 6) {
            expected_normal = glm::normalize(expected - glm::dvec3(scene.spheres[hit.primitive - 4].center));
        }
        REQUIRE(glm::length(glm::dvec3(normal) - expected_normal) < 1e-5);
    }
    CHECK(misses > 0);
}

TEST_CASE("a camera's interval of t cuts off what lies before and behind", "[renderer]") {
    // Walls at z = -2 and z = -4, where t is 2 and 4: the ends of the interval count.
    Scene scene;
    const std::uint32_t material = add_material(scene, ambient_material(glm::vec3(1)));
    scene.planes = {{{0, 0, -2}, {0, 0, 1}, material, 0}, {{0, 0, -4}, {0, 0, 1}, material, 0}};
    Renderer renderer(scene, {test_device()});
    struct Case {
        float t_min, t_max;
        std::uint32_t primitive;
    };
    const std::uint32_t none = CASTOR_INVALID_INDEX;
    for (const Case& one : {Case{0, kInfinity, 0}, Case{2, 3, 0}, Case{2.5f, 4, 1}, Case{2.5f, 3.5f, none},
                            Case{0, 1, none}, Case{5, kInfinity, none}}) {
        CAPTURE(one.t_min, one.t_max);
        Camera camera = square_camera({0, 0, 0}, {0, 0, -1}, 1.0f, 1);
        camera.t_min = one.t_min;
        camera.t_max = one.t_max;
        CHECK(plane(renderer.render(camera, all_planes()), "primitive").indices[0] == one.primitive);
    }
}

TEST_CASE("wrong options are refused with a reason", "[renderer][errors]") {
    Renderer renderer(busy_scene(), {test_device()});
    const auto refuses = [&](const RenderOptions& options, const std::string& reason) {
        try {
            renderer.render(busy_camera(8, 8), options);
            FAIL("not refused: " << reason);
        } catch (const UsageError& error) {
            INFO(error.what());
            CHECK(std::string(error.what()).find(reason) != std::string::npos);
        }
    };
    RenderOptions options;
    options.aovs = {"depth", "deepness"};
    refuses(options, "there is no plane \"deepness\"");
    options.aovs = {"depth", "depth"};
    refuses(options, "twice");
    options.aovs = {};
    for (const std::uint32_t size : {1u, 12u, 4104u, 0xfffffff8u}) {
        options.tile_size = size;
        refuses(options, "tile size " + std::to_string(size));
    }
    CHECK_THROWS_AS(Renderer(busy_scene(), {}), UsageError);
    CHECK_THROWS_AS(rule_set_from_string("r2021"), UsageError);
    CHECK_THROWS_AS(reconstruction_filter_from_string("sinc"), UsageError);
    for (const RuleSet rules : {RuleSet::r2022, RuleSet::r795, RuleSet::r2020, RuleSet::r2018})
        CHECK(rule_set_from_string(to_string(rules)) == rules);
    for (const auto filter : {ReconstructionFilter::box, ReconstructionFilter::tent, ReconstructionFilter::gaussian})
        CHECK(reconstruction_filter_from_string(to_string(filter)) == filter);
}

TEST_CASE("a wrong camera is refused with file, line and reason", "[renderer][errors]") {
    Scene scene = busy_scene();
    scene.file = "room.xml";
    Renderer renderer(scene, {test_device()});
    struct Case {
        const char* reason;
        void (*damage)(Camera&);
    };
    const Case cases[] = {
        {"gaze", [](Camera& c) { c.gaze = glm::vec3(0); }},
        {"gaze", [](Camera& c) { c.gaze.x = kNan; }},
        {"up", [](Camera& c) { c.up = glm::vec3(0); }},
        {"up",
         [](Camera& c) {
             c.up = {kInfinity, 0, 0};
         }},
        {"parallel",
         [](Camera& c) {
             c.up = {0, 0, 3};
         }},
        {"parallel",
         [](Camera& c) {
             c.gaze = {1, 2, 3}, c.up = {-2, -4, -6};
         }},
        {"resolution", [](Camera& c) { c.width = 0; }},
        {"resolution", [](Camera& c) { c.height = 0; }},
        {"resolution", [](Camera& c) { c.width = 65537; }},
        {"resolution", [](Camera& c) { c.height = 1000000; }},
        {"position", [](Camera& c) { c.position.z = kInfinity; }},
        {"position", [](Camera& c) { c.position.z = 1e13f; }},
        {"window", [](Camera& c) { c.left = c.right; }},
        {"window", [](Camera& c) { c.top = kNan; }},
        {"window", [](Camera& c) { c.right = 3e38f; }},
        {"distance", [](Camera& c) { c.distance = 0; }},
        {"distance", [](Camera& c) { c.distance = -1; }},
        {"distance", [](Camera& c) { c.distance = 1e-40f; }},
        {"distance", [](Camera& c) { c.distance = 3e38f; }},
        {"t_min", [](Camera& c) { c.t_min = 2, c.t_max = 1; }},
        {"t_min", [](Camera& c) { c.t_max = kNan; }},
    };
    for (const Case& one : cases) {
        CAPTURE(one.reason, &one - cases);
        Camera camera = busy_camera(8, 8);
        camera.line = 17;
        one.damage(camera);
        try {
            renderer.render(camera);
            FAIL_CHECK("not refused");
        } catch (const SceneError& error) {
            INFO(error.what());
            CHECK(std::string(error.what()).rfind("room.xml:17: ", 0) == 0);
            CHECK(error.reason().find(one.reason) != std::string::npos);
        }
    }
}

TEST_CASE("faces of STL files are lit on the side that is seen, others on the outside alone", "[renderer]") {
    const TemporaryDirectory folder;
    const std::string begin = "solid\nfacet normal 0 0 0\nouter loop\n", end = "endloop\nendfacet\nendsolid\n";
    const std::string a = "vertex -9 -9 0\n", b = "vertex 9 -9 0\n", c = "vertex 0 9 0\n";
    const auto shown = [](Scene scene) {
        scene.lights = {point_light({1, 2, 3}, {1000, 900, 800})};
        Renderer renderer(scene, {test_device()});
        return renderer.render(square_camera({0, 0, 2}, {0, 0, -1}, 0.5f, 8), {.samples_per_pixel = 4});
    };
    Scene front = load_scene(folder.write("front.stl", begin + a + b + c + end));
    Scene back = load_scene(folder.write("back.stl", begin + a + c + b + end));
    REQUIRE((front.shades_both_sides && back.shades_both_sides));
    const Film lit = shown(front);
    CHECK(lit.pixels[27].x > 1.0f);
    const Film turned = shown(back);  // its corners have another order: the same but for rounding
    for (std::size_t i = 0; i < lit.pixels.size(); ++i)
        CHECK(glm::distance(turned.pixels[i], lit.pixels[i]) <= 1e-4f * glm::length(lit.pixels[i]));
    const fs::path file = folder.path() / "back.castor";
    back.lights = {point_light({1, 2, 3}, {1000, 900, 800})};
    BuiltScene(back, {test_device()}).save(file);
    CHECK(load_built_scene(file).description().shades_both_sides);
    Renderer saved(load_built_scene(file), {test_device()});
    CHECK(saved.render(square_camera({0, 0, 2}, {0, 0, -1}, 0.5f, 8), {.samples_per_pixel = 4}).pixels ==
          turned.pixels);
    front.shades_both_sides = back.shades_both_sides = false;
    CHECK(shown(front).pixels == lit.pixels);
    for (const glm::vec3& pixel : shown(back).pixels) CHECK(pixel.x < lit.pixels[27].x / 3);  // ambient light
}

TEST_CASE("scenes that lack something are rendered", "[renderer]") {
    Scene scene;
    scene.background = {1, 2, 3};
    const auto pixel = [&] {
        return Renderer(scene, {test_device()}).render(busy_camera(16, 16), all_planes()).pixels;
    };
    const auto all = [](const std::vector<glm::vec3>& pixels, const glm::vec3& value) {
        return std::all_of(pixels.begin(), pixels.end(), [&](const glm::vec3& p) { return p == value; });
    };
    SECTION("nothing at all: background") {
        CHECK(all(pixel(), {1, 2, 3}));
    }
    SECTION("lights, but nothing to shine on: background") {
        scene.lights = {point_light({0, 0, 0}, glm::vec3(100))};
        CHECK(all(pixel(), {1, 2, 3}));
    }
    SECTION("only planes, no lights: ambient") {
        scene.ambient_light = glm::vec3(10);
        scene.planes = {{{0, 0, -1}, {0, 0, 1}, add_material(scene, ambient_material(glm::vec3(0.5f))), 0}};
        CHECK(all(pixel(), glm::vec3(5)));
    }
    SECTION("only spheres") {
        scene.ambient_light = glm::vec3(10);
        scene.spheres = {{{0, 0, 0}, 5.0f, add_material(scene, ambient_material(glm::vec3(0.5f))), 0}};
        CHECK(all(pixel(), glm::vec3(5)));
    }
}

TEST_CASE("nasty scenes have no NaN in their pictures", "[renderer]") {
    Scene scene = busy_scene();
    scene.shadow_ray_epsilon = GENERATE(0.0f, 1e-3f);
    Camera camera = busy_camera(65, 65);  // odd: the middle pixel looks straight ahead
    camera.bottom = -0.8f, camera.top = 0.8f;
    SECTION("a light at the very point that a pixel sees, and hardly before it") {
        scene.planes.push_back({{0, 0, -2}, {0, 0, 1}, 1, 0});
        scene.lights = {point_light({0, 0, -2}, glm::vec3(1e30f)),
                        point_light({0, 0, std::nextafter(-2.0f, 0.0f)}, glm::vec3(1000))};
    }
    SECTION("a light at a denormal distance from what a pixel sees") {
        camera.position.z = 1;
        scene.planes.push_back({{0, 0, 0}, {0, 0, 1}, 0, 0});  // a material without diffuse and specular parts
        scene.lights = {point_light({0, 0, 1e-20f}, glm::vec3(1000)), point_light({0, 0, 3e-23f}, glm::vec3(1e30f))};
    }
    SECTION("a light at the eye") {
        scene.lights = {point_light(camera.position, glm::vec3(1000))};
    }
    SECTION("degenerate triangles, and zero and opposite normals, in a smooth mesh") {
        Mesh mesh;
        mesh.positions = {{-1, -1, -2}, {1, -1, -2}, {0, 1, -2}, {0, 0, -2}, {0, 0, -2}, {0, -1, -2}};
        mesh.triangles = {{0, 1, 2}, {3, 4, 5}, {0, 0, 0}, {0, 1, 5}};
        mesh.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 1}};
        mesh.material = GENERATE(0u, 1u);
        scene.meshes.push_back(mesh);
    }
    SECTION("a sphere and a rectangle at the ends of the range of coordinates") {
        scene.spheres.push_back({{0, 0, -5e11f}, 4e11f, 1, 0});
        scene.meshes.push_back(rectangle({0, 0, -1e12f}, {9e11f, 0, 0}, {0, 9e11f, 0}, 0));
    }
    SECTION("nearly parallel to a plane, far out") {
        camera.gaze = {0, 1e-9f, -1};
    }
    SECTION("a conductor without indices, seen at all angles") {
        for (Material& material : scene.materials) {
            material.kind = MaterialKind::conductor;
            material.mirror = glm::vec3(1);
            material.refraction_index = material.absorption_index = 0.0f;
        }
    }
    Renderer renderer(scene, {test_device()});
    for (const RuleSet rules : {RuleSet::r2022, RuleSet::r795, RuleSet::r2020, RuleSet::r2018}) {
        CAPTURE(to_string(rules), scene.shadow_ray_epsilon);
        RenderOptions options;
        options.rules = rules;
        CHECK(all_finite(renderer.render(camera, options)));
    }
}

}  // namespace castor::test
