#include "scene_input.h"

#include "castor/error.h"
#include "castor/scene_io.h"
#include "report.h"

namespace castor::cli {

void SceneInput::build(const std::vector<Device>& devices, BuildOptions options, bool quiet,
                       const ProgramsOfScene& programs) {
    if (built) return;
    Phase phase("building the trees", quiet);
    options.progress = phase.hook();
    built = BuiltSceneAccess::build(std::move(scene), devices, options, programs);
    scene = built->description();
}

bool SceneInput::divide(const std::vector<Device>& devices, BuildOptions options, std::size_t shares, bool quiet) {
    std::vector<Warning> warnings;
    {
        Phase phase("cutting the scene", quiet);
        options.progress = phase.hook();
        built = divide_scene(*built, devices, options, shares, warnings);
    }
    print_warnings(warnings);
    return !warnings.empty();
}

Scene read_scene(const std::string& file, bool quiet, const LoadOptions& options) {
    Scene scene;
    {
        Phase phase("reading " + file, quiet);
        scene = load_scene(file, options, phase.hook());
    }
    print_warnings(scene.warnings);
    return scene;
}

void add_strict_option(CLI::App& command, bool& strict) {
    command.add_flag("--strict", strict, "refuse a scene that cannot be read without warnings");
}

void add_load_options(CLI::App& command, LoadOptions& options) {
    command.add_option("--environment", options.environment,
                       "picture of all directions (.hdr, .exr ...) that lights the scene; 1 is white");
    command.add_option("--time", options.time_seconds,
                       "seconds at which a glTF file's animation is shown; without it, the rest pose");
}

namespace {

void refuse_warnings(const Scene& scene, const std::string& file, const ReadingOptions& options) {
    const std::size_t count = scene.warnings.size();
    if (options.strict && count > 0)
        throw SceneError(file, 0,
                         fmt::format("has {} warning{}, which --strict takes as errors", count, count == 1 ? "" : "s"));
}

}  // namespace

SceneInput read_scene_input(const std::string& file, TreeQuality quality, const ReadingOptions& options) {
    SceneInput input;
    const bool is_built = is_built_scene(file);
    if (is_built && quality != TreeQuality::medium)
        throw UsageError(
            fmt::format("--quality: the trees of {} are built already; castor build takes the option", file));
    if (is_built && !options.load.environment.empty())
        throw UsageError(fmt::format("--environment: {} is built already; castor build takes the option", file));
    if (is_built && options.load.time_seconds)
        throw UsageError(fmt::format("--time: {} is built already; castor build takes the option", file));
    if (!is_built) {
        input.scene = read_scene(file, options.quiet, options.load);
        refuse_warnings(input.scene, file, options);
        return input;
    }
    {
        Phase phase("checking " + file, options.quiet);
        input.built = load_built_scene(file, phase.hook());
    }
    input.scene = input.built->description();
    print_warnings(input.scene.warnings);
    refuse_warnings(input.scene, file, options);
    return input;
}

}  // namespace castor::cli
