#include "picture_files.h"

#include "castor/image_io.h"

namespace castor::cli {

namespace fs = std::filesystem;

fs::path plane_file(const fs::path& picture, const std::string& plane) {
    fs::path name = picture.stem();
    name += "." + plane + ".exr";
    return picture.parent_path() / name;
}

Json write_picture(const fs::path& picture, const Film& film, RuleSet rules) {
    write_image(picture, film, {quantization(rules)});
    Json planes = Json::array();
    for (const FilmPlane& plane : film.planes) {
        const fs::path file = plane_file(picture, plane.name);
        write_plane(file, film, plane);
        planes.push_back({{"name", plane.name}, {"file", fs::absolute(file).string()}});
    }
    return planes;
}

}  // namespace castor::cli
