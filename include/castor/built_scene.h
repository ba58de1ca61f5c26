#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "castor/api.h"
#include "castor/device.h"
#include "castor/progress.h"
#include "castor/scene.h"
#include "castor/tracer.h"

namespace castor {

struct BuildOptions {
    Strategy strategy = Strategy::automatic;
    TreeQuality quality = TreeQuality::medium;
    bool use_profiles = true;    // what `castor tune` stored for the devices may say which trees they traverse
    ProgressHook progress = {};  // of flattening and building
};

/// A scene made ready for devices: flattened, and with the trees that they traverse. `Renderer` and `Tracer` take it as
/// it is. Copies share the same contents. Usable from several threads.
class CASTOR_API BuiltScene {
public:
    /// Flattens the scene and builds the trees that these devices traverse. `scene` is not kept. Throws SceneError if
    /// it is wrong, Interrupted where `options.progress` says so.
    BuiltScene(const Scene& scene, const std::vector<Device>& devices, const BuildOptions& options = {});
    /// The same, with less memory: the scene gives its geometry back before the trees are built.
    BuiltScene(Scene&& scene, const std::vector<Device>& devices, const BuildOptions& options = {});

    /// Writes it to a file that load_built_scene reads, on any machine of the same byte order. Throws FileError, and
    /// Interrupted where `progress` says so; an old file is then as it was.
    void save(const std::filesystem::path& file, const ProgressHook& progress = {}) const;

    /// What the scene has beside geometry: cameras, lights, materials, textures, warnings. No mesh, sphere or plane,
    /// and of images the file and the size, without texels. `file` is that which was loaded.
    const Scene& description() const;
    /// Seconds spent on flattening the scene, and on the trees; not those of the program that saved it.
    double flatten_seconds() const;
    double build_seconds() const;

private:
    struct Contents;
    friend struct BuiltSceneAccess;  // the library's own
    explicit BuiltScene(std::shared_ptr<Contents> contents);

    std::shared_ptr<Contents> contents_;
};

/// Maps what BuiltScene::save wrote: devices that share the host's memory use it in place. The file must not be changed
/// meanwhile (save leaves a file that it replaces to those who use it). Every byte is checked. Throws SceneError (what,
/// where, found and expected) where the file is missing, damaged, cut short, or of another version or byte order.
/// Throws Interrupted where `progress` says so.
CASTOR_API BuiltScene load_built_scene(const std::filesystem::path& file, const ProgressHook& progress = {});

/// Whether the file begins as one of BuiltScene::save. False for what cannot be read.
CASTOR_API bool is_built_scene(const std::filesystem::path& file);

}  // namespace castor
