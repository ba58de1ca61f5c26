// CASTOR_LANES pixels of a row a work-item (see lanes.cl). One level of an edge-avoiding wavelet transform: each pixel
// becomes the weighted mean of 5x5 pixels, `step` apart (Dammertz, Sewtz, Hanika, Lensch 2010, "Edge-Avoiding À-Trous
// Wavelet Transform for fast Global Illumination Filtering"), where the weights look at the variance of the pixels
// (Schied and others 2017, "Spatiotemporal Variance-Guided Filtering", section 4.4). Levels with steps 1, 2, 4, 8 and
// 16 follow one another.
//
// The picture has a margin of CASTOR_DENOISE_MARGIN pixels on all sides, which are not valid; `row_length` floats are a
// row with its margins, and `plane_length` floats a plane. Planes of `features`: CASTOR_DENOISE_NORMAL ... Planes of
// `before` and `after`: red, green and blue of the light without the surface's albedo, and the variance of its
// luminance. Where the variance is negative, the pixel is not valid: it counts for no other, and gets the mean of
// others that are.
#include "castor/shared/denoise_planes.h"
#include "device/vector.lanes.cl"

// How far a pixel may differ before its weight falls: see weight_of_distance.
#define CASTOR_DENOISE_DEVIATIONS 4.0f  // of the luminance, in standard deviations
#define CASTOR_DENOISE_ALBEDO 4.0f      // factor of the squared difference

// Returns a weight for a squared distance, (1 - x/16)^16, which is close to e^-x, and 0 from 14 on: no weight is so
// small that a device may take it for zero.
CASTOR_INLINE Real LANES(weight_of_distance)(const Real x)
{
    const Real base = fma(x, (Real)(-0.0625f), (Real)(1.0f));
    const Real square = base * base, fourth = square * square, eighth = fourth * fourth;
    return base > 0.125f ? eighth * eighth : (Real)(0.0f);
}

// The light and its variance at some pixels.
typedef struct LANES(Lights) {
    LANES(Vectors) rgb;
    Real luminance;
    Real variance;
} LANES(Lights);

CASTOR_INLINE LANES(Vectors) LANES(load_planes)(const global float *at, const uint plane_length)
{
    return LANES(vectors)(LANES(load_real_column)(at), LANES(load_real_column)(at + plane_length),
                          LANES(load_real_column)(at + 2 * (size_t)plane_length));
}

CASTOR_INLINE LANES(Lights) LANES(load_lights)(const global float *at, const uint plane_length)
{
    LANES(Lights) lights;
    lights.rgb = LANES(load_planes)(at, plane_length);
    lights.luminance = fma(lights.rgb.x, (Real)(0.2126f), fma(lights.rgb.y, (Real)(0.7152f), 0.0722f * lights.rgb.z));
    lights.variance = LANES(load_real_column)(at + 3 * (size_t)plane_length);
    return lights;
}

// Returns the variance of a pixel, or the mean of the valid ones among 3x3, weighted by 4, 2 and 1, if that is larger:
// what one pixel knows of its variance is itself noise.
CASTOR_INLINE Real LANES(likely_variance)(const global float *variance, const uint row_length)
{
    Real sum = (Real)(0.0f), weights = (Real)(0.0f);
    for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
            const Real value = LANES(load_real_column)(variance + y * (int)row_length + x);
            const Real weight = value >= 0.0f ? (Real)((float)((2 - abs(x)) * (2 - abs(y)))) : (Real)(0.0f);
            sum = fma(weight, value >= 0.0f ? value : (Real)(0.0f), sum);
            weights += weight;
        }
    }
    const Real mean = LANES(divide)(sum, weights > 0.0f ? weights : (Real)(1.0f));
    const Real own = LANES(load_real_column)(variance);
    return own > mean ? own : mean;
}

