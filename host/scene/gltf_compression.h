#pragma once

#include <string>
#include <string_view>

#include "scene/gltf_value.h"

namespace castor {

/// Whether this build reads an extension that needs a library.
bool knows_compression(std::string_view extension);

/// Decodes the bytes of an EXT_meshopt_compression buffer view.
std::string decode_meshopt(const GltfValue& extension, std::string_view bytes);

}  // namespace castor
