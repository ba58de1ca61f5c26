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
#include "trace/remote_batch.h"
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

/// What is asked of all rays of a batch.
struct Question {
    Query query;
    Coherence hint;
    std::uint32_t flags;

    std::size_t answer_bytes() const { return query == Query::any ? 1 : sizeof(Hit); }
};

void enqueue(TraceDevice& device, const Question& question, const TraceKernels::RayBuffers& rays,
             const cl::Buffer& answers, std::size_t count) {
    if (question.query == Query::any)
        device.kernels.any_hit(device.context.queue(), device.scene, rays, TraceKernels::Occluded(answers), 0, count,
                               question.flags, question.hint);
    else
        device.kernels.closest_hit(device.context.queue(), device.scene, rays, TraceKernels::Hits(answers), 0, count,
                                   question.flags, question.hint);
}

std::size_t items_in(std::size_t rays) {
    return (rays + kRaysPerItem - 1) / kRaysPerItem;
}

/// A device that uploads, traces and downloads the rays of a piece. The caller holds the device's lock.
class DeviceRayWorker : public RayWorker {
public:
    DeviceRayWorker(TraceDevice& device, const Question& question)
        : device_(device),
          question_(question),
          pace_(device.paces
                    .try_emplace(
                        {question.query, question.hint},
                        first_pace(device.tuning.strategies.of(question.query, question.hint), device.context.device()))
                    .first->second),
          most_items_(std::clamp<std::size_t>(device.context.device().max_allocation_bytes / sizeof(Ray) / kRaysPerItem,
                                              1, kResidentRays / kRaysPerItem)) {}

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
                                     context.make_buffer(count * question_.answer_bytes(), "answers")});
        }
        const bool is_wanted = context.with_mapped(buffers_->rays, CL_MAP_WRITE_INVALIDATE_REGION, count * sizeof(Ray),
                                                   [&](void* mapped) { return load(static_cast<Ray*>(mapped)); });
        if (!is_wanted) return false;
        enqueue(device_, question_, TraceKernels::RayBuffers::records(buffers_->rays), buffers_->answers, count);
        context.wait(pace_.expected_seconds(items));
        const bool counts =
            context.with_mapped(buffers_->answers, CL_MAP_READ, count * question_.answer_bytes(),
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
    Question question_;
    Pace& pace_;
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

    template <class Answer>
    bool trace(std::span<const Ray> rays, std::span<Answer> answers, Query query, Coherence hint,
               const std::function<bool()>& go_on, Manager* manager = nullptr) {
        assert(answers.size() == rays.size());
        return trace({rays.data(), reinterpret_cast<std::byte*>(answers.data()), sizeof(Answer), rays.size()},
                     {query, hint, flags}, go_on, manager);
    }

    /// Divides the batch among the devices, and those of other processes if there is a manager. Whether all rays are
    /// answered.
    bool trace(const RayBatch& batch, const Question& question, const std::function<bool()>& go_on, Manager* manager) {
        std::lock_guard batch_lock(batch_mutex);
        const std::vector<std::size_t> in_use = devices.in_use();
        if (in_use.empty() && !manager) throw DeviceError("", "", 0, "all devices of this tracer were dropped before");
        const std::size_t remote_count = manager ? manager->workers().size() : 0;
        std::vector<WorkerFunction> workers;
        std::vector<std::size_t> share_of(in_use);  // the number of each worker's share
        bool is_stopped = false;
        CrewOptions options{.deadlines = deadlines};
        if (go_on) options.tick = [&] { return !(is_stopped = !go_on()); };
        std::optional<DeviceError> last_failure;
        const auto on_answered = [this](std::size_t share, std::size_t rays, double seconds) {
            std::lock_guard lock(shares_mutex);
            ++shares[share].tiles;
            shares[share].rays += rays;
            shares[share].busy_seconds += seconds;
        };
        for (const std::size_t i : in_use) {
            auto device = devices.at(i);
            options.names.push_back(label(device->context.device()));
            options.in_callers_thread.push_back(device->context.quirks().stays_in_thread);
            workers.push_back([=](Schedule& schedule, std::size_t number) {
                const auto lock = lock_for_work(*device, [&] { return schedule.may_have_work(number); });
                if (!lock) return;
                DeviceRayWorker worker(*device, question);
                with_device_errors(*device, [&] {
                    answer_pieces(worker, batch, schedule, number,
                                  [&](std::size_t rays, double seconds) { on_answered(i, rays, seconds); });
                });
            });
        }
        for (std::size_t i = 0; i < remote_count; ++i) {
            options.names.push_back(manager->workers()[i].name);
            share_of.push_back(devices.size() + i);
            workers.push_back(manager->is_dropped(i) ? WorkerFunction([](Schedule&, std::size_t) {}) : nullptr);
            std::lock_guard lock(shares_mutex);
            if (shares.size() == devices.size() + i) shares.emplace_back().device = manager->workers()[i].name;
        }
        options.on_drop = [&](std::size_t worker, const DeviceError& why) {
            last_failure = why;
            if (worker < in_use.size())
                devices.drop(in_use[worker]);
            else
                manager->drop_worker(worker - in_use.size());
            std::lock_guard lock(shares_mutex);
            shares[share_of[worker]].failure = why.what();
            ++shares[share_of[worker]].retries;
        };
        options.on_leave = [&](std::size_t worker) {
            std::lock_guard lock(shares_mutex);
            ++shares[share_of[worker]].left_busy;
        };
        const auto schedule =
            std::make_shared<Schedule>(std::vector<Range>{{0, items_in(batch.count)}}, workers.size());
        if (manager) {
            RemoteBatch job(batch, describe(question), schedule, workers.size(),
                            [&](std::size_t worker, std::size_t rays, double seconds) {
                                on_answered(share_of[worker], rays, seconds);
                            });
            const RemoteTurn turn(*manager, job);
            options.serve = [&] { return manager->serve(); };
            manager->begin_schedule(schedule, in_use.size());
            run_crew(schedule, workers, options);
        } else {
            run_crew(schedule, workers, options);
        }
        const bool is_complete = schedule->items_left() == 0;
        if (!is_complete && !is_stopped)
            throw last_failure.value_or(DeviceError("", "", 0, "all devices were dropped before"));
        return is_complete;
    }

    /// All that answers depend on beside the rays, a line each.
    std::string describe(const Question& question) const {
        return fmt::format("castor {}\nscene {:016x}\nquery {}\nback faces {}\n", CASTOR_VERSION,
                           devices.contents().fingerprint, question.query == Query::any ? "any" : "closest",
                           question.flags & CASTOR_TRACE_CULL_BACK_FACES ? "culled" : "hit");
    }

    /// Lets the devices answer rays of the manager's next batch.
    bool serve(const Question& question, RankServer& server) {
        std::lock_guard batch_lock(batch_mutex);
        /// A worker with all that it uses.
        struct OwningRayWorker : RayWorker {
            OwningRayWorker(std::shared_ptr<TraceDevice> of, std::unique_lock<std::timed_mutex> device_lock,
                            const Question& asked)
                : device(std::move(of)), lock(std::move(device_lock)), worker(*device, asked) {}
            std::uint64_t items_wanted() const override { return worker.items_wanted(); }
            std::uint64_t most_items() const override { return worker.most_items(); }
            double items_per_second() const override { return worker.items_per_second(); }
            bool answer(std::size_t count, const LoadRays& load, const StoreAnswers& store) override {
                return with_device_errors(*device, [&] { return worker.answer(count, load, store); });
            }
            std::shared_ptr<TraceDevice> device;
            std::unique_lock<std::timed_mutex> lock;
            DeviceRayWorker worker;
        };
        std::vector<OrderedWorkerOffer> offers;
        for (const std::size_t i : devices.in_use()) {
            const auto device = devices.at(i);
            offers.push_back({device->context.quirks().stays_in_thread,
                              [=](const std::function<bool()>& is_needed) -> std::unique_ptr<OrderedWorker> {
                                  auto lock = lock_for_work(*device, is_needed);
                                  if (!lock) return nullptr;
                                  return ordered(std::make_unique<OwningRayWorker>(device, std::move(lock), question),
                                                 question.answer_bytes(), device->setup_seconds);
                              }});
        }
        return server.serve(describe(question), offers);
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
    return implementation_->trace(rays, hits, Query::closest, hint, go_on);
}

bool Tracer::any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint,
                     const std::function<bool()>& go_on) {
    return implementation_->trace(rays, occluded, Query::any, hint, go_on);
}

bool trace_together(Tracer& tracer, std::span<const Ray> rays, std::span<Hit> hits, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager) {
    return tracer.implementation_->trace(rays, hits, Query::closest, hint, go_on, &manager);
}

bool trace_together(Tracer& tracer, std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager) {
    return tracer.implementation_->trace(rays, occluded, Query::any, hint, go_on, &manager);
}

bool serve_trace(Tracer& tracer, Query query, Coherence hint, RankServer& server) {
    return tracer.implementation_->serve({query, hint, tracer.implementation_->flags}, server);
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
