#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "castor/device.h"
#include "castor/scene.h"
#include "trace/tuning.h"

namespace castor {

/// A change of a device's tuning that was tried.
struct Trial {
    enum class Outcome { taken, slower, wrong_hits, refused };

    std::string name;  // "wide_lanes", "closest_coherent", or "strategies" for all kinds of rays at once
    std::string value;
    Outcome outcome = Outcome::refused;
    double time = 0.0;    // relative to the best so far, which is 1; 0: not measured
    std::string problem;  // the first wrong hit, or the device's error
};
std::string_view to_string(Trial::Outcome outcome);

struct TunerOptions {
    std::uint32_t size = 0;  // N: N x N primary rays and as many random ones, a multiple of 8
    double seconds = 0.0;    // after which no further trial begins
    std::uint32_t seed = 1;
    std::function<void(const std::string& stage)> on_stage;  // called when a stage begins
    std::function<void(const Trial&)> on_trial;
    std::function<bool()> go_on;
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

/// Tries the values of tuning_space(device) one after the other on rays of all kinds, and keeps those that are faster
/// by more than chance. Every trial must give the answers of the defaults, bit for bit, or it is not taken; some of
/// these answers are compared with brute force. Throws DeviceError if the defaults fail or differ from brute force.
TunerResult tune_device(const Device& device, const std::vector<NamedScene>& scenes, const TunerOptions& options);

}  // namespace castor
