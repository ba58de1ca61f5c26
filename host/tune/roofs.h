#pragma once

#include "castor/device.h"

namespace castor {

/// What a device can do at most: no kernel is faster than both of its roofs allow (Williams, Waterman, Patterson 2009,
/// "Roofline").
struct Roofs {
    double bytes_per_second = 0.0;  // of memory that no cache holds, read and written, as STREAM's triad counts them
    double flops_per_second = 0.0;  // single precision, an fma is two
};

/// Measures both, in less than a second: the best of several short runs of kernels/bench/triad.cl and fma_chains.cl.
/// Throws DeviceError, also where they compute something wrong.
Roofs measure_roofs(const Device& device);

}  // namespace castor
