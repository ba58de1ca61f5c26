#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "support/gltf_builder.h"

namespace castor::test {

// What tests compress by the libraries with which Castor decompresses. Where the build has no library for something,
// its `has_` is false, and nothing else may be called.

/// A surface of `kEdge` x `kEdge` vertices: (x, y, x y / 4), with a normal (0, 0, 1), texture coordinates (x, y) / 4
/// and the colour (x, y, 0, 255) / 255 each.
struct Surface {
    static constexpr std::uint32_t kEdge = 5;
    std::vector<float> positions, normals, coordinates;
    std::vector<std::uint8_t> colors;
    std::vector<std::uint32_t> indices;

    Surface();
    std::size_t vertex_count() const { return positions.size() / 3; }
};

bool has_draco();
/// The surface by KHR_draco_mesh_compression, by either method: POSITION, NORMAL, TEXCOORD_0 and COLOR_0, in 14 bits
/// where they are not integers, and so many attributes that the file does not name.
GltfBuilder draco_gltf(bool is_sequential, int further_attributes = 0);

bool has_meshopt();
/// The surface by EXT_meshopt_compression: 16-bit positions, octahedral normals, exponential coordinates, indices in
/// either mode; two instances with quaternions.
GltfBuilder meshopt_gltf(bool has_index_sequence);

bool has_webp();
/// A picture of 8 bits, four values a texel, without loss.
std::string webp_bytes(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgba);
/// A triangle with a WebP picture of (10, 20, 30, 255) and (40, 50, 60, 128), and a PNG picture for those who do not
/// read it.
GltfBuilder webp_gltf();

/// All of these that the build has.
std::vector<GltfBuilder> compressed_gltfs();

}  // namespace castor::test
