#include "castor/built_scene.h"

#include <fmt/format.h>

#include <utility>

#include "base/progress.h"
#include "base/section_file.h"
#include "trace/saved_scene.h"
#include "trace/scene_contents.h"

namespace castor {

namespace {

std::string chunks_text(std::size_t count) {
    return count == 1 ? "one chunk" : fmt::format("{} chunks", count);
}

/// Returns the kinds of trees that are needed and missing.
std::string missing_trees(const SceneContents& contents, const TreeNeeds& needs) {
    const bool lacks_wide = needs.wide && !contents.has_wide();
    const bool lacks_compressed = needs.compressed && !contents.has_compressed();
    return lacks_wide && lacks_compressed ? "wide and a compressed" : lacks_wide ? "wide" : "compressed";
}

/// `scene` is a Scene, const or to be taken apart.
template <class AnyScene>
std::shared_ptr<SceneContents> contents_for(AnyScene&& scene, const std::vector<Device>& devices,
                                            const BuildOptions& options, const ProgramsOfScene& programs = {}) {
    const Progress whole(options.progress);
    const std::vector<TuningInUse> tunings = choose_tunings(options.strategy, devices, options.use_profiles);
    const auto begin_programs = [&](SceneContents& contents) {
        // Those of a scene that has to be cut are others.
        if (!programs || !fits(contents, needs_of(strategies_of(tunings)), options.quality, limits_of(devices))) return;
        for (std::size_t i = 0; i < devices.size(); ++i)
            contents.contexts_ahead.begin(devices[i], programs(contents.arrays(), tunings[i].tuning));
    };
    auto contents =
        std::make_shared<SceneContents>(build_scene(std::forward<AnyScene>(scene), strategies_of(tunings),
                                                    options.quality, limits_of(devices), whole, begin_programs));
    whole.reach(1.0);
    return contents;
}

}  // namespace

std::shared_ptr<SceneContents> complete_scene(const BuiltScene& scene, const std::vector<TuningInUse>& tunings,
                                              TreeQuality quality, const ChunkLimits& limits,
                                              std::vector<Warning>& warnings) {
    SceneContents& contents = contents_of(scene);
    std::lock_guard lock(*contents.mutex);
    const TreeNeeds needs = needs_of(strategies_of(tunings));
    const std::string missing = missing_trees(contents, needs);
    if (fits(contents, needs, quality, limits) && add_trees(contents, needs, quality))
        warnings.push_back(
            {contents.description.file, 0,
             fmt::format("was built without a {} tree, which the strategies in use traverse; it is built "
                         "now (castor build with the same --device and --strategy saves it)",
                         missing)});
    if (fits(contents, needs, quality, limits)) return BuiltSceneAccess::contents(scene);
    auto smaller = std::make_shared<SceneContents>(view_of(contents, BuiltSceneAccess::contents(scene)));
    cut_to_fit(*smaller, needs, quality, limits);
    warnings.push_back({contents.description.file, 0,
                        fmt::format("was built in {} for devices that can hold larger ones; what is too large is cut "
                                    "and built anew, into {} (castor build with the same --device saves them)",
                                    chunks_text(contents.chunks.size()), chunks_text(smaller->chunks.size()))});
    return smaller;
}

BuiltScene divide_scene(const BuiltScene& scene, const std::vector<Device>& devices, const BuildOptions& options,
                        std::size_t shares, std::vector<Warning>& warnings) {
    const std::vector<TuningInUse> tunings = choose_tunings(options.strategy, devices, options.use_profiles);
    std::shared_ptr<SceneContents> whole =
        complete_scene(scene, tunings, options.quality, limits_of(devices), warnings);
    if (whole->chunks.size() >= shares) return BuiltSceneAccess::scene_of(whole);
    SceneContents divided;
    {
        std::lock_guard lock(*whole->mutex);
        divided = view_of(*whole, whole);
    }
    const TreeNeeds needs = needs_of(strategies_of(tunings));
    cut_into(divided, 2 * shares, needs, options.quality, Progress(options.progress));
    if (divided.chunks.size() < shares)
        throw SceneError(whole->description.file, 0,
                         fmt::format("can be cut into {} at most, and {} processes are to keep some each",
                                     chunks_text(divided.chunks.size()), shares));
    warnings.push_back({whole->description.file, 0,
                        fmt::format("was built in {}; for {} processes it is cut and built anew, into {} (castor build "
                                    "with a --device-memory-limit saves chunks)",
                                    chunks_text(whole->chunks.size()), shares, chunks_text(divided.chunks.size()))});
    return BuiltSceneAccess::scene_of(std::make_shared<SceneContents>(std::move(divided)));
}

BuiltScene::BuiltScene(const Scene& scene, const std::vector<Device>& devices, const BuildOptions& options)
    : BuiltScene(contents_for(scene, devices, options)) {}

BuiltScene::BuiltScene(Scene&& scene, const std::vector<Device>& devices, const BuildOptions& options)
    : BuiltScene(contents_for(std::move(scene), devices, options)) {}

BuiltScene BuiltSceneAccess::build(Scene&& scene, const std::vector<Device>& devices, const BuildOptions& options,
                                   const ProgramsOfScene& programs) {
    return scene_of(contents_for(std::move(scene), devices, options, programs));
}

BuiltScene::BuiltScene(std::shared_ptr<Contents> contents) : contents_(std::move(contents)) {}

void BuiltScene::save(const std::filesystem::path& file, const ProgressHook& progress) const {
    std::lock_guard lock(*contents_->mutex);
    save_scene(file, *contents_, Progress(progress));
}

const Scene& BuiltScene::description() const {
    return contents_->description;
}
double BuiltScene::flatten_seconds() const {
    return contents_->flatten_seconds;
}

double BuiltScene::build_seconds() const {
    std::lock_guard lock(*contents_->mutex);
    return contents_->build_seconds;
}

BuiltScene load_built_scene(const std::filesystem::path& file, const ProgressHook& progress) {
    const Progress whole(progress);
    auto contents = std::make_shared<SceneContents>(map_saved_scene(file, whole));
    whole.reach(1.0);
    return BuiltSceneAccess::scene_of(std::move(contents));
}

bool is_built_scene(const std::filesystem::path& file) {
    return is_section_file(file) && !is_section_file_of_another_kind(file, kBuiltSceneFile);
}

}  // namespace castor
