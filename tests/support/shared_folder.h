#pragma once

#include <cstdlib>
#include <filesystem>

#include "test_paths.h"

namespace castor::test {

/// Where reference files that are not part of the project may lie: CASTOR_SHARED_DIR, else beside the source tree.
/// Tests that need it must do without.
inline std::filesystem::path shared_folder() {
    const char* const variable = std::getenv("CASTOR_SHARED_DIR");
    return variable ? variable : CASTOR_SOURCE_DIR "/../shared";
}

}  // namespace castor::test
