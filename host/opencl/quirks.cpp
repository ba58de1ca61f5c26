#include "opencl/quirks.h"

#include <fmt/format.h>

namespace castor {

DeviceProfile device_profile(const Device& device) {
    DeviceProfile profile;
    // 1.2 is the newest language that all drivers have; warnings are errors so that a new compiler's doubts are seen.
    profile.build_options =
        fmt::format("-cl-std=CL1.2 -Werror -DCASTOR_CORRECTLY_ROUNDED={}", device.correctly_rounded_divide_sqrt ? 1 : 0);
    // The option is legal only where the device reports the ability.
    if (device.correctly_rounded_divide_sqrt) profile.build_options += " -cl-fp32-correctly-rounded-divide-sqrt";
    // Oclgrind does not know what LLVM leaves where a function with `restrict` parameters was inlined
    // (llvm.experimental.noalias.scope.decl).
    if (device.platform_name == "Oclgrind") profile.build_options += " -DCASTOR_INLINE=";

    // PoCL has a cache of its own, and to hand out a binary it compiles every kernel once more, for groups of any size: that doubles a first start and saves
    // later ones some 20 ms a program.
    if (device.platform_name == "Portable Computing Language") profile.keeps_programs = false;

    // A CPU keeps a wave in its cache; a GPU needs many rays in flight. PoCL compiles a kernel again for launches of 65535 and more
    // work-items, so a CPU's launches stay below.
    if (device.type == DeviceType::gpu) {
        profile.tile_size = 512;
        profile.launch_items = 1u << 22;
    } else {
        profile.tile_size = 128;
        profile.launch_items = 1u << 15;
    }
    return profile;
}

}  // namespace castor
