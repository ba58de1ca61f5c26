#pragma once

#include <string_view>

#include "castor/api.h"

namespace castor {

/// How much work goes into the tree. Hits do not depend on it.
enum class TreeQuality {
    medium,  // each triangle once: quick to build
    high,    // triangles that fill their boxes badly, such as long thin ones, are cut into pieces: half as many
             // references more, faster rays
};

/// "medium", "high". tree_quality_from_string throws UsageError for any other word.
CASTOR_API std::string_view to_string(TreeQuality quality);
CASTOR_API TreeQuality tree_quality_from_string(std::string_view word);

}  // namespace castor
