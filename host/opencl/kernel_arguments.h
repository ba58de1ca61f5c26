#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "opencl/device_column.h"
#include "opencl/device_context.h"

/*
The arguments of kernels by name. A kernel has a list of its arguments, in its own order and with its own names, and
a struct made from it:

    #define CASTOR_SHADE_ARGUMENTS(value, in, out, columns_of) \
        value(RenderParams, params)                            \
        value(uint, depth)                                     \
        in(materials)                                          \
        in(surface_material)                                   \
        out(film_sum)

    struct Shade {
        static constexpr const char* kProgram = "render.lanes";  // the source, without .cl
        static constexpr const char* kKernel = "shade";
        static constexpr bool kInLanes = true;
        CASTOR_KERNEL_ARGUMENTS(CASTOR_SHADE_ARGUMENTS)
    };

A kernel whose source is a template (kernels/device/lanes.cl) has kProgram = "render.lanes", after the file, and in
its struct `static constexpr bool kInLanes = true`. It is built for as many lanes as suit the device, and each work-item
does the work of so many.

value(type, name)       by value; the type is one of castor::shared
in(column)              `const global element *restrict column`, a column of scene_columns.h or wave_columns.h
out(column)             the same without const: written, or read and written
columns_of(type, name)  several columns at once, see TraceColumns in trace/trace_arguments.h

A Kernel<Shade> is made once for a thread and launched often:

    Kernel<Shade> shade(context);
    shade.enqueue(slot_count, {.params = params,
                               .depth = depth,
                               .materials = scene.columns().materials,
                               .surface_material = surface_material,
                               .film_sum = film_sum});

Every argument must be given: a missing one, or one column in the place of another, does not compile. Columns are
made with make_column<columns::film_sum>(context, count). tests/kernels/kernel_arguments_test.cpp compares every
struct with the kernel that a device built: add new ones there.
*/

namespace castor {

/// An argument as the kernel's source declares it.
struct ArgumentInfo {
    std::string name;
    std::string type;        // as CL_KERNEL_ARG_TYPE_NAME tells it
    bool is_buffer = false;  // in global memory, else a value
    bool is_const = false;   // of buffers

    bool operator==(const ArgumentInfo&) const = default;
};

/// What was set of a kernel's arguments, most of which are what they were at the next launch: PoCL takes half as long
/// to set them all as to launch the kernel. A new buffer may have the handle of an old one, so that all are set again
/// when any buffer was made since.
struct ArgumentsSet {
    std::vector<std::byte> bytes;  // of all arguments, one after the other
    std::uint64_t buffers_made = 0;
};

/// Sets a kernel's arguments one after the other, where they are not as they were `before`.
class ArgumentSetter {
public:
    ArgumentSetter(cl::Kernel& kernel, ArgumentsSet& before) : kernel_(kernel), before_(before) {
        const std::uint64_t made = DeviceContext::buffers_made();
        if (before.buffers_made != made) before.bytes.clear();
        before.buffers_made = made;
    }

    template <class T>
    void operator()(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        const bool is_new = place_ == before_.bytes.size();
        if (is_new || std::memcmp(&before_.bytes[place_], &value, sizeof(T)) != 0) {
            kernel_.setArg(index_, sizeof(T), &value);
            if (is_new) before_.bytes.resize(place_ + sizeof(T));
            std::memcpy(&before_.bytes[place_], &value, sizeof(T));
        }
        ++index_;
        place_ += sizeof(T);
    }
    void operator()(const cl::Buffer& buffer) { (*this)(buffer()); }

private:
    cl::Kernel& kernel_;
    ArgumentsSet& before_;
    cl_uint index_ = 0;
    std::size_t place_ = 0;
};

/// An argument by value. There is no default, so that none can be forgotten, and no conversion.
template <class T>
class ValueArgument {
public:
    template <std::same_as<T> Same>
    ValueArgument(const Same& value) : value_(value) {}

    void set(ArgumentSetter& setter) const { setter(value_); }
    static void describe(const char* name, const char* type, std::vector<ArgumentInfo>& infos) {
        infos.push_back({name, type, false, false});
    }

private:
    T value_;
};

/// An argument that is a column, whose buffer must outlive it.
template <class Name, bool is_const>
class ColumnArgument {
public:
    ColumnArgument(const DeviceColumn<Name>& column) : buffer_(column.buffer()()) {}

