#include "bvh/primitive_ref.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <vector>

#include "base/column.h"
#include "bvh/presplit.h"
#include "castor/error.h"

namespace castor {

namespace {

// Node numbers have 32 bits, and n leaves of one primitive make 2n - 1 nodes.
constexpr std::size_t kMaxRefs = 0x7fffffffu;
constexpr std::size_t kChunk = 4096;

// With medium quality, triangles are cut whose boxes are longer than this share of the scene, if at least one in ten
// is, and together they waste this much of the half surface of the scene's box. Pieces cost more nodes than they save
// tests where a scene is small (a room of 20,000 thin slats loses a tenth of its rate, 50,000 gain nothing, 400,000 a
// third), or where few are long (a kitchen of 1.4 million triangles loses a fifth).
constexpr float kLongSide = 0.125f;
constexpr double kManyLong = 0.1, kMuchWaste = 0.5;
constexpr std::size_t kManyRefs = 65536;

// Of some boxes.
struct Extent {
    Box box;
    float longest_side = 0.0f;  // of any

    void add(const Box& other) {
        box.extend(other);
        longest_side = std::max(longest_side, castor::longest_side(other));
    }
    void add(const Extent& other) {
        box.extend(other.box);
        longest_side = std::max(longest_side, other.longest_side);
    }
};

bool is_degenerate(const glm::uvec3& triangle) {
    return triangle.x == triangle.y;
}

std::size_t count_of(const Primitives& primitives) {
    return primitives.triangles.size() + primitives.spheres.size();
}

// Calls body(primitive) for the non-degenerate ones of a chunk of the primitives that take part.
template <class Body>
void for_each_in_chunk(const Primitives& primitives, std::size_t chunk, const Body& body) {
    const std::size_t end = std::min((chunk + 1) * kChunk, count_of(primitives));
    const std::size_t triangles = primitives.triangles.size();
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
        if (i >= triangles)
            body(primitives.triangle_count() + primitives.spheres.begin + i - triangles);
        else if (!is_degenerate(primitives.triangle_vertices[primitives.triangles.begin + i]))
            body(primitives.triangles.begin + i);
    }
}

Box primitive_box(const Primitives& primitives, std::size_t primitive) {
    if (primitive >= primitives.triangle_count()) {
        return sphere_box(primitives.sphere_center_radius[primitive - primitives.triangle_count()]);
    }
    const glm::uvec3& triangle = primitives.triangle_vertices[primitive];
    return triangle_box(primitives.vertex_position[triangle.x], primitives.vertex_position[triangle.y],
                        primitives.vertex_position[triangle.z]);
}

// Where each chunk's references begin, and at the end how many there are.
std::vector<std::size_t> chunk_offsets(const Primitives& primitives) {
    const std::size_t chunk_count = (count_of(primitives) + kChunk - 1) / kChunk;
    std::vector<std::size_t> offsets(chunk_count + 1, 0);
    tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t chunk) {
        for_each_in_chunk(primitives, chunk, [&](std::size_t) { ++offsets[chunk + 1]; });
    });
    for (std::size_t chunk = 0; chunk < chunk_count; ++chunk) offsets[chunk + 1] += offsets[chunk];
    return offsets;
}

PrimitiveRef* allocate(std::size_t count) {
    if (count > kMaxRefs) {
        throw Error(fmt::format("{} triangles and spheres, but one tree takes at most {}", count, kMaxRefs));
    }
    return PageAllocator<PrimitiveRef>().allocate(count);
}

}  // namespace

void PrimitiveRefs::Free::operator()(PrimitiveRef* refs) const {
    PageAllocator<PrimitiveRef>().deallocate(refs, 0);
}

PrimitiveRefs::PrimitiveRefs(const Primitives& primitives, TreeQuality quality, const Progress& progress) {
    const double cutting = quality == TreeQuality::high ? 0.75 : 0.25;  // its share of the time
    const std::vector<std::size_t> offsets = chunk_offsets(primitives);
    count_ = offsets.back();
    refs_.reset(allocate(count_));
    ProgressCount chunks_done(progress.part(0.0, 1.0 - cutting), offsets.size() - 1);
    std::vector<Extent> extents(offsets.size() - 1);
    tbb::parallel_for(std::size_t{0}, extents.size(), [&](std::size_t chunk) {
        PrimitiveRef* next = refs_.get() + offsets[chunk];
        for_each_in_chunk(primitives, chunk, [&](std::size_t i) {
            const Box box = primitive_box(primitives, i);
            extents[chunk].add(box);
            new (next++) PrimitiveRef(PrimitiveRef::make(box, static_cast<std::uint32_t>(i)));
        });
        chunks_done.add(1);
    });
    Extent all;
    for (const Extent& extent : extents) all.add(extent);
    const Progress cuts = progress.part(1.0 - cutting, 1.0);
    if (quality == TreeQuality::high) {
        cut(primitives, 0.0f, cuts);
        return;
    }
    if (count_ < kManyRefs) return;
    const float long_side = kLongSide * longest_side(all.box);
    if (all.longest_side < long_side) return;
    const LongOnes long_ones = find_long_ones(primitives, long_side);
    if (static_cast<double>(long_ones.count) >= kManyLong * static_cast<double>(count_) &&
        long_ones.waste >= kMuchWaste * half_area(all.box))
        cut(primitives, long_side, cuts);
}

/// Triangles whose boxes have a side of this length.
PrimitiveRefs::LongOnes PrimitiveRefs::find_long_ones(const Primitives& primitives, float long_side) const {
    using Blocks = tbb::blocked_range<std::size_t>;
    const auto add = [&](const Blocks& range, LongOnes found) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) {
            if (longest_side(refs_[i].box) < long_side) continue;
            ++found.count;
            found.waste += wasted_half_area(primitives, refs_[i]);
        }
        return found;
    };
    const auto join = [](const LongOnes& a, const LongOnes& b) {
        return LongOnes{a.count + b.count, a.waste + b.waste};
    };
    return tbb::parallel_deterministic_reduce(Blocks(0, count_, kChunk), LongOnes{}, add, join);
}

void PrimitiveRefs::cut(const Primitives& primitives, float least_side, const Progress& progress) {
    std::vector<std::vector<PrimitiveRef>> pieces = presplit(primitives, span(), least_side, progress.part(0.0, 0.75));
    std::vector<std::size_t> offsets(pieces.size() + 1, 0);
    for (std::size_t i = 0; i < pieces.size(); ++i) offsets[i + 1] = offsets[i] + pieces[i].size();
    refs_.reset();
    ProgressCount parts_done(progress.part(0.75, 1.0), pieces.size());
    count_ = offsets.back();
    refs_.reset(allocate(count_));
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
        std::uninitialized_copy(pieces[i].begin(), pieces[i].end(), refs_.get() + offsets[i]);
        pieces[i] = {};
        parts_done.add(1);
    });
}

// The deterministic reduction joins in one order, whatever the threads: the sign of a zero depends on it.
Bounds bounds_of(std::span<const PrimitiveRef> refs) {
    using Blocks = tbb::blocked_range<std::size_t>;
    const auto extend = [&](const Blocks& range, Bounds bounds) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) bounds.extend(refs[i]);
        return bounds;
    };
    const auto join = [](Bounds a, const Bounds& b) {
        a.extend(b);
        return a;
    };
    return tbb::parallel_deterministic_reduce(Blocks(0, refs.size(), kChunk), Bounds{}, extend, join);
}

}  // namespace castor
