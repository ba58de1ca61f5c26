#include "castor/tracer.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <chrono>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <tuple>
#include <utility>

#include "base/stopwatch.h"
#include "opencl/device_context.h"
#include "schedule/crew.h"
#include "trace/chunk_answerer.h"
#include "trace/chunk_exchange.h"
#include "trace/device_pace.h"
#include "trace/distributed_trace.h"
#include "trace/ray_worker.h"
#include "trace/remote_batch.h"
#include "trace/scene_devices.h"
#include "trace/strategy.h"
#include "trace/surfaces.h"

namespace castor {

namespace {

/// Rays in an item, and the binary digits of a list's limit: rays with long lists are slower.
using PaceKey = std::tuple<Query, Coherence, std::size_t, int>;

struct TraceDevice : SceneDevice {
    TraceDevice(const Device& device, const std::shared_ptr<SceneContents>& scene_contents, const Tuning& device_tuning,
                const Range& kept_chunks)
        : SceneDevice(device, scene_contents, device_tuning, kept_chunks),
          kernels(context, scene, tuning),
          distributed(context, scene, tuning, kernels) {}
    ~TraceDevice() { finish_before_release(context); }  // before the kernels go

    TraceKernels kernels;
    DistributedTrace distributed;  // in use where others keep some of the chunks
    std::map<PaceKey, Pace> paces;
};

/// What is asked of all rays of a batch.
struct Question {
    Query query;
    Coherence hint;
    std::uint32_t flags;
    std::size_t limit = 0;  // of Query::list

    /// Returns the bytes that each ray has in each column of answers.
    std::vector<std::size_t> answer_bytes() const {
        switch (query) {
            case Query::closest:
                return {sizeof(Hit)};
            case Query::any:
                return {sizeof(std::uint8_t)};
            case Query::count:
                return {sizeof(std::uint32_t)};
            case Query::list:
                return {limit * sizeof(Hit), sizeof(std::uint32_t)};
        }
        return {};
    }

    /// Fewer where lists are so long that the answers of an item would not fit into any device's buffer.
    std::size_t rays_per_item() const {
        constexpr std::size_t kMostBytes = std::size_t{1} << 24;
        const std::size_t bytes = std::max<std::size_t>(1, answer_bytes().front());
        return std::clamp<std::size_t>(kMostBytes / bytes, 1, kRaysPerItem);
    }

    PaceKey pace_key() const { return {query, hint, rays_per_item(), std::bit_width(limit)}; }

    std::string text() const {
        return query == Query::list ? fmt::format("list, at most {} of a ray", limit) : std::string(to_string(query));
    }
};

/// Enqueues the question on a queue of the device. `answers`: the columns, each a buffer.
void enqueue(TraceDevice& device, const cl::CommandQueue& queue, const Question& question,
             const TraceKernels::RayBuffers& rays, std::span<const cl::Buffer> answers, std::size_t first,
             std::size_t count, cl::Event* event = nullptr) {
    TraceKernels& kernels = device.kernels;
    const auto& [query, hint, flags, limit] = question;
    switch (query) {
        case Query::closest:
            return kernels.closest_hit(queue, device.scene, rays, TraceKernels::Hits(answers[0]), first, count, flags,
                                       hint, event);
        case Query::any:
            return kernels.any_hit(queue, device.scene, rays, TraceKernels::Occluded(answers[0]), first, count, flags,
                                   hint, event);
        case Query::count:
            return kernels.count_crossings(queue, device.scene, rays, TraceKernels::CrossingCounts(answers[0]), first,
                                           count, flags, hint, event);
        case Query::list:
            return kernels.list_crossings(queue, device.scene, rays, static_cast<std::uint32_t>(limit),
                                          TraceKernels::Crossings(answers[0]), TraceKernels::CrossingCounts(answers[1]),
                                          first, count, flags, hint, event);
    }
}

/// A device that uploads, traces and downloads the rays of a piece. The caller holds the device's lock.
class DeviceRayWorker : public RayWorker {
public:
    /// `exchange`: with those who keep the other chunks; null: this device has all.
    DeviceRayWorker(TraceDevice& device, const Question& question,
                    const std::shared_ptr<ChunkExchange>& exchange = nullptr)
        : device_(device),
          question_(question),
          is_distributed_(exchange),
          answer_bytes_(question.answer_bytes()),
          pace_(device.paces
                    .try_emplace(
                        question.pace_key(),
                        first_pace(device.tuning.strategies.of(question.query, question.hint), device.context.device()))
                    .first->second),
          most_items_(std::max<std::size_t>(1, most_rays() / question.rays_per_item())) {
        if (exchange) device.distributed.set_exchange(exchange);
    }

