#include "castor/built_scene.h"

#include <fmt/format.h>

#include "base/progress.h"
#include "base/section_file.h"
#include "trace/saved_scene.h"
#include "trace/shared_scene.h"

namespace castor {

namespace {

std::string chunks_text(std::size_t count) {
    return count == 1 ? "one chunk" : fmt::format("{} chunks", count);
}

}  // namespace

std::shared_ptr<SharedScene> share_scene(const Scene& scene, const std::vector<TuningInUse>& tunings,
                                         TreeQuality quality, const ChunkLimits& limits, const ProgressHook& progress) {
    const Progress whole(progress);
    auto shared = std::make_shared<SharedScene>();
    shared->prepared = prepare_scene(scene, strategies_of(tunings), quality, limits, whole);
    whole.reach(1.0);
    return shared;
}

std::shared_ptr<SharedScene> share_scene(Scene&& scene, const std::vector<TuningInUse>& tunings, TreeQuality quality,
                                         const ChunkLimits& limits, const ProgressHook& progress) {
    const Progress whole(progress);
    auto shared = std::make_shared<SharedScene>();
    shared->prepared = prepare_scene(std::move(scene), strategies_of(tunings), quality, limits, whole);
    whole.reach(1.0);
    return shared;
}

std::shared_ptr<SharedScene> complete_scene(const BuiltScene& scene, const std::vector<TuningInUse>& tunings,
                                            TreeQuality quality, const ChunkLimits& limits,
                                            std::vector<Warning>& warnings) {
    SharedScene& shared = *scene.shared();
    std::lock_guard lock(shared.mutex);
    const TreeNeeds needs = needs_of(strategies_of(tunings));
    if (fits(shared.prepared, needs, quality, limits) && add_trees(shared.prepared, needs, quality))
        warnings.push_back(
            {shared.prepared.description.file, 0,
             "was built without a tree that the strategies in use walk; it is built now (castor build with the same "
             "--device and --strategy saves it)"});
    if (fits(shared.prepared, needs, quality, limits)) return scene.shared();
    auto smaller = std::make_shared<SharedScene>();
    smaller->prepared = view_of(shared.prepared, scene.shared());
    cut_to_fit(smaller->prepared, needs, quality, limits);
    warnings.push_back(
        {shared.prepared.description.file, 0,
         fmt::format("was built in {} for devices that can hold larger ones; what is too large is cut "
                     "and built anew, into {} (castor build with the same --device saves them)",
                     chunks_text(shared.prepared.chunks.size()), chunks_text(smaller->prepared.chunks.size()))});
    return smaller;
}

BuiltScene::BuiltScene(const Scene& scene, const std::vector<Device>& devices, const BuildOptions& options)
    : BuiltScene(share_scene(scene, choose_tunings(options.strategy, devices, options.use_profiles), options.quality,
                             limits_of(devices), options.progress)) {}

BuiltScene::BuiltScene(Scene&& scene, const std::vector<Device>& devices, const BuildOptions& options)
    : BuiltScene(share_scene(std::move(scene), choose_tunings(options.strategy, devices, options.use_profiles),
                             options.quality, limits_of(devices), options.progress)) {}

BuiltScene::BuiltScene(std::shared_ptr<SharedScene> shared) : shared_(std::move(shared)) {}

void BuiltScene::save(const std::filesystem::path& file, const ProgressHook& progress) const {
    std::lock_guard lock(shared_->mutex);
    save_scene(file, shared_->prepared, Progress(progress));
}

const Scene& BuiltScene::description() const {
    return shared_->prepared.description;
}
double BuiltScene::flatten_seconds() const {
    return shared_->prepared.flatten_seconds;
}

double BuiltScene::build_seconds() const {
    std::lock_guard lock(shared_->mutex);
    return shared_->prepared.build_seconds;
}

BuiltScene load_built_scene(const std::filesystem::path& file, const ProgressHook& progress) {
    const Progress whole(progress);
    auto shared = std::make_shared<SharedScene>();
    shared->prepared = map_saved_scene(file, whole);
    whole.reach(1.0);
    return BuiltScene(std::move(shared));
}

bool is_built_scene(const std::filesystem::path& file) {
    return is_section_file(file) && !is_section_file_of_another_kind(file, kBuiltSceneFile);
}

}  // namespace castor
