// Gradient noise (Perlin 2002, "Improving Noise"): a smooth function of points, 0 at all points with whole coordinates,
// with values in [-1, 1] and a mean of 0. The value is an exact function of the point, so that it is the same on every
// device; lattice points are numbered modulo 256.
#include "castor/shared/constants.h"
#include "castor/shared/layout.h"
#include "device/elementary.x1.cl"

// Perlin's own permutation of 0 to 255.
// clang-format off
constant uchar noise_permutation[256] = {
    151, 160, 137,  91,  90,  15, 131,  13, 201,  95,  96,  53, 194, 233,   7, 225,
    140,  36, 103,  30,  69, 142,   8,  99,  37, 240,  21,  10,  23, 190,   6, 148,
    247, 120, 234,  75,   0,  26, 197,  62,  94, 252, 219, 203, 117,  35,  11,  32,
     57, 177,  33,  88, 237, 149,  56,  87, 174,  20, 125, 136, 171, 168,  68, 175,
     74, 165,  71, 134, 139,  48,  27, 166,  77, 146, 158, 231,  83, 111, 229, 122,
     60, 211, 133, 230, 220, 105,  92,  41,  55,  46, 245,  40, 244, 102, 143,  54,
     65,  25,  63, 161,   1, 216,  80,  73, 209,  76, 132, 187, 208,  89,  18, 169,
    200, 196, 135, 130, 116, 188, 159,  86, 164, 100, 109, 198, 173, 186,   3,  64,
     52, 217, 226, 250, 124, 123,   5, 202,  38, 147, 118, 126, 255,  82,  85, 212,
    207, 206,  59, 227,  47,  16,  58,  17, 182, 189,  28,  42, 223, 183, 170, 213,
    119, 248, 152,   2,  44, 154, 163,  70, 221, 153, 101, 155, 167,  43, 172,   9,
    129,  22,  39, 253,  19,  98, 108, 110,  79, 113, 224, 232, 178, 185, 112, 104,
    218, 246,  97, 228, 251,  34, 242, 193, 238, 210, 144,  12, 191, 179, 162, 241,
     81,  51, 145, 235, 249,  14, 239, 107,  49, 192, 214,  31, 181, 199, 106, 157,
    184,  84, 204, 176, 115, 121,  50,  45, 127,   4, 150, 254, 138, 236, 205,  93,
    222, 114,  67,  29,  24,  72, 243, 141, 128, 195,  78,  66, 215,  61, 156, 180};
// clang-format on

CASTOR_INLINE uint permuted(const uint number) { return noise_permutation[number & 255u]; }

// Returns the slope of the plane through a lattice point, to one of twelve edges of a cube, and its value at `from`,
// which counts from that point.
CASTOR_INLINE float4 noise_plane(const uint hash, const float3 from)
{
    const uint h = hash & 15u;
    const float first = h & 1u ? -1.0f : 1.0f;
    const float second = h & 2u ? -1.0f : 1.0f;
    const uint is_y_first = h >= 8u;
    const uint is_y_second = h < 4u;
    const uint is_x_second = h == 12u || h == 14u;
    float4 plane;
    plane.x = (is_y_first ? 0.0f : first) + (is_x_second ? second : 0.0f);
    plane.y = (is_y_first ? first : 0.0f) + (is_y_second ? second : 0.0f);
    plane.z = is_y_second || is_x_second ? 0.0f : second;
    plane.w = plane.x * from.x + plane.y * from.y + plane.z * from.z;
    return plane;
}

// Returns a + t (b - a), a slope and a value.
CASTOR_INLINE float4 between_planes(const float4 a, const float4 b, const float t)
{
    return fma((float4)(t), b - a, a);
}

// 6 t^5 - 15 t^4 + 10 t^3, and its slope.
CASTOR_INLINE float noise_fade(const float t) { return t * t * t * fma(t, fma(t, 6.0f, -15.0f), 10.0f); }
CASTOR_INLINE float noise_fade_slope(const float t) { return 30.0f * t * t * fma(t, t - 2.0f, 1.0f); }

// Splits a coordinate into the lower lattice point's, modulo 256, and the rest. All steps are exact. Floats from 2^31
// on are multiples of 256; infinite ones count as such.
CASTOR_INLINE uint lattice_number(const float x, float *rest)
{
    const float within = fabs(x) < 2147483648.0f ? x - 256.0f * rounded_down(x * 0.00390625f) : 0.0f;
    const float whole = rounded_down(within);
    *rest = within - whole;
    return convert_uint(whole) & 255u;
}

// Returns the slope (x, y, z) of the noise, and its value (w).
CASTOR_INLINE float4 gradient_noise(const float3 point)
{
    float fx, fy, fz;
    const uint x = lattice_number(point.x, &fx);
    const uint y = lattice_number(point.y, &fy);
    const uint z = lattice_number(point.z, &fz);
    const float tx = noise_fade(fx), ty = noise_fade(fy), tz = noise_fade(fz);
    const float sx = noise_fade_slope(fx), sy = noise_fade_slope(fy), sz = noise_fade_slope(fz);
    float4 layers[2];
    for (uint k = 0; k < 2; ++k) {
        float4 rows[2];
        for (uint j = 0; j < 2; ++j) {
            const float3 from = (float3)(fx, fy - j, fz - k);
            const float4 a = noise_plane(permuted(permuted(permuted(x) + y + j) + z + k), from);
            const float4 b =
                noise_plane(permuted(permuted(permuted(x + 1u) + y + j) + z + k), from - (float3)(1.0f, 0.0f, 0.0f));
            rows[j] = between_planes(a, b, tx);
            rows[j].x = fma(sx, b.w - a.w, rows[j].x);
        }
        layers[k] = between_planes(rows[0], rows[1], ty);
        layers[k].y = fma(sy, rows[1].w - rows[0].w, layers[k].y);
    }
    float4 noise = between_planes(layers[0], layers[1], tz);
    noise.z = fma(sz, layers[1].w - layers[0].w, noise.z);
    return noise;
}

// Returns the sum over k of noise(2^k point) / 2^k, divided by the sum of 1 / 2^k so that it stays in [-1, 1], and its
// slope.
CASTOR_INLINE float4 noise_of_octaves(const float3 point, const uint octaves)
{
    float4 sum = (float4)(0.0f);
    float frequency = 1.0f, amplitude = 1.0f, amplitudes = 0.0f;
    for (uint octave = 0; octave < octaves; ++octave) {
        const float4 noise = gradient_noise(point * frequency);
        // The slope of noise(2^k point) / 2^k is that of noise itself.
        sum += noise * (float4)(1.0f, 1.0f, 1.0f, amplitude);
        amplitudes += amplitude;
        amplitude *= 0.5f;
        frequency *= 2.0f;
    }
    return sum * divide(1.0f, amplitudes);
}
