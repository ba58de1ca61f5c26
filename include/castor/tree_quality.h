#pragma once

#include <string_view>

#include "castor/api.h"

namespace castor {

/// How much work goes into building a tree. Hits do not depend on it.
enum class TreeQuality {
    medium,  // one reference to each triangle; in large scenes with many triangles that are long beside the scene,
             // about half as many more at most
    high,    // splits all triangles that fill their boxes badly, such as thin ones: about 1.5 times as many references
};

/// The words "medium" and "high". tree_quality_from_string throws UsageError for any other word.
CASTOR_API std::string_view to_string(TreeQuality quality);
CASTOR_API TreeQuality tree_quality_from_string(std::string_view word);

}  // namespace castor
