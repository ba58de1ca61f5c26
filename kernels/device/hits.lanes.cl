// Hits, for CASTOR_LANES lanes (see lanes.cl).
#include "castor/shared/types.h"
#include "device/simd.lanes.cl"

typedef struct LANES(Hits) {
    Real t, u, v;
    Whole primitive, instance;
} LANES(Hits);

#if CASTOR_LANES == 1
CASTOR_INLINE Hits load_hits(const global Hit *hits)
{
    Hits hit;
    hit.t = hits->t;
    hit.u = hits->u;
    hit.v = hits->v;
    hit.primitive = hits->primitive;
    hit.instance = hits->instance;
    return hit;
}
#elif CASTOR_LANES == 16
// Loads hits that follow one another. A Hit is five words.
CASTOR_INLINE Hits16 load_hits16(const global Hit *hits)
{
    const global uint *const words = (const global uint *)hits;
    const uint16 a = vload16(0, words), b = vload16(1, words), c = vload16(2, words), d = vload16(3, words),
                 e = vload16(4, words);
    Hits16 hit;
    hit.t = as_float16(
        (uint16)(a.s0, a.s5, a.sa, a.sf, b.s4, b.s9, b.se, c.s3, c.s8, c.sd, d.s2, d.s7, d.sc, e.s1, e.s6, e.sb));
    hit.u = as_float16(
        (uint16)(a.s1, a.s6, a.sb, b.s0, b.s5, b.sa, b.sf, c.s4, c.s9, c.se, d.s3, d.s8, d.sd, e.s2, e.s7, e.sc));
    hit.v = as_float16(
        (uint16)(a.s2, a.s7, a.sc, b.s1, b.s6, b.sb, c.s0, c.s5, c.sa, c.sf, d.s4, d.s9, d.se, e.s3, e.s8, e.sd));
    hit.primitive =
        (uint16)(a.s3, a.s8, a.sd, b.s2, b.s7, b.sc, c.s1, c.s6, c.sb, d.s0, d.s5, d.sa, d.sf, e.s4, e.s9, e.se);
    hit.instance =
        (uint16)(a.s4, a.s9, a.se, b.s3, b.s8, b.sd, c.s2, c.s7, c.sc, d.s1, d.s6, d.sb, e.s0, e.s5, e.sa, e.sf);
    return hit;
}

// Stores hits, one after another.
CASTOR_INLINE void store_hits16(const Hits16 hit, global Hit *hits)
{
    global uint *const words = (global uint *)hits;
    const uint16 t = as_uint16(hit.t), u = as_uint16(hit.u), v = as_uint16(hit.v), p = hit.primitive, n = hit.instance;
    store_whole_column16(
        (uint16)(t.s0, u.s0, v.s0, p.s0, n.s0, t.s1, u.s1, v.s1, p.s1, n.s1, t.s2, u.s2, v.s2, p.s2, n.s2, t.s3),
        words);
    store_whole_column16(
        (uint16)(u.s3, v.s3, p.s3, n.s3, t.s4, u.s4, v.s4, p.s4, n.s4, t.s5, u.s5, v.s5, p.s5, n.s5, t.s6, u.s6),
        words + 16);
    store_whole_column16(
        (uint16)(v.s6, p.s6, n.s6, t.s7, u.s7, v.s7, p.s7, n.s7, t.s8, u.s8, v.s8, p.s8, n.s8, t.s9, u.s9, v.s9),
        words + 32);
    store_whole_column16(
        (uint16)(p.s9, n.s9, t.sa, u.sa, v.sa, p.sa, n.sa, t.sb, u.sb, v.sb, p.sb, n.sb, t.sc, u.sc, v.sc, p.sc),
        words + 48);
    store_whole_column16(
        (uint16)(n.sc, t.sd, u.sd, v.sd, p.sd, n.sd, t.se, u.se, v.se, p.se, n.se, t.sf, u.sf, v.sf, p.sf, n.sf),
        words + 64);
}
#endif

// Copies hits that follow one another to places with a number for each lane, where `counts`.
CASTOR_INLINE void LANES(scatter_hits)(const global Hit *from, const Whole number, const Mask counts, global Hit *hits)
{
#if CASTOR_LANES == 1
    if (counts) hits[number] = *from;
#else
    uint numbers[CASTOR_LANES];
    LANES(store_wholes)(number, numbers);
    for (uint left = LANES(mask_of)(counts); left; left &= left - 1)
        hits[numbers[lowest_bit(left)]] = from[lowest_bit(left)];
#endif
}
