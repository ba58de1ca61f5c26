#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "castor/api.h"
#include "castor/film.h"
#include "castor/renderer.h"
#include "castor/scene.h"

namespace castor {

/// What checkpoints of one picture hold together.
struct MergedPicture {
    Film film;  // pixels that are not done have the means of the samples so far, or (0, 0, 0)
    RuleSet rules = RuleSet::r2022;
    std::uint64_t samples_done = 0;    // of all pixels
    std::uint64_t samples_spared = 0;  // of those that are done: see RenderOptions::noise
    std::vector<ToneMap> tone_maps{};  // the camera's
    bool is_denoised = false;          // see merge_checkpoints
    std::uint32_t oidn_version = 0;    // of what removed noise (denoise.h); 0: it was Castor, or noise was not removed

    /// The samples that the picture will have at most.
    std::uint64_t samples() const {
        return std::uint64_t{film.width} * film.height * film.samples_per_pixel - samples_spared;
    }
};

/// Joins checkpoints of one picture: of its parts (RenderOptions::part), or of renders that were ended early, in any
/// order and number. Of each block the one with more samples counts, so that joining is commutative, associative and
/// idempotent. `merged`, if it is not empty, is written: a checkpoint to go on from. Where the picture was rendered
/// with RenderOptions::denoise and is complete, noise is removed, unless `removes_noise` is false: by its denoiser,
/// Castor's own on the first of `devices` that can; where there are none, on what select_devices gives.
///
/// Throws UsageError where there is no file, or noise is to be removed by Open Image Denoise and there is none;
/// SceneError where a file is missing, damaged, or of another scene, view, options or version than the first, with what
/// differs; DeviceError where two hold the same block with as many samples and other bits, with the pixel, both values
/// and both files, or where noise cannot be removed; FileError where `merged` cannot be written.
CASTOR_API MergedPicture merge_checkpoints(const std::vector<std::filesystem::path>& files,
                                           const std::filesystem::path& merged = {},
                                           const std::vector<Device>& devices = {}, bool removes_noise = true);

}  // namespace castor
