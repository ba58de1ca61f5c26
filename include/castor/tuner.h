#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/api.h"
#include "castor/device.h"
#include "castor/scene.h"
#include "castor/tracer.h"

namespace castor {

/// The strategies of one device by kind of ray; none `automatic`.
struct CASTOR_API StrategyChoice {
    Strategy closest_incoherent = Strategy::brute;
    Strategy closest_coherent = Strategy::brute;
    Strategy any_incoherent = Strategy::brute;
    Strategy any_coherent = Strategy::brute;

    static StrategyChoice all(Strategy strategy) { return {strategy, strategy, strategy, strategy}; }
    Strategy of(Query query, Coherence hint) const;
    bool uses(Strategy strategy) const;
    bool operator==(const StrategyChoice&) const = default;
};

/// How a device answers ray queries. It changes the speed, never a bit of a hit.
struct Tuning {
    StrategyChoice strategies;
    std::uint32_t launch_items = 0;  // largest number of work-items in one launch
    // Work-items in a group, for strategies with one ray a work-item; less where a kernel allows less.
    std::uint32_t local_size = 0;
    std::uint32_t wide_lanes = 0;  // rays that a work-item of `wide` traces in turn
    std::uint32_t wide_batch = 0;  // rays that a work-item of `wide` or `packet` answers

    bool operator==(const Tuning&) const = default;
};

/// Returns the tuning of a device without a profile.
CASTOR_API Tuning default_tuning(const Device& device);

/// Returns where the profile of a device stands if there is one: a file for each name and platform in the folder
/// profiles/ of $CASTOR_PROFILE_DIR, or else of castor/ in $XDG_STATE_HOME or ~/.local/state. Empty where
/// CASTOR_PROFILE_DIR is set and empty, or there is no home.
CASTOR_API std::filesystem::path profile_file(const Device& device);

/// Stores a tuning, for all later uses of the device with `use_profiles`. Makes the folder and replaces the file, if
/// there is one, in one step. Throws FileError; an old file is then as it was.
CASTOR_API void write_profile(const std::filesystem::path& file, const Device& device, const Tuning& tuning);

/// A change of a device's tuning that was tried.
struct Trial {
    enum class Outcome { taken, slower, wrong_hits, refused };

    std::string name;  // "wide_lanes", "closest_coherent", or "strategies" for all kinds of rays at once
    std::string value;
    Outcome outcome = Outcome::refused;
    double time = 0.0;    // relative to the best so far, which is 1; 0: not measured
    std::string problem;  // the first wrong hit, or the device's error
};
CASTOR_API std::string_view to_string(Trial::Outcome outcome);

struct TunerOptions {
    std::uint32_t size = 256;  // N: N x N primary rays and as many random ones, a multiple of 8
    double seconds = 60.0;     // after which no further trial begins
    std::uint32_t seed = 1;
    // Each may be empty.
    std::function<void(const std::string& stage)> on_stage;  // called when a stage begins
    std::function<void(const Trial&)> on_trial;
    std::function<bool()> go_on;  // false: ends soon
};

struct TunerResult {
    Tuning defaults;  // the device's tuning without a profile
    Tuning tuning;    // not slower than the defaults when measured
    std::vector<Trial> trials;
    bool finished = false;               // false: `go_on` returned false, and the rest has no meaning
    bool all_tried = false;              // false: time ran out
    double time = 1.0;                   // with `tuning`, relative to the defaults
    std::size_t checked_rays = 0;        // rays whose answers each trial had to give
    std::size_t brute_checked_rays = 0;  // how many of them were compared with brute force
    double seconds = 0.0;
};

/// A scene to measure with, and its name.
struct NamedScene {
    std::string name;
    Scene scene;
};

/// Tries strategies, and all numbers that a profile may hold, one after the other on rays of all kinds, and keeps those
/// that are faster by more than chance. Every trial must give the answers of the defaults, bit for bit, or it is not
/// taken; some of these answers are compared with brute force. Throws DeviceError if the defaults fail or differ from
/// brute force, UsageError without a scene, or for a size that is 0 or no multiple of 8.
CASTOR_API TunerResult tune_device(const Device& device, const std::vector<NamedScene>& scenes,
                                   const TunerOptions& options);

}  // namespace castor
