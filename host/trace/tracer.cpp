#include "castor/tracer.h"

#include <algorithm>
#include <cassert>
#include <functional>
#include <mutex>
#include <thread>

#include "opencl/device_context.h"
#include "stopwatch.h"
#include "trace/device_scene.h"
#include "trace/shared_scene.h"
#include "trace/strategy.h"

namespace castor {

namespace {

/// One device with the scene on it.
struct TraceDevice {
    TraceDevice(const Device& device, const PreparedScene& prepared, const Tuning& tuning)
        : context(device), scene(upload_scene(context, prepared)), kernels(context, scene, tuning) {}

    DeviceContext context;
    DeviceScene scene;
    TraceKernels kernels;
    std::mutex mutex;  // held while the kernels' arguments are set, or a batch is on its way
};

using Enqueue = std::function<void(TraceDevice&, const TraceKernels::RayBuffers&, const cl::Buffer& answers, std::size_t count)>;

}  // namespace

struct Tracer::Implementation {
    Implementation(const Scene& scene, const std::vector<Device>& device_list, const TracerOptions& options)
        : Implementation(device_list, options) {
        shared = share_scene(scene, tunings, options.quality, common_allocation(device_list));
        set_up(device_list);
    }

    Implementation(const BuiltScene& scene, const std::vector<Device>& device_list, const TracerOptions& options)
        : Implementation(device_list, options) {
        shared = complete_scene(scene, tunings, options.quality, common_allocation(device_list), warnings);
        set_up(device_list);
    }

    Implementation(const std::vector<Device>& device_list, const TracerOptions& options)
        : tunings(choose_tunings(options.strategy, device_list, options.use_profiles)),
          flags(options.cull_back_faces ? CASTOR_TRACE_CULL_BACK_FACES : 0),
          warnings(warnings_of(tunings)) {
        if (device_list.empty()) throw UsageError("a Tracer needs at least one device");
    }

    void set_up(const std::vector<Device>& device_list) {
        std::lock_guard lock(shared->mutex);
        const PreparedScene& prepared = shared->prepared;
        warnings.insert(warnings.begin(), prepared.arrays.warnings.begin(), prepared.arrays.warnings.end());
        build_seconds = prepared.build_seconds;
        const Stopwatch setup_watch;
        for (std::size_t i = 0; i < device_list.size(); ++i)
            devices.push_back(std::make_unique<TraceDevice>(device_list[i], prepared, tunings[i].tuning));
        setup_seconds = setup_watch.seconds();
    }

    /// Uploads, traces and downloads part after part, so that no buffer grows beyond a batch.
    void trace_on(TraceDevice& device, const Ray* rays, std::byte* answers, std::size_t answer_bytes, std::size_t count,
                  const Enqueue& enqueue) {
        std::lock_guard lock(device.mutex);
        DeviceContext& context = device.context;
        const std::size_t part = std::min<std::size_t>({count, kResidentRays, std::max<std::size_t>(1, context.device().max_allocation_bytes / sizeof(Ray))});
        const cl::Buffer ray_buffer = context.make_buffer(part * sizeof(Ray), "rays");
        const cl::Buffer answer_buffer = context.make_buffer(part * answer_bytes, "answers");
        const TraceKernels::RayBuffers columns{ray_buffer, ray_buffer, true};
        for (std::size_t done = 0; done < count; done += part) {
            const std::size_t now = std::min(part, count - done);
            context.write(ray_buffer, rays + done, now * sizeof(Ray));
            enqueue(device, columns, answer_buffer, now);
            context.read(answer_buffer, answers + done * answer_bytes, now * answer_bytes);
        }
    }

    /// Equal contiguous shares of the batch, one a device.
    void trace(std::span<const Ray> rays, std::byte* answers, std::size_t answer_bytes, const Enqueue& enqueue) {
        std::vector<std::exception_ptr> failures(devices.size());
        const auto trace_share = [&](std::size_t i) {
            const std::size_t begin = rays.size() * i / devices.size();
            const std::size_t end = rays.size() * (i + 1) / devices.size();
            try {
                trace_on(*devices[i], rays.data() + begin, answers + begin * answer_bytes, answer_bytes, end - begin, enqueue);
            } catch (...) {
                failures[i] = std::current_exception();
            }
        };
        {
            std::vector<std::jthread> feeders;
            for (std::size_t i = 1; i < devices.size(); ++i) feeders.emplace_back(trace_share, i);
            trace_share(0);
        }
        for (const std::exception_ptr& failure : failures)
            if (failure) std::rethrow_exception(failure);
    }

    /// The device whose context the caller's queue belongs to.
    TraceDevice& device_of(cl_command_queue queue) {
        cl_context context = nullptr;
        clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof(context), &context, nullptr);
        for (const auto& device : devices)
            if (device->context.context()() == context) return *device;
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

    std::vector<TuningInUse> tunings;
    std::uint32_t flags;
    std::vector<Warning> warnings;
    std::shared_ptr<SharedScene> shared;
    double build_seconds = 0.0;
    double setup_seconds = 0.0;
    std::vector<std::unique_ptr<TraceDevice>> devices;
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
    implementation_->trace(rays, reinterpret_cast<std::byte*>(hits.data()), sizeof(Hit),
                           [&](TraceDevice& device, const auto& columns, const cl::Buffer& answers, std::size_t count) {
                               device.kernels.closest_hit(device.context.queue(), device.scene, columns, answers, 0, count,
                                                          implementation_->flags, hint);
                           });
}

void Tracer::any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint) {
    assert(occluded.size() == rays.size());
    implementation_->trace(rays, reinterpret_cast<std::byte*>(occluded.data()), 1,
                           [&](TraceDevice& device, const auto& columns, const cl::Buffer& answers, std::size_t count) {
                               device.kernels.any_hit(device.context.queue(), device.scene, columns, answers, 0, count,
                                                      implementation_->flags, hint);
                           });
}

TraceWork Tracer::count_closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint) {
    assert(hits.size() == rays.size());
    TraceWork work{};
    implementation_->trace_on(*implementation_->devices.front(), rays.data(), reinterpret_cast<std::byte*>(hits.data()), sizeof(Hit),
                              rays.size(), [&](TraceDevice& device, const auto& columns, const cl::Buffer& answers, std::size_t count) {
                                  device.kernels.count_closest_hit(device.scene, columns, answers, count, implementation_->flags, hint, work);
                              });
    return work;
}

TraceWork Tracer::count_any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint) {
    assert(occluded.size() == rays.size());
    TraceWork work{};
    implementation_->trace_on(*implementation_->devices.front(), rays.data(), reinterpret_cast<std::byte*>(occluded.data()), 1, rays.size(),
                              [&](TraceDevice& device, const auto& columns, const cl::Buffer& answers, std::size_t count) {
                                  device.kernels.count_any_hit(device.scene, columns, answers, count, implementation_->flags, hint, work);
                              });
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
    return implementation_->devices.at(device_index)->context.context()();
}

cl_command_queue Tracer::queue(std::size_t device_index) const {
    return implementation_->devices.at(device_index)->context.queue()();
}

const std::vector<Warning>& Tracer::warnings() const { return implementation_->warnings; }
Strategy Tracer::strategy(Coherence hint, Query query) const { return implementation_->tunings.front().tuning.strategies.of(query, hint); }
double Tracer::build_seconds() const { return implementation_->build_seconds; }
double Tracer::setup_seconds() const { return implementation_->setup_seconds; }

}  // namespace castor
