#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/range.h"
#include "render/wave_aovs.h"

namespace castor {

/// The state of some pixel blocks, of all of whose pixels equally many samples are taken. A slot is a pixel of a block:
/// 64 a block, row by row, also where they lie outside the picture.
struct PieceState {
    std::vector<std::uint32_t> blocks;  // their numbers, ascending
    std::uint32_t samples = 0;          // taken of each pixel
    // Of these samples, one a slot, for each row of Wave::sums; empty if there are none, or all and the order does not
    // want them.
    std::vector<glm::vec4> sums;
    std::vector<glm::vec3> means;  // one a slot; only if all samples of the picture are taken
};

/// The work on a piece: to go on from a state until so many samples are taken.
struct PieceOrder {
    PieceState begin;
    std::uint32_t samples = 0;
    std::uint32_t rows_of_sums = 1;
    bool wants_planes = false;
    bool wants_all_sums = false;  // also of pixels of which all samples are taken
};

/// What a worker gives back. It may have taken fewer samples than ordered, where it was told to end early.
struct PieceResult {
    PieceState state;
    std::optional<WaveAovs> planes;   // if they were wanted
    std::uint64_t rays = 0;           // of all kinds that were traced for it
    bool met_most_passed = false;     // see Wave::take_met_most_passed
    bool met_most_scattered = false;  // likewise
};

/// Someone who renders pieces of one picture: a device of this process, or of another one (see remote_piece.h). Orders
/// and results are plain values. Throws DeviceError when it can work no longer. For one thread.
class PieceWorker {
public:
    /// Told after each slice (Pace) how many samples of each pixel are taken, as a sign of life. Returning
    /// false ends the work on the piece early.
    using OnSamples = std::function<bool(std::uint32_t samples)>;

    virtual ~PieceWorker() = default;
    /// Returns how long making the worker took, without waiting.
    virtual double setup_seconds() const = 0;
    /// Returns how many samples of blocks the worker takes a second; 0: not known yet.
    virtual double block_samples_per_second() const = 0;
    /// Returns how many blocks the next piece should have at most, by the worker's speed.
    virtual std::uint64_t blocks_wanted() const = 0;
    /// Returns how many blocks a piece can have at most.
    virtual std::uint64_t most_blocks() const = 0;
    /// Measures the worker's speed, unless it is known, by a few samples of some of the blocks. They are lost, so that
    /// the worker's first piece is as large as all others. Ends early once `is_needed` returns false.
    virtual void measure(const Range& blocks, const std::function<bool()>& is_needed) = 0;
    /// Renders as ordered, or less where `on_samples` ends it.
    virtual PieceResult render(const PieceOrder& order, const OnSamples& on_samples) = 0;
};

/// Whether to measure a worker before it gets about so much of the work: it takes at most a few full waves.
inline bool is_worth_measuring(const PieceWorker& worker, std::uint64_t block_samples) {
    constexpr std::uint64_t kWaves = 64;
    return block_samples >= kWaves * worker.most_blocks();
}

/// An offer to work on a picture.
struct PieceWorkerOffer {
    std::string name;  // of the worker, for people
    double setup_seconds = 0.0;
    bool stays_in_callers_thread = false;
    /// Makes the worker, in the thread that is going to use it. Waits while the worker's means are in use elsewhere,
    /// and returns null if `is_needed`, asked meanwhile, returns false.
    std::function<std::unique_ptr<PieceWorker>(const std::function<bool()>& is_needed)> make;
    std::string host{};      // Device::host
    std::size_t device = 0;  // workers with the same number are teams of one device
};

}  // namespace castor
