#include "castor/tracer.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "opencl/device_context.h"
#include "schedule/crew.h"
#include "schedule/pace.h"
#include "stopwatch.h"
#include "trace/device_scene.h"
#include "trace/shared_scene.h"
#include "trace/strategy.h"

namespace castor {

namespace {

/// One device with the scene on it.
struct TraceDevice {
    TraceDevice(const Device& device, const std::shared_ptr<SharedScene>& shared_scene, const Tuning& tuning)
        : shared(shared_scene), context(device), scene(context, shared->prepared), kernels(context, scene, tuning) {}

    ~TraceDevice() { finish_before_release(context); }

    std::shared_ptr<SharedScene> shared;  // whose memory the device may share
    DeviceContext context;
    DeviceScene scene;
    TraceKernels kernels;
    std::map<std::pair<Query, Coherence>, Pace> paces;
    std::mutex mutex;  // held while the kernels' arguments are set, or a batch is on its way
};

using Enqueue = std::function<void(TraceDevice&, const TraceKernels::RayBuffers&, const cl::Buffer& answers, std::size_t count)>;

cl::Buffer upload_rays(DeviceContext& context, std::span<const Ray> rays) {
    const cl::Buffer buffer = context.make_buffer(rays.size_bytes(), "rays");
    context.write(buffer, rays.data(), rays.size_bytes());
    return buffer;
}

}  // namespace

struct Tracer::Implementation {
    Implementation(const Scene& scene, const std::vector<Device>& device_list, const TracerOptions& options)
        : Implementation(device_list, options) {
        shared = share_scene(scene, tunings, options.quality, limits_of(device_list));
        set_up(device_list);
    }

    Implementation(const BuiltScene& scene, const std::vector<Device>& device_list, const TracerOptions& options)
        : Implementation(device_list, options) {
        shared = complete_scene(scene, tunings, options.quality, limits_of(device_list), warnings);
        set_up(device_list);
    }

    Implementation(const std::vector<Device>& device_list, const TracerOptions& options)
        : tunings(choose_tunings(options.strategy, device_list, options.use_profiles)),
          flags(options.cull_back_faces ? CASTOR_TRACE_CULL_BACK_FACES : 0),
          deadline_seconds(options.deadline_seconds),
          warnings(warnings_of(tunings)) {
        if (device_list.empty()) throw UsageError("a Tracer needs at least one device");
    }

    /// A device that fails is left out, unless none is left.
    void set_up(const std::vector<Device>& device_list) {
        std::lock_guard lock(shared->mutex);
        const PreparedScene& prepared = shared->prepared;
        const std::vector<Warning>& scene_warnings = prepared.arrays().warnings;
        warnings.insert(warnings.begin(), scene_warnings.begin(), scene_warnings.end());
        build_seconds = prepared.build_seconds;
        const Stopwatch setup_watch;
        std::optional<DeviceError> last_failure;
        for (std::size_t i = 0; i < device_list.size(); ++i) {
            const Stopwatch watch;
            shares.emplace_back().device = label(device_list[i]);
            try {
                devices.push_back(std::make_shared<TraceDevice>(device_list[i], shared, tunings[i].tuning));
                shares.back().setup_seconds = watch.seconds();
            } catch (...) {
                last_failure = current_device_error(shares.back().device);
                devices.push_back(nullptr);
                shares.back().failure = last_failure->what();
                warnings.push_back({"", 0, fmt::format("{}; the device is dropped", last_failure->what())});
            }
        }
        if (alive_devices().empty()) throw *last_failure;
        setup_seconds = setup_watch.seconds();
    }

    /// A batch of the caller's, whose memory is touched only while the Schedule says that it is wanted.
    struct Batch {
        const Ray* rays;
        std::byte* answers;
        std::size_t answer_bytes;
        std::size_t count;
        Query query;
        Coherence hint;
    };

