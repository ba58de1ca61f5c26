#pragma once

#include <cstdint>
#include <vector>

namespace castor {

/// What the eye rays of a wave met, as `write_aovs` leaves it.
struct WaveAovs {
    std::vector<float> position_depth;                       // 4 a slot
    std::vector<float> normal;                               // 4 a slot
    std::vector<float> barycentric_t;                        // 4 a slot
    std::vector<std::uint32_t> primitive_instance_material;  // 4 a slot
    std::vector<float> albedo;                               // 4 a slot
    std::vector<float> uv;                                   // 4 a slot
};

}  // namespace castor
