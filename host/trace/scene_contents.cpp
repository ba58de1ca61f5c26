#include "trace/scene_contents.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "base/stopwatch.h"
#include "bvh/bvh.h"
#include "bvh/compressed.h"
#include "bvh/wide.h"
#include "scene/fingerprint.h"
#include "trace/instance_tree.h"

namespace castor {

namespace {

// Shares of the time: flattening of all; cutting, where there is any; a binary tree, and the 8-wide one, of those that
// are built of a geometry.
constexpr double kFlattening = 0.06;
constexpr double kCutting = 0.2;
constexpr double kBinary = 0.7;
constexpr double kWide = 0.85;

// By how many boxes a geometry's instances are bounded, and at most how many of them are turned into the world, so that
// this takes less than a second. Among scans 64 boxes save a tenth of the nodes that rays visit, a thousand hardly
// more.
constexpr std::size_t kMostCoverBoxes = 64;
constexpr std::size_t kCoverBoxes = std::size_t{1} << 22;

Scene without_geometry(const Scene& scene) {
    Scene description;
    description.file = scene.file;
    description.background = scene.background;
    description.ambient_light = scene.ambient_light;
    description.shadow_ray_epsilon = scene.shadow_ray_epsilon;
    description.max_recursion_depth = scene.max_recursion_depth;
    description.cameras = scene.cameras;
    description.lights = scene.lights;
    description.materials = scene.materials;
    description.textures = scene.textures;
    description.background_texture = scene.background_texture;
    description.shades_both_sides = scene.shades_both_sides;
    for (const Image& image : scene.images)
        description.images.push_back({image.file, image.width, image.height, {}, {}});
    description.warnings = scene.warnings;
    return description;
}

SceneContents flatten_alone(const Scene& scene, const Progress& progress) {
    SceneContents contents;
    const Stopwatch watch;
    contents.description = without_geometry(scene);
    SceneArrays& arrays = contents.chunks.front().arrays;
    arrays = flatten(scene, progress);
    contents.fingerprint = fingerprint(arrays);
    contents.counts = {arrays.triangle_count(), arrays.sphere_count(), arrays.plane_count(), arrays.mesh_ranges.size(),
                       arrays.vertex_position.size()};
    contents.flatten_seconds = watch.seconds();
    return contents;
}

// Of the chunk's bounded primitives.
double share_of(const SceneArrays& arrays, const shared::Geometry& part) {
    const std::size_t all = arrays.triangle_count() + arrays.sphere_count();
    return all == 0 ? 0.0 : (double(part.triangle_count) + double(part.sphere_count)) / double(all);
}

void put(Chunk& chunk, WideBvh&& trees) {
    chunk.wide_nodes = std::move(trees.nodes);
    chunk.triangle_blocks = std::move(trees.triangle_blocks);
    chunk.sphere_blocks = std::move(trees.sphere_blocks);
    chunk.wide_roots = std::move(trees.roots);
    chunk.wide_root = trees.root;
    chunk.has_wide = true;
}

void put(Chunk& chunk, CompressedBvh&& trees) {
    chunk.compressed_nodes = std::move(trees.nodes);
    chunk.compressed_primitives = std::move(trees.primitives);
    chunk.compressed_roots = std::move(trees.roots);
    chunk.compressed_levels = trees.levels;
    chunk.has_compressed = true;
}

/// Builds the wanted trees that the chunk does not have.
void build_trees(Chunk& chunk, const Column<shared::Instance>& instances, const TreeNeeds& needs, TreeQuality quality,
                 const Progress& progress) {
    const bool needs_wide = needs.wide && !chunk.has_wide, needs_compressed = needs.compressed && !chunk.has_compressed;
    if (!needs_wide && !needs_compressed) return;
    BvhOptions options = needs_wide ? kForBlocks : BvhOptions{};
    options.quality = quality;
    WideBvh wide;
    CompressedBvh compressed;
    std::vector<Box> boxes(chunk.arrays.geometries.size());
    std::vector<BoxCover> covers(boxes.size());
    const std::size_t cover_size =
        std::clamp<std::size_t>(kCoverBoxes / std::max<std::size_t>(instances.size(), 1), 1, kMostCoverBoxes);
    double done = 0.0;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        const double begin = done;
        done += share_of(chunk.arrays, chunk.arrays.geometries[i]);
        const Progress part = progress.part(begin, done);
        const double wide_end = needs_compressed ? kWide : 1.0;
        const Primitives primitives = primitives_of(chunk.arrays, i);
        const Bvh bvh = build_bvh(primitives, options, part.part(0.0, kBinary));
        if (!bvh.nodes.empty()) boxes[i] = box_of(bvh.nodes.front());
        covers[i] = cover_of(bvh, cover_size);
        if (needs_wide) append(wide, collapse_bvh(primitives, bvh, part.part(kBinary, wide_end)));
        if (needs_compressed)
            append(compressed, compress_bvh(primitives, bvh, part.part(needs_wide ? wide_end : kBinary, 1.0)));
    }
    if (!chunk.has_wide && !chunk.has_compressed) {
        chunk.instance_nodes = build_instance_tree(instances, chunk.arrays.geometries, covers);
        chunk.bounds = boxes.front();
        if (!chunk.instance_nodes.empty()) chunk.bounds.extend(box_of(chunk.instance_nodes.front()));
    }
    if (needs_wide) {
        put(chunk, std::move(wide));
        chunk.wide_instance_nodes = widen_instance_tree(chunk.instance_nodes);
    }
    if (needs_compressed) put(chunk, std::move(compressed));
}

std::uint64_t total_bytes(const SceneContents& contents, const TreeNeeds& needs, TreeQuality quality) {
    std::uint64_t total = 0;
    for (const Chunk& chunk : contents.chunks) total += sizes_of(chunk, needs, quality).total;
    return total;
}

/// Into how many chunks this one is to be cut; a single primitive is not.
std::size_t parts_of(const Chunk& chunk, std::uint64_t total, const TreeNeeds& needs, TreeQuality quality,
                     const ChunkLimits& limits) {
    const bool can_be_cut = chunk.arrays.triangle_count() + chunk.arrays.sphere_count() > 1;
    return can_be_cut ? chunks_needed(sizes_of(chunk, needs, quality), total, limits) : 1;
}

/// Cuts every chunk that does not keep to the limits. Returns whether there was any that could be cut.
bool cut_once(SceneContents& contents, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits,
              const Progress& progress) {
    const std::uint64_t total = total_bytes(contents, needs, quality);
    std::vector<Chunk> chunks;
    for (std::size_t i = 0; i < contents.chunks.size(); ++i) {
        Chunk& chunk = contents.chunks[i];
        const std::size_t parts = parts_of(chunk, total, needs, quality, limits);
        if (parts == 1) {
            chunks.push_back(std::move(chunk));
            continue;
        }
        const double count = double(contents.chunks.size());
        std::vector<Chunk> smaller = cut(chunk, parts, progress.part(double(i) / count, double(i + 1) / count));
        // Nothing but degenerate triangles was left out: the whole chunk stays, since a scene of one chunk has no
        // primitive_numbers.
        if (smaller.size() == 1) smaller.front() = std::move(chunk);
        chunk = {};
        std::move(smaller.begin(), smaller.end(), std::back_inserter(chunks));
    }
    const bool any = chunks.size() > contents.chunks.size();
    contents.chunks = std::move(chunks);
    return any;
}

}  // namespace

