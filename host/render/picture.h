#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "base/range.h"
#include "castor/film.h"
#include "render/checkpoint.h"
#include "render/picture_part.h"
#include "render/piece_worker.h"
#include "render/pixel_blocks.h"

namespace castor {

/// Pixel blocks to go on with, and the ranges of their places in `blocks` that have equally many samples.
struct BlocksLeft {
    std::vector<std::uint32_t> blocks;
    std::vector<Range> ranges;
};

/// A picture that grows. The state of each pixel block is how many samples are taken, with their sums, or that all are
/// taken, with the pixels: a function of that number alone. So two states of a block join by taking the one with more
/// samples, which is commutative, associative and idempotent: it does not matter who makes a state, when and how often.
/// Where blocks stop at noise (see noise.h), whether one is done is a function of its sums at certain numbers of
/// samples, which nobody may render past: see next_check. Usable from several threads.
class Picture {
public:
    /// `part`: which blocks are to be rendered. Others are joined and kept as well. `noise`: at which blocks stop;
    /// nullopt: they take all samples.
    explicit Picture(Checkpoint begin, const PicturePart& part = {}, std::optional<double> noise = std::nullopt);

    std::uint32_t width() const { return state_.film.width; }
    std::uint32_t height() const { return state_.film.height; }
    std::uint32_t samples_per_pixel() const { return state_.film.samples_per_pixel; }
    const PixelBlocks& blocks() const { return blocks_; }
    /// Returns how many pixels the blocks have in the picture.
    std::uint64_t pixels_of(std::span<const std::uint32_t> blocks) const;

    /// Joins the state of some blocks, and sets their planes if there are any.
    void join(const PieceState& piece, const std::optional<WaveAovs>& planes = std::nullopt);
    /// Joins another state of the same picture, planes of finished blocks too. Returns the blocks of which it had more.
    std::vector<std::uint32_t> join(const Checkpoint& other);

    // Of the part that is to be rendered:

    /// Returns the blocks with less than so many samples that are not done, those with the fewest first.
    BlocksLeft work_left(std::uint32_t samples) const;
    /// Returns the smallest number of samples of a block that is not done; where all are, that of the picture.
    std::uint32_t fewest_samples() const;
    /// Returns the most samples to which blocks with so many may be rendered at once.
    std::uint32_t next_check(std::uint32_t samples) const;
    /// Counts the samples of all pixels, without those that blocks were spared.
    std::uint64_t samples_to_do() const;
    std::uint64_t samples_done_of_part() const;

    /// Returns whether a block takes no more samples.
    bool is_finished(std::uint32_t block) const;
    /// Returns the order to go on with blocks of a range of `work_left` until they have so many samples; nullopt: they
    /// have them.
    std::optional<PieceOrder> order(std::span<const std::uint32_t> blocks, std::uint32_t samples) const;
    /// Counts the samples of all pixels, of whatever part.
    std::uint64_t samples_done() const;
    /// Counts the pixels of done blocks by their number of samples, of whatever part.
    std::map<std::uint32_t, std::uint64_t> pixels_by_samples() const;

    /// Returns a copy of the state.
    Checkpoint copy() const;
    /// Returns a copy of the film as it is now: pixels that are not done have the means of the samples so far.
    Film snapshot() const;

    // For when nobody else uses the picture.

    /// Makes all blocks done with so many samples, which each that is not done has, as if no more had been asked for.
    void finish_with(std::uint32_t samples);
    /// Writes the means of the samples so far into the film itself.
    void show_partial_blocks();
    Film& film() { return state_.film; }
    const Checkpoint& state() const { return state_; }

private:
    bool is_of_part(std::uint32_t block) const { return castor::is_of_part(block, blocks_.count(), part_); }
    bool is_done(std::uint32_t block) const;
    void join_done(std::uint32_t block, std::uint32_t samples, const glm::vec3* means, std::span<const glm::vec4> sums);
    bool stops(std::uint32_t block, std::uint32_t samples, std::span<const glm::vec4> sums) const;
    void set_stopped(std::uint32_t block, std::uint32_t samples);
    bool join_sums(std::uint32_t block, std::uint32_t samples, std::vector<glm::vec4> sums);
    std::uint32_t samples_of(std::uint32_t block) const;
    void show_partial_blocks(Film& film) const;

    PixelBlocks blocks_;
    const PicturePart part_;
    const std::optional<double> noise_;
    mutable std::mutex mutex_;
    Checkpoint state_;
    const std::uint32_t rows_of_sums_;
    const bool wants_all_sums_;
    std::vector<std::uint8_t> has_planes_;  // one a block: those of eye rays
    std::uint64_t samples_to_do_ = 0;
};

}  // namespace castor
