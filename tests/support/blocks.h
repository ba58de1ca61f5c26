#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "castor/renderer.h"
#include "support/catch.h"

namespace castor::test {

/// Renders pictures with the seeds from 0 on.
inline std::vector<Film> pictures_of(Renderer& renderer, const Camera& camera, RenderOptions options,
                                     std::uint32_t count) {
    std::vector<Film> films;
    for (options.seed = 0; options.seed < count; ++options.seed) films.push_back(renderer.render(camera, options));
    return films;
}

/// Compares the means of blocks of 4 x 4 pixels, and of the whole picture, in each channel.
class BlockTest {
public:
    /// `ways`: how many will be compared with `expected`, which are pictures of the seeds from 0 on.
    BlockTest(std::vector<Film> expected, std::size_t ways) : expected_(std::move(expected)) {
        const Film& film = expected_.front();
        REQUIRE((film.width % kSize == 0 && film.height % kSize == 0));
        for (std::uint32_t y = 0; y < film.height; y += kSize)
            for (std::uint32_t x = 0; x < film.width; x += kSize) {
                std::vector<std::size_t> pixels;
                for (std::uint32_t i = 0; i < kSize * kSize; ++i)
                    pixels.push_back((y + i / kSize) * film.width + x + i % kSize);
                blocks_.push_back(pixels);
            }
        std::vector<std::size_t> whole(film.pixels.size());
        for (std::size_t i = 0; i < whole.size(); ++i) whole[i] = i;
        blocks_.push_back(whole);
        significance_ = 1 - std::pow(1 - 0.01, 1 / double(3 * blocks_.size() * ways));  // Sidak
    }

    /// Checks that pictures with the same seeds have the same means. Errors, relative to what is expected, must not
    /// exceed `whole_error` for the whole picture and `block_error` in the root mean square of the blocks: so small are
    /// the differences that are found. An empty `block_error`: blocks have too little light that is found to be
    /// compared. Returns whether the pictures differ at all.
    bool check(const std::string& way, const std::vector<Film>& found, double whole_error,
               std::optional<double> block_error) const {
        REQUIRE(found.size() == expected_.size());
        std::size_t wrong = 0, unlike = 0, lit = 0;
        double largest = 0.0, squares = 0.0, of_whole = 0.0;
        std::string where;
        for (std::size_t block = block_error ? 0 : blocks_.size() - 1; block < blocks_.size(); ++block)
            for (int channel = 0; channel < 3; ++channel) {
                const Difference one = difference(found, blocks_[block], channel);
                if (one.expected == 0.0 && one.mean == 0.0 && one.error == 0.0) continue;  // black
                const double error = one.error / one.expected;
                if (block + 1 == blocks_.size())
                    of_whole = std::max(of_whole, error);
                else
                    ++lit, squares += error * error;
                // The rounding of floats comes on top.
                const double beyond = std::max(std::abs(one.mean) - 1e-5 * one.expected, 0.0);
                const double z = beyond > 0.0 ? beyond / one.error : 0.0;
                wrong += !std::isfinite(one.mean) || !(std::erfc(z / std::sqrt(2.0)) >= significance_);
                unlike += one.error > 0.0;
                if (!(z > largest)) continue;
                largest = z;
                where = "block " + std::to_string(block) + ", channel " + std::to_string(channel) + ": expected " +
                        std::to_string(one.expected) + ", difference " + std::to_string(one.mean) + " +- " +
                        std::to_string(one.error);
            }
        const double of_blocks = lit ? std::sqrt(squares / double(lit)) : 0.0;
        CAPTURE(way, largest, where, of_whole, of_blocks);
        CHECK(wrong == 0);
        CHECK(of_whole <= whole_error);
        CHECK(of_blocks <= block_error.value_or(0.0));
        return unlike > 0;
    }

private:
    static constexpr std::uint32_t kSize = 4;

    struct Difference {
        double mean = 0.0, error = 0.0, expected = 0.0;
    };

    /// Pixels, and pictures with other seeds, are independent; those of one seed share random numbers.
    Difference difference(const std::vector<Film>& found, const std::vector<std::size_t>& pixels, int channel) const {
        const auto seeds = static_cast<double>(expected_.size()), count = static_cast<double>(pixels.size());
        Difference all;
        double variance = 0.0;
        for (const std::size_t pixel : pixels) {
            double sum = 0.0, squares = 0.0;
            for (std::size_t seed = 0; seed < expected_.size(); ++seed) {
                const double value = expected_[seed].pixels[pixel][channel];
                const double by = double{found[seed].pixels[pixel][channel]} - value;
                all.expected += value / (seeds * count);
                sum += by;
                squares += by * by;
            }
            all.mean += sum / (seeds * count);
            variance += std::max(squares - sum * sum / seeds, 0.0) / (seeds - 1.0) / seeds;
        }
        all.error = std::sqrt(variance) / count;
        return all;
    }

    std::vector<Film> expected_;
    std::vector<std::vector<std::size_t>> blocks_;
    double significance_ = 0.0;
};

}  // namespace castor::test
