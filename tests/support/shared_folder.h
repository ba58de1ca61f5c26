#pragma once

#include <cstdlib>
#include <filesystem>

#include "test_paths.h"

namespace castor::test {

/// Returns the folder of reference files that are not part of the project: CASTOR_SHARED_DIR, or else one beside the
/// source tree. It may be missing; tests that need it must then do without.
inline std::filesystem::path shared_folder() {
    const char* const variable = std::getenv("CASTOR_SHARED_DIR");
    return variable ? variable : CASTOR_SOURCE_DIR "/../shared";
}

}  // namespace castor::test
