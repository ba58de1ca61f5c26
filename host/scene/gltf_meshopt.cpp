// Decodes EXT_meshopt_compression with meshoptimizer. Only this file includes that header.
#include "scene/gltf_meshopt.h"

#include <fmt/format.h>

#include <cstdint>

#ifdef CASTOR_HAS_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace castor {

#ifdef CASTOR_HAS_MESHOPTIMIZER

namespace {

constexpr std::uint64_t kMostElements = 0xfffffffeu;

/// The sizes of elements that a mode or a filter may have.
void require_stride(const GltfValue& extension, std::uint64_t stride, bool is_good, std::string_view expected) {
    if (!is_good)
        extension.require("byteStride").reject(fmt::format("{} bytes where {} was expected", stride, expected));
}

void apply_filter(const GltfValue& extension, std::string& bytes, std::size_t count, std::size_t stride) {
    const std::string filter = extension.text("filter", "NONE");
    if (filter == "NONE") return;
    if (filter == "OCTAHEDRAL") {
        require_stride(extension, stride, stride == 4 || stride == 8, "4 or 8");
        meshopt_decodeFilterOct(bytes.data(), count, stride);
    } else if (filter == "QUATERNION") {
        require_stride(extension, stride, stride == 8, "8");
        meshopt_decodeFilterQuat(bytes.data(), count, stride);
    } else if (filter == "EXPONENTIAL") {
        meshopt_decodeFilterExp(bytes.data(), count, stride);
    } else {
        extension.require("filter").reject(
            fmt::format("\"{}\" is none of NONE, OCTAHEDRAL, QUATERNION and EXPONENTIAL", filter.substr(0, 40)));
    }
}

}  // namespace

bool decodes_meshopt() {
    return true;
}

std::string decode_meshopt(const GltfValue& extension, std::string_view bytes) {
    const std::uint64_t count = extension.require("count").whole(kMostElements);
    const std::uint64_t stride = extension.require("byteStride").whole(256);
    const std::string mode = extension.require("mode").text();
    const bool is_attributes = mode == "ATTRIBUTES", is_triangles = mode == "TRIANGLES";
    if (!is_attributes && !is_triangles && mode != "INDICES")
        extension.require("mode").reject(
            fmt::format("\"{}\" is none of ATTRIBUTES, TRIANGLES and INDICES", mode.substr(0, 40)));
    if (is_attributes)
        require_stride(extension, stride, stride > 0 && stride % 4 == 0, "a multiple of 4 up to 256");
    else
        require_stride(extension, stride, stride == 2 || stride == 4, "2 or 4");
    if (is_triangles && count % 3 != 0)
        extension.require("count").reject(fmt::format("{} where a multiple of 3 was expected", count));
    // A byte holds at most a triangle, an index, or what four bytes of 16 elements hold that are all the same.
    constexpr std::uint64_t kMostOutOfAByte = 64;
    if (count * stride / kMostOutOfAByte > bytes.size())
        extension.reject(
            fmt::format("{} elements of {} bytes cannot be in {} compressed bytes", count, stride, bytes.size()));
    std::string decoded(count * stride, '\0');
    if (count == 0) return decoded;
    const auto* const first = reinterpret_cast<const unsigned char*>(bytes.data());
    const int status = is_attributes  ? meshopt_decodeVertexBuffer(decoded.data(), count, stride, first, bytes.size())
                       : is_triangles ? meshopt_decodeIndexBuffer(decoded.data(), count, stride, first, bytes.size())
                                      : meshopt_decodeIndexSequence(decoded.data(), count, stride, first, bytes.size());
    if (status != 0)
        extension.reject(fmt::format("its {} bytes are no {} elements in mode {}: code {} of meshoptimizer",
                                     bytes.size(), count, mode, status));
    if (is_attributes) apply_filter(extension, decoded, count, stride);
    return decoded;
}

#else

bool decodes_meshopt() {
    return false;
}

std::string decode_meshopt(const GltfValue& extension, std::string_view) {
    extension.reject("is not read: this build has no meshoptimizer");
}

#endif

}  // namespace castor
