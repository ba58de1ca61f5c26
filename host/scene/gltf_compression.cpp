#include "scene/gltf_compression.h"

namespace castor {

bool knows_compression(std::string_view) {
    return false;
}

std::string decode_meshopt(const GltfValue& extension, std::string_view) {
    extension.reject("is not read");
}

}  // namespace castor
