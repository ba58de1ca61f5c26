#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "base/box.h"
#include "base/mapped_file.h"
#include "base/progress.h"
#include "base/range.h"
#include "castor/built_scene.h"
#include "castor/device.h"
#include "castor/scene_share.h"
#include "castor/tracer.h"
#include "opencl/contexts_ahead.h"
#include "trace/chunk.h"
#include "trace/strategy_choice.h"
#include "trace/tuning.h"

namespace castor {

/// The numbers of things in a whole scene, however it is cut.
struct SceneCounts {
    std::uint64_t triangles = 0, spheres = 0, planes = 0;
    std::uint64_t meshes = 0, vertices = 0;  // of meshes that have triangles
};

/// What stands behind a BuiltScene: a scene's columns and the trees that the chosen strategies traverse, in as many
/// chunks as the devices' limits make necessary. Several renderers and tracers may use it: `mutex` is held where trees
/// are added and columns uploaded; what has been uploaded does not change.
struct BuiltScene::Contents {
    // On the heap, so that contents can be moved before they are shared.
    std::unique_ptr<std::mutex> mutex = std::make_unique<std::mutex>();
    std::shared_ptr<const MappedFile> file;  // in which columns stand; null: all are in memory of their own
    std::shared_ptr<const void> lender;      // whose columns some of these are (see view_of); null: nobody
    Scene description;                       // what is not geometry
    std::uint64_t fingerprint = 0;           // of the arrays before they are cut
    SceneCounts counts;
    std::vector<Chunk> chunks = std::vector<Chunk>(1);
    double flatten_seconds = 0.0;
    double build_seconds = 0.0;
    ContextsAhead contexts_ahead;  // for the first who put the scene on these devices

    /// The columns of the first chunk: those of the whole scene, if it is the only one, and what is not cut.
    const SceneArrays& arrays() const { return chunks.front().arrays; }
    /// Whether there are such trees, of all chunks.
    bool has_wide() const;
    bool has_compressed() const;
    /// Bounds all bounded primitives, instances a little larger; empty if there is none, or there are no trees.
    Box bounds() const;
};

/// Returns the programs that a device with this tuning will need for a scene.
using ProgramsOfScene = std::function<std::vector<KernelProgram>(const SceneArrays& arrays, const Tuning& tuning)>;

/// The library's own way to the contents of a BuiltScene.
struct BuiltSceneAccess {
    using Contents = BuiltScene::Contents;
    /// As BuiltScene does. While the trees are built, so are these programs, for the first who put the scene on the
    /// devices.
    static BuiltScene build(Scene&& scene, const std::vector<Device>& devices, const BuildOptions& options,
                            const ProgramsOfScene& programs);
    static const std::shared_ptr<Contents>& contents(const BuiltScene& scene) { return scene.contents_; }
    static BuiltScene scene_of(std::shared_ptr<Contents> contents) { return BuiltScene(std::move(contents)); }
};
using SceneContents = BuiltSceneAccess::Contents;

inline SceneContents& contents_of(const BuiltScene& scene) {
    return *BuiltSceneAccess::contents(scene);
}

/// What is to be done with a flat scene before its trees are built.
using OnFlattened = std::function<void(SceneContents& contents)>;

/// Flattens the scene and builds the trees that these strategies traverse, in chunks that keep to the limits as far as
/// a primitive can. Calls `on_flattened` between the two. Throws SceneError.
SceneContents build_scene(const Scene& scene, const std::vector<StrategyChoice>& strategies,
                          TreeQuality quality = TreeQuality::medium, const ChunkLimits& limits = {},
                          const Progress& progress = {}, const OnFlattened& on_flattened = {});
/// The same; the scene's geometry is given back before trees are built, so that both are never held.
SceneContents build_scene(Scene&& scene, const std::vector<StrategyChoice>& strategies,
                          TreeQuality quality = TreeQuality::medium, const ChunkLimits& limits = {},
                          const Progress& progress = {}, const OnFlattened& on_flattened = {});

/// Returns the scene with all trees that these devices traverse, in chunks that they can hold. Builds missing trees;
/// where a chunk is too large, cuts it and builds its trees anew, which makes other contents, since the chunks may be
/// in use. Adds a warning for either.
std::shared_ptr<SceneContents> complete_scene(const BuiltScene& scene, const std::vector<TuningInUse>& tunings,
                                              TreeQuality quality, const ChunkLimits& limits,
                                              std::vector<Warning>& warnings);

/// Divides the chunks, in their order, into so many ranges of about equally many bytes: neighbours in space stay
/// together. No range is empty where there are as many chunks as ranges.
std::vector<Range> divide_chunks(const SceneContents& contents, std::size_t count);

/// What processes that divide a scene must agree on, a line each; empty where it is not divided.
std::string describe_division(const SceneContents& contents, const SceneShare& share);

/// The same scene with all trees that these devices traverse, in at least as many chunks as there are shares. Where
/// chunks have to be cut for it, or do not fit, their trees are built anew, with a warning. Throws SceneError where
/// there are too few primitives for that.
BuiltScene divide_scene(const BuiltScene& scene, const std::vector<Device>& devices, const BuildOptions& options,
                        std::size_t shares, std::vector<Warning>& warnings);

/// Returns the limits for one device, which leave room for rays and programs; for several devices, the smallest of each
/// limit.
ChunkLimits limits_of(const Device& device);
ChunkLimits limits_of(const std::vector<Device>& devices);

/// Returns which trees the strategies traverse.
TreeNeeds needs_of(const std::vector<StrategyChoice>& strategies);

/// Builds the trees that are missing. Returns whether any was.
bool add_trees(SceneContents& contents, const TreeNeeds& needs, TreeQuality quality = TreeQuality::medium,
               const Progress& progress = {});

/// Whether all chunks keep to the limits. Trees that are yet to be built are estimated.
bool fits(const SceneContents& contents, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits);

/// Cuts the chunks that do not fit, and builds the trees. Chunks that fit stay as they are.
void cut_to_fit(SceneContents& contents, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits,
                const Progress& progress = {});

/// Cuts the chunks that are larger than the others, until there are about so many or more, as far as primitives allow,
/// and builds the trees.
void cut_into(SceneContents& contents, std::size_t chunk_count, const TreeNeeds& needs, TreeQuality quality,
              const Progress& progress = {});

/// Returns the same scene without columns of its own: they are those of `contents`, which `lender` keeps alive.
SceneContents view_of(const SceneContents& contents, std::shared_ptr<const void> lender);

/// Calls visit(name, column) for every column of all chunks; those of further chunks have names that end with the
/// chunk's number.
template <class Contents, class Visit>
void for_each_column_of_chunks(Contents& contents, const Visit& visit) {
    for (std::size_t i = 0; i < contents.chunks.size(); ++i)
        for_each_column(contents.chunks[i], [&](const char* name, auto& column) {
            visit(i == 0 ? std::string(name) : std::string(name) + '@' + std::to_string(i), column);
        });
}

}  // namespace castor
