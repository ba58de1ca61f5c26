#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/vec3.hpp>
#include <regex>
#include <string>
#include <vector>

#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "test_paths.h"

namespace {

/// A comment's line "Expected: camera 1 pixel 300 200 = 80 80 80": the camera counts from 1, the pixel from 0.
struct Expectation {
    std::size_t camera;
    std::uint32_t column, row;
    glm::vec3 color;
};

std::vector<std::filesystem::path> bundled_scenes() {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(CASTOR_SOURCE_DIR "/scenes")) {
        if (entry.path().extension() == ".xml") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

std::vector<Expectation> read_expectations(const std::filesystem::path& file) {
    const std::regex pattern(R"(Expected: camera (\d+) pixel (\d+) (\d+) = (\S+) (\S+) (\S+))");
    std::ifstream input(file);
    std::vector<Expectation> expectations;
    for (std::string line; std::getline(input, line);) {
        std::smatch words;
        if (!std::regex_search(line, words, pattern)) continue;
        const auto number = [&](int i) { return std::stof(words[static_cast<std::size_t>(i)]); };
        expectations.push_back({std::stoul(words[1]),
                                static_cast<std::uint32_t>(std::stoul(words[2])),
                                static_cast<std::uint32_t>(std::stoul(words[3])),
                                {number(4), number(5), number(6)}});
    }
    return expectations;
}

}  // namespace

TEST_CASE("every bundled scene is read without a warning and has a camera") {
    const auto files = bundled_scenes();
    REQUIRE(files.size() >= 6);
    for (const auto& file : files) {
        CAPTURE(file.string());
        const castor::Scene scene = castor::load_scene(file);
        for (const castor::Warning& warning : scene.warnings) FAIL_CHECK(warning.line << ": " << warning.text);
        CHECK_FALSE(scene.cameras.empty());
    }
}

TEST_CASE("bundled scenes have the pixels that their comments derive") {
    // Each number comes from a handful of float operations: their rounding and that of the scene's own numbers.
    constexpr float kTolerance = 1e-4f;
    std::size_t checked = 0;
    for (const auto& file : bundled_scenes()) {
        const auto expectations = read_expectations(file);
        if (expectations.empty()) continue;
        const castor::Scene scene = castor::load_scene(file);
        castor::Renderer renderer(scene, {castor::test::test_device()});
        for (const Expectation& expected : expectations) {
            CAPTURE(file.string(), expected.camera, expected.column, expected.row);
            REQUIRE(expected.camera >= 1);
            REQUIRE(expected.camera <= scene.cameras.size());
            const castor::Film film = renderer.render(scene.cameras[expected.camera - 1]);
            REQUIRE(expected.column < film.width);
            REQUIRE(expected.row < film.height);
            const glm::vec3 color = film.pixels[std::size_t{expected.row} * film.width + expected.column];
            for (int channel = 0; channel < 3; ++channel) {
                CAPTURE(channel, color[channel], expected.color[channel]);
                CHECK(std::abs(color[channel] - expected.color[channel]) <= kTolerance * expected.color[channel]);
            }
            ++checked;
        }
    }
    CHECK(checked >= 6);
}
