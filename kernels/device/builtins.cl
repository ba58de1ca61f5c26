// Declares the built-in functions that Castor's kernels use, as clang's opencl-c.h does. It stands before each program
// for drivers whose own declarations are left out (DeviceQuirks::prelude): those are of all types, spaces and
// roundings, 900 kB of text.
#define CASTOR_DECLARE __attribute__((overloadable))
#define CASTOR_DECLARE_CONST __attribute__((overloadable, const))
#define CASTOR_DECLARE_PURE __attribute__((overloadable, pure))

CASTOR_DECLARE_CONST size_t get_global_id(uint);
CASTOR_DECLARE_CONST int isnan(float);
CASTOR_DECLARE_CONST int isinf(float);
CASTOR_DECLARE_CONST uint select(uint, uint, uint);
CASTOR_DECLARE_CONST uint8 shuffle(uint8, uint8);
CASTOR_DECLARE_CONST int convert_int_rtz(float);
CASTOR_DECLARE uint atomic_inc(volatile global uint *);

#define CASTOR_DECLARE_ORDER(T)       \
    CASTOR_DECLARE_CONST T min(T, T); \
    CASTOR_DECLARE_CONST T max(T, T); \
    CASTOR_DECLARE_CONST T clamp(T, T, T);
#define CASTOR_DECLARE_CONVERSIONS(T, n)                \
    CASTOR_DECLARE_CONST T##n convert_##T##n(uchar##n); \
    CASTOR_DECLARE_CONST T##n convert_##T##n(int##n);   \
    CASTOR_DECLARE_CONST T##n convert_##T##n(uint##n);  \
    CASTOR_DECLARE_CONST T##n convert_##T##n(long##n);  \
    CASTOR_DECLARE_CONST T##n convert_##T##n(float##n);
#define CASTOR_DECLARE_ARITHMETIC(n)                                 \
    CASTOR_DECLARE_CONST float##n fma(float##n, float##n, float##n); \
    CASTOR_DECLARE_CONST float##n sqrt(float##n);                    \
    CASTOR_DECLARE_CONST float##n fabs(float##n);                    \
    CASTOR_DECLARE_CONST uint##n abs(int##n);                        \
    CASTOR_DECLARE_CONST uint##n popcount(uint##n);                  \
    CASTOR_DECLARE_CONST uint##n clz(uint##n);                       \
    CASTOR_DECLARE_ORDER(float##n)                                   \
    CASTOR_DECLARE_ORDER(int##n)                                     \
    CASTOR_DECLARE_ORDER(uint##n)                                    \
    CASTOR_DECLARE_CONVERSIONS(uchar, n)                             \
    CASTOR_DECLARE_CONVERSIONS(int, n)                               \
    CASTOR_DECLARE_CONVERSIONS(uint, n)                              \
    CASTOR_DECLARE_CONVERSIONS(float, n)
#define CASTOR_DECLARE_MEMORY(T, n)                                \
    CASTOR_DECLARE_PURE T##n vload##n(size_t, const global T *);   \
    CASTOR_DECLARE_PURE T##n vload##n(size_t, const constant T *); \
    CASTOR_DECLARE_PURE T##n vload##n(size_t, const private T *);  \
    CASTOR_DECLARE void vstore##n(T##n, size_t, global T *);       \
    CASTOR_DECLARE void vstore##n(T##n, size_t, private T *);
#define CASTOR_DECLARE_VECTORS(n)   \
    CASTOR_DECLARE_ARITHMETIC(n)    \
    CASTOR_DECLARE_MEMORY(uchar, n) \
    CASTOR_DECLARE_MEMORY(int, n)   \
    CASTOR_DECLARE_MEMORY(uint, n)  \
    CASTOR_DECLARE_MEMORY(float, n)

CASTOR_DECLARE_ARITHMETIC()
CASTOR_DECLARE_ORDER(long)
CASTOR_DECLARE_ORDER(ulong)
CASTOR_DECLARE_VECTORS(2)
CASTOR_DECLARE_VECTORS(3)
CASTOR_DECLARE_VECTORS(4)
CASTOR_DECLARE_VECTORS(8)
CASTOR_DECLARE_VECTORS(16)
