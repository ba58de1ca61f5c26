#include "bvh/primitive_ref.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <new>
#include <vector>

#include "bvh/presplit.h"
#include "castor/error.h"

namespace castor {

namespace {

// Node numbers have 32 bits, and n leaves of one primitive make 2n - 1 nodes.
constexpr std::size_t kMaxRefs = 0x7fffffffu;
constexpr std::size_t kChunk = 65536;

bool is_degenerate(const glm::uvec3& triangle) {
    return triangle.x == triangle.y;
}

std::size_t bounded_count(const shared::Geometry& geometry) {
    return std::size_t{geometry.triangle_count} + geometry.sphere_count;
}

// Calls body(primitive) for the bounded, non-degenerate primitives of one chunk of the geometry.
template <class Body>
void for_each_in_chunk(const SceneArrays& arrays, const shared::Geometry& geometry, std::size_t chunk,
                       const Body& body) {
    const std::size_t end = std::min((chunk + 1) * kChunk, bounded_count(geometry));
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
        if (i >= geometry.triangle_count)
            body(arrays.triangle_count() + geometry.first_sphere + i - geometry.triangle_count);
        else if (!is_degenerate(arrays.triangle_vertices[geometry.first_triangle + i]))
            body(geometry.first_triangle + i);
    }
}

Box primitive_box(const SceneArrays& arrays, std::size_t primitive) {
    if (primitive >= arrays.triangle_count()) {
        return sphere_box(arrays.sphere_center_radius[primitive - arrays.triangle_count()]);
    }
    const glm::uvec3& triangle = arrays.triangle_vertices[primitive];
    return triangle_box(arrays.vertex_position[triangle.x], arrays.vertex_position[triangle.y],
                        arrays.vertex_position[triangle.z]);
}

// Where each chunk's references begin, and at the end how many there are.
std::vector<std::size_t> chunk_offsets(const SceneArrays& arrays, const shared::Geometry& geometry) {
    const std::size_t chunk_count = (bounded_count(geometry) + kChunk - 1) / kChunk;
    std::vector<std::size_t> offsets(chunk_count + 1, 0);
    tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t chunk) {
        for_each_in_chunk(arrays, geometry, chunk, [&](std::size_t) { ++offsets[chunk + 1]; });
    });
    for (std::size_t chunk = 0; chunk < chunk_count; ++chunk) offsets[chunk + 1] += offsets[chunk];
    return offsets;
}

PrimitiveRef* allocate(std::size_t count) {
    if (count > kMaxRefs) {
        throw Error(fmt::format("{} triangles and spheres, but one tree takes at most {}", count, kMaxRefs));
    }
    return static_cast<PrimitiveRef*>(
        ::operator new(count * sizeof(PrimitiveRef), std::align_val_t(alignof(PrimitiveRef))));
}

}  // namespace

void PrimitiveRefs::Free::operator()(PrimitiveRef* refs) const {
    ::operator delete(refs, std::align_val_t(alignof(PrimitiveRef)));
}

PrimitiveRefs::PrimitiveRefs(const SceneArrays& arrays, const shared::Geometry& geometry, TreeQuality quality) {
    const std::vector<std::size_t> offsets = chunk_offsets(arrays, geometry);
    count_ = offsets.back();
    refs_.reset(allocate(count_));
    tbb::parallel_for(std::size_t{0}, offsets.size() - 1, [&](std::size_t chunk) {
        PrimitiveRef* next = refs_.get() + offsets[chunk];
        for_each_in_chunk(arrays, geometry, chunk, [&](std::size_t i) {
            new (next++) PrimitiveRef(PrimitiveRef::make(primitive_box(arrays, i), static_cast<std::uint32_t>(i)));
        });
    });
    if (quality == TreeQuality::high) cut(arrays);
}

void PrimitiveRefs::cut(const SceneArrays& arrays) {
    const std::vector<std::vector<PrimitiveRef>> pieces = presplit(arrays, span());
    std::vector<std::size_t> offsets(pieces.size() + 1, 0);
    for (std::size_t i = 0; i < pieces.size(); ++i) offsets[i + 1] = offsets[i] + pieces[i].size();
    refs_.reset();
    count_ = offsets.back();
    refs_.reset(allocate(count_));
    tbb::parallel_for(std::size_t{0}, pieces.size(), [&](std::size_t i) {
        std::uninitialized_copy(pieces[i].begin(), pieces[i].end(), refs_.get() + offsets[i]);
    });
}

// The deterministic reduction joins in one order, whatever the threads: the sign of a zero depends on it.
Bounds bounds_of(std::span<const PrimitiveRef> refs) {
    using Range = tbb::blocked_range<std::size_t>;
    const auto extend = [&](const Range& range, Bounds bounds) {
        for (std::size_t i = range.begin(); i != range.end(); ++i) bounds.extend(refs[i]);
        return bounds;
    };
    const auto join = [](Bounds a, const Bounds& b) {
        a.extend(b);
        return a;
    };
    return tbb::parallel_deterministic_reduce(Range(0, refs.size(), kChunk), Bounds{}, extend, join);
}

}  // namespace castor
