#include "scene/xml_files.h"

#include <fmt/format.h>

namespace castor {

namespace {

/// Returns whether a path leads out of a folder by its text; links are not followed.
bool leaves(const std::filesystem::path& path, const std::filesystem::path& folder) {
    std::error_code error;
    const std::filesystem::path base =
        std::filesystem::absolute(folder.empty() ? "." : folder, error).lexically_normal();
    const std::filesystem::path relative =
        std::filesystem::absolute(path, error).lexically_normal().lexically_relative(base);
    return error || relative.empty() || *relative.begin() == "..";
}

}  // namespace

std::filesystem::path path_beside(const XmlDocument& document, std::string_view name) {
    return document.file().parent_path() / name;
}

void warn_if_outside(XmlDocument& document, const char* where, const std::filesystem::path& file,
                     std::string_view naming) {
    if (leaves(file, document.file().parent_path()))
        document.warn(where,
                      fmt::format("the file '{}' that {} names is not in the scene's folder", file.string(), naming));
}

std::uintmax_t size_or_zero(const std::filesystem::path& file) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    return error ? 0 : size;
}

}  // namespace castor
