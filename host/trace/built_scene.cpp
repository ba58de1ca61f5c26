#include "castor/built_scene.h"

#include "progress.h"
#include "scene/section_file.h"
#include "trace/saved_scene.h"
#include "trace/shared_scene.h"

namespace castor {

std::shared_ptr<SharedScene> share_scene(const Scene& scene, const std::vector<TuningInUse>& tunings,
                                         TreeQuality quality, std::uint64_t max_column_bytes, const ProgressHook& progress) {
    const Progress whole(progress);
    auto shared = std::make_shared<SharedScene>();
    shared->prepared = prepare_scene(scene, strategies_of(tunings), quality, max_column_bytes, whole);
    whole.reach(1.0);
    return shared;
}

std::shared_ptr<SharedScene> share_scene(Scene&& scene, const std::vector<TuningInUse>& tunings, TreeQuality quality,
                                         std::uint64_t max_column_bytes, const ProgressHook& progress) {
    const Progress whole(progress);
    auto shared = std::make_shared<SharedScene>();
    shared->prepared = prepare_scene(std::move(scene), strategies_of(tunings), quality, max_column_bytes, whole);
    whole.reach(1.0);
    return shared;
}

std::shared_ptr<SharedScene> complete_scene(const BuiltScene& scene, const std::vector<TuningInUse>& tunings,
                                            TreeQuality quality, std::uint64_t max_column_bytes,
                                            std::vector<Warning>& warnings) {
    SharedScene& shared = *scene.shared();
    std::lock_guard lock(shared.mutex);
    if (add_trees(shared.prepared, strategies_of(tunings), quality, max_column_bytes))
        warnings.push_back(
            {shared.prepared.description.file, 0,
             "was built without a tree that the strategies in use walk; it is built now (castor build with the same "
             "--device and --strategy saves it)"});
    return scene.shared();
}

BuiltScene::BuiltScene(const Scene& scene, const std::vector<Device>& devices, const BuildOptions& options)
    : BuiltScene(share_scene(scene, choose_tunings(options.strategy, devices, options.use_profiles), options.quality,
                             common_allocation(devices), options.progress)) {
}

BuiltScene::BuiltScene(Scene&& scene, const std::vector<Device>& devices, const BuildOptions& options)
    : BuiltScene(share_scene(std::move(scene), choose_tunings(options.strategy, devices, options.use_profiles),
                             options.quality, common_allocation(devices), options.progress)) {}

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
    return is_section_file(file);
}

}  // namespace castor
