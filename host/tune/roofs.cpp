#include "castor/roofs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/stopwatch.h"
#include "castor/error.h"
#include "opencl/device_context.h"
#include "tune/bench_kernels.h"

namespace castor {

namespace {

constexpr int kRuns = 3;
constexpr std::size_t kLocalSize = 64;

/// Returns the shortest time of several runs, after one to warm up.
template <class Run>
double best_seconds(DeviceContext& context, const Run& run) {
    double best = INFINITY;
    for (int i = 0; i <= kRuns; ++i) {
        const Stopwatch watch;
        run();
        context.finish();
        if (i > 0) best = std::min(best, watch.seconds());
    }
    return best;
}

std::string lanes_option(std::size_t lanes) {
    return fmt::format("-DCASTOR_LANES={}", lanes);
}

[[noreturn]] void fail_wrong(const Device& device, const char* kernel, std::size_t at, float found, float expected) {
    throw DeviceError(
        device.name, "", 0,
        fmt::format("wrong answer: {} computes {} as element {}, expected is {}", kernel, found, at, expected));
}

/// Returns the bytes of each of the three buffers: far more than caches hold, and enough to keep a GPU busy for longer
/// than a launch takes.
std::size_t triad_bytes(const Device& device) {
    const std::size_t wanted = device.type == DeviceType::gpu ? std::size_t{256} << 20 : std::size_t{64} << 20;
    const std::size_t possible = std::min<std::uint64_t>(device.max_allocation_bytes, device.global_memory_bytes / 8);
    return std::min(wanted, possible) / 4096 * 4096;
}

double measure_bandwidth(DeviceContext& context) {
    const std::size_t bytes = triad_bytes(context.device()), floats = bytes / sizeof(float);
    const cl::Buffer a = context.make_buffer(bytes, "triad"), b = context.make_buffer(bytes, "triad"),
                     c = context.make_buffer(bytes, "triad");
    context.guarded("clEnqueueFillBuffer", [&] {
        context.queue().enqueueFillBuffer(b, 1.0f, 0, bytes);
        context.queue().enqueueFillBuffer(c, 2.0f, 0, bytes);
    });
    double best = INFINITY;
    std::vector<float> result(floats);
    for (const std::size_t lanes : {8, 16}) {
        context.fill_zero(a, bytes);
        cl::Kernel kernel = context.kernel_of("bench/triad", "triad", lanes_option(lanes));
        const auto count = static_cast<cl_uint>(floats / lanes);
        best =
            std::min(best, best_seconds(context, [&] {
                         context.enqueue_on(context.queue(), kernel, count, kLocalSize, nullptr, count, 3.0f, b, c, a);
                     }));
        context.read(a, result.data(), bytes);
        for (std::size_t i = 0; i < floats; ++i)
            if (result[i] != 7.0f) fail_wrong(context.device(), "triad", i, result[i], 7.0f);
    }
    return 3.0 * static_cast<double>(bytes) / best;
}

constexpr cl_uint kSteps = 1024;
constexpr float kFactor = -0.9990234375f, kSummand = 1.0f;
constexpr int kChains = 8, kFirstValues = 16;

/// Returns the end of a chain of fma_chains that begins with `x`.
float end_of_chain(float x) {
    for (cl_uint step = 0; step < kSteps; ++step) x = std::fma(x, kFactor, kSummand);
    return x;
}

double measure_arithmetic(DeviceContext& context) {
    // Chains begin with small integers: lane + work-item % 16 + chain.
    std::vector<float> ends;
    for (int first = 0; first < 16 + kFirstValues + kChains; ++first)
        ends.push_back(end_of_chain(static_cast<float>(first)));

    const std::size_t count = std::max<std::size_t>(context.device().compute_units, 1) * 16 * kLocalSize;
    double most = 0.0;
    for (const std::size_t lanes : {8, 16}) {
        const cl::Buffer sums = context.make_buffer(count * lanes * sizeof(float), "sums of chains");
        cl::Kernel kernel = context.kernel_of("bench/fma_chains", "fma_chains", lanes_option(lanes));
        const double seconds = best_seconds(context, [&] {
            context.enqueue_on(context.queue(), kernel, count, kLocalSize, nullptr, static_cast<cl_uint>(count), kSteps,
                               kFactor, kSummand, sums);
        });
        most = std::max(most, 2.0 * kChains * kSteps * static_cast<double>(lanes * count) / seconds);
        std::vector<float> found(count * lanes);
        context.read(sums, found.data(), found.size() * sizeof(float));
        for (std::size_t i = 0; i < found.size(); ++i) {
            const float* x = ends.data() + i % lanes + i / lanes % kFirstValues;
            const float expected = ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]));
            if (found[i] != expected) fail_wrong(context.device(), "fma_chains", i, found[i], expected);
        }
    }
    return most;
}

}  // namespace

Roofs measure_roofs(const Device& device) {
    DeviceContext context(device, kernels::bench_kernels);
    return {measure_bandwidth(context), measure_arithmetic(context)};
}

}  // namespace castor
