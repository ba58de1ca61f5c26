#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "castor/shared/types.h"
#include "castor/tracer.h"
#include "remote/bytes.h"

namespace castor {

using shared::Hit;
using shared::Ray;

/// What rays that travel from process to process ask of the chunks there.
enum class ChunkQuestion : std::uint32_t {
    closest,           // the nearest hit, if it is nearer than the one that the ray brings
    any,               // whether there is a hit
    surface,           // the surface at the hit that the ray brings
    textured_surface,  // the same, as textures change it
    uv,                // the texture coordinates there
    attributes,        // what principled materials need to know of the surface there
    passed,            // whether the ray passes the surface there
};

/// Rays, with their hits so far, that ask some chunks of a scene.
struct ChunkOrder {
    ChunkQuestion question = ChunkQuestion::closest;
    std::uint32_t flags = 0;  // CASTOR_TRACE_CULL_BACK_FACES, or CASTOR_TRACE_BENDS_NORMALS of surfaces; or none
    Coherence hint = Coherence::incoherent;
    std::vector<std::uint32_t> chunks;  // numbers
    std::vector<Ray> rays;
    /// One a ray, but none for `any`. For `closest`, t is in the ray's scaled units (CASTOR_TRACE_MORE_FOLLOWS), in the
    /// answer too.
    std::vector<Hit> hits;
    std::vector<float> times{};  // one a ray where something moves, for `closest` and `any`; else none
    float pixel_spread = 0.0f;   // for `textured_surface`: see SurfaceKernels
    // For `passed`: see SurfaceKernels::Bounce; `path_slots` has one a ray, and no slot stands at its own place.
    shared::RenderParams wave{};
    std::uint32_t node = 0, dimension = 0;
    std::vector<std::uint32_t> pixel_blocks{}, path_slots{};
};

/// An answer to ChunkQuestion::surface.
struct SurfaceAnswer {
    float position[4], normal[4];  // as the columns of a wave have them
    std::uint32_t material;        // CASTOR_INVALID_INDEX: these chunks do not have what was hit
};
/// An answer to ChunkQuestion::textured_surface.
struct TexturedSurfaceAnswer {
    SurfaceAnswer surface;
    float diffuse[4], specular[4];  // likewise
};
/// An answer to ChunkQuestion::uv.
struct UvAnswer {
    float uv[2];  // 0 where these chunks do not have what was hit
};

/// An answer to ChunkQuestion::attributes.
struct AttributesAnswer {
    float uvs[4], tangent[4];  // as the columns of a wave have them
    float color[4];            // the first is NaN where these chunks do not have what was hit
};

/// The bytes of the answer for one ray: a Hit, a byte (of `any`; of `passed`: CASTOR_PASSED, CASTOR_STOPPED,
/// CASTOR_AT_PANE, or 0 where these chunks do not have what was hit), or one of the structs above.
std::size_t answer_bytes(ChunkQuestion question);

Bytes bytes_of(const ChunkOrder& order);
/// Throws DeviceError where the bytes are no order for a scene of so many chunks.
ChunkOrder chunk_order_of(std::span<const std::byte> bytes, std::size_t chunk_count);

}  // namespace castor
