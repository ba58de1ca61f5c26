#pragma once

#include <cstdint>

namespace castor {

/// Which of a scene's chunks a process keeps on its devices, where several processes divide the scene among them: the
/// `number`-th share of `count`, from 0 on. All other chunks are brought to a device when they are needed. The default
/// is all of the scene.
struct SceneShare {
    std::uint32_t number = 0, count = 1;

    bool is_whole() const { return count <= 1; }
};

}  // namespace castor
