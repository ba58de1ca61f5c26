// One elementary function, chosen by its place in the list of elementary_test.cpp.
#include "device/elementary.cl"

kernel void elementary_test(const uint count, const uint function, const global float *restrict x,
                            const global float *restrict y, global float *restrict results)
{
    const uint i = get_global_id(0);
    if (i >= count) return;
    float result = NAN;
    switch (function) {
        case 0:
            result = sine(x[i]);
            break;
        case 1:
            result = cosine(x[i]);
            break;
        case 2:
            result = arc_sine(x[i]);
            break;
        case 3:
            result = arc_cosine(x[i]);
            break;
        case 4:
            result = exponential(x[i]);
            break;
        case 5:
            result = exponential2(x[i]);
            break;
        case 6:
            result = logarithm(x[i]);
            break;
        case 7:
            result = logarithm2(x[i]);
            break;
        case 8:
            result = power(x[i], y[i]);
            break;
        case 9:
            result = arc_tangent2(x[i], y[i]);
            break;
    }
    results[i] = result;
}
