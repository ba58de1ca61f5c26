#include "tune/resident_batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "base/stopwatch.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr Hit kMiss{std::numeric_limits<float>::infinity(), 0.0f, 0.0f, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX};
constexpr Hit kOccluded{0.0f, 0.0f, 0.0f, 0, 0};

/// Kernels count rays, two columns each, in 32 bits.
constexpr std::size_t kMostRaysOfAPart = std::size_t{1} << 30;

std::uint64_t items_of(std::size_t rays) {
    return (rays + kRaysPerItem - 1) / kRaysPerItem;
}

}  // namespace

std::vector<Hit> hits_of_occlusion(std::span<const std::uint8_t> occluded) {
    std::vector<Hit> hits(occluded.size());
    std::transform(occluded.begin(), occluded.end(), hits.begin(),
                   [](std::uint8_t hit) { return hit ? kOccluded : kMiss; });
    return hits;
}

ResidentBatch::ResidentBatch(Tracer& tracer, const Device& device, std::span<const Ray> rays, Query query,
                             Coherence hint)
    : tracer_(tracer),
      device_(device),
      query_(query),
      hint_(hint),
      ray_count_(rays.size()),
      pace_(first_pace(tracer.strategy(hint, query), device)) {
    const std::uint64_t needed = std::uint64_t{rays.size()} * (sizeof(Ray) + answer_bytes());
    if (needed > device.global_memory_bytes)
        throw DeviceError(
            device.name, "", 0,
            fmt::format("{} rays and their hits need {} bytes, but the device has {}; trace them in several files",
                        rays.size(), needed, device.global_memory_bytes));
    const std::size_t most = std::clamp<std::size_t>(device.max_allocation_bytes / sizeof(Ray), 1, kMostRaysOfAPart);
    for (std::size_t first = 0; first < rays.size(); first += most) {
        Part part{first, std::min(most, rays.size() - first), nullptr, nullptr};
        part.rays = make_buffer(CL_MEM_READ_ONLY, part.count * sizeof(Ray));
        part.answers = make_buffer(CL_MEM_READ_WRITE, part.count * answer_bytes());
        check(clEnqueueWriteBuffer(tracer.queue(), part.rays.get(), CL_TRUE, 0, part.count * sizeof(Ray),
                                   rays.data() + first, 0, nullptr, nullptr),
              "clEnqueueWriteBuffer");
        parts_.push_back(std::move(part));
    }
}

void ResidentBatch::check(cl_int status, const char* call) const {
    if (status != CL_SUCCESS)
        throw DeviceError(device_.name, call, status, "while a batch of rays was held on the device");
}

ResidentBatch::Memory ResidentBatch::make_buffer(cl_mem_flags flags, std::size_t bytes) const {
    cl_int status = CL_SUCCESS;
    Memory buffer(clCreateBuffer(tracer_.context(), flags, bytes, nullptr, &status));
    check(status, "clCreateBuffer");
    return buffer;
}

ResidentBatch::Event ResidentBatch::enqueue(const Part& part, std::size_t first, std::size_t count) {
    cl_event event = nullptr;
    if (query_ == Query::closest)
        tracer_.closest_hit(tracer_.queue(), part.rays.get(), part.answers.get(), first, count, &event, hint_);
    else
        tracer_.any_hit(tracer_.queue(), part.rays.get(), part.answers.get(), first, count, &event, hint_);
    Event owned(event);
    check(clFlush(tracer_.queue()), "clFlush");
    return owned;
}

std::optional<double> ResidentBatch::run(const std::function<bool()>& go_on) {
    const bool streams = tracer_.streams();
    const Stopwatch watch;
    Event last;                    // the previous slice
    std::uint64_t last_items = 0;  // 0: the slice was short, and so is not representative
    Stopwatch last_watch;          // since the device could begin that slice
    const auto wait = [&] {
        if (!last) return;
        check(clWaitForEvents(1, std::array{last.get()}.data()), "clWaitForEvents");
        if (last_items > 0) pace_.add(last_items, last_watch.seconds());
        last_watch = {};
        last.reset();
    };
    for (const Part& part : parts_)
        for (std::size_t first = 0; first < part.count;) {
            const std::uint64_t left = items_of(part.count - first);
            const std::uint64_t slice = pace_.items_in_slice(std::numeric_limits<std::uint64_t>::max());
            const std::uint64_t items = streams ? left : std::min(slice, left);
            const std::size_t count = std::min<std::size_t>(items * kRaysPerItem, part.count - first);
            // If a slice may take long, as with brute force over a large scene, only one is in flight: stopping waits
            // for it.
            if (pace_.items_per_second() <= 0.0 || pace_.expected_seconds(items) > 2 * Pace::kSliceSeconds) wait();
            if (!go_on()) {
                wait();
                return std::nullopt;
            }
            Event event = enqueue(part, first, count);
            wait();
            last = std::move(event);
            last_items = items == slice ? items : 0;
            first += count;
        }
    wait();
    return watch.seconds();
}

std::vector<Hit> ResidentBatch::hits() const {
    std::vector<Hit> hits(ray_count_);
    std::vector<std::uint8_t> occluded(query_ == Query::any ? ray_count_ : 0);
    for (const Part& part : parts_) {
        void* target =
            query_ == Query::closest ? static_cast<void*>(hits.data() + part.first) : occluded.data() + part.first;
        check(clEnqueueReadBuffer(tracer_.queue(), part.answers.get(), CL_TRUE, 0, part.count * answer_bytes(), target,
                                  0, nullptr, nullptr),
              "clEnqueueReadBuffer");
    }
    return query_ == Query::any ? hits_of_occlusion(occluded) : hits;
}

}  // namespace castor
