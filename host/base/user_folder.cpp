#include "base/user_folder.h"

#include <cstdlib>
#include <optional>

namespace castor {

namespace fs = std::filesystem;

fs::path user_folder(const char* own, const char* xdg, std::string_view home_folder, std::string_view name) {
    const auto variable = [](const char* variable_name) {
        const char* value = std::getenv(variable_name);
        return value ? std::optional<fs::path>(value) : std::nullopt;
    };
    if (const auto folder = variable(own)) return folder->empty() ? fs::path() : *folder / name;
    if (const auto folder = variable(xdg); folder && folder->is_absolute()) return *folder / "castor" / name;
    if (const auto home = variable("HOME"); home && home->is_absolute()) return *home / home_folder / "castor" / name;
    return {};
}

}  // namespace castor
