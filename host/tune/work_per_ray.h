#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "castor/tracer.h"
#include "tune/resident_batch.h"

namespace castor {

/// The cost of one of the tests that kernels count: the bytes that it reads, from memory or caches, and its operations.
/// An fma counts as two, any other operation or comparison of floats as one. The figures are taken from the kernels'
/// text, for tests without a hit, which are most.
struct WorkFigures {
    const char* name;
    std::uint64_t TraceWork::*count;
    bool is_of_tree;  // else of a primitive
    double bytes;
    double flops;
};

/// The figures of all counts in TraceWork.
extern const std::array<WorkFigures, CASTOR_WORK_KINDS> kWorkFigures;
/// The cost of a ray itself: reading and preparing it. Its answer has 20 bytes, or 1 for Query::any.
inline constexpr WorkFigures kRayFigures{"ray", nullptr, false, 32.0, 50.0};

struct WorkPerRay {
    double nodes = 0.0;  // nodes of the tree, eight boxes each; a bundle's test counts once for all its rays
    double tests = 0.0;  // primitives or leaf blocks; a bundle's test counts once
    double bytes = 0.0;
    double flops = 0.0;
};

/// Returns the mean cost of a ray. `rays` must not be 0.
WorkPerRay work_per_ray(const TraceWork& work, std::size_t rays, Query query);

}  // namespace castor