    void set(ArgumentSetter& setter) const { setter(buffer_); }
    static void describe(std::vector<ArgumentInfo>& infos) {
        infos.push_back({Name::kName, std::string(Name::kElementName) + '*', true, is_const});
    }

private:
    cl_mem buffer_;
};

#define CASTOR_VALUE_MEMBER(type, name) ::castor::ValueArgument<::castor::shared::type> name;
#define CASTOR_INPUT_MEMBER(name) ::castor::ColumnArgument<::castor::columns::name, true> name;
#define CASTOR_OUTPUT_MEMBER(name) ::castor::ColumnArgument<::castor::columns::name, false> name;
#define CASTOR_COLUMNS_MEMBER(type, name) type name;

#define CASTOR_SET_TYPED(type, name) name.set(setter);
#define CASTOR_SET_COLUMN(name) name.set(setter);

#define CASTOR_DESCRIBE_VALUE(type, name) decltype(name)::describe(#name, #type, infos);
#define CASTOR_DESCRIBE_COLUMN(name) decltype(name)::describe(infos);
#define CASTOR_DESCRIBE_COLUMNS(type, name) type::describe(infos);

/// The members of an argument struct, and what Kernel needs of them.
#define CASTOR_KERNEL_ARGUMENTS(list)                                                                     \
    list(CASTOR_VALUE_MEMBER, CASTOR_INPUT_MEMBER, CASTOR_OUTPUT_MEMBER, CASTOR_COLUMNS_MEMBER) void set( \
        ::castor::ArgumentSetter& setter) const {                                                         \
        list(CASTOR_SET_TYPED, CASTOR_SET_COLUMN, CASTOR_SET_COLUMN, CASTOR_SET_TYPED)                    \
    }                                                                                                     \
    static std::vector<::castor::ArgumentInfo> describe() {                                               \
        std::vector<::castor::ArgumentInfo> infos;                                                        \
        list(CASTOR_DESCRIBE_VALUE, CASTOR_DESCRIBE_COLUMN, CASTOR_DESCRIBE_COLUMN,                       \
             CASTOR_DESCRIBE_COLUMNS) return infos;                                                       \
    }

/// A program: its source as in kProgram, and with what options it is built.
struct KernelProgram {
    std::string source;
    std::string options;
};

/// How the sources of templates end: see kernels/device/lanes.cl.
inline constexpr std::string_view kTemplateProgram = ".lanes";

/// Returns the name of a program for the lanes of this device. `source`: as in KernelProgram.
inline std::string name_of_program(const DeviceContext& context, std::string_view source) {
    if (!source.ends_with(kTemplateProgram)) return std::string(source);
    source.remove_suffix(kTemplateProgram.size());
    return fmt::format("{}.x{}", source, context.quirks().lanes);
}

/// A built kernel that takes `Arguments`. For one thread.
template <class Arguments>
class Kernel {
public:
    /// The kernel that the struct names. `context` must outlive it. Throws DeviceError with the build log.
    explicit Kernel(DeviceContext& context, const std::string& options = "")
        : Kernel(context, KernelProgram{Arguments::kProgram, options}) {}
    /// The same of another program that has the kernel.
    Kernel(DeviceContext& context, const KernelProgram& program)
        : Kernel(context, name_of_program(context, program.source), name(context), program.options,
                 context.quirks().local_size) {
        if constexpr (kInLanes) lanes_ = context.quirks().lanes;
        // A group has as many elements as one of another kernel.
        local_size_ = std::max<std::size_t>(1, local_size_ / lanes_);
    }
    /// One of several kernels with the same arguments. Work-groups have `local_size` work-items, or as many as the
    /// device allows for this kernel.
    Kernel(DeviceContext& context, const std::string& program, const std::string& name, const std::string& options,
           std::size_t local_size)
        : context_(&context), kernel_(context.kernel_of(program, name, options)) {
        local_size_ = std::min(context.most_in_group(kernel_), local_size);
    }

    Kernel(const Kernel&) = delete;  // copies would share the kernel object
    Kernel& operator=(const Kernel&) = delete;
    Kernel(Kernel&&) = default;
    Kernel& operator=(Kernel&&) = default;

    /// The program and the name of the kernel that the struct names, for this device.
    static std::string program(const DeviceContext& context) { return name_of_program(context, Arguments::kProgram); }
    static std::string name(const DeviceContext& context) {
        const std::uint32_t lanes = context.quirks().lanes;
        return Arguments::kKernel + (kInLanes && lanes > 1 ? std::to_string(lanes) : "");
    }

    /// Enqueues work-items for `count` elements on the context's queue, rounded up to whole groups (kernels guard);
    /// nothing for count = 0.
    void enqueue(std::size_t count, const Arguments& arguments) { enqueue_on(context_->queue(), count, arguments); }
    /// The same on another queue of the context, with an event unless null.
    void enqueue_on(const cl::CommandQueue& queue, std::size_t count, const Arguments& arguments,
                    cl::Event* event = nullptr) {
        if (count == 0) return;
        context_->guarded("clSetKernelArg", [&] {
            ArgumentSetter setter(kernel_, arguments_set_);
            arguments.set(setter);
        });
        context_->launch(queue, kernel_, (count + lanes_ - 1) / lanes_, local_size_, event, queue() == last_queue_);
        last_queue_ = queue();
    }

private:
    static constexpr bool kInLanes = requires { Arguments::kInLanes; };
    static_assert(!kInLanes || std::string_view(Arguments::kProgram).ends_with(kTemplateProgram));

    DeviceContext* context_;
    cl::Kernel kernel_;
    std::size_t local_size_;
    std::size_t lanes_ = 1;
    ArgumentsSet arguments_set_;
    cl_command_queue last_queue_ = nullptr;
};

}  // namespace castor
