// What the two compilers spell differently. The only #ifdef between host and device is here.
#ifndef CASTOR_SHARED_LAYOUT_H
#define CASTOR_SHARED_LAYOUT_H

#ifdef __OPENCL_VERSION__
#define CASTOR_SHARED_BEGIN
#define CASTOR_SHARED_END
// Every device function: a compiler that leaves a call passes the structs of a ray through memory.
#ifndef CASTOR_INLINE
#define CASTOR_INLINE __attribute__((always_inline))
#endif
// Large functions that a kernel calls from several places, by pointers: compiled once.
#define CASTOR_NOINLINE __attribute__((noinline))
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
