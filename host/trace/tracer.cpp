#include "castor/tracer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "base/stopwatch.h"
#include "opencl/device_context.h"
#include "schedule/crew.h"
#include "trace/device_pace.h"
#include "trace/ray_worker.h"
#include "trace/scene_devices.h"
#include "trace/strategy.h"

namespace castor {

namespace {

struct TraceDevice : SceneDevice {
    TraceDevice(const Device& device, const std::shared_ptr<SceneContents>& scene_contents, const Tuning& device_tuning)
        : SceneDevice(device, scene_contents, device_tuning), kernels(context, scene, tuning) {}
    ~TraceDevice() { finish_before_release(context); }  // before the kernels go

    TraceKernels kernels;
    std::map<std::pair<Query, Coherence>, Pace> paces;
};

using Enqueue =
    std::function<void(TraceDevice&, const TraceKernels::RayBuffers&, const cl::Buffer& answers, std::size_t count)>;

std::size_t items_in(std::size_t rays) {
    return (rays + kRaysPerItem - 1) / kRaysPerItem;
}

/// A device that uploads, traces and downloads the rays of a piece. The caller holds the device's lock.
class DeviceRayWorker : public RayWorker {
public:
    DeviceRayWorker(TraceDevice& device, const RayBatch& batch, Query query, Coherence hint, const Enqueue& enqueue)
        : device_(device),
          pace_(device.paces
                    .try_emplace({query, hint},
                                 first_pace(device.tuning.strategies.of(query, hint), device.context.device()))
                    .first->second),
          enqueue_(enqueue),
          answer_bytes_(batch.answer_bytes),
          most_items_(std::min(
              {items_in(batch.count), kResidentRays / kRaysPerItem,
               std::max(std::size_t{1}, device.context.device().max_allocation_bytes / sizeof(Ray) / kRaysPerItem)})) {}

    std::uint64_t items_wanted() const override {
        // Where chunks stream, few rays take as long as many.
        return device_.scene.streaming_count() > 0 ? most_items_ : pace_.items_in_slice(most_items_);
    }
    std::uint64_t most_items() const override { return most_items_; }
    double items_per_second() const override { return pace_.items_per_second(); }

    bool answer(std::size_t count, const LoadRays& load, const StoreAnswers& store) override {
        const Stopwatch watch;
        const std::size_t items = items_in(count);
        DeviceContext& context = device_.context;
        if (!buffers_ || count > buffers_->capacity) {
            buffers_.reset();
            buffers_.emplace(Buffers{count, context.make_buffer(count * sizeof(Ray), "rays"),
                                     context.make_buffer(count * answer_bytes_, "answers")});
        }
        const bool is_wanted = context.with_mapped(buffers_->rays, CL_MAP_WRITE_INVALIDATE_REGION, count * sizeof(Ray),
                                                   [&](void* mapped) { return load(static_cast<Ray*>(mapped)); });
        if (!is_wanted) return false;
        enqueue_(device_, TraceKernels::RayBuffers::records(buffers_->rays), buffers_->answers, count);
        context.wait(pace_.expected_seconds(items));
        const bool counts =
            context.with_mapped(buffers_->answers, CL_MAP_READ, count * answer_bytes_,
                                [&](const void* mapped) { return store(static_cast<const std::byte*>(mapped)); });
        pace_.add(items, watch.seconds());
        return counts;
    }

private:
    static constexpr std::size_t kResidentRays = 1u << 22;
    struct Buffers {
        std::size_t capacity;  // in rays
        cl::Buffer rays, answers;
    };

    TraceDevice& device_;
    Pace& pace_;
    const Enqueue& enqueue_;
    std::size_t answer_bytes_;
    std::size_t most_items_;
    std::optional<Buffers> buffers_;
};

cl::Buffer upload_rays(DeviceContext& context, std::span<const Ray> rays) {
    const cl::Buffer buffer = context.make_buffer(rays.size_bytes(), "rays");
    context.write(buffer, rays.data(), rays.size_bytes());
    return buffer;
}

}  // namespace

struct Tracer::Implementation {
    template <class AnyScene>
    Implementation(const AnyScene& scene, const std::vector<Device>& device_list, const TracerOptions& options)
        : devices(scene, device_list, options),
          flags(options.cull_back_faces ? CASTOR_TRACE_CULL_BACK_FACES : 0),
          deadlines{options.deadline_seconds, options.stop_deadline_seconds},
          shares(devices.first_shares()) {
        std::lock_guard lock(*devices.contents().mutex);
        build_seconds = devices.contents().build_seconds;
    }