bool SceneContents::has_wide() const {
    return std::all_of(chunks.begin(), chunks.end(), [](const Chunk& chunk) { return chunk.has_wide; });
}

bool SceneContents::has_compressed() const {
    return std::all_of(chunks.begin(), chunks.end(), [](const Chunk& chunk) { return chunk.has_compressed; });
}

Box SceneContents::bounds() const {
    Box box;
    for (const Chunk& chunk : chunks) box.extend(chunk.bounds);
    return box;
}

SceneContents build_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
                          const ChunkLimits& limits, const Progress& progress, const OnFlattened& on_flattened) {
    SceneContents contents = flatten_alone(scene, progress.part(0.0, kFlattening));
    if (on_flattened) on_flattened(contents);
    cut_to_fit(contents, needs_of(strategies), quality, limits, progress.part(kFlattening, 1.0));
    return contents;
}

SceneContents build_scene(Scene&& scene, const std::vector<StrategyChoice>& strategies, TreeQuality quality,
                          const ChunkLimits& limits, const Progress& progress, const OnFlattened& on_flattened) {
    SceneContents contents = flatten_alone(scene, progress.part(0.0, kFlattening));
    scene = contents.description;
    if (on_flattened) on_flattened(contents);
    cut_to_fit(contents, needs_of(strategies), quality, limits, progress.part(kFlattening, 1.0));
    return contents;
}

ChunkLimits limits_of(const Device& device) {
    // A render's tile of 512 x 512 takes some 50 MiB, a batch of rays and hits 210. A little device has to do with
    // less.
    constexpr std::uint64_t kMostWork = 256u << 20, kTile = 64u << 20;
    const std::uint64_t bytes = device.global_memory_bytes;
    const std::uint64_t work = std::min(kMostWork, std::max(bytes / 4, std::min(kTile, bytes / 2)));
    return {device.max_allocation_bytes, bytes - work};
}

ChunkLimits limits_of(const std::vector<Device>& devices) {
    ChunkLimits limits;
    for (const Device& device : devices) {
        const ChunkLimits own = limits_of(device);
        limits.column_bytes = std::min(limits.column_bytes, own.column_bytes);
        limits.scene_bytes = std::min(limits.scene_bytes, own.scene_bytes);
    }
    return limits;
}

