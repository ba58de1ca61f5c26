#include "picture_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "castor/error.h"
#include "castor/image_io.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

std::string stem_of_scene(const Scene& scene) {
    const std::string stem = fs::path(scene.file).stem().string();
    return stem.empty() ? "scene" : stem;
}

/// Returns "a-2.png" for "a.png" and 2.
fs::path with_number(const fs::path& file, std::size_t number) {
    fs::path name = file.stem();
    name += fmt::format("-{}", number);
    name += file.extension();
    return file.parent_path() / name;
}

bool has_8_bits(const fs::path& file) {
    std::string extension = file.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    return extension == ".png" || extension == ".ppm";
}

bool has_known_extension(const fs::path& file) {
    try {
        check_image_extension(file);
        return true;
    } catch (const UsageError&) {
        return false;
    }
}

/// Returns the picture's file name. A scene may choose the name, but not the folder.
fs::path name_of(const Scene& scene, std::size_t number, bool several, std::vector<Warning>& warnings) {
    const Camera& camera = scene.cameras[number - 1];
    const fs::path wanted = fs::path(camera.image_name).filename();
    if (!wanted.empty() && has_known_extension(wanted)) {
        if (wanted != camera.image_name)
            warnings.push_back({scene.file, camera.line,
                                fmt::format("the folder of the image name \"{}\" is left out", camera.image_name)});
        return wanted;
    }
    const std::string fallback = stem_of_scene(scene) + (several ? fmt::format("-{}", number) : "") + ".png";
    if (!camera.image_name.empty())
        warnings.push_back(
            {scene.file, camera.line,
             fmt::format("the image name \"{}\" has no known extension; {} is used", camera.image_name, fallback)});
    return fallback;
}

/// Adds numbers to names that occur more than once, so that no picture replaces another.
void make_unique(std::vector<Picture>& pictures, bool stems_must_differ, const Scene& scene,
                 std::vector<Warning>& warnings) {
    const auto key = [&](const fs::path& file) {
        return stems_must_differ ? file.stem().string() : file.filename().string();
    };
    std::map<std::string, int> uses;
    for (const Picture& picture : pictures) ++uses[key(picture.file)];
    std::set<std::string> taken;
    for (const auto& [name, count] : uses)
        if (count == 1) taken.insert(name);
    for (Picture& picture : pictures) {
        if (uses[key(picture.file)] == 1) continue;
        const fs::path wanted = picture.file;
        do picture.file = with_number(picture.file, picture.camera_number);
        while (!taken.insert(key(picture.file)).second);
        warnings.push_back(
            {scene.file, scene.cameras[picture.camera_number - 1].line,
             fmt::format("several pictures would be named {}; that of camera {} is {}", wanted.filename().string(),
                         picture.camera_number, picture.file.filename().string())});
    }
}

}  // namespace

bool is_folder(const std::string& output) {
    std::error_code ignored;
    return !output.empty() && (output.back() == '/' || fs::is_directory(output, ignored));
}

std::vector<ToneMappedFile> name_tone_mapped(const fs::path& picture, const std::vector<ToneMap>& tone_maps) {
    std::vector<ToneMappedFile> files;
    std::set<fs::path> taken{picture};
    for (const ToneMap& map : tone_maps) {
        // A scene may choose the end of the name, but not the folder.
        fs::path name = picture.stem();
        name += fs::path(map.extension).filename();
        if (!has_8_bits(name)) name += ".png";
        fs::path file = files.empty() && has_8_bits(picture) ? picture : picture.parent_path() / name;
        if (file != picture)
            for (std::size_t number = 2; !taken.insert(file).second; ++number)
                file = with_number(picture.parent_path() / name, number);
        files.push_back({file, map});
    }
    return files;
}

std::vector<Picture> name_pictures(const Scene& scene, const std::vector<std::size_t>& camera_numbers,
                                   const std::string& output, bool stems_must_differ, std::vector<Warning>& warnings) {
    const bool several = camera_numbers.size() > 1;
    std::vector<Picture> pictures;
    const bool has_tone_maps = std::any_of(camera_numbers.begin(), camera_numbers.end(), [&](std::size_t number) {
        return !scene.cameras[number - 1].tone_maps.empty();
    });
    const auto add_tone_mapped = [&] {
        for (Picture& picture : pictures)
            picture.tone_mapped = name_tone_mapped(picture.file, scene.cameras[picture.camera_number - 1].tone_maps);
    };
    if (output.empty() || is_folder(output)) {
        for (const std::size_t number : camera_numbers)
            pictures.push_back({number, fs::path(output) / name_of(scene, number, scene.cameras.size() > 1, warnings)});
        make_unique(pictures, stems_must_differ || has_tone_maps, scene, warnings);
        add_tone_mapped();
        return pictures;
    }
    check_image_extension(output);
    for (const std::size_t number : camera_numbers)
        pictures.push_back({number, several ? with_number(output, number) : fs::path(output)});
    add_tone_mapped();
    return pictures;
}

}  // namespace castor::cli
