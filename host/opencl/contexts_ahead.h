#pragma once

#include <cstddef>
#include <future>
#include <memory>
#include <stop_token>
#include <vector>

#include "castor/device.h"
#include "opencl/device_context.h"
#include "opencl/kernel_arguments.h"

namespace castor {

/// Contexts of devices, and programs in them, made by a thread for each device while others work. For one thread.
class ContextsAhead {
public:
    ContextsAhead() = default;
    ContextsAhead(ContextsAhead&&) = default;
    ContextsAhead& operator=(ContextsAhead&& other) noexcept {
        works_.swap(other.works_);
        return *this;
    }
    /// Programs that are not begun will not be built. Does not wait for those at hand: see programs_being_built.
    ~ContextsAhead();

    /// Begins with a device, and with its programs in their order. What fails is left to whoever needs it, who is then
    /// told why; and so is all of a device that stays in one thread.
    void begin(const Device& device, std::vector<KernelProgram> programs);

    /// Returns the context of a device as soon as there is one; null where none was begun, it could not be made, or it
    /// was taken. Its programs are built on: who needs one waits for it.
    std::shared_ptr<DeviceContext> take(const Device& device);

private:
    struct Work {
        Device device;
        std::future<std::shared_ptr<DeviceContext>> context;
        std::stop_source stop;
    };

    std::vector<Work> works_;
};

/// Returns the number of threads of all ContextsAhead that still build programs. If there are any, the process is
/// better ended without waiting for drivers.
std::size_t programs_being_built();

}  // namespace castor
