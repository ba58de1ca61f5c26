// Sample points for CASTOR_LANES lanes (see lanes.cl): a function of pixel, sample number and seed alone, made of
// integers.
// Owen-scrambled Sobol points by hashing (Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4)): each pixel
// has its own scrambling, and every power of two of consecutive samples is well spread.
#include "device/simd.lanes.cl"

// Hashes 32 bits (Wellons 2018, "Prospecting for Hash Functions", lowbias32).
CASTOR_INLINE Whole LANES(hash_uint)(Whole x)
{
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    x ^= x >> 16u;
    return x;
}

CASTOR_INLINE Whole LANES(combine_hashes)(const Whole seed, const Whole value)
{
    return LANES(hash_uint)(seed ^ (value + 0x9e3779b9u + (seed << 6u) + (seed >> 2u)));
}

CASTOR_INLINE Whole LANES(reverse_bits)(Whole x)
{
    x = ((x >> 1u) & 0x55555555u) | ((x & 0x55555555u) << 1u);
    x = ((x >> 2u) & 0x33333333u) | ((x & 0x33333333u) << 2u);
    x = ((x >> 4u) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4u);
    x = ((x >> 8u) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8u);
    return (x >> 16u) | (x << 16u);
}

// Flips each bit by a hash of the bits below it (Laine, Karras 2011, with Burley's constants).
CASTOR_INLINE Whole LANES(laine_karras_permutation)(Whole x, const Whole seed)
{
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

// Returns Owen's scrambling of the number whose bits, reversed, are `reversed`.
CASTOR_INLINE Whole LANES(owen_scramble_reversed)(const Whole reversed, const Whole seed)
{
    return LANES(reverse_bits)(LANES(laine_karras_permutation)(reversed, seed));
}

// Returns the second dimension of the Sobol sequence, its bits reversed. The direction numbers are the rows of Pascal's
// triangle modulo 2: bit j of the result is the parity of those bits k of `index` whose number k has every bit of the
// number j (Lucas). Each step takes in one bit of these numbers. The first dimension, its bits reversed, is `index`
// itself.
CASTOR_INLINE Whole LANES(sobol_second_reversed)(Whole index)
{
    index ^= (index & 0xaaaaaaaau) >> 1u;
    index ^= (index & 0xccccccccu) >> 2u;
    index ^= (index & 0xf0f0f0f0u) >> 4u;
    index ^= (index & 0xff00ff00u) >> 8u;
    return index ^ (index >> 16u);
}

// Maps 32 bits to [0, 1), exactly.
CASTOR_INLINE Real LANES(unit_float)(const Whole x) { return LANES(convert_float)(x >> 8u) * 0x1p-24f; }

typedef struct LANES(Points) {
    Real x, y;
} LANES(Points);

// The dimensions of a sample, which has a point of the unit square in each. Those of a hit also depend on how the path
// came there: combine them with its node by dimension_of_node.
#define CASTOR_DIMENSION_PIXEL 0x51633e2du
#define CASTOR_DIMENSION_LENS 1u
#define CASTOR_DIMENSION_TIME 2u
#define CASTOR_DIMENSION_REFLECTION 3u
#define CASTOR_DIMENSION_REFRACTION 4u
// Of path tracing, at each bounce:
#define CASTOR_DIMENSION_CHOICE 5u        // x: which lobe scatters; y: which light is sampled, without a tree
#define CASTOR_DIMENSION_DIRECTION 6u     // within the lobe
#define CASTOR_DIMENSION_LIGHT_POINT 7u   // of the light; x: also which one a tree chooses
#define CASTOR_DIMENSION_END 8u           // x: roulette
#define CASTOR_DIMENSION_TEXEL 9u         // which texel of those that a filter would mix
#define CASTOR_DIMENSION_LIGHT_TEXEL 10u  // the same at the point of the light
// And CASTOR_DIMENSION_OPACITY, CASTOR_DIMENSION_SHADOW_OPACITY, with the place of a surface among those that a ray
// passes: whether it is there; CASTOR_DIMENSION_PANE_TEXEL, likewise: its texel. See sample_order.h.
#define CASTOR_DIMENSION_FIRST_LIGHT 16u  // and its number
#define CASTOR_MOST_DIMENSIONS 6          // that sample_dimensions takes at once

// Returns the nodes to which rays that go on from nodes lead. `kind`: CASTOR_NODE_REFLECTION, CASTOR_NODE_REFRACTION.
CASTOR_INLINE Whole LANES(next_node)(const Whole node, const uint kind)
{
    return LANES(combine_hashes)(node, (Whole)(kind));
}
CASTOR_INLINE Whole LANES(dimension_of_node)(const Whole node, const uint dimension)
{
    return LANES(combine_hashes)(node, (Whole)(dimension));
}

// Draws the points of the unit square that one sample of each pixel has in `count` dimensions, a constant. A point is a
// long chain of instructions, each of which waits for the one before: those of several dimensions go side by side.
CASTOR_INLINE void LANES(sample_dimensions)(const Whole pixel, const Whole sample, const uint seed,
                                            const Whole *dimension, const uint count, LANES(Points) * point)
{
    const Whole of_pixel = LANES(combine_hashes)(LANES(hash_uint)((Whole)(seed)), pixel);
    const Whole reversed = LANES(reverse_bits)(sample);
    Whole pixel_seed[CASTOR_MOST_DIMENSIONS], index[CASTOR_MOST_DIMENSIONS];  // in registers, with loops unrolled
#pragma unroll
    for (uint i = 0; i < count; ++i) pixel_seed[i] = LANES(combine_hashes)(of_pixel, dimension[i]);
#pragma unroll
    for (uint i = 0; i < count; ++i) index[i] = LANES(owen_scramble_reversed)(reversed, pixel_seed[i]);
#pragma unroll
    for (uint i = 0; i < count; ++i)
        point[i].x = LANES(unit_float)(
            LANES(owen_scramble_reversed)(index[i], LANES(combine_hashes)(pixel_seed[i], (Whole)(1))));
#pragma unroll
    for (uint i = 0; i < count; ++i)
        point[i].y = LANES(unit_float)(LANES(owen_scramble_reversed)(LANES(sobol_second_reversed)(index[i]),
                                                                     LANES(combine_hashes)(pixel_seed[i], (Whole)(2))));
}

// Returns the points of one dimension.
CASTOR_INLINE LANES(Points)
    LANES(sample_dimension)(const Whole pixel, const Whole sample, const uint seed, const Whole dimension)
{
    LANES(Points) point;
    LANES(sample_dimensions)(pixel, sample, seed, &dimension, 1, &point);
    return point;
}

// The points by which samples lie in their pixels.
CASTOR_INLINE LANES(Points) LANES(sample_square)(const Whole pixel, const Whole sample, const uint seed)
{
    return LANES(sample_dimension)(pixel, sample, seed, (Whole)(CASTOR_DIMENSION_PIXEL));
}
