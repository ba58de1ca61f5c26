#include "opencl/contexts_ahead.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace castor {

void ContextsAhead::begin(const Device& device, std::vector<KernelProgram> programs) {
    if (device_quirks(device).stays_in_thread) return;
    Work& work = *works_.emplace_back(std::make_unique<Work>());
    work.device = device;
    work.thread = std::jthread([&work, programs = std::move(programs)](const std::stop_token& stop) {
        try {
            work.context = std::make_unique<DeviceContext>(work.device);
            for (const KernelProgram& program : programs) {
                if (stop.stop_requested()) return;
                work.context->build_ahead(name_of_program(*work.context, program.source), program.options);
            }
        } catch (const std::exception&) {
            // It happens again where the device or the program is used.
        }
    });
}

std::unique_ptr<DeviceContext> ContextsAhead::take(const Device& device) {
    const auto found =
        std::find_if(works_.begin(), works_.end(), [&](const auto& work) { return work->device.id == device.id; });
    if (found == works_.end()) return nullptr;
    const std::unique_ptr<Work> work = std::move(*found);
    works_.erase(found);
    work->thread.join();
    return std::move(work->context);
}

}  // namespace castor
