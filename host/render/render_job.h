#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "castor/renderer.h"
#include "render/pixel_blocks.h"
#include "render/render_device.h"
#include "render/wave.h"
#include "schedule/pace.h"
#include "schedule/schedule.h"

namespace castor {

/// One picture: which device does what of it, and what there is of it so far. Shared with the devices' threads, one of which may outlive the render.
class RenderJob : public std::enable_shared_from_this<RenderJob> {
public:
    /// `film` has its size, and no picture yet.
    RenderJob(Film film, const WaveSettings& settings, std::vector<std::shared_ptr<RenderDevice>> devices, std::uint32_t tile_size);

    /// Returns when the picture is done, `on_progress` has stopped it, or no device is left.
    void run(double deadline_seconds, const ProgressCallback& on_progress);

    /// Afterwards: what there is, what the devices did, in their order, and why the last of them was dropped.
    Film& film() { return film_; }
    const std::vector<DeviceShare>& shares() const { return shares_; }
    const std::optional<DeviceError>& last_failure() const { return last_failure_; }

private:
    void render_pieces(RenderDevice& device, Schedule& schedule, std::size_t worker);
    void render_piece(Wave& wave, Pace& pace, const Range& piece, Schedule& schedule, std::size_t worker);
    void store(const Range& piece, const std::vector<glm::vec3>& means, const WaveAovs& aovs, bool is_done);
    RenderProgress progress();
    void drop(std::size_t worker, const DeviceError& why);

    Film film_;
    PixelBlocks blocks_;
    WaveSettings settings_;
    std::vector<std::shared_ptr<RenderDevice>> devices_;
    std::uint32_t tile_size_;
    Stopwatch watch_;

    std::mutex mutex_;  // of what follows
    std::vector<DeviceShare> shares_;
    std::vector<std::uint64_t> samples_under_way_;  // of each device's piece
    std::vector<std::string> notices_;              // that nobody was told yet
    std::optional<DeviceError> last_failure_;
};

}  // namespace castor