    /// Divides the batch among the devices. Whether all rays are answered.
    bool trace(const RayBatch& batch, Query query, Coherence hint, const Enqueue& enqueue,
               const std::function<bool()>& go_on) {
        std::lock_guard batch_lock(batch_mutex);
        const std::vector<std::size_t> in_use = devices.in_use();
        if (in_use.empty()) throw DeviceError("", "", 0, "all devices of this tracer were dropped before");
        std::vector<WorkerFunction> workers;
        bool is_stopped = false;
        CrewOptions options{.deadlines = deadlines};
        if (go_on) options.tick = [&] { return !(is_stopped = !go_on()); };
        std::optional<DeviceError> last_failure;
        for (const std::size_t i : in_use) {
            auto device = devices.at(i);
            options.names.push_back(label(device->context.device()));
            options.in_callers_thread.push_back(device->context.quirks().stays_in_thread);
            const auto on_answered = [this, i](std::size_t rays, double seconds) {
                std::lock_guard lock(shares_mutex);
                ++shares[i].tiles;
                shares[i].rays += rays;
                shares[i].busy_seconds += seconds;
            };
            workers.push_back([=](Schedule& schedule, std::size_t number) {
                const auto lock = lock_for_work(*device, [&] { return schedule.may_have_work(number); });
                if (!lock) return;
                DeviceRayWorker worker(*device, batch, query, hint, enqueue);
                with_device_errors(*device, [&] { answer_pieces(worker, batch, schedule, number, on_answered); });
            });
        }
        options.on_drop = [&](std::size_t worker, const DeviceError& why) {
            last_failure = why;
            devices.drop(in_use[worker]);
            std::lock_guard lock(shares_mutex);
            shares[in_use[worker]].failure = why.what();
            ++shares[in_use[worker]].retries;
        };
        options.on_leave = [&](std::size_t worker) {
            std::lock_guard lock(shares_mutex);
            ++shares[in_use[worker]].left_busy;
        };
        const auto schedule =
            std::make_shared<Schedule>(std::vector<Range>{{0, items_in(batch.count)}}, workers.size());
        run_crew(schedule, workers, options);
        const bool is_complete = schedule->items_left() == 0;
        if (!is_complete && !is_stopped) throw *last_failure;
        return is_complete;
    }

    std::shared_ptr<TraceDevice> device_at(std::size_t index) const {
        auto device = devices.at(index);
        std::lock_guard lock(shares_mutex);
        if (!device) throw DeviceError(shares[index].device, "", 0, "was dropped before: " + shares[index].failure);
        return device;
    }

    /// For this thread alone, once batches are not on their way any more.
    std::unique_lock<std::timed_mutex> lock(TraceDevice& device) const {
        std::unique_lock lock(device.mutex, std::chrono::duration<double>(deadlines.seconds));
        if (!lock)
            throw DeviceError(label(device.context.device()), "", 0,
                              fmt::format("has been at a batch for {:g} s", deadlines.seconds));
        return lock;
    }

    /// The device whose context the caller's queue belongs to.
    std::shared_ptr<TraceDevice> device_of(cl_command_queue queue) const {
        cl_context context = nullptr;
        clGetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof(context), &context, nullptr);
        for (std::size_t i = 0; i < devices.size(); ++i)
            if (auto device = devices.at(i); device && device->context.context()() == context) return device;
        throw UsageError("the command queue belongs to none of this Tracer's contexts");
    }

    void trace_callers_buffers(cl_command_queue queue, cl_mem rays, cl_mem answers, std::size_t first,
                               std::size_t count, cl_event* event, bool any, Coherence hint) {
        const std::shared_ptr<TraceDevice> device = device_of(queue);
        if (first > kMostRaysOfABuffer || count > kMostRaysOfABuffer - first)
            throw UsageError(fmt::format("{} rays from number {} on are asked for, and a buffer holds {} at most",
                                         count, first, kMostRaysOfABuffer));
        const cl::CommandQueue callers_queue(queue, true);
        const cl::Buffer ray_buffer(rays, true);
        const cl::Buffer answer_buffer(answers, true);
        const auto columns = TraceKernels::RayBuffers::records(ray_buffer);
        cl::Event complete;
        cl::Event* const wanted = event ? &complete : nullptr;
        const auto device_lock = lock(*device);
        if (any)
            device->kernels.any_hit(callers_queue, device->scene, columns, TraceKernels::Occluded(answer_buffer), first,
                                    count, flags, hint, wanted);
        else
            device->kernels.closest_hit(callers_queue, device->scene, columns, TraceKernels::Hits(answer_buffer), first,
                                        count, flags, hint, wanted);
        if (event) {
            *event = complete();
            clRetainEvent(*event);
        }
    }

