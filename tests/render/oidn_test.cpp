// Removing noise by Open Image Denoise, with libraries that stand in for it: support/oidn_stand_in.cpp.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "castor/denoise.h"
#include "castor/error.h"
#include "castor/merge.h"
#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "reference/random_source.h"
#include "render/denoise.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor::test {

namespace {

using glm::vec3;

constexpr const char* kLibrary = "CASTOR_OIDN_LIBRARY";
constexpr const char* kFails = "OIDN_STAND_IN_FAILS";

/// A film with so small multiples of eighths that the stand-in's result is exact.
Film exact_film(std::uint32_t width, std::uint32_t height) {
    Film film;
    film.width = width;
    film.height = height;
    film.samples_per_pixel = 4;
    film.planes = {{"depth", {"Y"}, {}, {}},
                   {"mean-normal", {"X", "Y", "Z"}, {}, {}},
                   {"mean-albedo", {"R", "G", "B", "A"}, {}, {}}};
    RandomSource random(3);
    const auto eighths = [&](double lower, double upper) {
        return static_cast<float>(std::floor(random.uniform(lower, upper) * 8.0)) / 8.0f;
    };
    for (std::size_t i = 0; i < std::size_t{width} * height; ++i) {
        film.pixels.emplace_back(eighths(0, 1000), eighths(0, 1000), eighths(0, 1000));
        film.done.push_back(1);
        film.planes[0].values.push_back(eighths(1, 2));
        for (int c = 0; c < 3; ++c) film.planes[1].values.push_back(eighths(-1, 1));
        for (int c = 0; c < 4; ++c) film.planes[2].values.push_back(eighths(0, 1));
    }
    return film;
}

/// Returns what the stand-in makes of a value of the picture, its albedo and its normal.
float filtered(float light, float albedo, float normal) {
    return light * (0.5f * albedo + 0.25f) + (0.5f * normal + 0.25f);
}

bool same_pixels(const Film& a, const Film& b) {
    return a.pixels.size() == b.pixels.size() &&
           std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(vec3)) == 0;
}

const FilmPlane& plane_of(const Film& film, const std::string& name) {
    const auto plane =
        std::find_if(film.planes.begin(), film.planes.end(), [&](const FilmPlane& p) { return p.name == name; });
    REQUIRE(plane != film.planes.end());
    return *plane;
}

template <class Wrong>
std::string message_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const Wrong& error) {
        return error.what();
    }
    FAIL("nothing was thrown");
    return "";
}

bool has(const std::string& text, const std::string& part) {
    UNSCOPED_INFO(text);
    return text.find(part) != std::string::npos;
}

Scene small_scene() {
    Scene scene = load_scene(std::string(CASTOR_SOURCE_DIR) + "/scenes/area.xml");
    resize(scene.cameras[0], 24, 18);
    return scene;
}

RenderOptions small_options() {
    RenderOptions options;
    options.integrator = Integrator::path;
    options.samples_per_pixel = 4;
    options.denoise = true;
    options.denoiser = Denoiser::oidn;
    options.aovs = {"mean-normal", "noisy", "mean-albedo"};
    return options;
}

}  // namespace

TEST_CASE("denoisers have words", "[denoise][oidn]") {
    for (const Denoiser denoiser : {Denoiser::castor, Denoiser::oidn})
        CHECK(denoiser_from_string(to_string(denoiser)) == denoiser);
    CHECK(has(message_of<UsageError>([] { denoiser_from_string("optix"); }), "\"optix\"; there are castor, oidn"));
    CHECK(denoiser_planes() == std::vector<std::string>{"variance", "mean-albedo", "mean-normal", "mean-position"});
    CHECK(denoiser_planes(Denoiser::oidn) == std::vector<std::string>{"mean-albedo", "mean-normal"});
}

