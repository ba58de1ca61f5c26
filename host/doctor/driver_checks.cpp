// What Castor takes for granted of a driver: arithmetic, layouts, queues, events, atomics, memory.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>

#include "base/byte_count.h"
#include "base/host_memory.h"
#include "castor/error.h"
#include "castor/shared/types.h"
#include "doctor/check.h"
#include "doctor/layout_test_fields.h"
#include "reference/operands.h"
#include "reference/ulp.h"

namespace castor::doctor {

namespace {

using reference::RandomSource;
using reference::same_float;

std::string describe_abilities(Patient& patient, Rounds&) {
    if (!patient.device.infinity_and_nan) return "the device does not report infinities and NaN, which Castor needs";
    return "";
}

/// Remarks on what the compiler warns of, which is no fault: programs are built without regard to warnings.
std::string compiler_warnings(Patient& patient, Rounds&) {
    const auto in_lanes = [lanes = patient.runner.context().quirks().lanes](const char* name) {
        return fmt::format("{}.x{}", name, lanes);
    };
    for (const std::string& program :
         std::vector<std::string>{in_lanes("render"), in_lanes("wave"), "write_aovs", "find_uvs", "find_attributes",
                                  "opacity", "trace_brute", "trace_simt", "trace_wide", "trace_packet"}) {
        try {
            patient.runner.context().try_build(program, "-Werror");
        } catch (const DeviceError& error) {
            constexpr std::size_t kLongest = 1000;
            patient.remark(fmt::format("with warnings as errors: {}", std::string(error.what()).substr(0, kLongest)));
            break;
        }
    }
    return "";
}

struct ArithmeticResult {
    float sum, difference, product, fused, unfused, converted;
    cl_int truncated;
    cl_uint relations;
};

ArithmeticResult exact_arithmetic(float a, float b, float c) {
    ArithmeticResult result{};
    result.sum = a + b;
    result.difference = a - b;
    result.product = a * b;
    result.fused = std::fma(a, b, c);
    result.unfused = a * b + c;
    result.converted = static_cast<float>(std::bit_cast<std::int32_t>(a));
    result.truncated = b > -0x1p30f && b < 0x1p30f ? static_cast<cl_int>(b) : 0;
    result.relations = cl_uint{a < b} | cl_uint{a <= b} << 1 | cl_uint{a == b} << 2 | cl_uint{a != b} << 3 |
                       cl_uint{std::isnan(a)} << 4 | cl_uint{std::isinf(a)} << 5 | cl_uint{a < b} << 6;
    return result;
}

bool is_subnormal(std::initializer_list<float> values) {
    return std::any_of(values.begin(), values.end(), [](float v) { return std::fpclassify(v) == FP_SUBNORMAL; });
}

/// The name of the first operation whose result is wrong.
std::string wrong_operation(const ArithmeticResult& found, const ArithmeticResult& expected) {
    const auto compare = [](const char* name, float f, float e) {
        return same_float(f, e) ? "" : fmt::format("{}: found {:a}, expected {:a}", name, f, e);
    };
    for (const std::string& text :
         {compare("a + b", found.sum, expected.sum), compare("a - b", found.difference, expected.difference),
          compare("a * b", found.product, expected.product), compare("fma(a, b, c)", found.fused, expected.fused),
          compare("a * b + c without contraction", found.unfused, expected.unfused),
          compare("float from int", found.converted, expected.converted)})
        if (!text.empty()) return text;
    if (found.truncated != expected.truncated)
        return fmt::format("int from b: found {}, expected {}", found.truncated, expected.truncated);
    if (found.relations != expected.relations)
        return fmt::format("comparisons: found {:#x}, expected {:#x}", found.relations, expected.relations);
    return "";
}

std::string check_arithmetic(reference::KernelRunner& runner, const std::vector<float>& a, const std::vector<float>& b,
                             const std::vector<float>& c) {
    const auto found = runner.run_kernel<ArithmeticResult>("doctor/arithmetic", "arithmetic", a.size(), a, b, c);
    for (std::size_t i = 0; i < a.size(); ++i) {
        const ArithmeticResult expected = exact_arithmetic(a[i], b[i], c[i]);
        // A device may flush what it says that it does not keep.
        if (!runner.device().denormals && is_subnormal({a[i], b[i], c[i], expected.sum, expected.difference,
                                                        expected.product, expected.fused, expected.unfused}))
            continue;
        const std::string wrong = wrong_operation(found[i], expected);
        if (!wrong.empty()) return fmt::format("{} for a = {:a}, b = {:a}, c = {:a}", wrong, a[i], b[i], c[i]);
    }
    return "";
}

/// Three operands: first all zeros of both signs beside ordinary numbers, then such that product and sum nearly cancel
/// now and then, where contraction tells.
std::string arithmetic(Patient& patient, Rounds& rounds) {
    const std::vector<float> special = reference::special_values();
    while (const std::size_t size = rounds.next()) {
        RandomSource random(patient.seed + 1000 * rounds.number());
        std::vector<float> a, b, c;
        for (const float x : {0.0f, -0.0f, 1.5f, -1.5f})
            for (const float y : {0.0f, -0.0f, 1.5f, -1.5f})
                for (const float z : {0.0f, -0.0f, 1.5f, -1.5f}) a.push_back(x), b.push_back(y), c.push_back(z);
        for (std::size_t i = 0; i < size; ++i) {
            a.push_back(i % 4 ? reference::random_operand(random, random.below(4))
                              : special[random.below(static_cast<std::uint32_t>(special.size()))]);
            b.push_back(i % 3 ? reference::random_operand(random, random.below(4))
                              : special[random.below(static_cast<std::uint32_t>(special.size()))]);
            c.push_back(i % 2 ? -(a.back() * b.back()) : reference::random_operand(random, random.below(4)));
        }
        const std::string wrong = check_arithmetic(patient.runner, a, b, c);
        if (!wrong.empty()) return wrong;
    }
    return "";
}

struct QuotientAndRoot {
    float quotient, quotient_by_integers, root, root_by_integers;
};

std::string check_quotients(reference::KernelRunner& runner, const std::vector<float>& a, const std::vector<float>& b) {
    const auto found = runner.run<QuotientAndRoot>("doctor/exact_test", a.size(), a, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
        const float quotient = a[i] / b[i], root = std::sqrt(a[i]);
        // The integer versions keep denormals everywhere; the device's own operators do where it says so.
        const bool own_counts = runner.device().denormals || !is_subnormal({a[i], b[i], quotient});
        const auto compare = [&](const char* name, float f, float e) {
            return same_float(f, e)
                       ? ""
                       : fmt::format("{} for a = {:a}, b = {:a}: found {:a}, expected {:a}", name, a[i], b[i], f, e);
        };
        for (const std::string& text : {own_counts ? compare("divide(a, b)", found[i].quotient, quotient) : "",
                                        own_counts ? compare("square_root(a)", found[i].root, root) : "",
                                        compare("divide_by_integers(a, b)", found[i].quotient_by_integers, quotient),
                                        compare("square_root_by_integers(a)", found[i].root_by_integers, root)})
            if (!text.empty()) return text;
    }
    return "";
}

std::string quotients_and_roots(Patient& patient, Rounds& rounds) {
    const std::vector<float> special = reference::special_values();
    std::vector<float> a, b;
    for (std::size_t i = 0; i < special.size(); ++i)
        for (std::size_t k = 0; k < special.size(); ++k) {
            a.push_back(special[i]);
            b.push_back(special[k]);
        }
    std::string wrong = check_quotients(patient.runner, a, b);
    while (wrong.empty()) {
        const std::size_t size = rounds.next();
        if (size == 0) break;
        RandomSource random(patient.seed + 1001 * rounds.number());
        a.resize(size);
        b.resize(size);
        for (std::size_t i = 0; i < size; ++i) {
            a[i] = reference::random_operand(random, i % 4);
            b[i] = reference::random_operand(random, i / 4 % 4);
        }
        wrong = check_quotients(patient.runner, a, b);
    }
    return wrong;
}

std::string layouts(Patient& patient, Rounds&) {
    struct Entry {
        const char* name;
        cl_uint number;
    };
#define CASTOR_SIZE_ENTRY(type) {"sizeof " #type, sizeof(shared::type)},
#define CASTOR_OFFSET_ENTRY(type, member) {#type "." #member, offsetof(shared::type, member)},
    const std::vector<Entry> expected{CASTOR_LAYOUT(CASTOR_SIZE_ENTRY, CASTOR_OFFSET_ENTRY)};
    const auto found = patient.runner.run<cl_uint>("doctor/layout_test", expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
        if (found[i] != expected[i].number)
            return fmt::format("{}: found {}, expected {}", expected[i].name, found[i], expected[i].number);
    return "";
}

/// What was enqueued first is done first, whatever the launches' number.
std::string order_of_launches(Patient& patient, Rounds&) {
    constexpr cl_uint kCount = 1024, kLaunches = 200;
    DeviceContext& context = patient.runner.context();
    const cl::Buffer values = context.make_buffer(kCount * sizeof(cl_uint), "values");
    context.fill_zero(values, kCount * sizeof(cl_uint));
    cl::Kernel kernel = context.kernel_of("doctor/queue", "next_value");
    cl_uint expected = 0;
    for (cl_uint k = 0; k < kLaunches; ++k) {
        context.enqueue(kernel, kCount, kCount, k, values);
        expected = expected * 2 + k;
    }
    std::vector<cl_uint> found(kCount);
    context.read(values, found.data(), kCount * sizeof(cl_uint));
    for (cl_uint i = 0; i < kCount; ++i)
        if (found[i] != expected)
            return fmt::format("after {} launches one after the other value {} is {}, expected {}", kLaunches, i,
                               found[i], expected);
    return "";
}

std::string atomics(Patient& patient, Rounds&) {
    constexpr cl_uint kCount = 4096;
    DeviceContext& context = patient.runner.context();
    const cl::Buffer counter = context.make_buffer(sizeof(cl_uint), "counter"),
                     tickets = context.make_buffer(kCount * sizeof(cl_uint), "tickets");
    context.fill_zero(counter, sizeof(cl_uint));
    cl::Kernel kernel = context.kernel_of("doctor/queue", "take_tickets");
    context.enqueue(kernel, kCount, kCount, counter, tickets);
    std::vector<cl_uint> found(kCount);
    cl_uint count = 0;
    context.read(counter, &count, sizeof count);
    context.read(tickets, found.data(), kCount * sizeof(cl_uint));
    if (count != kCount) return fmt::format("{} atomic increments counted {}", kCount, count);
    std::sort(found.begin(), found.end());
    for (cl_uint i = 0; i < kCount; ++i)
        if (found[i] != i) return fmt::format("of {} atomic increments none returned {}", kCount, i);
    return "";
}

/// A loop of more turns than 16 bits count, or of as many as the driver is known to give.
std::string long_loops(Patient& patient, Rounds&) {
    constexpr cl_uint kCount = 2;
    DeviceContext& context = patient.runner.context();
    const cl_uint turns = std::min(1u << 17, context.quirks().loop_turns - 1);
    const cl::Buffer results = context.make_buffer(kCount * sizeof(cl_uint), "results");
    cl::Kernel kernel = context.kernel_of("doctor/queue", "work");
    context.enqueue(kernel, kCount, kCount, turns, results);
    std::vector<cl_uint> found(kCount);
    context.read(results, found.data(), kCount * sizeof(cl_uint));
    for (cl_uint i = 0; i < kCount; ++i) {
        cl_uint expected = i;
        for (cl_uint k = 0; k < turns; ++k) expected = expected * 1664525u + 1013904223u;
        if (found[i] != expected)
            return fmt::format("after a loop of {} turns value {} is {}, expected {}", turns, i, found[i], expected);
    }
    return "";
}

/// A launch that takes a while, with its event, on a queue of its own.
struct Work {
    Work(DeviceContext& of, cl_command_queue_properties properties)
        : context(of),
          queue(
              of.guarded("clCreateCommandQueue",
                         [&] { return cl::CommandQueue(of.context(), cl::Device(of.device().id, true), properties); })),
          kernel(of.kernel_of("doctor/queue", "work")),
          results(of.make_buffer(kCount * sizeof(cl_uint), "results")) {}

    void enqueue(cl_uint rounds) {
        context.enqueue_on(queue, kernel, kCount, 0, &event, cl_uint{kCount}, rounds, results);
    }
    double run(cl_uint rounds) {
        const Stopwatch watch;
        enqueue(rounds);
        context.guarded("clFinish", [&] { queue.finish(); });
        return watch.seconds();
    }
    /// Rounds for a launch of some 20 ms.
    cl_uint rounds_of_a_while() {
        run(1);
        cl_uint rounds = 16;
        while (rounds < 1u << 26 && run(rounds) < 0.02) rounds *= 4;
        return rounds;
    }

    static constexpr cl_uint kCount = 256;
    DeviceContext& context;
    cl::CommandQueue queue;
    cl::Kernel kernel;
    cl::Buffer results;
    cl::Event event;
};

std::string event_order(Patient& patient, Rounds&) {
    DeviceContext& context = patient.runner.context();
    Work first(context, 0), second(context, 0);
    const cl_uint rounds = first.rounds_of_a_while();
    second.run(1);
    first.enqueue(rounds);
    return context.guarded("clWaitForEvents", [&]() -> std::string {
        first.queue.flush();
        const std::vector<cl::Event> before{first.event};
        second.queue.enqueueMarkerWithWaitList(&before);
        second.run(1);
        const auto status = first.event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>();
        if (status != CL_COMPLETE)
            return fmt::format(
                "a command that waits for an event was done while the event's status was {}, expected {}", status,
                CL_COMPLETE);
        return "";
    });
}

/// Nothing but figures depend on times, so that wrong ones are no fault.
std::string event_times(Patient& patient, Rounds&) {
    DeviceContext& context = patient.runner.context();
    Work work(context, CL_QUEUE_PROFILING_ENABLE);
    const double wall = work.run(work.rounds_of_a_while());
    return context.guarded("clGetEventProfilingInfo", [&]() -> std::string {
        const cl_ulong queued = work.event.getProfilingInfo<CL_PROFILING_COMMAND_QUEUED>(),
                       submitted = work.event.getProfilingInfo<CL_PROFILING_COMMAND_SUBMIT>(),
                       started = work.event.getProfilingInfo<CL_PROFILING_COMMAND_START>(),
                       ended = work.event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
        const double seconds = 1e-9 * static_cast<double>(ended - started);
        if (queued > submitted || submitted > started || started > ended)
            patient.remark(fmt::format("event times do not ascend: queued {}, submitted {}, started {}, ended {} ns",
                                       queued, submitted, started, ended));
        else if (seconds < 0.2 * wall || seconds > 1.1 * wall)
            patient.remark(fmt::format("event times are wrong: a launch of {:.2f} ms took {:.2f} ms by them",
                                       1e3 * wall, 1e3 * seconds));
        return "";
    });
}

/// Writes words all over a buffer of so many bytes and reads them again.
std::string try_allocation(DeviceContext& context, std::uint64_t bytes) {
    constexpr cl_uint kWords = 4096;
    const cl::Buffer buffer = context.make_buffer(bytes, "a large buffer"),
                     is_wrong = context.make_buffer(kWords * sizeof(cl_uint), "marks");
    const cl_ulong last = bytes / sizeof(cl_uint) - 1, stride = last / kWords;
    cl::Kernel write = context.kernel_of("doctor/touch", "write_words"),
               check = context.kernel_of("doctor/touch", "check_words");
    context.enqueue(write, kWords, kWords, stride, last, buffer);
    context.enqueue(check, kWords, kWords, stride, last, buffer, is_wrong);
    std::vector<cl_uint> found(kWords);
    context.read(is_wrong, found.data(), kWords * sizeof(cl_uint));
    const auto wrong = std::find(found.begin(), found.end(), 1u);
    if (wrong == found.end()) return "";
    const std::size_t i = static_cast<std::size_t>(wrong - found.begin());
    return fmt::format("of a buffer of {} the word at {} is not what was written", byte_count(bytes),
                       byte_count(sizeof(cl_uint) * (i + 1 == kWords ? last : i * stride)));
}

std::string largest_allocation(Patient& patient, Rounds&) {
    constexpr std::uint64_t kLeast = 1 << 20;
    const std::uint64_t promised = patient.device.max_allocation_bytes / sizeof(cl_uint) * sizeof(cl_uint);
    // What others on the machine need is left to them.
    const std::uint64_t affordable =
        patient.device.unified_memory ? available_host_memory() / 4 : patient.device.global_memory_bytes;
    std::string refusal;
    for (std::uint64_t bytes = std::min(promised, affordable / kLeast * kLeast); bytes >= kLeast;
         bytes = bytes / 2 / kLeast * kLeast) {
        try {
            const std::string wrong = try_allocation(patient.runner.context(), bytes);
            if (!wrong.empty()) return wrong;
        } catch (const DeviceError& error) {
            refusal = error.what();
            continue;
        }
        if (!refusal.empty())
            patient.remark(fmt::format("a buffer of {} can be used, of the promised {}: {}", byte_count(bytes),
                                       byte_count(promised), refusal));
        else if (bytes < promised)
            patient.remark(fmt::format("a buffer of {} can be used; {} are promised, for which memory is too short now",
                                       byte_count(bytes), byte_count(promised)));
        return "";
    }
    return refusal.empty() ? "there is no memory for a buffer of 1 MiB" : refusal;
}

}  // namespace

std::vector<Check> driver_checks() {
    return {
        {"the device's description", describe_abilities},
        {"exact arithmetic", arithmetic},
        {"quotients and roots", quotients_and_roots},
        {"struct layouts", layouts},
        {"the order of launches", order_of_launches},
        {"long loops", long_loops},
        {"atomic increments", atomics},
        {"the order that events make", event_order},
        {"event times", event_times},
        {"the largest allocation", largest_allocation},
    };
}

std::vector<Check> compiler_checks() {
    return {{"warnings", compiler_warnings}};
}

}  // namespace castor::doctor
