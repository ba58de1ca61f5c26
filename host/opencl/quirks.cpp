#include "opencl/quirks.h"

#include <fmt/format.h>

namespace castor {

DeviceProfile device_profile(const Device& device) {
    DeviceProfile profile;
    // 1.2 is the newest language that all drivers have; warnings are errors so that a new compiler's doubts are seen.
    profile.build_options = fmt::format("-cl-std=CL1.2 -Werror -DCASTOR_CORRECTLY_ROUNDED={}",
                                        device.correctly_rounded_divide_sqrt ? 1 : 0);
    // The option is legal only where the device reports the ability.
    if (device.correctly_rounded_divide_sqrt)
        profile.build_options += " -cl-fp32-correctly-rounded-divide-sqrt";
    else
        profile.quirks.emplace_back("division and square root are computed by integers");
    // Oclgrind does not know what LLVM leaves where a function with `restrict` parameters was inlined
    // (llvm.experimental.noalias.scope.decl).
    if (device.platform_name == "Oclgrind") {
        profile.build_options += " -DCASTOR_INLINE=";
        // Its 21.10 crashes with --uninitialized where another thread touches a buffer.
        profile.stays_in_thread = true;
        profile.quirks.emplace_back("one thread does everything");
        profile.waits_asleep = true;  // or rather, does the work in these calls
        profile.quirks.emplace_back("device functions are not inlined");
    }

    // PoCL has a cache of its own, and to hand out a binary it compiles every kernel once more, for groups of any size:
    // that doubles a first start and saves later ones some 20 ms a program.
    if (device.platform_name == "Portable Computing Language") {
        profile.keeps_programs = false;
        profile.waits_asleep = true;
        profile.quirks.emplace_back("compiled programs are kept by the driver");
    }

    // A CPU keeps a wave in its cache; a GPU needs many rays in flight.
    profile.tile_size = device.type == DeviceType::gpu ? 512 : 128;
    return profile;
}

}  // namespace castor
