#pragma once

#include <string>
#include <vector>

#include "castor/api.h"
#include "castor/device.h"
#include "castor/film.h"

namespace castor {

/// The planes that `denoise` reads: "variance", "mean-albedo", "mean-normal" and "mean-position".
CASTOR_API const std::vector<std::string>& denoiser_planes();

/// Removes noise from the film's pixels: five levels of an edge-avoiding wavelet transform (Dammertz and others 2010)
/// of the light without the surfaces' albedo, guided by variance, albedo, normal and position of the pixels (Schied and
/// others 2017). Planes stay as they are. The result has the same bits on every device. Pixels that are NaN, infinite
/// or beyond 1e15 times their albedo become the mean of those around them that belong to the same surface, and stay as
/// they are where there are none within 62 pixels. What is equal to all that it is compared with does not change.
///
/// The first of `devices` does the work; one that fails is followed by the next. Throws UsageError where there is no
/// device, or the film lacks one of denoiser_planes(), or has another number of values in it; DeviceError of the last
/// device.
CASTOR_API void denoise(Film& film, const std::vector<Device>& devices);

}  // namespace castor
