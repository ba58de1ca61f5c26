#pragma once

#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "opencl/device_context.h"

namespace castor::reference {

/// Owner of a device's context and queue that runs test kernels over arrays.
class KernelRunner {
public:
    KernelRunner(const Device& device, const kernels::SourceTable& sources) : context_(device, sources) {}

    DeviceContext& context() { return context_; }
    const Device& device() const { return context_.device(); }

    /// Runs the kernel of the source `name`.cl, which has its file's name without the folder. The kernel's parameters
    /// are (const uint count, inputs ..., global Out *outputs): a vector becomes a buffer, anything else a value.
    /// Every vector has `count` elements, or a multiple. Returns the outputs, which start as zeros.
    template <class Out, class... Inputs>
    std::vector<Out> run(const std::string& name, std::size_t count, const Inputs&... inputs) {
        return run_kernel<Out>(name, name.substr(name.rfind('/') + 1), count, inputs...);
    }

    /// Runs the kernel of the template `name`.lanes.cl, built for `lanes` lanes. It takes a multiple of them, so that
    /// the last elements are repeated. Vectors have one element each.
    template <class Out, class... Inputs>
    std::vector<Out> run_in_lanes(const std::string& name, std::uint32_t lanes, std::size_t count,
                                  const Inputs&... inputs) {
        const std::size_t padded = (count + lanes - 1) / lanes * lanes;
        const std::string kernel = name.substr(name.rfind('/') + 1);
        std::vector<Out> outputs =
            run_kernel<Out>(name + ".x" + std::to_string(lanes), lanes > 1 ? kernel + std::to_string(lanes) : kernel,
                            padded, padded_input(inputs, padded)...);
        outputs.resize(count);
        return outputs;
    }

    /// Runs the kernel `name` of the source `program`.cl in the same way.
    template <class Out, class... Inputs>
    std::vector<Out> run_kernel(const std::string& program, const std::string& name, std::size_t count,
                                const Inputs&... inputs) {
        cl::Kernel kernel = context_.kernel_of(program, name);
        std::vector<Out> outputs(count);
        const cl::Buffer output = argument(outputs);
        std::apply(
            [&](const auto&... arguments) {
                context_.enqueue(kernel, count, static_cast<cl_uint>(count), arguments..., output);
            },
            std::make_tuple(argument(inputs)...));
        context_.read(output, outputs.data(), outputs.size() * sizeof(Out));
        return outputs;
    }

private:
    template <class T>
    static std::vector<T> padded_input(std::vector<T> values, std::size_t count) {
        values.resize(count, values.back());
        return values;
    }
    template <class T>
    requires std::is_trivially_copyable_v<T>
    static T padded_input(T value, std::size_t) { return value; }

    template <class T>
    cl::Buffer argument(const std::vector<T>& values) {
        const cl::Buffer buffer = context_.make_buffer(values.size() * sizeof(T), "test data");
        context_.write(buffer, values.data(), values.size() * sizeof(T));
        return buffer;
    }
    template <class T>
    requires std::is_trivially_copyable_v<T> T argument(T value) { return value; }

    DeviceContext context_;
};

}  // namespace castor::reference
