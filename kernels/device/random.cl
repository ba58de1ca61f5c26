// Sample points: a function of pixel, sample number and seed alone, made of integers.
// Owen-scrambled Sobol points by hashing (Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4)): each pixel
// has its own scrambling, and every power of two of consecutive samples is well spread.
#include "castor/shared/layout.h"

// Hashes 32 bits (Wellons 2018, "Prospecting for Hash Functions", lowbias32).
CASTOR_INLINE uint hash_uint(uint x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

CASTOR_INLINE uint combine_hashes(const uint seed, const uint value)
{
    return hash_uint(seed ^ (value + 0x9e3779b9u + (seed << 6) + (seed >> 2)));
}

CASTOR_INLINE uint reverse_bits(uint x)
{
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

// Flips each bit by a hash of the bits below it (Laine, Karras 2011, with Burley's constants).
CASTOR_INLINE uint laine_karras_permutation(uint x, const uint seed)
{
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

CASTOR_INLINE uint owen_scramble(const uint x, const uint seed)
{
    return reverse_bits(laine_karras_permutation(reverse_bits(x), seed));
}

// Computes the second dimension of the Sobol sequence; the first is reverse_bits.
CASTOR_INLINE uint sobol_second(uint index)
{
    uint x = 0;
    for (uint direction = 0x80000000u; index; index >>= 1) {
        if (index & 1) x ^= direction;
        direction ^= direction >> 1;
    }
    return x;
}

// Maps 32 bits to [0, 1), exactly.
CASTOR_INLINE float unit_float(const uint x) { return (float)(x >> 8) * 0x1p-24f; }

// Returns the point of a sample in the unit square.
CASTOR_INLINE float2 sample_square(const uint pixel, const uint sample, const uint seed)
{
    const uint pixel_seed = combine_hashes(combine_hashes(hash_uint(seed), pixel), 0x51633e2du);
    const uint index = owen_scramble(sample, pixel_seed);
    const uint x = owen_scramble(reverse_bits(index), combine_hashes(pixel_seed, 1));
    const uint y = owen_scramble(sobol_second(index), combine_hashes(pixel_seed, 2));
    return (float2)(unit_float(x), unit_float(y));
}
