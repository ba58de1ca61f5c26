#include "bvh/partition.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/avx2_clone.h"

namespace castor {

namespace {

constexpr std::size_t kChunk = 8192;

Box centers2_of(std::span<const PrimitiveRef> refs) {
    Box box;
    for (const PrimitiveRef& ref : refs) box.extend(ref.center2());
    return box;
}

// Each reference is written to both sides, of which one goes on: where it goes is a coin toss, and not branched on.
CASTOR_AVX2_CLONE Partition partition_chunk(std::span<PrimitiveRef> refs, const Binning& binning, const Split& split) {
    thread_local std::vector<PrimitiveRef> goes_right;
    if (goes_right.size() < refs.size()) goes_right.resize(refs.size());
    PrimitiveRef *left = refs.data(), *right = goes_right.data();
    for (const PrimitiveRef& each : refs) {
        const PrimitiveRef ref = each;
        const bool goes_left = binning.bin(ref, split.axis) < split.bin;
        *left = ref;
        *right = ref;
        left += goes_left;
        right += !goes_left;
    }
    std::copy(goes_right.data(), right, left);
    Partition result;
    result.left_count = static_cast<std::size_t>(left - refs.data());
    result.left_centers2 = centers2_of(refs.first(result.left_count));
    result.right_centers2 = centers2_of(refs.subspan(result.left_count));
    return result;
}

// A run of references on the wrong side of the border, and how many such come before it.
struct Run {
    std::size_t begin;
    std::size_t size;
    std::size_t before;
};

struct Runs {
    std::vector<Run> runs;
    std::size_t size = 0;

    void add(std::size_t begin, std::size_t end) {
        if (begin >= end) return;
        runs.push_back({begin, end - begin, size});
        size += end - begin;
    }
    // Where the i-th of all these references is.
    std::size_t position(std::size_t i) const {
        const auto after = std::upper_bound(runs.begin(), runs.end(), i,
                                            [](std::size_t value, const Run& run) { return value < run.before; });
        const Run& run = *std::prev(after);
        return run.begin + (i - run.before);
    }
};

// As many references stand right of the border and should be left of it as the other way round.
void swap_misplaced(std::span<PrimitiveRef> refs, const Runs& should_be_left, const Runs& should_be_right) {
    const std::size_t chunk_count = (should_be_left.size + kChunk - 1) / kChunk;
    tbb::parallel_for(std::size_t{0}, chunk_count, [&](std::size_t chunk) {
        const std::size_t end = std::min((chunk + 1) * kChunk, should_be_left.size);
        for (std::size_t i = chunk * kChunk; i < end; ++i) {
            std::swap(refs[should_be_left.position(i)], refs[should_be_right.position(i)]);
        }
    });
}

}  // namespace

Partition partition(std::span<PrimitiveRef> refs, const Binning& binning, const Split& split) {
    if (refs.size() <= kChunk) return partition_chunk(refs, binning, split);

    const std::size_t chunk_count = (refs.size() + kChunk - 1) / kChunk;
    const auto chunk_refs = [&](std::size_t chunk) {
        return refs.subspan(chunk * kChunk, std::min(kChunk, refs.size() - chunk * kChunk));
    };
    std::vector<Partition> chunks(chunk_count);
    tbb::parallel_for(std::size_t{0}, chunk_count,
                      [&](std::size_t chunk) { chunks[chunk] = partition_chunk(chunk_refs(chunk), binning, split); });

    Partition all;
    for (const Partition& chunk : chunks) {
        all.left_count += chunk.left_count;
        all.left_centers2.extend(chunk.left_centers2);
        all.right_centers2.extend(chunk.right_centers2);
    }
    Runs should_be_left, should_be_right;
    for (std::size_t chunk = 0; chunk < chunk_count; ++chunk) {
        const std::size_t begin = chunk * kChunk;
        const std::size_t middle = begin + chunks[chunk].left_count;
        const std::size_t end = begin + chunk_refs(chunk).size();
        should_be_left.add(std::max(begin, all.left_count), middle);
        should_be_right.add(middle, std::min(end, all.left_count));
    }
    swap_misplaced(refs, should_be_left, should_be_right);
    return all;
}

std::size_t partition(std::span<PrimitiveRef> refs, const Ranks& ranks, const Split& split) {
    PrimitiveRef sorted[kMaxSorted];
    for (std::size_t i = 0; i < refs.size(); ++i) sorted[ranks.of[i][split.axis]] = refs[i];
    std::copy(sorted, sorted + refs.size(), refs.begin());
    return static_cast<std::size_t>(split.bin);
}

}  // namespace castor