TEST_CASE("Open Image Denoise of both interfaces gets all values, and gives the film back", "[denoise][oidn]") {
    struct Case {
        const char* library;
        std::uint32_t version;
    };
    for (const Case& each : {Case{CASTOR_OIDN_1, 10403}, {CASTOR_OIDN_2, 20303}}) {
        CAPTURE(each.library);
        const ScopedVariable library(kLibrary, each.library);
        CHECK(oidn_version() == each.version);
        for (const auto& [width, height] : {std::pair{1u, 1u}, {7u, 5u}, {64u, 3u}}) {
            const Film film = exact_film(width, height);
            Film clean = film;
            CHECK(denoise_by_oidn(clean) == each.version);
            for (std::size_t i = 0; i < film.pixels.size(); ++i)
                for (std::size_t c = 0; c < 3; ++c) {
                    const auto channel = static_cast<glm::length_t>(c);
                    const float expected = filtered(film.pixels[i][channel], film.planes[2].values[4 * i + c],
                                                    film.planes[1].values[3 * i + c]);
                    CAPTURE(width, height, i, c);
                    REQUIRE(clean.pixels[i][channel] == expected);
                }
            for (std::size_t p = 0; p < film.planes.size(); ++p) CHECK(clean.planes[p].values == film.planes[p].values);
        }
    }
}

TEST_CASE("an Open Image Denoise that is not there, or of no use, is told", "[denoise][oidn]") {
    const auto refusal_of = [](const std::string& library) {
        const ScopedVariable variable(kLibrary, library);
        const std::string refusal = message_of<UsageError>([] { oidn_version(); });
        Film film = exact_film(3, 2);
        CHECK(message_of<UsageError>([&] { denoise_by_oidn(film); }) == refusal);
        CHECK(same_pixels(film, exact_film(3, 2)));
        return refusal;
    };
    const TemporaryDirectory folder;
    const std::string none = (folder.path() / "none.so").string();
    CHECK(has(refusal_of(none), "CASTOR_OIDN_LIBRARY: Open Image Denoise cannot be loaded: " + none));
    folder.write("text.so", "this is no library");
    CHECK(has(refusal_of((folder.path() / "text.so").string()), "text.so"));
    CHECK(has(refusal_of(CASTOR_OIDN_old), "it is Open Image Denoise 1.3.0, expected 1.4.0 or later"));
    CHECK(has(refusal_of(CASTOR_OIDN_lacking), "it has no function oidnExecuteFilter"));
    CHECK(has(refusal_of(CASTOR_ABORTING_ICD), "it has no function oidnNewDevice"));
    {
        const ScopedVariable fails(kFails, "oidnNewDevice");
        CHECK(has(refusal_of(CASTOR_OIDN_2), "cannot be used: no device today"));
    }
    const ScopedVariable fails(kFails, "oidnCommitDevice");
    CHECK(has(refusal_of(CASTOR_OIDN_1), "cannot be used: not on this processor"));
}

TEST_CASE("films that Open Image Denoise cannot take stay as they are", "[denoise][oidn]") {
    const ScopedVariable library(kLibrary, CASTOR_OIDN_2);
    const auto refusal_of = [](Film film) { return message_of<UsageError>([&] { denoise_by_oidn(film); }); };
    Film bad = exact_film(4, 3);
    bad.planes.pop_back();
    CHECK(has(refusal_of(bad), "takes the planes mean-albedo, mean-normal, and the film has no plane \"mean-albedo\""));
    bad = exact_film(4, 3);
    bad.planes[1].values.pop_back();
    CHECK(has(refusal_of(bad), "has 35 floats, expected 36"));
    CHECK(has(refusal_of(Film{}), "0x0 pixels"));

    const ScopedVariable fails(kFails, "oidnExecuteFilter");
    Film film = exact_film(4, 3);
    CHECK(message_of<DeviceError>([&] { denoise_by_oidn(film); }) ==
          "Open Image Denoise 2.3.3: noise was not removed: out of luck");
    CHECK(same_pixels(film, exact_film(4, 3)));
}

