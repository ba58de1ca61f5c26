#include "castor/merge.h"

#include <fmt/format.h>

#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "base/description.h"
#include "castor/error.h"
#include "render/checkpoint.h"
#include "render/denoise.h"
#include "render/film_comparison.h"
#include "render/oidn.h"
#include "render/picture.h"

namespace castor {

namespace {

namespace fs = std::filesystem;

/// Throws DeviceError unless two states agree in all blocks of which they have equally many samples. `maker_of` names
/// the file of a block of the first, `maker` that of the second.
template <class MakerOf>
void expect_equal(const Checkpoint& first, const Checkpoint& second, const PixelBlocks& blocks, const MakerOf& maker_of,
                  const std::string& maker) {
    const auto fail = [](const char* what, const Verification& found) {
        throw DeviceError(
            "", "", 0,
            fmt::format("{} pixels have equally many samples in two files, and other {}; the first is {}. castor "
                        "doctor may tell which device is wrong",
                        found.differing_pixels, what, describe(*found.first)));
    };
    FilmComparison comparison(first.film);
    for (std::uint32_t block = 0; block < blocks.count(); ++block)
        blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
            for (std::size_t i = pixel; i < pixel + count; ++i)
                if (first.film.done[i] && second.film.done[i])
                    comparison.compare(second.film, i, maker_of(block), maker);
        });
    if (comparison.result().first) fail("values", comparison.result());

    if (first.partial_blocks.empty() || second.partial_blocks.empty()) return;
    Film sums_of_first, sums_of_second;  // in the places of pixels
    sums_of_first.width = first.film.width;
    sums_of_first.pixels = first.film.pixels;
    sums_of_second.pixels = first.film.pixels;
    FilmComparison sums(sums_of_first);
    for (const auto& entry : first.partial_blocks) {
        const std::uint32_t block = entry.first;
        const PartialBlock& state = entry.second;
        const auto other = second.partial_blocks.find(block);
        if (other == second.partial_blocks.end() || other->second.samples != state.samples) continue;
        blocks.for_each_row(block, 0, [&](std::size_t pixel, std::size_t slot, std::uint32_t count) {
            for (std::uint32_t i = 0; i < count; ++i) {
                sums_of_first.pixels[pixel + i] = glm::vec3(state.sums[slot + i]);
                sums_of_second.pixels[pixel + i] = glm::vec3(other->second.sums[slot + i]);
                sums.compare(sums_of_second, pixel + i, maker_of(block), maker);
            }
        });
    }
    if (sums.result().first) fail("sums of samples", sums.result());
}

/// Returns what a line says that not every picture has.
std::optional<std::string> value_if_any(const Checkpoint& checkpoint, std::string_view name) {
    const std::string begin = std::string(name) + ' ';
    for (const std::string& line : lines_of(checkpoint.picture))
        if (line.starts_with(begin)) return line.substr(begin.size());
    return std::nullopt;
}

std::vector<std::string> words_of(const std::string& text) {
    std::istringstream stream(text);
    std::vector<std::string> words;
    for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
    return words;
}

}  // namespace

MergedPicture merge_checkpoints(const std::vector<fs::path>& files, const fs::path& merged,
                                const std::vector<Device>& devices, bool removes_noise) {
    if (files.empty()) throw UsageError("there is no checkpoint to merge");
    Checkpoint first = load_checkpoint(files.front());
    const Checkpoint expected{.picture = first.picture, .film = first.film, .partial_blocks = {}};
    Picture picture(std::move(first));
    std::vector<std::size_t> file_of_block(picture.blocks().count(), 0);
    for (std::size_t i = 1; i < files.size(); ++i) {
        const Checkpoint next = load_checkpoint(files[i], expected, files.front().string());
        expect_equal(
            picture.state(), next, picture.blocks(),
            [&](std::uint32_t block) { return files[file_of_block[block]].string(); }, files[i].string());
        for (const std::uint32_t block : picture.join(next)) file_of_block[block] = i;
    }
    if (!merged.empty()) save_checkpoint(merged, picture.state());
    MergedPicture result;
    try {
        result.rules = rule_set_from_string(value_of(picture.state(), "rules"));
        result.tone_maps = tone_maps_of(picture.state());
    } catch (const UsageError& error) {
        throw SceneError(files.front().string(), 0, fmt::format("is damaged: {}", error.what()));
    }
    result.samples_done = picture.samples_done();
    result.samples_spared = samples_spared(picture.state());
    picture.show_partial_blocks();
    const std::optional<std::string> planes = value_if_any(picture.state(), kDenoiseLine);
    const bool is_for_oidn = value_if_any(picture.state(), kDenoiserLine) == to_string(Denoiser::oidn);
    result.film = std::move(picture.film());
    if (planes)
        finish_denoised(result.film, words_of(*planes), [&](Film& film) {
            if (!removes_noise) return;
            if (is_for_oidn)
                result.oidn_version = denoise_by_oidn(film);
            else
                denoise(film, devices.empty() ? select_devices() : devices);
            result.is_denoised = true;
        });
    return result;
}

}  // namespace castor
