#include "failures/opencl_shim.h"

#include <dlfcn.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>

namespace castor::test {
namespace {

class Shim {
public:
    void reset(std::optional<Fault> fault) {
        std::lock_guard lock(mutex_);
        calls_.clear();
        fault_ = std::move(fault);
        happened_ = false;
        faulty_object_ = nullptr;
        hanging_allowed_ = true;
    }

    /// The status with which this call is to fail. Hangs first, if it is to.
    std::optional<cl_int> enter(const char* function, const void* object) {
        std::unique_lock lock(mutex_);
        const int call = entered_call() = calls_[function]++;
        if (!fault_ || fault_->function != function || fault_->of_command || fault_->corrupts || fault_->flags ||
            fault_->delay)
            return std::nullopt;
        const bool is_first = call == fault_->call && !happened_;
        const bool is_later = fault_->lasts && happened_ && object == faulty_object_;
        if (!is_first && !is_later) return std::nullopt;
        happened_ = true;
        faulty_object_ = object;
        if (fault_->hangs) {
            released_.wait(lock, [&] { return !hanging_allowed_; });
            return std::nullopt;
        }
        return fault_->status;
    }

    /// Whether a buffer with these flags is to be refused.
    std::optional<cl_int> refusal(cl_mem_flags flags) {
        std::lock_guard lock(mutex_);
        if (!fault_ || !fault_->flags || (flags & fault_->flags) != fault_->flags) return std::nullopt;
        happened_ = true;
        return fault_->status;
    }

    /// What clGetEventInfo is to give instead of the status.
    std::optional<cl_int> command_status() {
        std::lock_guard lock(mutex_);
        if (!fault_ || !fault_->of_command || calls_["clGetEventInfo"] - 1 != fault_->call) return std::nullopt;
        happened_ = true;
        return fault_->status;
    }

    /// Whether the read that this thread entered last is to be corrupted.
    bool corrupts_read() {
        std::lock_guard lock(mutex_);
        if (!fault_ || !fault_->corrupts || happened_ || entered_call() != fault_->call) return false;
        return happened_ = true;
    }

    /// The event for which the launch that this thread entered last is to wait, or null.
    cl_event launch_delay() {
        std::lock_guard lock(mutex_);
        if (!fault_ || !fault_->delay || happened_ || entered_call() != fault_->call) return nullptr;
        happened_ = true;
        return fault_->delay;
    }

    void release() {
        std::lock_guard lock(mutex_);
        hanging_allowed_ = false;
        released_.notify_all();
    }

    void add_object(const char* kind, long count) {
        std::lock_guard lock(mutex_);
        objects_[kind] += count;
    }

    void slow_down(const std::vector<int>& times) {
        std::lock_guard lock(mutex_);
        times_ = times;
        next_queue_ = 0;
    }
    void limit_groups(std::size_t most) { most_in_group_ = most; }
    std::size_t most_in_group() const { return most_in_group_; }
    void add_queue(cl_command_queue queue) {
        std::lock_guard lock(mutex_);
        if (next_queue_ < times_.size()) queue_times_[queue] = times_[next_queue_++];
    }
    int times_of(cl_command_queue queue) {
        std::lock_guard lock(mutex_);
        const auto found = queue_times_.find(queue);
        return found == queue_times_.end() ? 1 : found->second;
    }

    std::map<std::string, int> calls() {
        std::lock_guard lock(mutex_);
        return calls_;
    }
    std::map<std::string, long> objects() {
        std::lock_guard lock(mutex_);
        return objects_;
    }
    bool happened() {
        std::lock_guard lock(mutex_);
        return happened_;
    }

private:
    /// The number of the call that this thread entered last.
    static int& entered_call() {
        thread_local int call = -1;
        return call;
    }

