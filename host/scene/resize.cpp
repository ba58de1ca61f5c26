#include "castor/scene.h"

namespace castor {

void resize(Camera& camera, std::uint32_t width, std::uint32_t height) {
    const double stretch = (double(width) * camera.height) / (double(height) * camera.width);
    const double middle = (double(camera.left) + camera.right) / 2;
    const double half = (double(camera.right) - camera.left) / 2 * stretch;
    if (stretch != 1.0) {
        camera.left = static_cast<float>(middle - half);
        camera.right = static_cast<float>(middle + half);
    }
    camera.width = width;
    camera.height = height;
}

}  // namespace castor
