#include "scene/fingerprint.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "base/checksum.h"

namespace castor {

namespace {

constexpr std::size_t kPieceBytes = std::size_t{4} << 20;

/// The checksum of the checksums of all pieces and of the number of bytes.
std::uint64_t column_checksum(std::span<const std::byte> bytes) {
    std::vector<std::uint64_t> pieces((bytes.size() + kPieceBytes - 1) / kPieceBytes);
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
        pieces[i] = XXH3_64bits(bytes.data() + i * kPieceBytes, std::min(kPieceBytes, bytes.size() - i * kPieceBytes));
    });
    pieces.push_back(bytes.size());
    return XXH3_64bits(pieces.data(), pieces.size() * sizeof pieces[0]);
}

}  // namespace

std::uint64_t fingerprint(const SceneArrays& arrays) {
    std::vector<std::uint64_t> parts;
    const auto add = [&](const auto& column) { parts.push_back(column_checksum(std::as_bytes(std::span(column)))); };
    for_each_flat_column(arrays, [&](const char*, const auto& column) { add(column); });
    const float rest[] = {arrays.background.x,
                          arrays.background.y,
                          arrays.background.z,
                          arrays.ambient_light.x,
                          arrays.ambient_light.y,
                          arrays.ambient_light.z,
                          arrays.shadow_ray_epsilon,
                          static_cast<float>(arrays.max_recursion_depth),
                          arrays.shades_both_sides ? 1.0f : 0.0f};
    add(rest);
    add(std::span(&arrays.background_texture, 1));
    return XXH3_64bits(parts.data(), parts.size() * sizeof parts[0]);
}

}  // namespace castor
