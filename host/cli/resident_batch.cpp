#include "resident_batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "castor/error.h"
#include "stopwatch.h"

namespace castor::cli {

namespace {

constexpr Hit kMiss{std::numeric_limits<float>::infinity(), 0.0f, 0.0f, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX};
constexpr Hit kOccluded{0.0f, 0.0f, 0.0f, 0, 0};

/// Kernels count rays, two columns each, in 32 bits.
constexpr std::size_t kMostRaysOfAPart = std::size_t{1} << 30;

}  // namespace

std::vector<Hit> hits_of_occlusion(std::span<const std::uint8_t> occluded) {
    std::vector<Hit> hits(occluded.size());
    std::transform(occluded.begin(), occluded.end(), hits.begin(),
                   [](std::uint8_t hit) { return hit ? kOccluded : kMiss; });
    return hits;
}

ResidentBatch::ResidentBatch(Tracer& tracer, const std::vector<Device>& devices, std::span<const Ray> rays, Query query,
                             Coherence hint)
    : tracer_(tracer), devices_(devices), query_(query), hint_(hint), ray_count_(rays.size()) {
    for (std::size_t i = 0; i < devices.size(); ++i)
        add_parts(i, rays, rays.size() * i / devices.size(), rays.size() * (i + 1) / devices.size());
}

void ResidentBatch::check(cl_int status, const char* call, std::size_t device) const {
    if (status != CL_SUCCESS)
        throw DeviceError(devices_[device].name, call, status, "while a batch of rays was held on the device");
}

ResidentBatch::Memory ResidentBatch::make_buffer(std::size_t device, cl_mem_flags flags, std::size_t bytes) const {
    cl_int status = CL_SUCCESS;
    Memory buffer(clCreateBuffer(tracer_.context(device), flags, bytes, nullptr, &status));
    check(status, "clCreateBuffer", device);
    return buffer;
}

void ResidentBatch::add_parts(std::size_t device, std::span<const Ray> rays, std::size_t begin, std::size_t end) {
    const std::uint64_t needed = std::uint64_t{end - begin} * (sizeof(Ray) + answer_bytes());
    if (needed > devices_[device].global_memory_bytes)
        throw DeviceError(
            devices_[device].name, "", 0,
            fmt::format("{} rays and their hits need {} bytes, but the device has {}; trace them in several files",
                        end - begin, needed, devices_[device].global_memory_bytes));
    const std::size_t most =
        std::clamp<std::size_t>(devices_[device].max_allocation_bytes / sizeof(Ray), 1, kMostRaysOfAPart);
    for (std::size_t first = begin; first < end; first += most) {
        Part part{device, first, std::min(most, end - first), nullptr, nullptr};
        part.rays = make_buffer(device, CL_MEM_READ_ONLY, part.count * sizeof(Ray));
        part.answers = make_buffer(device, CL_MEM_READ_WRITE, part.count * answer_bytes());
        check(clEnqueueWriteBuffer(tracer_.queue(device), part.rays.get(), CL_TRUE, 0, part.count * sizeof(Ray),
                                   rays.data() + first, 0, nullptr, nullptr),
              "clEnqueueWriteBuffer", device);
        parts_.push_back(std::move(part));
    }
}

double ResidentBatch::run() {
    const Stopwatch watch;
    for (const Part& part : parts_) {
        cl_command_queue queue = tracer_.queue(part.device);
        if (query_ == Query::closest)
            tracer_.closest_hit(queue, part.rays.get(), part.answers.get(), part.count, nullptr, hint_);
        else
            tracer_.any_hit(queue, part.rays.get(), part.answers.get(), part.count, nullptr, hint_);
        check(clFlush(queue), "clFlush", part.device);
    }
    for (std::size_t i = 0; i < devices_.size(); ++i) check(clFinish(tracer_.queue(i)), "clFinish", i);
    return watch.seconds();
}

std::vector<Hit> ResidentBatch::hits() const {
    std::vector<Hit> hits(ray_count_);
    std::vector<std::uint8_t> occluded(query_ == Query::any ? ray_count_ : 0);
    for (const Part& part : parts_) {
        void* target =
            query_ == Query::closest ? static_cast<void*>(hits.data() + part.first) : occluded.data() + part.first;
        check(clEnqueueReadBuffer(tracer_.queue(part.device), part.answers.get(), CL_TRUE, 0,
                                  part.count * answer_bytes(), target, 0, nullptr, nullptr),
              "clEnqueueReadBuffer", part.device);
    }
    return query_ == Query::any ? hits_of_occlusion(occluded) : hits;
}

}  // namespace castor::cli
