#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "castor/tracer.h"
#include "tune/resident_batch.h"

namespace castor {

/// What one of the things that kernels count stands for: bytes that are read, wherever they come from, and operations.
/// An fma is two, any other operation or comparison of floats one. Taken from the kernels' text, of tests that find
/// nothing, which most do.
struct WorkFigures {
    const char* name;
    std::uint64_t TraceWork::*count;
    bool is_of_tree;  // else of a primitive
    double bytes;
    double flops;
};

/// All numbers of TraceWork.
extern const std::array<WorkFigures, CASTOR_WORK_KINDS> kWorkFigures;
/// Of a ray itself: to read it and make it ready. Its answer is 20 bytes, or 1 for Query::any.
inline constexpr WorkFigures kRayFigures{"ray", nullptr, false, 32.0, 50.0};

struct WorkPerRay {
    double nodes = 0.0;  // tests of nodes of the tree, eight boxes each; a bundle's counts once for all its rays
    double tests = 0.0;  // of primitives, or of blocks of four; a bundle's counts once
    double bytes = 0.0;
    double flops = 0.0;
};

/// `rays` is not 0.
WorkPerRay work_per_ray(const TraceWork& work, std::size_t rays, Query query);

}  // namespace castor