    /// Uploads, traces and downloads piece after piece of kRaysPerItem rays an item.
    static void trace_pieces(TraceDevice& device, const Batch& batch, const Enqueue& enqueue, Schedule& schedule, std::size_t worker,
                             const std::function<void(std::size_t rays, double seconds)>& on_piece) {
        std::lock_guard lock(device.mutex);
        DeviceContext& context = device.context;
        Pace& pace = device.paces[{batch.query, batch.hint}];
        schedule.set_speed(worker, pace.units_per_second());
        const std::size_t largest_buffer = std::max(std::size_t{1}, context.device().max_allocation_bytes / sizeof(Ray) / kRaysPerItem);
        const std::size_t most_items = std::min({items_of(batch.count), kResidentRays / kRaysPerItem, largest_buffer});
        struct Buffers {
            std::size_t capacity;  // in rays
            cl::Buffer rays, answers;
        };
        std::optional<Buffers> buffers;
        while (const auto piece = schedule.take(worker, pace.units_in_slice(most_items, kFirstItems))) {
            const Stopwatch watch;
            const std::size_t first = piece->begin * kRaysPerItem;
            const std::size_t now = std::min(piece->end * kRaysPerItem, batch.count) - first;
            if (!buffers || now > buffers->capacity) {
                buffers.reset();
                buffers.emplace(Buffers{now, context.make_buffer(now * sizeof(Ray), "rays"), context.make_buffer(now * batch.answer_bytes, "answers")});
            }
            const bool is_wanted = context.with_mapped(buffers->rays, CL_MAP_WRITE_INVALIDATE_REGION, now * sizeof(Ray), [&](void* mapped) {
                return schedule.keep(worker, [&] { std::memcpy(mapped, batch.rays + first, now * sizeof(Ray)); });
            });
            if (!is_wanted) continue;
            enqueue(device, TraceKernels::RayBuffers{buffers->rays, buffers->rays, true}, buffers->answers, now);
            context.wait(pace.expected_seconds(piece->size()));
            const bool counts = context.with_mapped(buffers->answers, CL_MAP_READ, now * batch.answer_bytes, [&](const void* mapped) {
                return schedule.finish(worker, [&] {
                    std::memcpy(batch.answers + first * batch.answer_bytes, mapped, now * batch.answer_bytes);
                    on_piece(now, watch.seconds());
                });
            });
            pace.add(piece->size(), watch.seconds());
            if (counts) schedule.set_speed(worker, pace.units_per_second());
        }
    }

    /// Divides the batch among the devices.
    void trace(const Batch& batch, const Enqueue& enqueue) {
        std::lock_guard batch_lock(batch_mutex);
        const std::vector<std::size_t> alive = alive_devices();
        if (alive.empty()) throw DeviceError("", "", 0, "all devices of this tracer were dropped before");
        std::vector<WorkerFunction> workers;
        CrewOptions options{.deadline_seconds = deadline_seconds};
        std::optional<DeviceError> last_failure;
        for (const std::size_t i : alive) {
            options.names.push_back(shares[i].device);
            options.in_callers_thread.push_back(devices[i]->context.profile().stays_in_thread);
            workers.push_back([this, device = devices[i], i, batch, enqueue](Schedule& schedule, std::size_t worker) {
                trace_pieces(*device, batch, enqueue, schedule, worker, [this, i](std::size_t rays, double seconds) {
                    std::lock_guard lock(shares_mutex);
                    ++shares[i].tiles;
                    shares[i].rays += rays;
                    shares[i].busy_seconds += seconds;
                });
            });
        }
        options.on_drop = [&](std::size_t worker, const DeviceError& why) {
            std::lock_guard lock(shares_mutex);
            shares[alive[worker]].failure = why.what();
            ++shares[alive[worker]].retries;
            devices[alive[worker]] = nullptr;
            last_failure = why;
        };
        const auto schedule = std::make_shared<Schedule>(std::vector<Range>{{0, items_of(batch.count)}}, workers.size());
        run_crew(schedule, workers, options);
        if (schedule->items_left() > 0) throw *last_failure;
    }

    std::vector<std::size_t> alive_devices() const {
        std::vector<std::size_t> alive;
        for (std::size_t i = 0; i < devices.size(); ++i)
            if (devices[i]) alive.push_back(i);
        return alive;
    }

    TraceDevice& device_at(std::size_t index) const {
        const auto& device = devices.at(index);
        if (!device) throw DeviceError(shares[index].device, "", 0, "was dropped before: " + shares[index].failure);
        return *device;
    }

    /// The device whose context the caller's queue belongs to.
    TraceDevice& device_of(cl_command_queue queue) {
        cl_context context = nullptr;
        clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof(context), &context, nullptr);
        for (const auto& device : devices)
            if (device && device->context.context()() == context) return *device;
        throw UsageError("the command queue belongs to none of this Tracer's contexts");
    }

    void trace_callers_buffers(cl_command_queue queue, cl_mem rays, cl_mem answers, std::size_t count, cl_event* event, bool any,
                               Coherence hint) {
        TraceDevice& device = device_of(queue);
        const cl::CommandQueue callers_queue(queue, true);
        const cl::Buffer ray_buffer(rays, true);
        const cl::Buffer answer_buffer(answers, true);
        const TraceKernels::RayBuffers columns{ray_buffer, ray_buffer, true};
        cl::Event last;
        std::lock_guard lock(device.mutex);
        if (any)
            device.kernels.any_hit(callers_queue, device.scene, columns, answer_buffer, 0, count, flags, hint, &last);
        else
            device.kernels.closest_hit(callers_queue, device.scene, columns, answer_buffer, 0, count, flags, hint, &last);
        if (count == 0) device.context.guarded("clEnqueueMarker", [&] { callers_queue.enqueueMarkerWithWaitList(nullptr, &last); });
        if (event) {
            *event = last();
            clRetainEvent(*event);
        }
    }