    std::mutex mutex_;
    std::condition_variable released_;
    std::map<std::string, int> calls_;
    std::map<std::string, long> objects_;
    std::optional<Fault> fault_;
    bool happened_ = false;
    bool hanging_allowed_ = true;
    const void* faulty_object_ = nullptr;
    std::atomic<std::size_t> most_in_group_ = 0;
    std::vector<int> times_;
    std::size_t next_queue_ = 0;
    std::map<cl_command_queue, int> queue_times_;
};

// Never destroyed: threads may outlive main.
Shim& shim() {
    static Shim& only = *new Shim;
    return only;
}

template <class Function>
Function* real(const char* name) {
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

void reset_shim() {
    shim().reset(std::nullopt);
}
void reset_shim(const Fault& fault) {
    shim().reset(fault);
}
void release_hanging_calls() {
    shim().release();
}
bool fault_happened() {
    return shim().happened();
}
std::map<std::string, int> shim_calls() {
    return shim().calls();
}
std::map<std::string, long> live_objects() {
    return shim().objects();
}
void limit_groups(std::size_t most) {
    shim().limit_groups(most);
}
void slow_down_queues(const std::vector<int>& times) {
    shim().slow_down(times);
}

}  // namespace castor::test

using castor::test::real;
using castor::test::shim;

// A function that returns a status; its first argument is `object`.
#define CASTOR_SHIM_STATUS(name, parameters, arguments, object)              \
    extern "C" cl_int CL_API_CALL name parameters {                          \
        static auto* const handed_on = real<decltype(name)>(#name);          \
        if (const auto status = shim().enter(#name, object)) return *status; \
        return handed_on arguments;                                          \
    }

// A function that makes an object.
#define CASTOR_SHIM_CREATE(type, kind, name, parameters, arguments, object) \
    extern "C" type CL_API_CALL name parameters {                           \
        static auto* const handed_on = real<decltype(name)>(#name);         \
        if (const auto status = shim().enter(#name, object)) {              \
            if (errcode) *errcode = *status;                                \
            return nullptr;                                                 \
        }                                                                   \
        const type made = handed_on arguments;                              \
        if (made) shim().add_object(kind, 1);                               \
        return made;                                                        \
    }

// Retaining and releasing. A release that fails has released nevertheless.
#define CASTOR_SHIM_COUNTS(type, kind, retain, release)                        \
    extern "C" cl_int CL_API_CALL retain(type object) {                        \
        static auto* const handed_on = real<decltype(retain)>(#retain);        \
        if (const auto status = shim().enter(#retain, object)) return *status; \
        shim().add_object(kind, 1);                                            \
        return handed_on(object);                                              \
    }                                                                          \
    extern "C" cl_int CL_API_CALL release(type object) {                       \
        static auto* const handed_on = real<decltype(release)>(#release);      \
        shim().add_object(kind, -1);                                           \
        const cl_int done = handed_on(object);                                 \
        return shim().enter(#release, object).value_or(done);                  \
    }

CASTOR_SHIM_COUNTS(cl_context, "context", clRetainContext, clReleaseContext)
CASTOR_SHIM_COUNTS(cl_command_queue, "queue", clRetainCommandQueue, clReleaseCommandQueue)
CASTOR_SHIM_COUNTS(cl_mem, "buffer", clRetainMemObject, clReleaseMemObject)
CASTOR_SHIM_COUNTS(cl_program, "program", clRetainProgram, clReleaseProgram)
CASTOR_SHIM_COUNTS(cl_kernel, "kernel", clRetainKernel, clReleaseKernel)
CASTOR_SHIM_COUNTS(cl_event, "event", clRetainEvent, clReleaseEvent)

CASTOR_SHIM_STATUS(clGetPlatformIDs, (cl_uint count, cl_platform_id* platforms, cl_uint* found),
                   (count, platforms, found), nullptr)
CASTOR_SHIM_STATUS(clGetPlatformInfo,
                   (cl_platform_id platform, cl_platform_info name, size_t size, void* value, size_t* written),
                   (platform, name, size, value, written), platform)
CASTOR_SHIM_STATUS(clGetDeviceIDs,
                   (cl_platform_id platform, cl_device_type type, cl_uint count, cl_device_id* devices, cl_uint* found),
                   (platform, type, count, devices, found), platform)
CASTOR_SHIM_STATUS(clGetDeviceInfo,
                   (cl_device_id device, cl_device_info name, size_t size, void* value, size_t* written),
                   (device, name, size, value, written), device)
CASTOR_SHIM_STATUS(clCreateSubDevices,
                   (cl_device_id device, const cl_device_partition_property* properties, cl_uint count,
                    cl_device_id* devices, cl_uint* found),
                   (device, properties, count, devices, found), device)
CASTOR_SHIM_STATUS(clRetainDevice, (cl_device_id device), (device), device)
CASTOR_SHIM_STATUS(clReleaseDevice, (cl_device_id device), (device), device)
CASTOR_SHIM_STATUS(clBuildProgram,
                   (cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
                    void(CL_CALLBACK* notify)(cl_program, void*), void* data),
                   (program, count, devices, options, notify, data), program)
CASTOR_SHIM_STATUS(clGetProgramInfo,
                   (cl_program program, cl_program_info name, size_t size, void* value, size_t* written),
                   (program, name, size, value, written), program)
CASTOR_SHIM_STATUS(clGetProgramBuildInfo,
                   (cl_program program, cl_device_id device, cl_program_build_info name, size_t size, void* value,
                    size_t* written),
                   (program, device, name, size, value, written), program)
CASTOR_SHIM_STATUS(clSetKernelArg, (cl_kernel kernel, cl_uint index, size_t size, const void* value),
                   (kernel, index, size, value), kernel)
CASTOR_SHIM_STATUS(clGetCommandQueueInfo,
                   (cl_command_queue queue, cl_command_queue_info name, size_t size, void* value, size_t* written),
                   (queue, name, size, value, written), queue)
CASTOR_SHIM_STATUS(clFlush, (cl_command_queue queue), (queue), queue)

namespace {

/// An enqueued command: the event that the caller wants is one more object.
template <class HandOn>
cl_int enqueue(const char* name, cl_command_queue queue, cl_event* event, const HandOn& hand_on) {
    if (const auto status = shim().enter(name, queue)) return *status;
    const cl_int done = hand_on();
    if (done == CL_SUCCESS && event) shim().add_object("event", 1);
    return done;
}

bool is_trace_kernel(cl_kernel kernel) {
    char name[256] = {};
    clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof(name) - 1, name, nullptr);
    return std::string(name).find("_hit_") != std::string::npos;
}

}  // namespace

extern "C" cl_int CL_API_CALL clGetKernelWorkGroupInfo(cl_kernel kernel, cl_device_id device,
                                                       cl_kernel_work_group_info name, size_t size, void* value,
                                                       size_t* written) {
    static auto* const handed_on = real<decltype(clGetKernelWorkGroupInfo)>("clGetKernelWorkGroupInfo");
    if (const auto status = shim().enter("clGetKernelWorkGroupInfo", kernel)) return *status;
    const cl_int done = handed_on(kernel, device, name, size, value, written);
    if (const std::size_t most = shim().most_in_group();
        most > 0 && done == CL_SUCCESS && name == CL_KERNEL_WORK_GROUP_SIZE && value)
        *static_cast<std::size_t*>(value) = most;
    return done;
}

extern "C" cl_int CL_API_CALL clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                                                     const size_t* offset, const size_t* global, const size_t* local,
                                                     cl_uint waits, const cl_event* list, cl_event* event) {
    static auto* const handed_on = real<decltype(clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel");
    const int times = shim().times_of(queue);
    if (const std::size_t most = shim().most_in_group(); most > 0 && local && *local > most)
        return CL_INVALID_WORK_GROUP_SIZE;
    // To trace the same rays again changes nothing.
    if (times > 1 && is_trace_kernel(kernel))
        for (int i = 1; i < times; ++i)
            handed_on(queue, kernel, dimensions, offset, global, local, waits, list, nullptr);
    return enqueue("clEnqueueNDRangeKernel", queue, event, [&] {
        std::vector<cl_event> before(list, list + waits);
        if (const cl_event delay = shim().launch_delay()) before.push_back(delay);
        return handed_on(queue, kernel, dimensions, offset, global, local, static_cast<cl_uint>(before.size()),
                         before.empty() ? nullptr : before.data(), event);
    });
}

#define CASTOR_SHIM_ENQUEUE(name, parameters, arguments)                          \
    extern "C" cl_int CL_API_CALL name parameters {                               \
        static auto* const handed_on = real<decltype(name)>(#name);               \
        return enqueue(#name, queue, event, [&] { return handed_on arguments; }); \
    }

CASTOR_SHIM_ENQUEUE(clEnqueueWriteBuffer,
                    (cl_command_queue queue, cl_mem buffer, cl_bool blocks, size_t offset, size_t size,
                     const void* source, cl_uint waits, const cl_event* list, cl_event* event),
                    (queue, buffer, blocks, offset, size, source, waits, list, event))
CASTOR_SHIM_ENQUEUE(clEnqueueFillBuffer,
                    (cl_command_queue queue, cl_mem buffer, const void* pattern, size_t pattern_size, size_t offset,
                     size_t size, cl_uint waits, const cl_event* list, cl_event* event),
                    (queue, buffer, pattern, pattern_size, offset, size, waits, list, event))
CASTOR_SHIM_ENQUEUE(clEnqueueUnmapMemObject,
                    (cl_command_queue queue, cl_mem buffer, void* mapped, cl_uint waits, const cl_event* list,
                     cl_event* event),
                    (queue, buffer, mapped, waits, list, event))
CASTOR_SHIM_ENQUEUE(clEnqueueMarkerWithWaitList,
                    (cl_command_queue queue, cl_uint waits, const cl_event* list, cl_event* event),
                    (queue, waits, list, event))
CASTOR_SHIM_ENQUEUE(clEnqueueBarrierWithWaitList,
                    (cl_command_queue queue, cl_uint waits, const cl_event* list, cl_event* event),
                    (queue, waits, list, event))

// What is told to have failed has ended all the same: nothing works on in the background.
extern "C" cl_int CL_API_CALL clFinish(cl_command_queue queue) {
    static auto* const handed_on = real<decltype(clFinish)>("clFinish");
    const auto status = shim().enter("clFinish", queue);
    const cl_int done = handed_on(queue);
    return status.value_or(done);
}

extern "C" cl_int CL_API_CALL clEnqueueReadBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocks, size_t offset,
                                                  size_t size, void* target, cl_uint waits, const cl_event* list,
                                                  cl_event* event) {
    static auto* const handed_on = real<decltype(clEnqueueReadBuffer)>("clEnqueueReadBuffer");
    return enqueue("clEnqueueReadBuffer", queue, event, [&] {
        const bool corrupts = shim().corrupts_read();
        const cl_int done = handed_on(queue, buffer, blocks, offset, size, target, waits, list, event);
        if (corrupts) *static_cast<unsigned char*>(target) ^= 1;
        return done;
    });
}

extern "C" void* CL_API_CALL clEnqueueMapBuffer(cl_command_queue queue, cl_mem buffer, cl_bool blocks,
                                                cl_map_flags flags, size_t offset, size_t size, cl_uint waits,
                                                const cl_event* list, cl_event* event, cl_int* errcode) {
    static auto* const handed_on = real<decltype(clEnqueueMapBuffer)>("clEnqueueMapBuffer");
    if (const auto status = shim().enter("clEnqueueMapBuffer", queue)) {
        if (errcode) *errcode = *status;
        return nullptr;
    }
    return handed_on(queue, buffer, blocks, flags, offset, size, waits, list, event, errcode);
}

extern "C" cl_int CL_API_CALL clGetEventInfo(cl_event event, cl_event_info name, size_t size, void* value,
                                             size_t* written) {
    static auto* const handed_on = real<decltype(clGetEventInfo)>("clGetEventInfo");
    if (const auto status = shim().enter("clGetEventInfo", event)) return *status;
    const cl_int done = handed_on(event, name, size, value, written);
    if (const auto status = shim().command_status(); status && value) *static_cast<cl_int*>(value) = *status;
    return done;
}

CASTOR_SHIM_CREATE(cl_context, "context", clCreateContext,
                   (const cl_context_properties* properties, cl_uint count, const cl_device_id* devices,
                    void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*), void* data, cl_int* errcode),
                   (properties, count, devices, notify, data, errcode), nullptr)
CASTOR_SHIM_CREATE(cl_program, "program", clCreateProgramWithSource,
                   (cl_context context, cl_uint count, const char** strings, const size_t* lengths, cl_int* errcode),
                   (context, count, strings, lengths, errcode), context)
CASTOR_SHIM_CREATE(cl_program, "program", clCreateProgramWithBinary,
                   (cl_context context, cl_uint count, const cl_device_id* devices, const size_t* lengths,
                    const unsigned char** binaries, cl_int* statuses, cl_int* errcode),
                   (context, count, devices, lengths, binaries, statuses, errcode), context)
CASTOR_SHIM_CREATE(cl_kernel, "kernel", clCreateKernel, (cl_program program, const char* name, cl_int* errcode),
                   (program, name, errcode), program)

extern "C" cl_mem CL_API_CALL clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host,
                                             cl_int* errcode) {
    static auto* const handed_on = real<decltype(clCreateBuffer)>("clCreateBuffer");
    std::optional<cl_int> status = shim().enter("clCreateBuffer", context);
    if (!status) status = shim().refusal(flags);
    if (status) {
        if (errcode) *errcode = *status;
        return nullptr;
    }
    const cl_mem made = handed_on(context, flags, size, host, errcode);
    if (made) shim().add_object("buffer", 1);
    return made;
}

extern "C" cl_command_queue CL_API_CALL clCreateCommandQueue(cl_context context, cl_device_id device,
                                                             cl_command_queue_properties properties, cl_int* errcode) {
    static auto* const handed_on = real<decltype(clCreateCommandQueue)>("clCreateCommandQueue");
    if (const auto status = shim().enter("clCreateCommandQueue", context)) {
        if (errcode) *errcode = *status;
        return nullptr;
    }
    const cl_command_queue made = handed_on(context, device, properties, errcode);
    if (!made) return nullptr;
    shim().add_object("queue", 1);
    shim().add_queue(made);
    return made;
}
