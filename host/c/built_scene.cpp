#include "castor/built_scene.h"

#include "c/handle.h"
#include "trace/scene_contents.h"

using namespace castor;
using namespace castor::c;

castor_status castor_built_scene_create(castor_scene* scene, const castor_devices* devices,
                                        const castor_build_options* options, castor_built_scene** built) {
    return guarded([&] {
        make_handle(built, "built", [&] {
            Scene& from = require(scene, "scene").scene;
            const castor_build_options given = read_options(options);
            BuildOptions build_options;
            build_options.strategy = to_strategy(given.strategy);
            build_options.quality = to_quality(given.quality);
            build_options.use_profiles = !flag(given.ignore_profiles, "ignore_profiles");
            build_options.progress = progress_hook(given.progress, given.progress_user);
            const std::vector<Device> list = devices_of(devices);
            if (!flag(given.take_geometry, "take_geometry"))
                return new castor_built_scene(BuiltScene(from, list, build_options));
            BuiltScene taken(std::move(from), list, build_options);
            from = taken.description();
            return new castor_built_scene(std::move(taken));
        });
    });
}

castor_status castor_built_scene_load(const char* path, castor_progress_function progress, void* user,
                                      castor_built_scene** built) {
    return guarded([&] {
        make_handle(built, "built", [&] {
            return new castor_built_scene(load_built_scene(&require(path, "path"), progress_hook(progress, user)));
        });
    });
}

castor_status castor_built_scene_save(const castor_built_scene* built, const char* path,
                                      castor_progress_function progress, void* user) {
    return guarded([&] {
        const BuiltScene& scene = require(built, "built").built;
        scene.save(&require(path, "path"), progress_hook(progress, user));
    });
}

castor_status castor_is_built_scene(const char* path, uint32_t* is_one) {
    return guarded([&] {
        require(is_one, "is_built_scene");
        *is_one = is_built_scene(&require(path, "path"));
    });
}

void castor_built_scene_retain(castor_built_scene* built) {
    retain(built);
}
void castor_built_scene_release(castor_built_scene* built) {
    release(built);
}

castor_status castor_built_scene_get_counts(const castor_built_scene* built, castor_scene_counts* counts) {
    return guarded([&] {
        const BuiltScene& scene = require(built, "built").built;
        const SceneContents& contents = contents_of(scene);
        const std::size_t instances = contents.arrays().instances.size();
        castor_scene_counts told{};
        told.vertices = contents.counts.vertices;
        told.triangles = contents.counts.triangles;
        told.meshes = contents.counts.meshes;
        told.instances = instances > 0 ? instances - 1 : 0;  // number 0 is what stands in the scene once
        told.spheres = contents.counts.spheres;
        told.planes = contents.counts.planes;
        told.materials = scene.description().materials.size();
        told.lights = scene.description().lights.size();
        told.cameras = scene.description().cameras.size();
        write_struct(counts, told, "counts");
    });
}

castor_status castor_built_scene_find_lights(const castor_built_scene* built, const char* word, uint32_t* lights,
                                             size_t capacity, size_t* count) {
    return guarded(
        [&] { find_lights(require(built, "built").built.description().lights, word, lights, capacity, count); });
}

castor_status castor_built_scene_get_camera(const castor_built_scene* built, size_t i, castor_camera* camera) {
    return guarded([&] { get_camera(require(built, "built").built.description().cameras, i, camera); });
}

castor_status castor_built_scene_get_tone_map_count(const castor_built_scene* built, size_t camera, size_t* count) {
    return guarded([&] {
        const std::vector<Camera>& cameras = require(built, "built").built.description().cameras;
        require(count, "count") = tone_map_count(cameras, camera);
    });
}

castor_status castor_built_scene_get_tone_map(const castor_built_scene* built, size_t camera, size_t i,
                                              castor_tone_map* tone_map, const char** extension) {
    return guarded(
        [&] { get_tone_map(require(built, "built").built.description().cameras, camera, i, tone_map, extension); });
}

castor_status castor_built_scene_get_warning_count(const castor_built_scene* built, size_t* count) {
    return guarded([&] { require(count, "count") = require(built, "built").built.description().warnings.size(); });
}

castor_status castor_built_scene_get_warning(const castor_built_scene* built, size_t i, castor_warning* warning) {
    return guarded([&] { get_warning(require(built, "built").built.description().warnings, i, warning); });
}
