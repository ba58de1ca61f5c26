#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "castor/device.h"
#include "castor/scene.h"
#include "trace/tuning.h"

namespace castor {

/// One change of a device's tuning that was tried.
struct Trial {
    enum class Outcome { taken, slower, wrong_hits, refused };

    std::string name;  // "wide_lanes", "closest_coherent", or "strategies" for all kinds of rays at once
    std::string value;
    Outcome outcome = Outcome::refused;
    double time = 0.0;    // in that of the best so far, which is 1; 0 where it was not measured
    std::string problem;  // the first wrong hit, or what the device said
};
std::string_view to_string(Trial::Outcome outcome);

struct TunerOptions {
    std::uint32_t size = 0;  // N: N x N primary rays and as many random ones, a multiple of 8
    double seconds = 0.0;    // after which no further trial begins
    std::uint32_t seed = 1;
    std::function<void(const std::string& stage)> on_stage;  // that a part of the work begins
    std::function<void(const Trial&)> on_trial;
    std::function<bool()> go_on;
};

struct TunerResult {
    Tuning defaults;  // what the device does untuned
    Tuning tuning;    // no slower than the defaults where it was measured
    std::vector<Trial> trials;
    bool finished = false;               // false: `go_on` said so; the rest is of no use
    bool all_tried = false;              // false: time ran out
    double time = 1.0;                   // of rays with `tuning`, in that with the defaults
    std::size_t checked_rays = 0;        // whose answers each trial had to give
    std::size_t brute_checked_rays = 0;  // of these, compared with brute force
    double seconds = 0.0;
};

/// A scene to measure on and its name.
struct NamedScene {
    std::string name;
    Scene scene;
};

/// Tries the values of tuning_space(device) one after the other on rays of all kinds, and keeps what makes them faster
/// by more than chance would. The answers of the defaults, of which some are compared with brute force, are what every
/// trial has to give, bit for bit, or it is not taken. Throws DeviceError if the defaults fail or find another hit than
/// brute force.
TunerResult tune_device(const Device& device, const std::vector<NamedScene>& scenes, const TunerOptions& options);

}  // namespace castor
