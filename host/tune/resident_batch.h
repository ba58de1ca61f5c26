#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "castor/device.h"
#include "castor/tracer.h"
#include "trace/device_pace.h"

namespace castor {

/// Converts occlusion to hits: an occluded ray has t = u = v = 0 and primitive = instance = 0, any other ray is a miss.
std::vector<Hit> hits_of_occlusion(std::span<const std::uint8_t> occluded);

/// Rays and their answers in the memory of a device, so that the query alone can be timed. A batch that is larger than
/// the device's largest allocation is split into several buffers, all of them resident.
class ResidentBatch {
public:
    /// Uploads the rays. `device` is the tracer's first device; the tracer must outlive the batch. Throws DeviceError,
    /// naming both sizes, if the device's memory cannot hold the batch.
    ResidentBatch(Tracer& tracer, const Device& device, std::span<const Ray> rays, Query query, Coherence hint);

    /// Runs the query on all rays in slices (see Pace) and waits for the end. While the device computes a slice, the
    /// next one is enqueued, unless slices take long. Returns the seconds from the first enqueue to the end, or nullopt
    /// if `go_on`, which is called between slices, returned false.
    std::optional<double> run(const std::function<bool()>& go_on);

    /// Returns the answers of a run that has ended; those of Query::any are converted by hits_of_occlusion.
    std::vector<Hit> hits() const;

private:
    struct ReleaseMemory {
        void operator()(cl_mem memory) const { clReleaseMemObject(memory); }
    };
    struct ReleaseEvent {
        void operator()(cl_event event) const { clReleaseEvent(event); }
    };
    using Memory = std::unique_ptr<std::remove_pointer_t<cl_mem>, ReleaseMemory>;
    using Event = std::unique_ptr<std::remove_pointer_t<cl_event>, ReleaseEvent>;
    struct Part {
        std::size_t first = 0;
        std::size_t count = 0;
        Memory rays;
        Memory answers;
    };

    void check(cl_int status, const char* call) const;
    Memory make_buffer(cl_mem_flags flags, std::size_t bytes) const;
    Event enqueue(const Part& part, std::size_t first, std::size_t count);
    std::size_t answer_bytes() const { return query_ == Query::closest ? sizeof(Hit) : 1; }

    Tracer& tracer_;
    Device device_;
    Query query_;
    Coherence hint_;
    std::size_t ray_count_;
    std::vector<Part> parts_;
    Pace pace_;
};

}  // namespace castor
