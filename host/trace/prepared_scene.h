#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/box.h"
#include "base/mapped_file.h"
#include "base/progress.h"
#include "castor/device.h"
#include "castor/tracer.h"
#include "trace/chunk.h"
#include "trace/strategy_choice.h"

namespace castor {

/// What there is in a whole scene, however it is cut.
struct SceneCounts {
    std::uint64_t triangles = 0, spheres = 0, planes = 0;
    std::uint64_t meshes = 0, vertices = 0;  // of meshes that have triangles
};

/// A scene's columns and the trees that the chosen strategies walk, in as many chunks as the devices' limits make
/// necessary.
struct PreparedScene {
    std::shared_ptr<const MappedFile> file;  // in which columns stand; null: all are in memory of their own
    std::shared_ptr<const void> lender;      // whose columns some of these are (see view_of); null: nobody
    Scene description;                       // what is not geometry
    std::uint64_t fingerprint = 0;           // of the arrays before they are cut
    SceneCounts counts;
    std::vector<Chunk> chunks = std::vector<Chunk>(1);
    double flatten_seconds = 0.0;
    double build_seconds = 0.0;

    /// The columns of the first chunk: those of the whole scene, if it is the only one, and what is not cut.
    const SceneArrays& arrays() const { return chunks.front().arrays; }
    /// Whether there are such trees, of all chunks.
    bool has_wide() const;
    bool has_compressed() const;
    /// Of all bounded primitives, of instances a little larger; empty if there is none, or there are no trees.
    Box bounds() const;
};

/// Flattens, and builds the trees that these strategies walk, in chunks that keep to the limits as far as a primitive
/// can. Throws SceneError.
PreparedScene prepare_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies,
                            TreeQuality quality = TreeQuality::medium, const ChunkLimits& limits = {},
                            const Progress& progress = {});
/// The same; the scene's geometry is given back before trees are built, so that both are never held.
PreparedScene prepare_scene(Scene&& scene, const std::vector<StrategyChoice>& strategies,
                            TreeQuality quality = TreeQuality::medium, const ChunkLimits& limits = {},
                            const Progress& progress = {});

/// Of a device: its memory is shared with rays and programs. Of several: what suits all of them.
ChunkLimits limits_of(const Device& device);
ChunkLimits limits_of(const std::vector<Device>& devices);

/// Whether the strategies walk them.
TreeNeeds needs_of(const std::vector<StrategyChoice>& strategies);

/// Builds those of the trees that are not there yet. Returns whether there were any.
bool add_trees(PreparedScene& prepared, const TreeNeeds& needs, TreeQuality quality = TreeQuality::medium,
               const Progress& progress = {});

/// Whether all chunks keep to the limits. Trees that are yet to be built are estimated.
bool fits(const PreparedScene& prepared, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits);

/// Cuts what does not fit, and builds the trees. Chunks that fit stay as they are.
void cut_to_fit(PreparedScene& prepared, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits,
                const Progress& progress = {});

/// The same scene, whose columns are those of `lender`'s scene, in place.
PreparedScene view_of(const PreparedScene& prepared, std::shared_ptr<const void> lender);

/// Calls visit(name, column) for every column of all chunks; those of further chunks have names that end with the
/// chunk's number.
template <class Prepared, class Visit>
void for_each_column_of_chunks(Prepared& prepared, const Visit& visit) {
    for (std::size_t i = 0; i < prepared.chunks.size(); ++i)
        for_each_column(prepared.chunks[i], [&](const char* name, auto& column) {
            visit(i == 0 ? std::string(name) : std::string(name) + '@' + std::to_string(i), column);
        });
}

}  // namespace castor
