#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "c/call.h"
#include "castor/built_scene.h"
#include "castor/device.h"
#include "castor/device_share.h"
#include "castor/film.h"
#include "castor/renderer.h"
#include "castor/scene.h"
#include "castor/tracer.h"

namespace castor::c {

/// What handles point to: destroyed with the last reference.
struct Counted {
    std::atomic<std::size_t> references = 1;
};

template <class Handle>
void retain(Handle* handle) noexcept {
    if (handle) handle->references.fetch_add(1, std::memory_order_relaxed);
}

template <class Handle>
void release(Handle* handle) noexcept {
    if (handle && handle->references.fetch_sub(1, std::memory_order_acq_rel) == 1) delete handle;
}

/// Texts that were told, kept as long as the handle: each once. For texts that change. Usable from several threads.
class ToldTexts {
public:
    const char* keep(const std::string& text) const {
        std::lock_guard lock(mutex_);
        return texts_.insert(text).first->c_str();
    }

private:
    mutable std::mutex mutex_;
    mutable std::set<std::string> texts_;
};

void get_warning(const std::vector<Warning>& warnings, std::size_t i, castor_warning* warning);
void get_share(const std::vector<DeviceShare>& shares, std::size_t i, const ToldTexts& texts,
               castor_device_share* share);
/// Strings of the camera in C are those of `camera`.
void get_camera(const std::vector<Camera>& cameras, std::size_t i, castor_camera* camera);
std::size_t tone_map_count(const std::vector<Camera>& cameras, std::size_t camera);
void find_lights(const std::vector<Light>& lights, const char* word, std::uint32_t* numbers, std::size_t capacity,
                 std::size_t* count);
void get_tone_map(const std::vector<Camera>& cameras, std::size_t camera, std::size_t i, castor_tone_map* tone_map,
                  const char** extension);
Camera to_camera(const castor_camera& given);

/// The handle's devices; for null those of an empty selection.
std::vector<Device> devices_of(const castor_devices* devices);

// Enumerators have the same numbers in C.
inline Strategy to_strategy(std::uint32_t value) {
    return enumerator<Strategy>(value, 5, "strategy");
}
inline TreeQuality to_quality(std::uint32_t value) {
    return enumerator<TreeQuality>(value, 2, "quality");
}
inline Query to_query(std::uint32_t value) {
    static_assert(static_cast<int>(Query::list) == CASTOR_QUERY_LIST);
    return enumerator<Query>(value, 4, "query");
}
inline Coherence to_coherence(std::uint32_t value) {
    return enumerator<Coherence>(value, 2, "coherence");
}

/// The options that a tracer and a renderer have in common.
template <class Options, class Given>
Options to_options(const Given& given) {
    Options options;
    options.strategy = to_strategy(given.strategy);
    options.quality = to_quality(given.quality);
    options.use_profiles = !flag(given.ignore_profiles, "ignore_profiles");
    options.deadline_seconds = value_or(given.deadline_seconds, options.deadline_seconds);
    options.stop_deadline_seconds = value_or(given.stop_deadline_seconds, options.stop_deadline_seconds);
    for (const double seconds : {options.deadline_seconds, options.stop_deadline_seconds})
        if (!(seconds > 0.0)) throw ArgumentError("a deadline", fmt::format("is {} s, expected more than 0", seconds));
    return options;
}

}  // namespace castor::c

struct castor_devices : castor::c::Counted {
    std::vector<castor::Device> devices;
    std::vector<castor::Warning> warnings;
};

struct castor_scene : castor::c::Counted {
    castor::Scene scene;
};

struct castor_built_scene : castor::c::Counted {
    explicit castor_built_scene(castor::BuiltScene scene) : built(std::move(scene)) {}
    castor::BuiltScene built;
};

struct castor_tracer : castor::c::Counted {
    template <class AnyScene>
    castor_tracer(const AnyScene& scene, const std::vector<castor::Device>& devices,
                  const castor::TracerOptions& options)
        : tracer(scene, devices, options), device_count(devices.size()) {}
    castor::Tracer tracer;
    std::size_t device_count;
    castor::c::ToldTexts texts;
};

struct castor_crossings : castor::c::Counted {
    explicit castor_crossings(castor::CrossingLists of) : lists(std::move(of)) {}
    const castor::CrossingLists lists;
};

struct castor_renderer : castor::c::Counted {
    template <class AnyScene>
    castor_renderer(const AnyScene& scene, const std::vector<castor::Device>& devices,
                    const castor::RendererOptions& options)
        : renderer(scene, devices, options), device_count(devices.size()) {}
    castor::Renderer renderer;
    std::size_t device_count;
    castor::c::ToldTexts texts;
};

struct castor_film : castor::c::Counted {
    explicit castor_film(castor::Film of);
    const castor::Film film;
    std::vector<std::string> channels;  // of each plane, with commas between
};
