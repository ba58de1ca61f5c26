#pragma once

#include <filesystem>
#include <string_view>

namespace castor {

/// Where files of one kind are kept for a user: NAME/ in the folder that the environment variable `own` names, or else
/// in castor/ of the folder that `xdg` names (where that is absolute, as the XDG Base Directory Specification has it),
/// or of ~/HOME_FOLDER. Empty where `own` is set and empty, or there is no home.
std::filesystem::path user_folder(const char* own, const char* xdg, std::string_view home_folder,
                                  std::string_view name);

}  // namespace castor
