#pragma once

#include <cstdlib>  // defines __GLIBC__ where it is the C library

/// Before a function in which a tree's build spends its time: compiles it for AVX2 too, and the loader takes the clone
/// that suits the processor. Results are the same bits, since AVX2 alone brings no fused multiply-add. The function
/// must belong to its file alone: GCC exports others from a shared library, whatever their visibility. There is no
/// clone with Clang, which exports the function that chooses, nor with sanitizers, which count calls before the loader
/// is done and make it fail.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CASTOR_AVX2_CLONE __attribute__((target_clones("avx2", "default")))
#else
#define CASTOR_AVX2_CLONE
#endif
