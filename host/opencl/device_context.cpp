#include "opencl/device_context.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/stopwatch.h"

namespace castor {

DeviceContext::DeviceContext(const Device& device, const kernels::SourceTable& extra_sources)
    : DeviceContext(device, extra_sources,
                    device_quirks(device).keeps_programs ? ProgramCache(program_cache_folder()) : ProgramCache()) {}

DeviceContext::DeviceContext(const Device& device, const kernels::SourceTable& extra_sources, ProgramCache cache)
    : device_(device), quirks_(device_quirks(device)), extra_sources_(extra_sources), cache_(std::move(cache)) {
    if (quirks_.teams == 1 || !divide())
        guarded("clCreateContext", [&] { context_ = cl::Context(cl::Device(device_.id, true)); });
    guarded("clCreateCommandQueue", [&] { queue_ = cl::CommandQueue(context_, cl::Device(device_.id, true)); });
}

DeviceContext::DeviceContext(const DeviceContext& whole, std::size_t team)
    : device_(whole.device_),
      quirks_(whole.quirks_),
      extra_sources_(whole.extra_sources_),
      cache_(whole.cache_),
      context_(whole.context_),
      programs_(whole.programs_) {
    const SubDevice& part = whole.teams_.at(team);
    device_.compute_units = part.compute_units;
    guarded("clCreateCommandQueue", [&] { queue_ = cl::CommandQueue(context_, cl::Device(part.id, true)); });
}

/// Makes a context of the device and its teams. Returns false if the driver does not.
bool DeviceContext::divide() {
    try {
        std::vector<SubDevice> teams = sub_devices(device_, quirks_.teams);
        std::vector<cl::Device> devices{cl::Device(device_.id, true)};
        for (const SubDevice& team : teams) devices.emplace_back(team.id, true);
        context_ = cl::Context(devices);
        teams_ = std::move(teams);
        return true;
    } catch (...) {
        undivided_because_ = current_device_error(label(device_)).what();
        return false;
    }
}

DeviceError current_device_error(const std::string& device) {
    try {
        throw;
    } catch (const DeviceError& error) {
        return error;
    } catch (const cl::Error& error) {
        return DeviceError(device, error.what() ? error.what() : "", error.err(), "");
    }
}

void DeviceContext::fail(std::string_view call, const cl::Error& error) const {
    // The bindings name the call that failed more closely than we do, except where one of ours makes several.
    const std::string name = error.what() ? error.what() : std::string(call);
    throw DeviceError(label(device_), name, error.err(), "");
}

std::string DeviceContext::options_with(const std::string& extra_options) const {
    return extra_options.empty() ? quirks_.build_options : quirks_.build_options + " " + extra_options;
}

std::string DeviceContext::source_of(const std::string& program) const {
    return kernels::expand_kernel_source(program + ".cl", extra_sources_, quirks_.prelude);
}

void DeviceContext::try_build(const std::string& program, const std::string& extra_options) {
    build_source(program, source_of(program), options_with(extra_options));
}

cl::Program DeviceContext::program_of(const std::string& name, const std::string& extra_options) {
    const std::string options = options_with(extra_options);
    std::lock_guard lock(programs_->mutex);
    const std::string entry = name + "\n" + options;
    auto found = programs_->built.find(entry);
    if (found == programs_->built.end()) found = programs_->built.emplace(entry, build(name, options)).first;
    return found->second;
}

std::size_t DeviceContext::program_count() {
    std::lock_guard lock(programs_->mutex);
    return programs_->built.size();
}

cl::Kernel DeviceContext::kernel_of(const std::string& program_name, const std::string& name,
                                    const std::string& extra_options) {
    const cl::Program program = program_of(program_name, extra_options);
    return guarded("clCreateKernel", [&] { return cl::Kernel(program, name.c_str()); });
}

cl::Program DeviceContext::build(const std::string& name, const std::string& options) {
    const std::string source = source_of(name);
    const std::string key = program_cache_key(device_, source, options);
    if (const auto binary = cache_.find(key)) {
        if (const auto program = build_binary(*binary, options)) return *program;
        cache_.forget(key);
    }
    const cl::Program program = build_source(name, source, options);
    keep(program, key);
    return program;
}

/// Nothing if the driver does not take the binary.
std::optional<cl::Program> DeviceContext::build_binary(const ProgramCache::Binary& binary, const std::string& options) {
    try {
        const std::vector<cl::Device> devices{cl::Device(device_.id, true)};
        cl::Program program(context_, devices, cl::Program::Binaries{binary});
        program.build(devices, options.c_str());
        return program;
    } catch (const cl::Error&) {
        return std::nullopt;
    }
}

void DeviceContext::keep(const cl::Program& program, const std::string& key) {
    if (!cache_.is_on()) return;
    try {
        const cl::Program::Binaries binaries = program.getInfo<CL_PROGRAM_BINARIES>();
        if (binaries.size() == 1 && !binaries.front().empty()) cache_.store(key, binaries.front());
    } catch (const cl::Error&) {
        // A driver that does not give its binaries away.
    }
}

cl::Program DeviceContext::build_source(const std::string& name, const std::string& source,
                                        const std::string& options) {
    const cl::Program program = guarded("clCreateProgramWithSource", [&] { return cl::Program(context_, source); });
    // Not by the bindings, which tell of a failure only if they get the log too.
    const cl_int status = ::clBuildProgram(program(), 1, &device_.id, options.c_str(), nullptr, nullptr);
    if (status != CL_SUCCESS)
        throw DeviceError(label(device_), "clBuildProgram", status,
                          fmt::format("{}.cl does not compile with {}:\n{}", name, options, build_log(program)));
    return program;
}

std::string DeviceContext::build_log(const cl::Program& program) const {
    try {
        return program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(cl::Device(device_.id, true));
    } catch (const cl::Error& error) {
        return fmt::format("({} gives no log: {} failed with {})", label(device_), error.what(), error.err());
    }
}

void DeviceContext::check_allocation(std::size_t bytes, std::string_view what) const {
    if (bytes > device_.max_allocation_bytes)
        throw DeviceError(
            label(device_), "", 0,
            fmt::format("{} needs {} bytes in one buffer, but the device's largest allocation is {} bytes", what, bytes,
                        device_.max_allocation_bytes));
}

cl::Buffer DeviceContext::new_buffer(cl_mem_flags flags, std::size_t bytes, void* data) {
    cl::Buffer buffer(context_, flags, bytes, data);
    ++buffers_made_;
    return buffer;
}

cl::Buffer DeviceContext::make_buffer(std::size_t bytes, std::string_view what) {
    check_allocation(bytes, what);
    constexpr std::size_t kSmallest = 16;
    return guarded("clCreateBuffer",
                   [&] { return new_buffer(CL_MEM_READ_WRITE, std::max(bytes, kSmallest), nullptr); });
}

cl::Buffer DeviceContext::upload_bytes(const void* data, std::size_t bytes, std::string_view what) {
    if (bytes == 0) return make_buffer(0, what);
    check_allocation(bytes, what);
    const auto make = [&](cl_mem_flags flags) {
        return new_buffer(CL_MEM_READ_ONLY | flags, bytes, const_cast<void*>(data));
    };
    if (device_.unified_memory) {
        try {
            return make(CL_MEM_USE_HOST_PTR);
        } catch (const cl::Error&) {
            // Some drivers refuse memory that is mapped read-only, or that another context uses.
        }
    }
    return guarded("clCreateBuffer", [&] { return make(CL_MEM_COPY_HOST_PTR); });
}

void DeviceContext::write(const cl::Buffer& buffer, const void* source, std::size_t bytes, std::size_t offset) {
    if (bytes == 0) return;
    guarded("clEnqueueWriteBuffer", [&] { queue_.enqueueWriteBuffer(buffer, CL_TRUE, offset, bytes, source); });
}

void DeviceContext::read(const cl::Buffer& buffer, void* target, std::size_t bytes, std::size_t offset) {
    if (bytes == 0) return;
    guarded("clEnqueueReadBuffer", [&] { queue_.enqueueReadBuffer(buffer, CL_TRUE, offset, bytes, target); });
}

void DeviceContext::begin_write(const cl::Buffer& buffer, const void* source, std::size_t bytes) {
    if (bytes == 0) return;
    guarded("clEnqueueWriteBuffer", [&] { queue_.enqueueWriteBuffer(buffer, CL_FALSE, 0, bytes, source); });
}

cl::Event DeviceContext::begin_read(const cl::Buffer& buffer, void* target, std::size_t bytes) {
    cl::Event event;
    if (bytes == 0) return event;
    guarded("clEnqueueReadBuffer",
            [&] { queue_.enqueueReadBuffer(buffer, CL_FALSE, 0, bytes, target, nullptr, &event); });
    flush();
    return event;
}

void DeviceContext::fill_zero(const cl::Buffer& buffer, std::size_t bytes) {
    if (bytes == 0) return;
    guarded("clEnqueueFillBuffer", [&] { queue_.enqueueFillBuffer(buffer, cl_uint{0}, 0, bytes); });
}

std::size_t DeviceContext::most_in_group(const cl::Kernel& kernel) const {
    const std::size_t most = guarded("clGetKernelWorkGroupInfo", [&] {
        return kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(cl::Device(device_.id, true));
    });
    return std::max<std::size_t>(most, 1);
}

/// Is this the kernel's first launch on the queue in groups of that size?
bool DeviceContext::is_first_launch(const cl::CommandQueue& queue, const cl::Kernel& kernel,
                                    std::size_t local_size) const {
    // Not by the bindings, which release the program in the end even if they could not retain it.
    cl_program program = nullptr;
    if (const cl_int status = ::clGetKernelInfo(kernel(), CL_KERNEL_PROGRAM, sizeof(program), &program, nullptr);
        status != CL_SUCCESS)
        throw cl::Error(status, "clGetKernelInfo");
    const std::string name = kernel.getInfo<CL_KERNEL_FUNCTION_NAME>();
    std::lock_guard lock(launched_->mutex);
    return launched_->kernels.emplace(queue(), program, name, local_size).second;
}

void DeviceContext::launch(const cl::CommandQueue& queue, cl::Kernel& kernel, std::size_t count, std::size_t local_size,
                           cl::Event* event, bool is_again) {
    if (count == 0) return;
    const std::size_t local =
        local_size ? local_size : std::min<std::size_t>(quirks_.local_size, most_in_group(kernel));
    std::size_t global = (count + local - 1) / local * local;
    guarded("clEnqueueNDRangeKernel", [&] {
        if (quirks_.first_launch > global && !is_again && is_first_launch(queue, kernel, local))
            global = quirks_.first_launch / local * local;
        queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(global), cl::NDRange(local), nullptr, event);
    });
}

