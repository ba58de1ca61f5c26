#include "picture_files.h"

#include "castor/image_io.h"
#include "castor/tone_map.h"

namespace castor::cli {

namespace fs = std::filesystem;

fs::path plane_file(const fs::path& picture, const std::string& plane) {
    fs::path name = picture.stem();
    name += "." + plane + ".exr";
    return picture.parent_path() / name;
}

FurtherFiles write_picture(const Picture& picture, const Film& film, RuleSet rules, PlaneFiles planes) {
    FurtherFiles written;
    const auto& tone_mapped = picture.tone_mapped;
    const bool has_layers = planes == PlaneFiles::layers;
    if (has_layers)
        write_layers(picture.file, film);
    else if (tone_mapped.empty() || tone_mapped.front().file != picture.file)
        write_image(picture.file, film, {quantization(rules)});
    for (const ToneMappedFile& file : tone_mapped) {
        write_image(file.file, apply_tone_map(film, file.tone_map));
        written.tone_mapped.push_back(fs::absolute(file.file).string());
    }
    for (const FilmPlane& plane : film.planes) {
        const fs::path file = has_layers ? picture.file : plane_file(picture.file, plane.name);
        if (!has_layers) write_plane(file, film, plane);
        written.planes.push_back({{"name", plane.name}, {"file", fs::absolute(file).string()}});
    }
    return written;
}

}  // namespace castor::cli
