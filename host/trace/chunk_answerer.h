#pragma once

#include <memory>
#include <optional>

#include "remote/rank_server.h"
#include "trace/chunk_order.h"
#include "trace/scene_devices.h"
#include "trace/strategy.h"
#include "trace/surface_kernels.h"

namespace castor {

/// Lets one device answer rays that come from elsewhere. For one thread.
class ChunkAnswerer {
public:
    ChunkAnswerer(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning);

    /// Returns answer_bytes for each ray of the order. Throws DeviceError.
    Bytes answer(const ChunkOrder& order);

private:
    Bytes find_surfaces(const ChunkOrder& order, const DeviceScene::Subset& subset);
    Bytes find_attributes(const SurfaceKernels::Query& query, std::size_t room);
    Bytes find_passed(const ChunkOrder& order, const SurfaceKernels::Query& query, std::size_t room);
    SurfaceKernels& surface_kernels(bool has_textures);

    DeviceContext& context_;
    const DeviceScene& scene_;
    TraceKernels trace_kernels_;
    std::optional<SurfaceKernels> surface_kernels_;
};

/// Offers a device to a manager, to answer rays.
OrderedWorkerOffer chunk_answerer_offer(const std::shared_ptr<SceneDevice>& device);

}  // namespace castor
