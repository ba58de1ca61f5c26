#pragma once

#include <algorithm>
#include <concepts>
#include <cstdlib>
#include <string>
#include <tuple>
#include <vector>

#include "opencl/device_context.h"

namespace castor::kernels {
extern const SourceTable test_kernels;  // tests/kernels/*.cl
}

namespace castor::test {

/// The device that CASTOR_TEST_DEVICE selects (as select_devices does; unset: the default device). Throws, and so fails
/// the test, if there is none.
inline Device test_device() {
    const char* selection = std::getenv("CASTOR_TEST_DEVICE");
    return select_devices(selection ? selection : "").at(0);
}

/// How many cases to try: `full`, or no more than `small` where CASTOR_TEST_SMALL is set (for Oclgrind, which
/// interprets).
inline std::size_t test_size(std::size_t full, std::size_t small = 192) {
    return std::getenv("CASTOR_TEST_SMALL") ? std::min(full, small) : full;
}

/// Owns the context and queue of the device under test, and runs test kernels over arrays.
class KernelFixture {
public:
    DeviceContext& context() { return context_; }
    const Device& device() const { return context_.device(); }

    /// Runs kernel `name` of tests/kernels/`name`.cl, whose parameters are (const uint count, inputs ..., global Out
    /// *outputs): a vector is a buffer, a number a number. Every vector has `count` elements, or a multiple. Returns
    /// the outputs, which start as zeros.
    template <class Out, class... Inputs>
    std::vector<Out> run(const std::string& name, std::size_t count, const Inputs&... inputs) {
        cl::Kernel kernel = context_.kernel(name);
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
    cl::Buffer argument(const std::vector<T>& values) {
        const cl::Buffer buffer = context_.make_buffer(values.size() * sizeof(T), "test data");
        context_.write(buffer, values.data(), values.size() * sizeof(T));
        return buffer;
    }
    template <class T>
    requires std::is_arithmetic_v<T> T argument(T value) { return value; }

    DeviceContext context_{test_device(), kernels::test_kernels};
};

}  // namespace castor::test
