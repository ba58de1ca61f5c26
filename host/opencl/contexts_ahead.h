#pragma once

#include <memory>
#include <thread>
#include <vector>

#include "castor/device.h"
#include "opencl/device_context.h"
#include "opencl/kernel_arguments.h"

namespace castor {

/// Contexts of devices, and programs in them, made by a thread for each device while others work. For one thread.
class ContextsAhead {
public:
    /// Begins with a device, and with its programs in their order. What fails is left to whoever needs it, who is then
    /// told why; and so is all of a device that stays in one thread.
    void begin(const Device& device, std::vector<KernelProgram> programs);

    /// Returns the context of a device when all its programs are built; null where none was begun, or it was taken.
    std::unique_ptr<DeviceContext> take(const Device& device);

private:
    struct Work {
        Device device;
        std::unique_ptr<DeviceContext> context;
        std::jthread thread;  // ends before the context goes, after the program at hand
    };

    std::vector<std::unique_ptr<Work>> works_;
};

}  // namespace castor
