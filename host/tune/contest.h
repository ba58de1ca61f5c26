#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "castor/device.h"
#include "castor/ray_sets.h"
#include "castor/scene.h"
#include "castor/tracer.h"

namespace castor {

/// A device with a strategy, which competes with others.
struct Contender {
    Device device;
    Strategy asked = Strategy::automatic;
    std::unique_ptr<Tracer> tracer;
};

/// Makes one contender for each device and strategy. Throws what Tracer throws.
std::vector<Contender> make_contenders(const Scene& scene, const std::vector<Device>& devices,
                                       const std::vector<Strategy>& strategies, TreeQuality quality, bool use_profiles);

/// The result of one contender with one set of rays.
struct Score {
    std::size_t hits = 0;         // for Query::any: rays that hit something
    TraceWork work;               // for all rays, counted outside the timed runs
    std::vector<double> seconds;  // each repeat, from the first enqueue to the end, rays and answers on the device
};

struct ContestResult {
    std::size_t brute_checked = 0;  // rays whose answer was compared with brute force
    std::vector<Score> scores;      // one for each contender
};

/// Traces the rays with every contender. Checks the answers first: those of the first contender are compared with brute
/// force on its device, for rays drawn with `seed`; then those of every contender, and of the kernels that count their
/// work, with the first contender's, for every ray and bit by bit. Then all contenders warm up, and take turns in
/// `repeat` rounds. Ends early, except while counting, if `go_on` returns false; an unfinished score has no `seconds`.
/// Throws DeviceError if a check fails, naming the first ray that differs and both answers.
ContestResult run_contest(Tracer& brute, std::size_t primitive_count, const std::vector<Contender>& contenders,
                          const RaySet& set, std::uint32_t repeat, std::uint32_t seed,
                          const std::function<bool()>& go_on);

}  // namespace castor