    std::uint64_t items_wanted() const override {
        // Where chunks stream, or others keep some, few rays take as long as many.
        return device_.scene.streaming_count() > 0 || is_distributed_ ? most_items_ : pace_.items_in_slice(most_items_);
    }
    std::uint64_t most_items() const override { return most_items_; }
    double items_per_second() const override { return pace_.items_per_second(); }

    bool answer(std::size_t count, const LoadRays& load, const StoreAnswers& store) override {
        const Stopwatch watch;
        const std::size_t items = (count + question_.rays_per_item() - 1) / question_.rays_per_item();
        DeviceContext& context = device_.context;
        if (!buffers_ || count > buffers_->capacity) {
            buffers_.reset();
            Buffers buffers{count, context.make_buffer(count * sizeof(Ray), "rays"), {}};
            for (const std::size_t bytes : answer_bytes_)
                buffers.answers.push_back(context.make_buffer(count * bytes, "answers"));
            buffers_ = std::move(buffers);
        }
        const bool is_wanted = context.with_mapped(buffers_->rays, CL_MAP_WRITE_INVALIDATE_REGION, count * sizeof(Ray),
                                                   [&](void* mapped) { return load(static_cast<Ray*>(mapped)); });
        if (!is_wanted) return false;
        trace(TraceKernels::RayBuffers::records(buffers_->rays), count);
        context.wait(pace_.expected_seconds(items));
        std::vector<const std::byte*> mapped;
        const bool counts = store_mapped(count, store, mapped);
        pace_.add(items, watch.seconds());
        return counts;
    }

private:
    void trace(const TraceKernels::RayBuffers& rays, std::size_t count) {
        if (!is_distributed_)
            enqueue(device_, device_.context.queue(), question_, rays, buffers_->answers, 0, count);
        else if (question_.query == Query::any)
            device_.distributed.any_hit(rays, TraceKernels::Occluded(buffers_->answers[0]), count, question_.flags,
                                        question_.hint);
        else
            device_.distributed.closest_hit(rays, TraceKernels::Hits(buffers_->answers[0]), count, question_.flags,
                                            question_.hint);
    }

    static constexpr std::size_t kResidentRays = 1u << 22;
    struct Buffers {
        std::size_t capacity;  // in rays
        cl::Buffer rays;
        std::vector<cl::Buffer> answers;
    };

    /// The rays that are on the device at once: none of their buffers is too large, nor all together much larger than
    /// for kResidentRays nearest hits.
    std::size_t most_rays() const {
        std::size_t most = kResidentRays, largest = sizeof(Ray);
        for (const std::size_t bytes : answer_bytes_) {
            most = std::min(most, kResidentRays * sizeof(Ray) / bytes);
            largest = std::max(largest, bytes);
        }
        return std::min<std::size_t>(most, device_.context.device().max_allocation_bytes / largest);
    }

    /// Calls `store` while all columns of answers are mapped, of which `mapped` has the first ones.
    bool store_mapped(std::size_t count, const StoreAnswers& store, std::vector<const std::byte*>& mapped) {
        const std::size_t column = mapped.size();
        if (column == answer_bytes_.size()) return store(mapped);
        return device_.context.with_mapped(buffers_->answers[column], CL_MAP_READ, count * answer_bytes_[column],
                                           [&](const void* data) {
                                               mapped.push_back(static_cast<const std::byte*>(data));
                                               return store_mapped(count, store, mapped);
                                           });
    }

