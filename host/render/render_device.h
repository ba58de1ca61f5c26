#pragma once

#include <memory>

#include "opencl/device_context.h"
#include "stopwatch.h"
#include "trace/device_scene.h"
#include "trace/shared_scene.h"
#include "trace/tuning.h"

namespace castor {

/// One device with the scene on it.
struct RenderDevice {
    RenderDevice(const Device& device, const std::shared_ptr<SharedScene>& shared_scene, const Tuning& device_tuning)
        : shared(shared_scene), context(device), scene(context, shared->prepared), tuning(device_tuning), setup_seconds(watch.seconds()) {}

    ~RenderDevice() { finish_before_release(context); }

    Stopwatch watch;
    std::shared_ptr<SharedScene> shared;  // whose memory the device may share
    DeviceContext context;
    DeviceScene scene;
    Tuning tuning;
    double setup_seconds;
};

}  // namespace castor
