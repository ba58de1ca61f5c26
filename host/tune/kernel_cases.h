#pragma once

#include <array>
#include <glm/vec4.hpp>
#include <string_view>
#include <vector>

#include "castor/shared/types.h"

namespace castor {

/// The reference's judgement, in double precision, of a ray and a primitive. Near an edge either answer is right.
struct Verdict {
    bool may_hit = false, must_hit = false;
    double least_t = 0.0, greatest_t = 0.0;  // where a hit may lie
};

/// A function of kernels/device that tests a ray against a primitive.
struct TestedFunction {
    std::string_view name;
    std::size_t rows;  // float4 for each primitive, laid out as in kernels/bench/nearest_in_list.cl
    /// Makes seeded primitives in [-2, 2]^3, `rows` elements each.
    std::vector<glm::vec4> (*make_primitives)(std::size_t count, std::uint32_t seed);
    Verdict (*judge)(const shared::Ray& ray, const glm::vec4* rows);
};

/// The three triangle tests, sphere, plane and box.
extern const std::array<TestedFunction, 6> kTestedFunctions;

/// The largest coordinate of the primitives.
inline constexpr float kLargestCoordinate = 2.0f;

/// Makes rays from [-2, 2]^3 to points in [-1, 1]^3, t from 0 to infinity.
std::vector<shared::Ray> make_case_rays(std::size_t count, std::uint32_t seed);

}  // namespace castor
