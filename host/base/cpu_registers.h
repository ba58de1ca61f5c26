#pragma once

namespace castor {

/// Whether the registers of this computer's CPUs hold sixteen floats (AVX-512), which CASTOR_REGISTERS_OF_16 tells
/// kernels that are compiled for them.
inline bool has_registers_of_16() {
#if defined(__x86_64__)
    return __builtin_cpu_supports("avx512f") != 0;
#else
    return false;
#endif
}

}  // namespace castor
