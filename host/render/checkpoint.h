#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec4.hpp>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "castor/film.h"
#include "castor/scene.h"
#include "render/pixel_blocks.h"

namespace castor {

/// A pixel block of which some samples are taken: how many, and their sums, a slot each, for each row of Wave::sums.
struct PartialBlock {
    std::uint32_t samples = 0;
    std::vector<glm::vec4> sums = std::vector<glm::vec4>(PixelBlocks::kPixels);
};

/// The line of Checkpoint::picture that a picture has whose noise is to be removed when it is complete: the planes that
/// are asked for, with commas between.
inline constexpr std::string_view kDenoiseLine = "denoise";
/// A further line of such a picture, with the name of the denoiser, if it is not Castor's own.
inline constexpr std::string_view kDenoiserLine = "denoiser";

/// What there is of a picture, to be gone on with later, and perhaps elsewhere.
struct Checkpoint {
    // All that its pixels depend on, and the tone maps if there are any; a line each: its name, a blank, its value.
    std::string picture;
    Film film;  // pixels that are not done are not looked at
    std::map<std::uint32_t, PartialBlock> partial_blocks;
    std::map<std::uint32_t, std::uint32_t> stopped_blocks{};  // done with fewer samples than the film's: so many
};

/// Writes a file of sections (see base/section_file.h), replaced in one step: of the pixels those of blocks that are
/// done, and of planes also those of blocks that are begun. Throws FileError; an old file is then as it was.
void save_checkpoint(const std::filesystem::path& file, Checkpoint checkpoint);

/// Reads what save_checkpoint wrote for the picture of which `expected` has the description, the size, and planes of
/// any values. Throws SceneError where the file is missing, damaged, of another version, or of another picture, with
/// what was found and what was expected. `expected_name`: what is expected, for people.
Checkpoint load_checkpoint(const std::filesystem::path& file, const Checkpoint& expected,
                           const std::string& expected_name = "this one");
/// The same of any picture.
Checkpoint load_checkpoint(const std::filesystem::path& file);

/// Returns what the line of Checkpoint::picture with this name says. Throws SceneError where there is none.
std::string value_of(const Checkpoint& checkpoint, std::string_view name);

/// The value of the line "tone maps", and what it says. Throws SceneError for a value that was not made so.
std::string describe(const std::vector<ToneMap>& tone_maps);
std::vector<ToneMap> tone_maps_of(const Checkpoint& checkpoint);

/// What a checkpoint tells of itself.
struct CheckpointSummary {
    std::vector<std::string> picture;  // the lines of Checkpoint::picture
    std::uint32_t width = 0, height = 0, samples_per_pixel = 0;
    std::uint64_t pixels_done = 0;
    std::uint64_t samples_done = 0;    // of all pixels, those that are done too
    std::uint64_t samples_spared = 0;  // of those that are done: see RenderOptions::noise

    std::uint64_t pixels() const { return std::uint64_t{width} * height; }
    std::uint64_t samples() const { return pixels() * samples_per_pixel - samples_spared; }
};

/// Throws SceneError where the file is missing, damaged, of another version or kind.
CheckpointSummary summarize_checkpoint(const std::filesystem::path& file);

/// Samples that pixels of stopped blocks did not take.
std::uint64_t samples_spared(const Checkpoint& checkpoint);
/// Samples that are taken, of all pixels.
std::uint64_t samples_done(const Checkpoint& checkpoint);

}  // namespace castor