TreeNeeds needs_of(const std::vector<StrategyChoice>& strategies) {
    const auto needs = [&](Strategy strategy) {
        return std::any_of(strategies.begin(), strategies.end(),
                           [&](const StrategyChoice& choice) { return choice.uses(strategy); });
    };
    return {needs(Strategy::wide) || needs(Strategy::packet), needs(Strategy::simt)};
}

bool add_trees(SceneContents& contents, const TreeNeeds& needs, TreeQuality quality, const Progress& progress) {
    if ((!needs.wide || contents.has_wide()) && (!needs.compressed || contents.has_compressed())) return false;
    const Stopwatch watch;
    // Chunks have about the same number of primitives.
    const double count = double(contents.chunks.size());
    for (std::size_t i = 0; i < contents.chunks.size(); ++i)
        build_trees(contents.chunks[i], contents.arrays().instances, needs, quality,
                    progress.part(double(i) / count, double(i + 1) / count));
    contents.build_seconds += watch.seconds();
    return true;
}

bool fits(const SceneContents& contents, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits) {
    const std::uint64_t total = total_bytes(contents, needs, quality);
    const ChunkLimits rest = limits.without(scene_column_bytes(contents.chunks.front()));
    return std::all_of(contents.chunks.begin(), contents.chunks.end(),
                       [&](const Chunk& chunk) { return parts_of(chunk, total, needs, quality, rest) == 1; });
}

void cut_to_fit(SceneContents& contents, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits,
                const Progress& progress) {
    // Cut by estimates first; then trees are there, and sizes are exact.
    const ChunkLimits rest = limits.without(scene_column_bytes(contents.chunks.front()));
    double cut_share = 0.0;
    do {
        const Stopwatch watch;
        while (cut_once(contents, needs, quality, rest, progress.part(0.0, kCutting))) cut_share = kCutting;
        contents.build_seconds += watch.seconds();
    } while (add_trees(contents, needs, quality, progress.part(cut_share, 1.0)));
}

void cut_into(SceneContents& contents, std::size_t chunk_count, const TreeNeeds& needs, TreeQuality quality,
              const Progress& progress) {
    const Stopwatch watch;
    const std::uint64_t total = total_bytes(contents, needs, quality);
    ChunkLimits limits;
    limits.scene_bytes = std::min(total - 1, ChunkLimits::kShareOfChunk * (total / chunk_count));
    while (contents.chunks.size() < chunk_count &&
           cut_once(contents, needs, quality, limits, progress.part(0.0, kCutting)))
        continue;
    contents.build_seconds += watch.seconds();
    add_trees(contents, needs, quality, progress.part(kCutting, 1.0));
}

std::vector<Range> divide_chunks(const SceneContents& contents, std::size_t count) {
    std::vector<std::uint64_t> bytes_before{0};
    for (const Chunk& chunk : contents.chunks)
        bytes_before.push_back(bytes_before.back() + sizes_of(chunk, {}, TreeQuality::medium).total);
    const std::size_t chunks = contents.chunks.size();
    std::vector<Range> ranges;
    std::size_t begin = 0;
    for (std::size_t share = 1; share <= count; ++share) {
        // The end is where the bytes before come closest to the share's, with a chunk left for each of the next.
        const double wanted = double(bytes_before.back()) * double(share) / double(count);
        std::size_t end = std::min(begin + 1, chunks);
        while (end < chunks && chunks - end > count - share &&
               std::abs(double(bytes_before[end + 1]) - wanted) <= std::abs(double(bytes_before[end]) - wanted))
            ++end;
        if (share == count) end = chunks;
        ranges.push_back({begin, end});
        begin = end;
    }
    return ranges;
}

std::string describe_division(const SceneContents& contents, const SceneShare& share) {
    if (share.is_whole()) return {};
    return fmt::format("chunks {}\nshares {}\n", contents.chunks.size(), share.count);
}

SceneContents view_of(const SceneContents& contents, std::shared_ptr<const void> lender) {
    SceneContents view;
    view.lender = std::move(lender);
    view.description = contents.description;
    view.fingerprint = contents.fingerprint;
    view.counts = contents.counts;
    view.chunks.resize(contents.chunks.size());
    view.flatten_seconds = contents.flatten_seconds;
    for (std::size_t i = 0; i < contents.chunks.size(); ++i) {
        const Chunk& from = contents.chunks[i];
        Chunk& to = view.chunks[i];
        static_cast<SceneSettings&>(to.arrays) = from.arrays;
        to.bounds = from.bounds;
        to.compressed_levels = from.compressed_levels;
        to.wide_root = from.wide_root;
        to.has_compressed = from.has_compressed;
        to.has_wide = from.has_wide;
        std::vector<std::pair<const void*, std::size_t>> columns;
        for_each_column(from,
                        [&](const char*, const auto& column) { columns.emplace_back(column.data(), column.size()); });
        auto next = columns.begin();
        for_each_column(to, [&]<class T>(const char*, Column<T>& column) {
            column = column_in_place(static_cast<const T*>(next->first), next->second);
            ++next;
        });
    }
    return view;
}

}  // namespace castor