    TraceDevice& device_;
    Question question_;
    bool is_distributed_;
    std::vector<std::size_t> answer_bytes_;
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
          scene_share(options.scene_share),
          flags(options.cull_back_faces ? CASTOR_TRACE_CULL_BACK_FACES : 0),
          deadlines{options.deadline_seconds, options.stop_deadline_seconds},
          shares(devices.first_shares()) {
        std::lock_guard lock(*devices.contents().mutex);
        build_seconds = devices.contents().build_seconds;
    }

    Question question(Query query, Coherence hint, std::size_t limit = 0) const { return {query, hint, flags, limit}; }

    /// Answers the rays into `answers`, the columns of the question, which are spans.
    template <class... Answers>
    bool trace(const Question& question, std::span<const Ray> rays, const std::function<bool()>& go_on,
               Manager* manager, const Answers&... answers) {
        RayBatch batch{rays, {}, question.rays_per_item()};
        const std::vector<std::size_t> bytes = question.answer_bytes();
        const auto add = [&](const auto& column) {
            assert(column.size_bytes() == rays.size() * bytes[batch.answers.size()]);
            batch.answers.push_back({reinterpret_cast<std::byte*>(column.data()), bytes[batch.answers.size()]});
        };
        (add(answers), ...);
        return trace(batch, question, go_on, manager);
    }

    /// Throws UsageError if a device cannot hold the crossings of one ray.
    void check_limit(std::size_t limit) const {
        for (const std::size_t i : devices.in_use()) {
            const auto device = devices.at(i);
            if (!device) continue;
            const std::uint64_t most = std::min<std::uint64_t>(
                device->context.device().max_allocation_bytes / sizeof(Hit), std::numeric_limits<std::uint32_t>::max());
            if (limit > most)
                throw UsageError(
                    fmt::format("{} crossings of a ray are asked for, and the largest buffer of {} holds {}", limit,
                                label(device->context.device()), most));
        }
    }

    bool list_crossings(std::span<const Ray> rays, std::size_t limit, std::span<Hit> crossings,
                        std::span<std::uint32_t> counts, Coherence hint, const std::function<bool()>& go_on,
                        Manager* manager = nullptr) {
        if (limit == 0) return trace(question(Query::count, hint), rays, go_on, manager, counts);
        check_limit(limit);
        return trace(question(Query::list, hint, limit), rays, go_on, manager, crossings, counts);
    }

