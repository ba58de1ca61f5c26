#include "scene/xml_files.h"

#include <fmt/format.h>

#include "scene/named_files.h"

namespace castor {

std::filesystem::path path_beside(const XmlDocument& document, std::string_view name) {
    return document.file().parent_path() / name;
}

void warn_if_outside(XmlDocument& document, const char* where, const std::filesystem::path& file,
                     std::string_view naming) {
    if (leads_out_of(document.file().parent_path(), file))
        document.warn(where,
                      fmt::format("the file '{}' that {} names is not in the scene's folder", file.string(), naming));
}

std::uintmax_t size_or_zero(const std::filesystem::path& file) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    return error ? 0 : size;
}

}  // namespace castor
