#pragma once

#include <string>
#include <string_view>

#include "scene/gltf_value.h"

namespace castor {

/// Whether this build has the library that decodes EXT_meshopt_compression.
bool decodes_meshopt();

/// Decodes the bytes of an EXT_meshopt_compression buffer view: `count` elements of `byteStride` bytes. Throws
/// SceneError with the extension's path.
std::string decode_meshopt(const GltfValue& extension, std::string_view bytes);

}  // namespace castor
