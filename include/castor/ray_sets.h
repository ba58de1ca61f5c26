#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "castor/api.h"
#include "castor/scene.h"
#include "castor/tracer.h"

namespace castor {

/// Kinds of rays, each with the query that a renderer asks for them.
enum class RayKind {
    primary,  // of the first camera, through the pixels' centres, in blocks of 8 x 8; the nearest hit
    shadow,   // from the primary hits to a point light; any hit
    diffuse,  // from the primary hits, distributed by the cosine; the nearest hit
    random,   // origins uniform in the box of the scene, directions uniform on the sphere; the nearest hit
};
inline constexpr RayKind kRayKinds[] = {RayKind::primary, RayKind::shadow, RayKind::diffuse, RayKind::random};

/// The words "primary", "shadow", "diffuse", "random". ray_kind_from_string throws UsageError for any other word.
CASTOR_API std::string_view to_string(RayKind kind);
CASTOR_API RayKind ray_kind_from_string(std::string_view word);

struct RaySet {
    RayKind kind = RayKind::primary;
    Query query = Query::closest;
    Coherence hint = Coherence::incoherent;
    std::vector<Ray> rays;
};

/// Makes one set for each of `kinds`. `primary` and `random` have size * size rays (size is a multiple of 8); `shadow`
/// and `diffuse` have one ray for each primary hit. The light is the scene's first point light, or else one above the
/// camera and to its right. `tracer` must hold this scene. The same arguments give the same rays on every machine.
/// Throws SceneError if the camera is wrong or missing.
CASTOR_API std::vector<RaySet> make_ray_sets(const Scene& scene, Tracer& tracer, const std::vector<RayKind>& kinds,
                                             std::uint32_t size, std::uint32_t seed);

}  // namespace castor