kernel CASTOR_IN_LANES void LANES(denoise_level)(const uint width, const uint height, const uint row_length,
                                                 const uint plane_length, const uint step,
                                                 const global float *restrict features,
                                                 const global float *restrict before, global float *restrict after)
{
    const uint items_a_row = (width + CASTOR_LANES - 1) / CASTOR_LANES;
    const uint row = get_global_id(0) / items_a_row, column = get_global_id(0) % items_a_row * CASTOR_LANES;
    if (row >= height) return;
    const size_t place = (size_t)(row + CASTOR_DENOISE_MARGIN) * row_length + CASTOR_DENOISE_MARGIN + column;

    const LANES(Lights) own = LANES(load_lights)(before + place, plane_length);
    const global float *const normals = features + CASTOR_DENOISE_NORMAL * (size_t)plane_length + place;
    const global float *const positions = features + CASTOR_DENOISE_POSITION * (size_t)plane_length + place;
    const global float *const albedos = features + CASTOR_DENOISE_ALBEDO_RGB * (size_t)plane_length + place;
    const LANES(Vectors) normal = LANES(load_planes)(normals, plane_length);
    const LANES(Vectors) position = LANES(load_planes)(positions, plane_length);
    const LANES(Vectors) albedo = LANES(load_planes)(albedos, plane_length);
    const Real normal_factor =
        LANES(load_real_column)(features + CASTOR_DENOISE_NORMAL_FACTOR * (size_t)plane_length + place);
    const Real distance_factor =
        LANES(load_real_column)(features + CASTOR_DENOISE_DISTANCE_FACTOR * (size_t)plane_length + place);
    const Mask is_valid = own.variance >= 0.0f;
    // A deviation that is small beside the luminance is allowed where there is no variance.
    const Real variance = LANES(likely_variance)(before + 3 * (size_t)plane_length + place, row_length);
    const Real allowed = fma((Real)(CASTOR_DENOISE_DEVIATIONS * CASTOR_DENOISE_DEVIATIONS), variance,
                             fma(own.luminance * 1e-8f, own.luminance, (Real)(1e-20f)));
    const Real luminance_factor = is_valid ? LANES(divide)((Real)(1.0f), allowed) : (Real)(0.0f);

    const float spline[3] = {0.375f, 0.25f, 0.0625f};
    const Real zero = (Real)(0.0f);
    LANES(Vectors) change = LANES(vectors)(zero, zero, zero);
    Real weights = (Real)(0.0f), squares = (Real)(0.0f);
    for (int y = -2; y <= 2; ++y) {
        for (int x = -2; x <= 2; ++x) {
            const long offset = (long)(y * (int)step) * row_length + x * (int)step;
            const LANES(Lights) other = LANES(load_lights)(before + place + offset, plane_length);
            const LANES(Vectors) turned =
                LANES(difference_of_vectors)(LANES(load_planes)(normals + offset, plane_length), normal);
            const LANES(Vectors) way =
                LANES(difference_of_vectors)(LANES(load_planes)(positions + offset, plane_length), position);
            const LANES(Vectors) coloured =
                LANES(difference_of_vectors)(LANES(load_planes)(albedos + offset, plane_length), albedo);
            const Real brighter = other.luminance - own.luminance;
            const Real above = LANES(dot_products)(normal, way);  // the plane of the pixel's surface
            Real distance = luminance_factor * brighter * brighter;
            distance = fma(normal_factor, LANES(dot_products)(turned, turned), distance);
            distance = fma(distance_factor * above, above, distance);
            distance = fma((Real)(CASTOR_DENOISE_ALBEDO), LANES(dot_products)(coloured, coloured), distance);
            const Real weight = other.variance >= 0.0f
                                    ? spline[abs(x)] * spline[abs(y)] * LANES(weight_of_distance)(distance)
                                    : (Real)(0.0f);
            const LANES(Vectors) difference = LANES(difference_of_vectors)(other.rgb, own.rgb);
            change = LANES(sum_of_vectors)(change, LANES(scaled_vectors)(difference, weight));
            weights += weight;
            squares = fma(weight * weight, other.variance, squares);
        }
    }
    // Of differences, so that what is equal stays as it is.
    const Mask has_any = weights > 0.0f;
    const Real inverse = LANES(divide)((Real)(1.0f), has_any ? weights : (Real)(1.0f));
    const Mask is_pixel = column + LANES(lane_numbers)() < width;
    const Mask is_known = has_any & is_pixel;
    const LANES(Vectors) mean = LANES(sum_of_vectors)(own.rgb, LANES(scaled_vectors)(change, inverse));
    LANES(store_real_column)(is_known ? mean.x : zero, after + place);
    LANES(store_real_column)(is_known ? mean.y : zero, after + place + plane_length);
    LANES(store_real_column)(is_known ? mean.z : zero, after + place + 2 * (size_t)plane_length);
    LANES(store_real_column)
    (is_known ? squares * inverse * inverse : (Real)(-1.0f), after + place + 3 * (size_t)plane_length);
}