    /// Traces rays on the first device, counting; `count(device, rays, answers)` enqueues.
    template <class Answer, class Count>
    TraceWork count_hits(std::span<const Ray> rays, std::span<Answer> answers, const Count& count) const {
        assert(answers.size() == rays.size());
        const std::shared_ptr<TraceDevice> device = device_at(0);
        const auto device_lock = lock(*device);
        DeviceContext& context = device->context;
        const cl::Buffer ray_buffer = upload_rays(context, rays);
        const cl::Buffer answer_buffer = context.make_buffer(answers.size_bytes(), "answers");
        TraceWork work;
        count(*device, TraceKernels::RayBuffers::records(ray_buffer), answer_buffer, work);
        context.read(answer_buffer, answers.data(), answers.size_bytes());
        return work;
    }

    static constexpr std::size_t kMostRaysOfABuffer = std::size_t{1} << 31;  // kernels count in 32 bits

    SceneDevices<TraceDevice> devices;
    std::uint32_t flags;
    Deadlines deadlines;
    double build_seconds = 0.0;
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

bool Tracer::closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint,
                         const std::function<bool()>& go_on) {
    assert(hits.size() == rays.size());
    return implementation_->trace(
        {rays.data(), reinterpret_cast<std::byte*>(hits.data()), sizeof(Hit), rays.size()}, Query::closest, hint,
        [hint, flags = implementation_->flags](TraceDevice& device, const auto& columns, const cl::Buffer& answers,
                                               std::size_t count) {
            device.kernels.closest_hit(device.context.queue(), device.scene, columns, TraceKernels::Hits(answers), 0,
                                       count, flags, hint);
        },
        go_on);
}

bool Tracer::any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint,
                     const std::function<bool()>& go_on) {
    assert(occluded.size() == rays.size());
    return implementation_->trace(
        {rays.data(), reinterpret_cast<std::byte*>(occluded.data()), 1, rays.size()}, Query::any, hint,
        [hint, flags = implementation_->flags](TraceDevice& device, const auto& columns, const cl::Buffer& answers,
                                               std::size_t count) {
            device.kernels.any_hit(device.context.queue(), device.scene, columns, TraceKernels::Occluded(answers), 0,
                                   count, flags, hint);
        },
        go_on);
}

TraceWork Tracer::count_closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint) {
    return implementation_->count_hits(
        rays, hits, [&](TraceDevice& device, const auto& columns, const cl::Buffer& answers, TraceWork& work) {
            device.kernels.count_closest_hit(device.scene, columns, TraceKernels::Hits(answers), rays.size(),
                                             implementation_->flags, hint, work);
        });
}

TraceWork Tracer::count_any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint) {
    return implementation_->count_hits(
        rays, occluded, [&](TraceDevice& device, const auto& columns, const cl::Buffer& answers, TraceWork& work) {
            device.kernels.count_any_hit(device.scene, columns, TraceKernels::Occluded(answers), rays.size(),
                                         implementation_->flags, hint, work);
        });
}

void Tracer::closest_hit(cl_command_queue queue, cl_mem rays, cl_mem hits, std::size_t first, std::size_t count,
                         cl_event* event, Coherence hint) {
    implementation_->trace_callers_buffers(queue, rays, hits, first, count, event, false, hint);
}

void Tracer::any_hit(cl_command_queue queue, cl_mem rays, cl_mem occluded, std::size_t first, std::size_t count,
                     cl_event* event, Coherence hint) {
    implementation_->trace_callers_buffers(queue, rays, occluded, first, count, event, true, hint);
}

cl_context Tracer::context(std::size_t device_index) const {
    return implementation_->device_at(device_index)->context.context()();
}

cl_command_queue Tracer::queue(std::size_t device_index) const {
    return implementation_->device_at(device_index)->context.queue()();
}

const std::vector<Warning>& Tracer::warnings() const {
    return implementation_->devices.warnings();
}
Strategy Tracer::strategy(Coherence hint, Query query, std::size_t device_index) const {
    return implementation_->devices.tuning(device_index).strategies.of(query, hint);
}
bool Tracer::streams(std::size_t device_index) const {
    return implementation_->device_at(device_index)->scene.streaming_count() > 0;
}
std::vector<DeviceShare> Tracer::shares() const {
    std::lock_guard lock(implementation_->shares_mutex);
    return implementation_->shares;
}
double Tracer::build_seconds() const {
    return implementation_->build_seconds;
}
double Tracer::setup_seconds() const {
    return implementation_->devices.setup_seconds();
}

}  // namespace castor
