#include "scene_input.h"

#include "castor/error.h"
#include "castor/scene_io.h"
#include "report.h"

namespace castor::cli {

void SceneInput::build(const std::vector<Device>& devices, const BuildOptions& options, bool quiet) {
    if (built) return;
    const Phase phase("building the trees", quiet);
    built.emplace(std::move(scene), devices, options);
    scene = built->description();
}

SceneInput read_scene_input(const std::string& file, TreeQuality quality, bool quiet) {
    SceneInput input;
    const bool is_built = is_built_scene(file);
    if (is_built && quality != TreeQuality::medium)
        throw UsageError(
            fmt::format("--quality: the trees of {} are built already; castor build takes the option", file));
    {
        const Phase phase(is_built ? "checking " + file : "reading " + file, quiet);
        if (is_built) input.built = load_built_scene(file);
        input.scene = is_built ? input.built->description() : load_scene(file);
    }
    print_warnings(input.scene.warnings);
    return input;
}

}  // namespace castor::cli
