#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "render/piece_worker.h"
#include "render/pixel_blocks.h"
#include "render/wave.h"
#include "schedule/pace.h"
#include "trace/scene_devices.h"

namespace castor {

/// A team of a device's compute units, or all of them, with what it keeps from one picture for the next: buffers,
/// kernels and its speed. For one thread at a time, which holds the mutex.
struct RenderTeam {
    RenderTeam(std::shared_ptr<DeviceContext> of_team, std::timed_mutex& held)
        : context(std::move(of_team)), mutex(held) {}
    ~RenderTeam() { finish_before_release(*context); }  // before the buffers are released

    std::shared_ptr<DeviceContext> context;
    std::timed_mutex& mutex;
    std::unique_ptr<Wave> wave;
    std::uint64_t wave_room = 0;  // WaveSize::room of the wave
    std::optional<Pace> pace;     // an item is one sample of a block
};

/// A device that renders.
struct RenderDevice : SceneDevice {
    RenderDevice(const Device& device, const std::shared_ptr<SceneContents>& scene_contents,
                 const Tuning& device_tuning, const Range& kept_chunks);

    RenderTeam whole;
    std::deque<std::timed_mutex> team_mutexes;
    std::deque<RenderTeam> teams;  // none where the device is not divided
};

/// Offers a device for a picture of these blocks and so many samples, in pieces of at most `tile_size` x `tile_size`
/// pixels, or 0: what suits the device. `number`: PieceWorkerOffer::device. `by_teams`: one offer for each of its
/// teams, unless these cannot work apart.
std::vector<PieceWorkerOffer> offers_of(const std::shared_ptr<RenderDevice>& device, std::size_t number, bool by_teams,
                                        const WaveSettings& settings, const PixelBlocks& blocks,
                                        std::uint32_t samples_per_pixel, std::uint32_t tile_size);

}  // namespace castor
