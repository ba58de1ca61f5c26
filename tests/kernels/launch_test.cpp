#include <fmt/format.h>

#include <atomic>
#include <cstdint>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "castor/error.h"
#include "opencl/device_context.h"
#include "opencl/kernel_arguments.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "trace/trace_arguments.h"

namespace castor::test {
namespace {

constexpr std::size_t kThreads = 4;

/// What the kernel `work` of doctor/queue.cl leaves at place i.
std::uint32_t worked(std::uint32_t i, std::uint32_t rounds) {
    for (std::uint32_t k = 0; k < rounds; ++k) i = i * 1664525u + 1013904223u;
    return i;
}

#define CASTOR_WORK_ARGUMENTS(value, in, out, columns_of) value(uint, count) value(uint, rounds) out(crossing_counts)

struct Work {
    static constexpr const char* kProgram = "doctor/queue";
    static constexpr const char* kKernel = "work";
    CASTOR_KERNEL_ARGUMENTS(CASTOR_WORK_ARGUMENTS)
};

}  // namespace

// A kernel sets only what is not as it was before.
TEST_CASE("a kernel has the arguments of each launch, also in a new buffer with the handle of an old one", "[device]") {
    DeviceContext context(test_device(), kernels::doctor_kernels);
    Kernel<Work> kernel(context);
    constexpr std::uint32_t kCount = 256;
    const auto launch = [&](Kernel<Work>& work, std::uint32_t count, std::uint32_t rounds,
                            const DeviceColumn<columns::crossing_counts>& results) {
        context.fill_zero(results.buffer(), kCount * sizeof(std::uint32_t));
        work.enqueue(kCount, {.count = count, .rounds = rounds, .crossing_counts = results});
        std::vector<std::uint32_t> answers(kCount), expected(kCount);
        context.read(results.buffer(), answers.data(), kCount * sizeof(std::uint32_t));
        for (std::uint32_t i = 0; i < count; ++i) expected[i] = worked(i, rounds);
        return answers == expected;
    };
    const auto kept = make_column<columns::crossing_counts>(context, kCount);
    std::set<cl_mem> handles;
    for (std::uint32_t turn = 0; turn < 8; ++turn) {
        CAPTURE(turn);
        const auto made = make_column<columns::crossing_counts>(context, kCount);
        handles.insert(made.buffer()());
        CHECK(launch(kernel, kCount, 3, made));
        CHECK(launch(kernel, kCount, 3, made));
        CHECK(launch(kernel, kCount - turn, 3, made));
        CHECK(launch(kernel, kCount - turn, 4 + turn, made));
        CHECK(launch(kernel, kCount, 3, kept));
        kernel.enqueue(0, {.count = kCount, .rounds = turn, .crossing_counts = made});
    }
    CAPTURE(handles.size());  // 8: this driver gave no handle twice
    Kernel<Work> moved = std::move(kernel);
    CHECK(launch(moved, kCount, 3, kept));
    CHECK(launch(moved, kCount, 2, kept));
}

// PoCL 3.1 aborts there unless each kernel's first launch is a wide one: DeviceQuirks::first_launch.
TEST_CASE("threads launch one kernel side by side, each launch wider than those before", "[device]") {
    const Device device = test_device();
    const std::size_t launches = test_size(100, 4);
    const std::size_t widest = kThreads * launches * 128;  // below 65535: all use the same code of PoCL
    std::atomic<std::size_t> next_width = 0;
    std::vector<std::string> faults(kThreads);
    const auto launch = [&](std::uint32_t rounds) -> std::string {
        DeviceContext context(device, kernels::doctor_kernels);
        Kernel<Work> kernel(context);
        const auto results = make_column<columns::crossing_counts>(context, widest);
        std::size_t width = 0;
        for (std::size_t i = 0; i < launches; ++i) {
            width = next_width += 128;
            kernel.enqueue(width,
                           {.count = static_cast<std::uint32_t>(width), .rounds = rounds, .crossing_counts = results});
        }
        std::vector<std::uint32_t> answers(width);
        context.read(results, answers.data(), width * sizeof(std::uint32_t));
        for (std::uint32_t i = 0; i < width; ++i)
            if (answers[i] != worked(i, rounds)) return fmt::format("place {} of {} has {}", i, width, answers[i]);
        return "";
    };
    std::vector<std::thread> threads;
    for (std::size_t k = 0; k < kThreads; ++k)
        threads.emplace_back([&, k] {
            try {
                faults[k] = launch(20 + static_cast<std::uint32_t>(k));
            } catch (const Error& error) {
                faults[k] = error.what();
            }
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(faults == std::vector<std::string>(kThreads));
}

}  // namespace castor::test
