#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "castor/scene.h"

namespace castor::cli {

/// A tone map and the file of its picture.
struct ToneMappedFile {
    std::filesystem::path file;
    ToneMap tone_map;
};

/// A camera, by its number in the scene from 1 on, and the files of its picture.
struct Picture {
    std::size_t camera_number = 1;
    std::filesystem::path file;
    std::vector<ToneMappedFile> tone_mapped{};
};

/// Names one picture for each camera. `output` is the argument of -o:
/// - empty or a folder (an existing one, or one that ends with '/'): the camera's image name without its folder, in
/// that
///   folder; without a usable image name, the scene's stem and .png, with the camera's number if there are several;
/// - a file: that file, with the camera's number before the extension if there are several.
///
/// Names that would be equal, or would have equal stems if `stems_must_differ`, get the camera's number. Warns of every
/// name that is changed. Throws UsageError if `output` has no known extension.
std::vector<Picture> name_pictures(const Scene& scene, const std::vector<std::size_t>& camera_numbers,
                                   const std::string& output, bool stems_must_differ, std::vector<Warning>& warnings);

/// Names a picture for each tone map: the picture's stem and the map's extension, and .png where that names no format
/// of 8 bits. Where the picture itself has 8 bits a channel, it is the first map's. Equal names get numbers.
std::vector<ToneMappedFile> name_tone_mapped(const std::filesystem::path& picture,
                                             const std::vector<ToneMap>& tone_maps);

/// Returns whether `output` names a folder.
bool is_folder(const std::string& output);

}  // namespace castor::cli
