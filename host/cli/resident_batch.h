#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "castor/device.h"
#include "castor/tracer.h"

namespace castor::cli {

/// An occluded ray has t = u = v = 0 and primitive = instance = 0, any other is a miss.
std::vector<Hit> hits_of_occlusion(std::span<const std::uint8_t> occluded);

/// Rays and their answers in the memory of the devices, so that the query alone can be timed. The devices share the
/// batch in equal contiguous parts; a part larger than a device's largest allocation is split further, all of it
/// resident.
class ResidentBatch {
public:
    /// Uploads the rays. `devices` are those of the tracer, which must outlive the batch. Throws DeviceError, naming
    /// both sizes, if a device's memory cannot hold its share.
    ResidentBatch(Tracer& tracer, const std::vector<Device>& devices, std::span<const Ray> rays, Query query,
                  Coherence hint);

    /// Runs the query on all rays and waits for it; returns the seconds from the first enqueue to the end.
    double run();

    /// The answers of the last run; for Query::any as hits_of_occlusion has them.
    std::vector<Hit> hits() const;

private:
    struct ReleaseMemory {
        void operator()(cl_mem memory) const { clReleaseMemObject(memory); }
    };
    using Memory = std::unique_ptr<std::remove_pointer_t<cl_mem>, ReleaseMemory>;
    struct Part {
        std::size_t device = 0;
        std::size_t first = 0;
        std::size_t count = 0;
        Memory rays;
        Memory answers;
    };

    void add_parts(std::size_t device, std::span<const Ray> rays, std::size_t begin, std::size_t end);
    Memory make_buffer(std::size_t device, cl_mem_flags flags, std::size_t bytes) const;
    void check(cl_int status, const char* call, std::size_t device) const;
    std::size_t answer_bytes() const { return query_ == Query::closest ? sizeof(Hit) : 1; }

    Tracer& tracer_;
    std::vector<Device> devices_;
    Query query_;
    Coherence hint_;
    std::size_t ray_count_;
    std::vector<Part> parts_;
};

}  // namespace castor::cli
