#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "render/piece_worker.h"
#include "render/pixel_blocks.h"
#include "render/wave.h"
#include "schedule/pace.h"
#include "trace/scene_devices.h"

namespace castor {

/// A device that renders, with what it keeps from one picture for the next: buffers, kernels and its speed.
struct RenderDevice : SceneDevice {
    using SceneDevice::SceneDevice;
    ~RenderDevice() { finish_before_release(context); }  // before the buffers are released

    std::unique_ptr<Wave> wave;
    std::uint64_t wave_room = 0;  // WaveSize::room of the wave
    std::optional<Pace> pace;     // an item is one sample of a block
};

/// Offers a device for a picture of these blocks and so many samples, in pieces of at most `tile_size` x `tile_size`
/// pixels, or 0: what suits the device.
PieceWorkerOffer offer_of(const std::shared_ptr<RenderDevice>& device, const WaveSettings& settings,
                          const PixelBlocks& blocks, std::uint32_t samples_per_pixel, std::uint32_t tile_size);

}  // namespace castor