void DeviceContext::finish() {
    guarded("clFinish", [&] { queue_.finish(); });
}

void DeviceContext::wait(double expected_seconds) {
    if (quirks_.waits_asleep) return finish();
    cl::Event end;
    guarded("clEnqueueMarkerWithWaitList", [&] { queue_.enqueueMarkerWithWaitList(nullptr, &end); });
    flush();
    sleep_until_done(end, expected_seconds);
}

void DeviceContext::wait(const cl::Event& event) {
    if (event()) guarded("clWaitForEvents", [&] { event.wait(); });
}

/// Sleeps for most of the time that is expected, and then for a fiftieth of what has passed at a time.
void DeviceContext::sleep_until_done(const cl::Event& event, double expected_seconds) const {
    constexpr double kShortest = 20e-6, kLongest = 2e-3, kLongestFirst = 50e-3;
    const Stopwatch watch;
    double pause = std::min(0.9 * expected_seconds, kLongestFirst);
    for (;;) {
        const cl_int status =
            guarded("clGetEventInfo", [&] { return event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>(); });
        if (status == CL_COMPLETE) return;
        if (status < 0)
            throw DeviceError(label(device_), "clEnqueueMarkerWithWaitList", status,
                              "a command ended with this status");
        std::this_thread::sleep_for(std::chrono::duration<double>(pause));
        pause = std::clamp(watch.seconds() / 50, kShortest, kLongest);
    }
}

void DeviceContext::flush() {
    guarded("clFlush", [&] { queue_.flush(); });
}

}  // namespace castor
