#include "scene/named_files.h"

#include <fmt/format.h>

#include "castor/error.h"
#include "castor/image_io.h"

namespace castor {

bool leads_out_of(const std::filesystem::path& folder, const std::filesystem::path& file) {
    std::error_code error;
    const std::filesystem::path base =
        std::filesystem::absolute(folder.empty() ? "." : folder, error).lexically_normal();
    const std::filesystem::path relative =
        std::filesystem::absolute(file, error).lexically_normal().lexically_relative(base);
    return error || relative.empty() || *relative.begin() == "..";
}

Image read_named_picture(const std::filesystem::path& file, std::string& problem) {
    try {
        return read_image(file);
    } catch (const Error& error) {
        problem = fmt::format("{}: a checkerboard of magenta and black takes its place", error.what());
    }
    return {file.string(), 2, 2, {255, 0, 255, 0, 0, 0, 0, 0, 0, 255, 0, 255}, {}};
}

}  // namespace castor
