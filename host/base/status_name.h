#pragma once

#include <string_view>

namespace castor {

/// "CL_OUT_OF_RESOURCES" for -5 and so on; "unknown status" for a code that OpenCL does not define.
std::string_view status_name(int code);

}  // namespace castor
