#include "opencl/contexts_ahead.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>
#include <utility>

namespace castor {

namespace {

std::atomic<std::size_t> being_built = 0;

/// What the thread of a device does. It owns or shares all that it uses, since a driver that hangs is left behind.
void make_context(const Device& device, const std::vector<KernelProgram>& programs, const std::stop_token& stop,
                  std::promise<std::shared_ptr<DeviceContext>>& promise) {
    std::shared_ptr<DeviceContext> context;
    try {
        context = std::make_shared<DeviceContext>(device);
    } catch (const std::exception&) {
        // It happens again where the device is used.
    }
    promise.set_value(context);
    if (!context) return;
    for (const KernelProgram& program : programs) {
        if (stop.stop_requested()) return;
        try {
            context->build_ahead(name_of_program(*context, program.source), program.options);
        } catch (const std::exception&) {
            // It happens again where the program is used.
        }
    }
}

bool is_same(const Device& a, const Device& b) {
    return a.id == b.id && a.max_allocation_bytes == b.max_allocation_bytes &&
           a.global_memory_bytes == b.global_memory_bytes;
}

}  // namespace

ContextsAhead::~ContextsAhead() {
    for (Work& work : works_) work.stop.request_stop();
}

void ContextsAhead::begin(const Device& device, std::vector<KernelProgram> programs) {
    if (device_quirks(device).stays_in_thread) return;
    std::promise<std::shared_ptr<DeviceContext>> promise;
    Work work{device, promise.get_future(), {}};
    ++being_built;
    try {
        std::thread([device, programs = std::move(programs), stop = work.stop.get_token(),
                     promise = std::move(promise)]() mutable {
            make_context(device, programs, stop, promise);
            --being_built;
        }).detach();
    } catch (const std::system_error&) {  // too many threads
        --being_built;
        return;
    }
    works_.push_back(std::move(work));
}

std::shared_ptr<DeviceContext> ContextsAhead::take(const Device& device) {
    const auto found =
        std::find_if(works_.begin(), works_.end(), [&](const Work& work) { return is_same(work.device, device); });
    if (found == works_.end()) return nullptr;
    Work work = std::move(*found);
    works_.erase(found);
    return work.context.get();
}

std::size_t programs_being_built() {
    return being_built;
}

}  // namespace castor
