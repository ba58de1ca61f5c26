#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/box.h"
#include "base/progress.h"
#include "bvh/primitives.h"
#include "castor/tree_quality.h"

namespace castor {

/// What the builder moves about: the box of a primitive and, in a lane that the box does not use, its number. 32 bytes.
struct PrimitiveRef {
    Box box;

    static PrimitiveRef make(const Box& box, std::uint32_t primitive) {
        PrimitiveRef ref{box};
        ref.box.lower[3] = std::bit_cast<float>(primitive);
        ref.box.upper[3] = 0.0f;
        return ref;
    }
    std::uint32_t primitive() const { return std::bit_cast<std::uint32_t>(float(box.lower[3])); }
    /// Twice the box's centre: a sum needs no rounding care where a mean does. The fourth lane is 0: as a number the
    /// primitive's would be denormal, and slow.
    Float4 center2() const {
        constexpr Int4 kAxes{-1, -1, -1, 0};
        return std::bit_cast<Float4>(std::bit_cast<Int4>(box.lower) & kAxes) + box.upper;
    }
};

/// The boxes that guide the builder, of a set of primitives.
struct Bounds {
    Box box;
    Box centers2;  // of their center2

    void extend(const PrimitiveRef& ref) {
        box.extend(ref.box);
        centers2.extend(ref.center2());
    }
    void extend(const Bounds& other) {
        box.extend(other.box);
        centers2.extend(other.centers2);
    }
};

/// Storage for all references of a tree, not initialised before they are written.
class PrimitiveRefs {
public:
    /// Makes references to all primitives that take part and are not degenerate, in order of their numbers; or to
    /// pieces of some, see presplit: of triangles that fill their boxes badly with high quality, and with medium only
    /// of those that are long beside the scene, and where there are many.
    PrimitiveRefs(const Primitives& primitives, TreeQuality quality, const Progress& progress);

    std::span<PrimitiveRef> span() { return {refs_.get(), count_}; }

private:
    struct Free {
        void operator()(PrimitiveRef* refs) const;
    };
    struct LongOnes {
        std::size_t count = 0;
        double waste = 0.0;  // the sum of wasted_half_area
    };
    LongOnes find_long_ones(const Primitives& primitives, float long_side) const;
    void cut(const Primitives& primitives, float least_side, const Progress& progress);

    std::unique_ptr<PrimitiveRef[], Free> refs_;
    std::size_t count_ = 0;
};

Bounds bounds_of(std::span<const PrimitiveRef> refs);

}  // namespace castor