    static constexpr std::size_t kResidentRays = 1u << 22;
    static constexpr std::size_t kRaysPerItem = 256;
    static constexpr std::uint64_t kFirstItems = 16;  // until a device's speed is known

    static std::size_t items_of(std::size_t rays) { return (rays + kRaysPerItem - 1) / kRaysPerItem; }

    std::vector<TuningInUse> tunings;
    std::uint32_t flags;
    double deadline_seconds;
    std::vector<Warning> warnings;
    std::shared_ptr<SharedScene> shared;
    double build_seconds = 0.0;
    double setup_seconds = 0.0;
    std::vector<std::shared_ptr<TraceDevice>> devices;  // null: dropped
    std::mutex batch_mutex;  // one batch at a time
    std::vector<DeviceShare> shares;
    mutable std::mutex shares_mutex;
};

Tracer::Tracer(const Scene& scene, const std::vector<Device>& devices, const TracerOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Tracer::Tracer(const BuiltScene& scene, const std::vector<Device>& devices, const TracerOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

void Tracer::closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint) {
    assert(hits.size() == rays.size());
    implementation_->trace({rays.data(), reinterpret_cast<std::byte*>(hits.data()), sizeof(Hit), rays.size(), Query::closest, hint},
                           [hint, flags = implementation_->flags](TraceDevice& device, const auto& columns, const cl::Buffer& answers, std::size_t count) {
                               device.kernels.closest_hit(device.context.queue(), device.scene, columns, answers, 0, count, flags, hint);
                           });
}

void Tracer::any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint) {
    assert(occluded.size() == rays.size());
    implementation_->trace({rays.data(), reinterpret_cast<std::byte*>(occluded.data()), 1, rays.size(), Query::any, hint},
                           [hint, flags = implementation_->flags](TraceDevice& device, const auto& columns, const cl::Buffer& answers, std::size_t count) {
                               device.kernels.any_hit(device.context.queue(), device.scene, columns, answers, 0, count, flags, hint);
                           });
}

TraceWork Tracer::count_closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint) {
    assert(hits.size() == rays.size());
    TraceDevice& device = implementation_->device_at(0);
    std::lock_guard lock(device.mutex);
    const cl::Buffer ray_buffer = upload_rays(device.context, rays);
    const cl::Buffer answers = device.context.make_buffer(hits.size_bytes(), "answers");
    TraceWork work{};
    device.kernels.count_closest_hit(device.scene, {ray_buffer, ray_buffer, true}, answers, rays.size(), implementation_->flags, hint, work);
    device.context.read(answers, hits.data(), hits.size_bytes());
    return work;
}

TraceWork Tracer::count_any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint) {
    assert(occluded.size() == rays.size());
    TraceDevice& device = implementation_->device_at(0);
    std::lock_guard lock(device.mutex);
    const cl::Buffer ray_buffer = upload_rays(device.context, rays);
    const cl::Buffer answers = device.context.make_buffer(occluded.size_bytes(), "answers");
    TraceWork work{};
    device.kernels.count_any_hit(device.scene, {ray_buffer, ray_buffer, true}, answers, rays.size(), implementation_->flags, hint, work);
    device.context.read(answers, occluded.data(), occluded.size_bytes());
    return work;
}

void Tracer::closest_hit(cl_command_queue queue, cl_mem rays, cl_mem hits, std::size_t count, cl_event* event,
                         Coherence hint) {
    implementation_->trace_callers_buffers(queue, rays, hits, count, event, false, hint);
}

void Tracer::any_hit(cl_command_queue queue, cl_mem rays, cl_mem occluded, std::size_t count, cl_event* event,
                         Coherence hint) {
    implementation_->trace_callers_buffers(queue, rays, occluded, count, event, true, hint);
}

cl_context Tracer::context(std::size_t device_index) const {
    return implementation_->device_at(device_index).context.context()();
}

cl_command_queue Tracer::queue(std::size_t device_index) const {
    return implementation_->device_at(device_index).context.queue()();
}

const std::vector<Warning>& Tracer::warnings() const { return implementation_->warnings; }
Strategy Tracer::strategy(Coherence hint, Query query, std::size_t device_index) const {
    return implementation_->tunings.at(device_index).tuning.strategies.of(query, hint);
}
std::vector<DeviceShare> Tracer::shares() const {
    std::lock_guard lock(implementation_->shares_mutex);
    return implementation_->shares;
}
double Tracer::build_seconds() const { return implementation_->build_seconds; }
double Tracer::setup_seconds() const { return implementation_->setup_seconds; }

}  // namespace castor
