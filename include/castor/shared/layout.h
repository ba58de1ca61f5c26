// What the two compilers spell differently. The only #ifdef between host and device is here.
#ifndef CASTOR_SHARED_LAYOUT_H
#define CASTOR_SHARED_LAYOUT_H

#ifdef __OPENCL_VERSION__
#define CASTOR_SHARED_BEGIN
#define CASTOR_SHARED_END
// Clang warns that vectors wider than the device's registers are handed over differently elsewhere. Nothing is: device
// functions are inlined, or called by kernels of the same program.
// NVIDIA's compiler is a Clang that does not know this warning, and warns of that.
#ifdef __has_warning
#if __has_warning("-Wpsabi")
#pragma clang diagnostic ignored "-Wpsabi"
#endif
#endif
// Every device function: a compiler that leaves a call passes the structs of a ray through memory. What no kernel of a
// program uses is not compiled.
#ifndef CASTOR_INLINE
#define CASTOR_INLINE static __attribute__((always_inline))
#endif
// Large functions: compiled once, where PoCL compiles three copies of a kernel and of all that is inlined into it.
#define CASTOR_NOINLINE static __attribute__((noinline))
#define CASTOR_ASSERT_SIZE(type, bytes) typedef char type##_is_##bytes##_bytes[sizeof(type) == bytes ? 1 : -1]
#else
#include <cstdint>
#define CASTOR_SHARED_BEGIN     \
    namespace castor::shared {  \
    using uint = std::uint32_t; \
    using uchar = std::uint8_t;
#define CASTOR_SHARED_END }
#define CASTOR_ASSERT_SIZE(type, bytes) static_assert(sizeof(type) == bytes)
#endif

#endif