    /// Divides the batch among the devices, and those of other processes if there is a manager. Whether all rays are
    /// answered.
    bool trace(const RayBatch& batch, const Question& question, const std::function<bool()>& go_on, Manager* manager) {
        std::lock_guard batch_lock(batch_mutex);
        const std::vector<std::size_t> in_use = devices.in_use();
        if (in_use.empty() && (!manager || !scene_share.is_whole()))
            throw DeviceError("", "", 0, "all devices of this tracer were dropped before");
        std::shared_ptr<ChunkExchange> exchange;
        if (manager && !scene_share.is_whole() && question.query != Query::closest && question.query != Query::any)
            throw UsageError("crossings cannot be counted or listed where several processes divide the scene");
        if (manager && !scene_share.is_whole())
            exchange =
                std::make_shared<ChunkExchange>(*manager, describe(question), devices.contents(), deadlines.seconds);
        // Who keeps chunks answers for these, and gets no pieces of the batch.
        const std::size_t remote_count = manager && !exchange ? manager->workers().size() : 0;
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
                const auto lock = lock_for_work(device->mutex, [&] { return schedule.may_have_work(number); });
                if (!lock) return;
                DeviceRayWorker worker(*device, question, exchange);
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
        const auto schedule = std::make_shared<Schedule>(std::vector<Range>{{0, batch.items()}}, workers.size());
        if (exchange) {
            const ChunkExchangeTurn turn(*exchange);
            exchange->let_serve(options);
            run_crew(schedule, workers, options);
            take_others(exchange->shares());
        } else if (manager) {
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

    /// Adds what those did who keep other chunks.
    void take_others(const std::vector<DeviceShare>& others) {
        std::lock_guard lock(shares_mutex);
        shares.resize(devices.size() + others.size());
        for (std::size_t i = 0; i < others.size(); ++i) {
            DeviceShare& share = shares[devices.size() + i];
            share.device = others[i].device;
            share.failure = others[i].failure;
            share.tiles += others[i].tiles;
            share.rays += others[i].rays;
            share.retries += others[i].retries;
            share.busy_seconds += others[i].busy_seconds;
        }
    }

    /// All that answers depend on beside the rays, a line each, and how the scene is divided.
    std::string describe(const Question& question) const {
        return fmt::format("castor {}\nscene {:016x}\nquery {}\nback faces {}\n{}", CASTOR_VERSION,
                           devices.contents().fingerprint, question.text(),
                           question.flags & CASTOR_TRACE_CULL_BACK_FACES ? "culled" : "hit",
                           describe_division(devices.contents(), scene_share));
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
            if (!scene_share.is_whole()) {
                offers.push_back(chunk_answerer_offer(device));
                continue;
            }
            offers.push_back({device->context.quirks().stays_in_thread,
                              [=](const std::function<bool()>& is_needed) -> std::unique_ptr<OrderedWorker> {
                                  auto lock = lock_for_work(device->mutex, is_needed);
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

    void trace_callers_buffers(const Question& question, cl_command_queue queue, cl_mem rays,
                               std::initializer_list<cl_mem> answers, std::size_t first, std::size_t count,
                               cl_event* event) {
        const std::shared_ptr<TraceDevice> device = device_of(queue);
        if (first > kMostRaysOfABuffer || count > kMostRaysOfABuffer - first)
            throw UsageError(fmt::format("{} rays from number {} on are asked for, and a buffer holds {} at most",
                                         count, first, kMostRaysOfABuffer));
        const cl::CommandQueue callers_queue(queue, true);
        const cl::Buffer ray_buffer(rays, true);
        std::vector<cl::Buffer> answer_buffers;
        for (const cl_mem buffer : answers) answer_buffers.emplace_back(buffer, true);
        cl::Event complete;
        const auto device_lock = lock(*device);
        enqueue(*device, callers_queue, question, TraceKernels::RayBuffers::records(ray_buffer), answer_buffers, first,
                count, event ? &complete : nullptr);
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
    SceneShare scene_share;
    std::uint32_t flags;
    Deadlines deadlines;
    double build_seconds = 0.0;
    std::mutex batch_mutex;  // one batch at a time
    std::vector<DeviceShare> shares;
    mutable std::mutex shares_mutex;
};

namespace {

/// Lists all crossings of rays: counts them, and then lists those of some rays at a time, which bounds the memory and
/// how long it takes until `go_on` is called again.
class CrossingLister {
public:
    CrossingLister(Tracer& tracer, Coherence hint, const std::function<bool()>& go_on)
        : tracer_(tracer), hint_(hint), go_on_(go_on) {}

    std::optional<CrossingLists> list_all(std::span<const Ray> rays) {
        CrossingLists lists;
        if (!count(rays, lists.first) || !make_room(lists)) return std::nullopt;
        for (std::size_t begin = 0; begin < rays.size(); begin += kRaysAtATime) {
            const std::size_t end = std::min(begin + kRaysAtATime, rays.size());
            if (!list(rays.subspan(begin, end - begin), std::span(lists.first).subspan(begin), lists.crossings))
                return std::nullopt;
        }
        return lists;
    }

private:
    static constexpr std::size_t kRaysAtATime = std::size_t{1} << 20;
    static constexpr std::size_t kBytesAtATime = std::size_t{1} << 25;

    bool goes_on() const { return !go_on_ || go_on_(); }

    bool count(std::span<const Ray> rays, std::vector<std::uint64_t>& first) {
        first.reserve(rays.size() + 1);
        first.push_back(0);
        std::vector<std::uint32_t> counts(std::min(kRaysAtATime, rays.size()));
        for (std::size_t begin = 0; begin < rays.size(); begin += kRaysAtATime) {
            const auto some = rays.subspan(begin, std::min(kRaysAtATime, rays.size() - begin));
            const auto found = std::span(counts).first(some.size());
            if (!goes_on() || !tracer_.count_crossings(some, found, hint_, go_on_)) return false;
            for (const std::uint32_t crossings : found) first.push_back(first.back() + crossings);
        }
        return true;
    }

    bool make_room(CrossingLists& lists) const {
        const std::size_t size = lists.first.back();
        lists.crossings.reserve(size);
        while (lists.crossings.size() < size) {
            if (!goes_on()) return false;
            lists.crossings.resize(std::min(size, lists.crossings.size() + kBytesAtATime / sizeof(Hit)));
        }
        return true;
    }

    /// Rays with about equally many crossings are listed together, so that none has more than twice its room. `first`:
    /// where the crossings of the rays begin in `crossings`, and the end of the last one's.
    bool list(std::span<const Ray> rays, std::span<const std::uint64_t> first, std::span<Hit> crossings) {
        std::map<std::uint64_t, std::vector<std::uint32_t>> rays_by_room;
        for (std::size_t i = 0; i < rays.size(); ++i)
            if (first[i + 1] > first[i])
                rays_by_room[std::bit_ceil(first[i + 1] - first[i])].push_back(static_cast<std::uint32_t>(i));
        for (const auto& [room, numbers] : rays_by_room) {
            std::size_t limit = 0;
            for (const std::uint32_t i : numbers) limit = std::max(limit, first[i + 1] - first[i]);
            const std::size_t most = std::max<std::size_t>(1, kBytesAtATime / (sizeof(Ray) + limit * sizeof(Hit)));
            for (std::span<const std::uint32_t> left = numbers; !left.empty();) {
                const auto portion = left.first(std::min(most, left.size()));
                if (!goes_on() || !list(rays, portion, limit, first, crossings)) return false;
                left = left.subspan(portion.size());
            }
        }
        return true;
    }

    /// Lists the crossings of the rays of these numbers, which have at most `limit` each.
    bool list(std::span<const Ray> rays, std::span<const std::uint32_t> numbers, std::size_t limit,
              std::span<const std::uint64_t> first, std::span<Hit> crossings) {
        rays_.clear();
        for (const std::uint32_t i : numbers) rays_.push_back(rays[i]);
        if (crossings_.size() < numbers.size() * limit) crossings_.resize(numbers.size() * limit);
        counts_.resize(numbers.size());
        const auto found = std::span(crossings_).first(numbers.size() * limit);
        if (!tracer_.list_crossings(rays_, limit, found, counts_, hint_, go_on_)) return false;
        for (std::size_t k = 0; k < numbers.size(); ++k) {
            const std::uint32_t i = numbers[k];
            std::copy_n(&found[k * limit], first[i + 1] - first[i], &crossings[first[i]]);
        }
        return true;
    }

    Tracer& tracer_;
    Coherence hint_;
    const std::function<bool()>& go_on_;
    // Of some rays, kept for the next ones.
    std::vector<Ray> rays_;
    std::vector<Hit> crossings_;
    std::vector<std::uint32_t> counts_;
};

}  // namespace

Tracer::Tracer(const Scene& scene, const std::vector<Device>& devices, const TracerOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Tracer::Tracer(const BuiltScene& scene, const std::vector<Device>& devices, const TracerOptions& options)
    : implementation_(std::make_unique<Implementation>(scene, devices, options)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

bool Tracer::closest_hit(std::span<const Ray> rays, std::span<Hit> hits, Coherence hint,
                         const std::function<bool()>& go_on) {
    return implementation_->trace(implementation_->question(Query::closest, hint), rays, go_on, nullptr, hits);
}

bool Tracer::any_hit(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint,
                     const std::function<bool()>& go_on) {
    return implementation_->trace(implementation_->question(Query::any, hint), rays, go_on, nullptr, occluded);
}

bool Tracer::count_crossings(std::span<const Ray> rays, std::span<std::uint32_t> counts, Coherence hint,
                             const std::function<bool()>& go_on) {
    return implementation_->trace(implementation_->question(Query::count, hint), rays, go_on, nullptr, counts);
}

bool Tracer::list_crossings(std::span<const Ray> rays, std::size_t limit, std::span<Hit> crossings,
                            std::span<std::uint32_t> counts, Coherence hint, const std::function<bool()>& go_on) {
    return implementation_->list_crossings(rays, limit, crossings, counts, hint, go_on);
}

std::optional<CrossingLists> Tracer::list_all_crossings(std::span<const Ray> rays, Coherence hint,
                                                        const std::function<bool()>& go_on) {
    return CrossingLister(*this, hint, go_on).list_all(rays);
}

bool trace_together(Tracer& tracer, std::span<const Ray> rays, std::span<Hit> hits, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager) {
    auto& own = *tracer.implementation_;
    return own.trace(own.question(Query::closest, hint), rays, go_on, &manager, hits);
}

bool trace_together(Tracer& tracer, std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager) {
    auto& own = *tracer.implementation_;
    return own.trace(own.question(Query::any, hint), rays, go_on, &manager, occluded);
}

bool count_together(Tracer& tracer, std::span<const Ray> rays, std::span<std::uint32_t> counts, Coherence hint,
                    const std::function<bool()>& go_on, Manager& manager) {
    auto& own = *tracer.implementation_;
    return own.trace(own.question(Query::count, hint), rays, go_on, &manager, counts);
}

bool list_together(Tracer& tracer, std::span<const Ray> rays, std::size_t limit, std::span<Hit> crossings,
                   std::span<std::uint32_t> counts, Coherence hint, const std::function<bool()>& go_on,
                   Manager& manager) {
    return tracer.implementation_->list_crossings(rays, limit, crossings, counts, hint, go_on, &manager);
}

bool serve_trace(Tracer& tracer, Query query, std::size_t limit, Coherence hint, RankServer& server) {
    return tracer.implementation_->serve(tracer.implementation_->question(query, hint, limit), server);
}

void Tracer::find_surfaces(std::span<const Ray> rays, std::span<const Hit> hits, std::span<Surface> surfaces) const {
    assert(hits.size() == rays.size() && surfaces.size() == rays.size());
    const SceneContents& contents = implementation_->devices.contents();
    tbb::parallel_for(std::size_t{0}, rays.size(),
                      [&](std::size_t i) { surfaces[i] = surface_of_hit(contents, rays[i], hits[i]); });
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
    implementation_->trace_callers_buffers(implementation_->question(Query::closest, hint), queue, rays, {hits}, first,
                                           count, event);
}

void Tracer::any_hit(cl_command_queue queue, cl_mem rays, cl_mem occluded, std::size_t first, std::size_t count,
                     cl_event* event, Coherence hint) {
    implementation_->trace_callers_buffers(implementation_->question(Query::any, hint), queue, rays, {occluded}, first,
                                           count, event);
}

void Tracer::count_crossings(cl_command_queue queue, cl_mem rays, cl_mem counts, std::size_t first, std::size_t count,
                             cl_event* event, Coherence hint) {
    implementation_->trace_callers_buffers(implementation_->question(Query::count, hint), queue, rays, {counts}, first,
                                           count, event);
}

void Tracer::list_crossings(cl_command_queue queue, cl_mem rays, std::uint32_t limit, cl_mem crossings, cl_mem counts,
                            std::size_t first, std::size_t count, cl_event* event, Coherence hint) {
    if (limit == 0) return count_crossings(queue, rays, counts, first, count, event, hint);
    implementation_->trace_callers_buffers(implementation_->question(Query::list, hint, limit), queue, rays,
                                           {crossings, counts}, first, count, event);
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
