#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "castor/scene.h"

namespace castor {

void compute_smooth_normals(Mesh& mesh) {
    // In double precision, differences and products of floats keep their digits and cannot overflow.
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0.0));
    for (const glm::uvec3& triangle : mesh.triangles) {
        // A scene that a program made is checked later, so that an index may be out of range here.
        if (triangle.x >= sums.size() || triangle.y >= sums.size() || triangle.z >= sums.size()) continue;
        const glm::dvec3 p0(mesh.positions[triangle.x]);
        const glm::dvec3 cross =
            glm::cross(glm::dvec3(mesh.positions[triangle.y]) - p0, glm::dvec3(mesh.positions[triangle.z]) - p0);
        for (int i = 0; i < 3; ++i) sums[triangle[i]] += cross;
    }
    mesh.normals.clear();
    mesh.normals.reserve(sums.size());
    for (const glm::dvec3& sum : sums) {
        const double length = glm::length(sum);
        const bool has_direction = length > 0.0 && length <= std::numeric_limits<double>::max();
        mesh.normals.push_back(has_direction ? glm::vec3(sum / length) : glm::vec3(0.0f));
    }
}

}  // namespace castor
