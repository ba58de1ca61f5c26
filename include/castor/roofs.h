#pragma once

#include "castor/api.h"
#include "castor/device.h"

namespace castor {

/// The measured limits of a device: no kernel is faster than both roofs allow (Williams, Waterman, Patterson 2009,
/// "Roofline").
struct Roofs {
    double bytes_per_second = 0.0;  // memory outside caches, read and written, counted as in STREAM's triad
    double flops_per_second = 0.0;  // single precision, an fma is two
};

/// Measures both roofs in less than a second: the best of several short runs. Throws DeviceError, also if they compute
/// something wrong.
CASTOR_API Roofs measure_roofs(const Device& device);

}  // namespace castor
