#include "fuzz/targets.h"

#include <array>
#include <stdexcept>

namespace castor::fuzz {

std::span<const Target> targets() {
    static constexpr std::array kTargets = {
        Target{"ply", run_ply, ply_seeds},
        Target{"obj", run_obj, obj_seeds},
        Target{"stl", run_stl, stl_seeds},
        Target{"gltf", run_gltf, gltf_seeds},
        Target{"xml", run_xml, xml_seeds},
        Target{"json", run_json, json_seeds},
        Target{"built_scene", run_built_scene, built_scene_seeds},
        Target{"checkpoint", run_checkpoint, checkpoint_seeds},
        Target{"picture", run_picture, picture_seeds},
        Target{"rays", run_rays, ray_seeds},
    };
    return kTargets;
}

void require(bool kept, const char* promise) {
    if (!kept) throw std::logic_error(promise);
}

}  // namespace castor::fuzz