TEST_CASE("a picture goes to Open Image Denoise when it is complete, also joined and gone on with", "[denoise][oidn]") {
    const ScopedVariable library(kLibrary, CASTOR_OIDN_1);
    const Scene scene = small_scene();
    Renderer renderer(scene, {test_device()});
    const RenderOptions options = small_options();
    const Film clean = renderer.render(scene.cameras[0], options);
    CHECK(renderer.statistics().oidn_version == 10403);
    CHECK(renderer.statistics().denoise_seconds > 0.0);
    REQUIRE(clean.planes.size() == 3);
    RenderOptions plain = options;
    plain.denoise = false;
    plain.aovs = {"depth"};
    const Film noisy = renderer.render(scene.cameras[0], plain);
    CHECK(renderer.statistics().oidn_version == 0);
    CHECK(std::memcmp(plane_of(clean, "noisy").values.data(), noisy.pixels.data(),
                      noisy.pixels.size() * sizeof(vec3)) == 0);
    const std::vector<float>& albedo = plane_of(clean, "mean-albedo").values;
    const std::vector<float>& normal = plane_of(clean, "mean-normal").values;
    CHECK(*std::max_element(albedo.begin(), albedo.end()) > 0.0f);
    for (std::size_t i = 0; i < noisy.pixels.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const auto channel = static_cast<glm::length_t>(c);
            CAPTURE(i, c);
            REQUIRE(clean.pixels[i][channel] ==
                    filtered(noisy.pixels[i][channel], albedo[4 * i + c], normal[3 * i + c]));
        }

    // One sample a pixel is enough, since it needs no variance; and Castor's own filter is another picture.
    RenderOptions one = options;
    one.samples_per_pixel = 1;
    CHECK(renderer.render(scene.cameras[0], one).complete());
    RenderOptions own = options;
    own.denoiser = Denoiser::castor;
    CHECK_FALSE(same_pixels(renderer.render(scene.cameras[0], own), clean));
    CHECK(renderer.statistics().oidn_version == 0);
    CHECK(renderer.statistics().denoise_seconds > 0.0);

    const TemporaryDirectory folder;
    std::vector<std::filesystem::path> parts;
    {
        const ScopedVariable nothing(kLibrary, "/dev/null");  // parts are joined where it is
        for (const std::uint32_t number : {1u, 2u}) {
            RenderOptions of_part = options;
            of_part.part = PicturePart{number, 2};
            of_part.checkpoint_file = parts.emplace_back(folder.path() / std::to_string(number));
            renderer.render(scene.cameras[0], of_part);
        }
        CHECK_FALSE(merge_checkpoints({parts[0]}).is_denoised);
        CHECK_THROWS_AS(merge_checkpoints(parts), UsageError);
    }
    const MergedPicture merged = merge_checkpoints(parts);
    CHECK(merged.is_denoised);
    CHECK(merged.oidn_version == 10403);
    CHECK(same_pixels(merged.film, clean));
    REQUIRE(merged.film.planes.size() == 3);
    CHECK(merged.film.planes[1].values == clean.planes[1].values);
    RenderOptions resumed = options;
    resumed.resume_file = parts[0];
    CHECK(same_pixels(renderer.render(scene.cameras[0], resumed), clean));
    resumed.denoiser = Denoiser::castor;
    CHECK_THROWS_AS(renderer.render(scene.cameras[0], resumed), SceneError);  // a checkpoint is of one denoiser
}

TEST_CASE("no sample is lost by an Open Image Denoise that fails", "[denoise][oidn]") {
    const ScopedVariable library(kLibrary, CASTOR_OIDN_2);
    const Scene scene = small_scene();
    Renderer renderer(scene, {test_device()});
    const TemporaryDirectory folder;
    RenderOptions options = small_options();
    options.checkpoint_file = folder.path() / "checkpoint";
    {
        const ScopedVariable nothing(kLibrary, "/dev/null");
        bool has_begun = false;
        const auto progress = [&](const RenderProgress&) { return has_begun = true; };
        CHECK_THROWS_AS(renderer.render(scene.cameras[0], options, progress), UsageError);
        CHECK_FALSE(has_begun);
    }
    {
        const ScopedVariable fails(kFails, "oidnExecuteFilter");
        try {
            renderer.render(scene.cameras[0], options);
            FAIL("nothing was thrown");
        } catch (const RenderError& error) {
            CHECK(has(error.what(), "Open Image Denoise 2.3.3: noise was not removed: out of luck"));
            RenderOptions plain = options;
            plain.denoise = false;
            plain.checkpoint_file.clear();
            CHECK(error.film().complete());
            CHECK(same_pixels(error.film(), renderer.render(scene.cameras[0], plain)));
            REQUIRE(error.film().planes.size() == 3);
            CHECK(error.film().planes[1].name == "noisy");
        }
    }
    // The checkpoint is of the complete picture.
    RenderOptions again = options;
    again.resume_file = options.checkpoint_file;
    const Film clean = renderer.render(scene.cameras[0], again);
    CHECK(renderer.statistics().rays == 0);
    CHECK(renderer.statistics().oidn_version == 20303);
    CHECK(same_pixels(merge_checkpoints({options.checkpoint_file}).film, clean));
}

}  // namespace castor::test
