#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "castor/device.h"
#include "castor/scene.h"
#include "castor/tracer.h"
#include "tune/ray_sets.h"

namespace castor {

/// One device with one strategy.
struct Contender {
    Device device;
    Strategy asked = Strategy::automatic;
    std::unique_ptr<Tracer> tracer;
};

/// Throws what Tracer throws.
std::vector<Contender> make_contenders(const Scene& scene, const std::vector<Device>& devices,
                                       const std::vector<Strategy>& strategies, TreeQuality quality, bool use_profiles);

/// What one contender did with one set of rays.
struct Score {
    std::size_t hits = 0;         // for Query::any: rays that hit something
    TraceWork work;               // of all rays, counted apart from the timed runs
    std::vector<double> seconds;  // of every repeat, from the first enqueue to the end, rays and answers on the device
};

struct ContestResult {
    std::size_t brute_checked = 0;  // rays whose answer was compared with brute force
    std::vector<Score> scores;      // of each contender
};

/// Traces the rays with every contender. The answers are checked first: those of the first contender against brute
/// force on its device for rays drawn with `seed`, then everyone's against the first's, every ray and every bit, also
/// by kernels that count their work. Then everyone warms up, and then they take turns, `repeat` rounds. All of it
/// but counting ends early where `go_on` returns false: a score whose `seconds` are empty was then not finished. Throws
/// DeviceError, naming the first ray that differs and both answers, where a check fails.
ContestResult run_contest(Tracer& brute, std::size_t primitive_count, const std::vector<Contender>& contenders,
                          const RaySet& set, std::uint32_t repeat, std::uint32_t seed,
                          const std::function<bool()>& go_on);

}  // namespace castor
