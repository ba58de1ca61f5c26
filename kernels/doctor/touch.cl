// Words all over a buffer, for castor doctor: written in one launch, counted in the next.
// Word i lies at i * stride; the last one at the end of the buffer.
#include "castor/shared/layout.h"

CASTOR_INLINE ulong place_of(const uint i, const uint count, const ulong stride, const ulong last)
{
    return i + 1 == count ? last : i * stride;
}

CASTOR_INLINE uint pattern(const uint i) { return i * 2654435761u ^ 0x5ca1ab1eu; }

kernel void write_words(const uint count, const ulong stride, const ulong last, global uint *restrict words)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    words[place_of(i, count, stride, last)] = pattern(i);
}

kernel void check_words(const uint count, const ulong stride, const ulong last, const global uint *restrict words,
                        global uint *restrict is_wrong)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    is_wrong[i] = words[place_of(i, count, stride, last)] != pattern(i);
}
