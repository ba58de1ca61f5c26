#include "opencl/quirks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

namespace castor {

namespace {

// llvmpipe counts the turns of all loops of a work-item. When it has counted so many, each loop ends after the turn
// that it is in, and no error is reported (lp_exec_mask_init in Mesa's gallivm; seen with 22.3).
constexpr std::uint32_t kLlvmpipeLoopTurns = 65535;

bool is_llvmpipe(const Device& device) {
    return device.platform_name == "rusticl" && device.name.starts_with("llvmpipe");
}

}  // namespace

std::vector<std::string> broken_promises(const Device& device) {
    std::vector<std::string> promises;
    if (!device.infinity_and_nan)
        promises.push_back(fmt::format(
            "{} reports no infinities and NaN, by which Castor tells misses and empty boxes: its answers may be wrong",
            device.name));
    if (!device.denormals)
        promises.push_back(fmt::format(
            "{} takes numbers below 1.2e-38 for 0: answers that depend on one may differ from other devices' bits",
            device.name));
    if (is_llvmpipe(device))
        promises.push_back(fmt::format(
            "{} ends loops after {} turns: a ray that meets more boxes and primitives may get a wrong answer",
            device.name, kLlvmpipeLoopTurns));
    return promises;
}

DeviceQuirks device_quirks(const Device& device) {
    DeviceQuirks quirks;
    // 1.2 is the newest language that all drivers have.
    quirks.build_options =
        fmt::format("-cl-std=CL1.2 -DCASTOR_CORRECTLY_ROUNDED={}", device.correctly_rounded_divide_sqrt ? 1 : 0);
    // The option is legal only where the device reports the ability.
    if (device.correctly_rounded_divide_sqrt)
        quirks.build_options += " -cl-fp32-correctly-rounded-divide-sqrt";
    else
        quirks.remarks.emplace_back("division and square root are computed by integers");
    // Oclgrind does not know what LLVM leaves where a function with `restrict` parameters was inlined
    // (llvm.experimental.noalias.scope.decl).
    if (device.platform_name == "Oclgrind") {
        quirks.build_options += " -DCASTOR_INLINE=";
        quirks.remarks.emplace_back("device functions are not inlined");
        // Its 21.10 crashes with --uninitialized where another thread touches a buffer.
        quirks.stays_in_thread = true;
        quirks.remarks.emplace_back("one thread does everything");
        quirks.waits_asleep = true;  // it computes within these calls
    }

    // PoCL has a cache of its own. To hand out a binary it compiles every kernel once more, for groups of any size,
    // which doubles a first start and saves later ones some 20 ms a program.
    if (device.platform_name == "Portable Computing Language") {
        quirks.keeps_programs = false;
        quirks.waits_asleep = true;
        quirks.remarks.emplace_back("compiled programs are kept by the driver");
        // It lists the code of kernels by the widest launch, too, and gives back the first entry of a kernel when a
        // launch ends, whichever that one used (pocl_release_dlhandle_cache, seen with version 3.1): where queues run a
        // kernel side by side and one of them has more work-items than any launch before, the process aborts. With
        // 65535 work-items it is compiled once more. One compute unit runs one launch after another.
        if (device.compute_units > 1 || device.part_count > 1) quirks.first_launch = 65534;
        // It reads clang's opencl-c.h for each program, before it looks into its cache: 15 ms. _OPENCL_H_ guards that
        // header. Seen with version 3.1; others may have their declarations elsewhere.
        if (device.driver_version.starts_with("3.1")) {
            quirks.build_options += " -D_OPENCL_H_";
            quirks.prelude = "device/builtins.cl";
            quirks.remarks.emplace_back("programs declare the built-in functions that they use");
        }
    }

    if (const char* more = std::getenv("CASTOR_BUILD_OPTIONS"); more && *more)
        quirks.build_options += fmt::format(" {}", more);

    // rusticl's compiler inlines all functions by itself, after it has simplified each. What clang inlines before that,
    // without any optimization, is some 25 times as much code, most of it in functions that nothing calls any more.
    if (device.platform_name == "rusticl") {
        quirks.build_options += " -DCASTOR_INLINE=";
        quirks.remarks.emplace_back("device functions are inlined by the driver alone");
    }

    // Mesa's fma in software gives a zero the sign of the product: fma(-1, 0, 0) is -0. It has dozens of branches and
    // is inlined at each call, and the memory that llvmpipe takes to compile a kernel grows as branches times values:
    // the tests of BSDFs took more than 13 GiB.
    if (device.platform_name == "rusticl" && !device.fused_multiply_add) {
        quirks.prelude = "device/fma_by_integers.cl";
        quirks.remarks.emplace_back("fma is computed by integers");
    }

    // On a CPU too rusticl runs work-items in the lanes of vectors. A kernel with vectors of its own is taken apart
    // into all of their elements there, which compiles for minutes and runs slowly; and each launch costs some 0.1 s.
    quirks.is_like_gpu = device.type == DeviceType::gpu;
    if (device.platform_name == "rusticl" && !quirks.is_like_gpu) {
        quirks.is_like_gpu = true;
        quirks.remarks.emplace_back("it is treated as a GPU");
    }

    if (is_llvmpipe(device)) {
        quirks.loop_turns = kLlvmpipeLoopTurns;
        quirks.remarks.push_back(fmt::format("loops of a work-item take {} turns at most", kLlvmpipeLoopTurns));
    }

    // A GPU makes vectors of work-items. A CPU's compiler does so only with the simplest kernels, so that the others
    // have vectors of their own there.
    quirks.lanes = quirks.is_like_gpu ? 1 : 16;

    // PoCL copies a kernel's arguments once a group, and a CPU waits for the copies. For other drivers of CPUs nothing
    // was measured.
    quirks.local_size = quirks.is_like_gpu ? 64 : 256;

    // PoCL gives the work-groups of a launch to whatever core is free, so that a stage reads what another core wrote
    // last, and every launch ends with cores that wait for the last one. Cores with waves of their own are 5 to 10 %
    // faster. All of them share PoCL's one list of commands; more teams than sixteen were not tried, nor other drivers.
    constexpr std::uint32_t kMostTeams = 16;
    if (device.platform_name == "Portable Computing Language" && device.type == DeviceType::cpu)
        quirks.teams = std::clamp(device.compute_units, 1u, kMostTeams);
    if (quirks.teams > 1)
        quirks.remarks.push_back(fmt::format("{} teams of its compute units render side by side", quirks.teams));

    // A wave of one core stays in its caches; where several share a wave, smaller ones cost more in launches. A GPU
    // needs many rays in flight.
    quirks.tile_size = quirks.is_like_gpu ? 512 : device.compute_units == 1 ? 128 : 256;
    return quirks;
}

}  // namespace castor
