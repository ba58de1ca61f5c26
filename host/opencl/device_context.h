#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "base/column.h"
#include "castor/device.h"
#include "castor/error.h"
#include "opencl/cl.h"
#include "opencl/kernel_source.h"
#include "opencl/program_cache.h"
#include "opencl/quirks.h"
#include "opencl/sub_devices.h"

namespace castor {

/// The exception that is being handled, as a failure of this device. Throws it again if it is neither a DeviceError nor
/// a cl::Error.
DeviceError current_device_error(const std::string& device);

/// A context, an in-order queue and the programs of one device, or of one team of its compute units. Every failure
/// leaves as a DeviceError that names the device and the call. Kernel objects are not shared: each call of `kernel`
/// makes one, for one thread. The other members may be used from several threads.
class DeviceContext {
public:
    /// `extra_sources` are those of tests. Compiled programs go into program_cache_folder() where the device's quirks
    /// say that it is worth it.
    explicit DeviceContext(const Device& device, const kernels::SourceTable& extra_sources = {});
    /// Compiled programs go into `cache`, whatever the device's quirks say.
    DeviceContext(const Device& device, const kernels::SourceTable& extra_sources, ProgramCache cache);
    /// For one of the device's teams, numbered from 0 on: shares buffers and programs with `whole`, and has a queue
    /// whose commands run on the team's compute units alone.
    DeviceContext(const DeviceContext& whole, std::size_t team);
    DeviceContext(const DeviceContext&) = delete;
    DeviceContext& operator=(const DeviceContext&) = delete;

    /// The device. That of a team has the team's number of compute units.
    const Device& device() const { return device_; }
    /// Returns into how many teams the device is divided: DeviceQuirks::teams, or 1 if the driver does not do it.
    std::size_t team_count() const { return std::max<std::size_t>(teams_.size(), 1); }
    /// Returns why the driver does not divide the device into the teams that it should have; empty: it does.
    const std::string& undivided_because() const { return undivided_because_; }
    const DeviceQuirks& quirks() const { return quirks_; }
    /// Lets kernels that are made later have another number of lanes than suits the device.
    void set_lanes(std::uint32_t lanes) { quirks_.lanes = lanes; }
    const cl::Context& context() const { return context_; }
    const cl::CommandQueue& queue() const { return queue_; }

    /// Builds the source `program`.cl as kernel_of does, which then finds it. Throws DeviceError with the whole build
    /// log.
    void build_ahead(const std::string& program, const std::string& extra_options) {
        program_of(program, extra_options);
    }

    /// Returns how many programs are built.
    std::size_t program_count();

    /// Builds the source `program`.cl as kernel_of does, and forgets it. Throws DeviceError with the whole build log.
    void try_build(const std::string& program, const std::string& extra_options);

    /// Returns the kernel `name` of the source `program`.cl, which is built on first use with the quirks' build options
    /// and `extra_options` ("-DNAME=VALUE ..."). Throws DeviceError with the whole build log.
    cl::Kernel kernel_of(const std::string& program, const std::string& name, const std::string& extra_options = "");
    /// The kernel `name` of the source `name`.cl.
    cl::Kernel kernel(const std::string& name, const std::string& extra_options = "") {
        return kernel_of(name, name, extra_options);
    }

    /// Returns how many buffers were made until now, on any device.
    static std::uint64_t buffers_made() { return buffers_made_; }

    /// A buffer for the device's own use. Zero bytes give a buffer of 16, since OpenCL has no empty ones.
    /// Throws DeviceError naming `what` and both sizes if it is larger than the device's largest allocation.
    cl::Buffer make_buffer(std::size_t bytes, std::string_view what);

    /// Makes a read-only buffer that holds the column. It shares the column's memory if the device shares the host's
    /// and the driver allows it, so the column must outlive it and stay unchanged.
    template <class T>
    cl::Buffer upload(const Column<T>& column, std::string_view what) {
        return upload_bytes(column.data(), column.size() * sizeof(T), what);
    }
    cl::Buffer upload_bytes(const void* data, std::size_t bytes, std::string_view what);

    /// Blocking copies between the host and the start of a buffer (or `offset` bytes into it).
    void write(const cl::Buffer& buffer, const void* source, std::size_t bytes, std::size_t offset = 0);
    void read(const cl::Buffer& buffer, void* target, std::size_t bytes, std::size_t offset = 0);
    /// The same at the start of a buffer, without waiting: the host's memory must live and stay as it is until the
    /// queue is past the copy. A read is done when wait(event) returns. Zero bytes: nothing is copied.
    void begin_write(const cl::Buffer& buffer, const void* source, std::size_t bytes);
    cl::Event begin_read(const cl::Buffer& buffer, void* target, std::size_t bytes);

