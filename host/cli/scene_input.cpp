#include "scene_input.h"

#include "castor/error.h"
#include "report.h"

namespace castor::cli {

SceneInput read_scene_input(const std::string& file, TreeQuality quality) {
    SceneInput input;
    if (!is_built_scene(file)) {
        input.scene = load_scene_with_warnings(file);
        return input;
    }
    if (quality != TreeQuality::medium)
        throw UsageError(fmt::format("--quality: the trees of {} are built already; castor build takes the option", file));
    input.built = load_built_scene(file);
    input.scene = input.built->description();
    print_warnings(input.scene.warnings);
    return input;
}

}  // namespace castor::cli
