#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/stopwatch.h"
#include "castor/device_share.h"
#include "castor/error.h"
#include "opencl/device_context.h"
#include "trace/device_scene.h"
#include "trace/scene_contents.h"
#include "trace/tuning.h"

namespace castor {

/// Returns a context that was made ahead, or else a new one. The contents' mutex must be held.
inline std::shared_ptr<DeviceContext> context_for(const Device& device, SceneContents& contents) {
    std::shared_ptr<DeviceContext> context = contents.contexts_ahead.take(device);
    return context ? context : std::make_shared<DeviceContext>(device);
}

/// A device with the scene on it. Its queue and its scene are for one thread at a time, because some drivers need it:
/// two threads that used PoCL's `basic` at once hung, or got wrong pixels.
struct SceneDevice {
    SceneDevice(const Device& device, const std::shared_ptr<SceneContents>& scene_contents, const Tuning& device_tuning,
                const Range& kept_chunks)
        : contents(scene_contents),
          own_context(context_for(device, *contents)),
          context(*own_context),
          scene(context, *contents, kept_chunks),
          tuning(device_tuning) {}
    ~SceneDevice() { finish_before_release(context); }

    std::shared_ptr<SceneContents> contents;     // whose memory the device may share
    std::shared_ptr<DeviceContext> own_context;  // programs may still be built in it: see ContextsAhead
    DeviceContext& context;
    DeviceScene scene;
    Tuning tuning;
    double setup_seconds = 0.0;  // programs and uploads
    std::timed_mutex mutex;      // held while the device is used
};

/// Locks the mutex of a device, or of a part of it, for a worker. The device may still be busy with earlier work that
/// was not waited for; the lock is not owned if `is_needed`, asked meanwhile, returns false.
inline std::unique_lock<std::timed_mutex> lock_for_work(std::timed_mutex& mutex,
                                                        const std::function<bool()>& is_needed) {
    constexpr std::chrono::milliseconds kPeriod(1);
    std::unique_lock lock(mutex, std::defer_lock);
    while (!lock.try_lock_for(kPeriod) && is_needed()) continue;
    return lock;
}

/// Runs `action`, so that all failures of the device leave as DeviceError.
template <class Action>
auto with_device_errors(const SceneDevice& device, Action&& action) {
    try {
        return action();
    } catch (...) {
        throw current_device_error(label(device.context.device()));
    }
}

/// The scene of a renderer or a tracer, and the devices that it is on, each a `OneDevice` derived from SceneDevice. A
/// device that fails is dropped. Usable from several threads, which keep a device that is dropped meanwhile.
template <class OneDevice>
class SceneDevices {
public:
    /// Uploads a Scene or a BuiltScene, with the options of the renderer or tracer. Throws UsageError if there are no
    /// devices or no such share of the scene, and the last one's DeviceError if no device is left.
    template <class AnyScene, class Options>
    SceneDevices(const AnyScene& scene, const std::vector<Device>& devices, const Options& options)
        : tunings_(choose_tunings(options.strategy, devices, options.use_profiles)), warnings_(warnings_of(tunings_)) {
        if (devices.empty()) throw UsageError("without a device there is nothing to render or trace with");
        if (const SceneShare& share = options.scene_share; share.number >= share.count)
            throw UsageError(fmt::format("there is no share {} of {} of a scene; they are numbered from 0",
                                         share.number, share.count));
        take(scene, options.quality, limits_of(devices));
        std::lock_guard lock(*contents_->mutex);
        kept_chunks_ = divide_chunks(*contents_, options.scene_share.count).at(options.scene_share.number);
        const std::vector<Warning>& scene_warnings = contents_->arrays().warnings;
        warnings_.insert(warnings_.begin(), scene_warnings.begin(), scene_warnings.end());
        const Stopwatch watch;
        std::optional<DeviceError> last_failure;
        for (std::size_t i = 0; i < devices.size(); ++i) {
            const Stopwatch device_watch;
            DeviceShare& share = shares_.emplace_back();
            share.device = label(devices[i]);
            try {
                devices_.push_back(
                    std::make_shared<OneDevice>(devices[i], contents_, tunings_[i].tuning, kept_chunks_));
                share.setup_seconds = devices_.back()->setup_seconds = device_watch.seconds();
                if (const std::string& why = devices_.back()->context.undivided_because(); !why.empty())
                    warnings_.push_back({"", 0, fmt::format("{}; its cores render together, and slower", why)});
            } catch (...) {
                last_failure = current_device_error(share.device);
                devices_.push_back(nullptr);
                share.failure = last_failure->what();
                warnings_.push_back({"", 0, fmt::format("{}; the device is dropped", last_failure->what())});
            }
        }
        if (in_use().empty()) throw *last_failure;
        setup_seconds_ = watch.seconds();
    }

    SceneContents& contents() const { return *contents_; }
    /// Returns which chunks may stay on the devices.
    const Range& kept_chunks() const { return kept_chunks_; }
    const std::vector<Warning>& warnings() const { return warnings_; }
    const Tuning& tuning(std::size_t index) const { return tunings_.at(index).tuning; }
    double setup_seconds() const { return setup_seconds_; }
    /// Returns the devices' names, and how their setup went.
    const std::vector<DeviceShare>& first_shares() const { return shares_; }

    std::size_t size() const { return shares_.size(); }
    /// Returns a device; null if it was dropped.
    std::shared_ptr<OneDevice> at(std::size_t index) const {
        std::lock_guard lock(mutex_);
        return devices_.at(index);
    }
    /// Returns the numbers of the devices that are not dropped.
    std::vector<std::size_t> in_use() const {
        std::lock_guard lock(mutex_);
        std::vector<std::size_t> numbers;
        for (std::size_t i = 0; i < devices_.size(); ++i)
            if (devices_[i]) numbers.push_back(i);
        return numbers;
    }
    void drop(std::size_t index) {
        std::shared_ptr<OneDevice> device;  // released after the lock
        std::lock_guard lock(mutex_);
        device.swap(devices_.at(index));
    }

private:
    void take(const Scene& scene, TreeQuality quality, const ChunkLimits& limits) {
        contents_ = std::make_shared<SceneContents>(build_scene(scene, strategies_of(tunings_), quality, limits));
    }
    void take(const BuiltScene& scene, TreeQuality quality, const ChunkLimits& limits) {
        contents_ = complete_scene(scene, tunings_, quality, limits, warnings_);
    }

    std::vector<TuningInUse> tunings_;
    std::vector<Warning> warnings_;
    std::shared_ptr<SceneContents> contents_;
    Range kept_chunks_;
    std::vector<DeviceShare> shares_;
    double setup_seconds_ = 0.0;
    mutable std::mutex mutex_;
    std::vector<std::shared_ptr<OneDevice>> devices_;
};

}  // namespace castor