    /// What use(pointer) gives while the first `bytes` bytes of the buffer, at least one, are mapped for the host.
    template <class Use>
    auto with_mapped(const cl::Buffer& buffer, cl_map_flags flags, std::size_t bytes, const Use& use) {
        void* const mapped =
            guarded("clEnqueueMapBuffer", [&] { return queue_.enqueueMapBuffer(buffer, CL_TRUE, flags, 0, bytes); });
        const auto result = use(mapped);
        guarded("clEnqueueUnmapMemObject", [&] { queue_.enqueueUnmapMemObject(buffer, mapped); });
        return result;
    }

    /// Enqueues that the first `bytes` bytes (a multiple of 4) become zero.
    void fill_zero(const cl::Buffer& buffer, std::size_t bytes);

    /// Returns how many work-items a group of the kernel may have, at least 1.
    std::size_t most_in_group(const cl::Kernel& kernel) const;

    /// Sets all arguments in order and enqueues `count` work-items, rounded up to whole groups of the quirks' local
    /// size, or of as many as the kernel may have there (kernels guard). Nothing is enqueued for count = 0.
    template <class... Arguments>
    void enqueue(cl::Kernel& kernel, std::size_t count, const Arguments&... arguments) {
        enqueue_on(queue_, kernel, count, 0, nullptr, arguments...);
    }
    /// The same on another queue of the context, in groups of `local_size` (0: as above), with an event unless
    /// null.
    template <class... Arguments>
    void enqueue_on(const cl::CommandQueue& queue, cl::Kernel& kernel, std::size_t count, std::size_t local_size,
                    cl::Event* event, const Arguments&... arguments) {
        guarded("clSetKernelArg", [&] {
            cl_uint index = 0;
            (kernel.setArg(index++, arguments), ...);
        });
        launch(queue, kernel, count, local_size, event, false);
    }
    /// The same of a kernel whose arguments are set. `is_again`: it was launched on this queue before, in such groups.
    void launch(const cl::CommandQueue& queue, cl::Kernel& kernel, std::size_t count, std::size_t local_size,
                cl::Event* event, bool is_again);

    /// Waits until everything enqueued on queue() is done.
    void finish();
    /// The same where that is about `expected_seconds` from now: sleeps also where the driver's own waiting takes a
    /// whole core.
    void wait(double expected_seconds);
    /// Waits until the command of this event is done; of an empty event, not at all.
    void wait(const cl::Event& event);
    void flush();

    /// Runs `action`, turning cl::Error into DeviceError.
    template <class Action>
    auto guarded(std::string_view call, Action&& action) const {
        try {
            return action();
        } catch (const cl::Error& error) {
            fail(call, error);
        }
    }

private:
    [[noreturn]] void fail(std::string_view call, const cl::Error& error) const;
    void sleep_until_done(const cl::Event& event, double expected_seconds) const;
    void check_allocation(std::size_t bytes, std::string_view what) const;
    std::string options_with(const std::string& extra_options) const;
    std::string source_of(const std::string& program) const;
    cl::Program program_of(const std::string& name, const std::string& extra_options);
    cl::Program build(const std::string& name, const std::string& options);
    cl::Program build_source(const std::string& name, const std::string& source, const std::string& options);
    std::string build_log(const cl::Program& program) const;
    std::optional<cl::Program> build_binary(const ProgramCache::Binary& binary, const std::string& options);
    bool divide();
    void keep(const cl::Program& program, const std::string& key);
    bool is_first_launch(const cl::CommandQueue& queue, const cl::Kernel& kernel, std::size_t local_size) const;
    cl::Buffer new_buffer(cl_mem_flags flags, std::size_t bytes, void* data);

    struct Programs {
        std::mutex mutex;
        std::map<std::string, cl::Program> built;  // by name and options
    };
    struct Launched {
        std::mutex mutex;
        // A queue, a program, the kernel's name and the size of a group.
        std::set<std::tuple<cl_command_queue, cl_program, std::string, std::size_t>> kernels;
    };

    static inline std::atomic<std::uint64_t> buffers_made_ = 0;

    Device device_;
    DeviceQuirks quirks_;
    kernels::SourceTable extra_sources_;
    ProgramCache cache_;
    std::vector<SubDevice> teams_;  // empty: the device is not divided
    std::string undivided_because_;
    cl::Context context_;
    cl::CommandQueue queue_;
    std::shared_ptr<Programs> programs_ = std::make_shared<Programs>();
    std::shared_ptr<Launched> launched_ = std::make_shared<Launched>();
};

}  // namespace castor
