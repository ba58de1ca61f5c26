// Lets libFuzzer call one target, which the environment variable CASTOR_FUZZ_TARGET names. scripts/fuzz builds it.
#include <oneapi/tbb/global_control.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "fuzz/targets.h"

namespace {

const castor::fuzz::Target& chosen_target() {
    const char* name = std::getenv("CASTOR_FUZZ_TARGET");
    for (const castor::fuzz::Target& target : castor::fuzz::targets())
        if (name != nullptr && name == std::string_view(target.name)) return target;
    std::fputs("CASTOR_FUZZ_TARGET does not name a target; scripts/fuzz sets it\n", stderr);
    std::exit(2);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // One thread: inputs are too small for several, and a finding is easier to repeat.
    static const tbb::global_control kOneThread(tbb::global_control::max_allowed_parallelism, 1);
    static const castor::fuzz::Target& target = chosen_target();
    target.run({reinterpret_cast<const char*>(data), size});
    return 0;
}
