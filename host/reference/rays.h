#pragma once

#include <glm/vec3.hpp>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>

#include "castor/shared/types.h"

namespace castor::reference {

inline shared::Ray make_ray(glm::vec3 origin, glm::vec3 direction, float t_min = 0.0f,
                            float t_max = std::numeric_limits<float>::infinity()) {
    return {{origin.x, origin.y, origin.z}, t_min, {direction.x, direction.y, direction.z}, t_max};
}

inline glm::vec3 origin_of(const shared::Ray& ray) {
    return {ray.origin[0], ray.origin[1], ray.origin[2]};
}
inline glm::vec3 direction_of(const shared::Ray& ray) {
    return {ray.direction[0], ray.direction[1], ray.direction[2]};
}

/// Returns a text for messages: exact, and ready to be pasted into a test.
inline std::string to_text(glm::vec3 v) {
    std::ostringstream text;
    text << std::hexfloat << '{' << v.x << "f, " << v.y << "f, " << v.z << "f}";
    return text.str();
}
inline std::string to_text(const shared::Ray& ray) {
    std::ostringstream text;
    text << std::hexfloat << "make_ray(" << to_text(origin_of(ray)) << ", " << to_text(direction_of(ray)) << ", "
         << ray.t_min << "f, " << ray.t_max << "f)";
    return text.str();
}

}  // namespace castor::reference
