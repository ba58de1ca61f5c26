#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>

namespace castor::reference {

/// The point where a ray's line meets the plane of a triangle, inside or not; u is the weight of p1, v that of p2.
struct TrianglePoint {
    double t, u, v;
    double condition;  // amplification of the input's relative errors: 1 at best
    bool from_behind;
    /// Returns the distance to the nearest edge as a weight: negative outside.
    double inside() const { return std::fmin(std::fmin(u, v), 1.0 - u - v); }
};

/// Intersects in double precision (Möller, Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection"). Returns
/// nullopt if the triangle is seen edge-on.
inline std::optional<TrianglePoint> intersect_triangle(glm::dvec3 o, glm::dvec3 d, glm::dvec3 p0, glm::dvec3 p1,
                                                       glm::dvec3 p2) {
    const glm::dvec3 e1 = p1 - p0, e2 = p2 - p0, s = o - p0;
    const glm::dvec3 p = glm::cross(d, e2), q = glm::cross(s, e1);
    const double determinant = glm::dot(e1, p);
    if (determinant == 0.0) return std::nullopt;
    const double size = glm::length(s) + glm::length(e1) + glm::length(e2);
    return TrianglePoint{glm::dot(e2, q) / determinant, glm::dot(s, p) / determinant, glm::dot(d, q) / determinant,
                         size * size * glm::length(d) / std::fabs(determinant), glm::dot(glm::cross(e1, e2), d) > 0.0};
}

/// The two roots of |o + t d - c|^2 = r^2 in extended precision. `grazing` is the discriminant relative to the terms of
/// its sum (negative: a miss). A relative error e of these terms moves a root by e * `sensitivity`.
struct SphereRoots {
    long double near_t, far_t, grazing, sensitivity;
};

inline SphereRoots intersect_sphere(glm::vec3 o, glm::vec3 d, glm::vec3 c, float r) {
    long double a = 0, b = 0, distance2 = 0;
    const long double r2 = static_cast<long double>(r) * r;
    for (int k = 0; k < 3; ++k) {
        const long double f = static_cast<long double>(o[k]) - c[k], g = d[k];
        a += g * g;
        b += f * g;
        distance2 += f * f;
    }
    const long double discriminant = b * b - a * (distance2 - r2);
    const long double terms = b * b + a * (distance2 + r2);
    if (discriminant <= 0) return {0, 0, discriminant / terms, 0};
    const long double root = std::sqrt(discriminant);
    const long double q = -(b + std::copysign(root, b));
    const long double one = q / a, other = (distance2 - r2) / q;
    return {std::fmin(one, other), std::fmax(one, other), discriminant / terms, terms / (2 * a * root)};
}

/// The interval in which a ray's line is inside a box.
struct BoxInterval {
    double entry, exit;
};

inline BoxInterval intersect_box(glm::dvec3 o, glm::dvec3 d, glm::dvec3 lower, glm::dvec3 upper) {
    BoxInterval interval{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (int k = 0; k < 3; ++k) {
        if (d[k] == 0.0) {
            if (o[k] < lower[k] || o[k] > upper[k]) return {1.0, -1.0};
            continue;
        }
        const double first = (lower[k] - o[k]) / d[k], second = (upper[k] - o[k]) / d[k];
        interval.entry = std::fmax(interval.entry, std::fmin(first, second));
        interval.exit = std::fmin(interval.exit, std::fmax(first, second));
    }
    return interval;
}

}  // namespace castor::reference
