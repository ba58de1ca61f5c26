#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "castor/api.h"
#include "castor/device.h"
#include "castor/film.h"

namespace castor {

/// What removes noise from a picture.
enum class Denoiser {
    castor,  // denoise: the same bits on every device
    oidn,    // denoise_by_oidn: Open Image Denoise, where it is installed
};
/// "castor", "oidn".
CASTOR_API std::string_view to_string(Denoiser denoiser);
CASTOR_API Denoiser denoiser_from_string(std::string_view word);

/// The planes that a denoiser reads: `denoise` "variance", "mean-albedo", "mean-normal" and "mean-position",
/// `denoise_by_oidn` "mean-albedo" and "mean-normal".
CASTOR_API const std::vector<std::string>& denoiser_planes(Denoiser denoiser = Denoiser::castor);

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

/// The version of Open Image Denoise that `denoise_by_oidn` uses, as the library itself counts: 10403 is 1.4.3.
///
/// Castor is built without it, and looks for it in each call: for the file that the environment variable
/// CASTOR_OIDN_LIBRARY names; where that is not set or empty, for libOpenImageDenoise.so.2, .so.1 and .so where the
/// system looks for libraries. Throws UsageError where there is none, it cannot be loaded, is older than 1.4.0, lacks a
/// function, or cannot run on this CPU: to be asked before a long render.
CASTOR_API std::uint32_t oidn_version();

/// Removes noise from the film's pixels by Open Image Denoise, on the CPU: by its filter "RT" for unlimited values.
/// Albedo and normal go through the filter first, each by itself, since they are noisy too where lenses, motion or
/// textures are; the picture is then filtered with `cleanAux`. Planes stay as they are. Returns the version. Pixels
/// that are NaN or infinite become what the library makes of them.
///
/// The bits depend on the version of the library, and may depend on the CPU. Throws UsageError as `oidn_version`, or
/// where the film lacks one of the denoiser_planes, or has another number of values in it; DeviceError where the
/// library reports an error or memory is short. The film is then as it was.
CASTOR_API std::uint32_t denoise_by_oidn(Film& film);

}  // namespace castor
