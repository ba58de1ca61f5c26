#include "scene_input.h"

#include "castor/error.h"
#include "castor/scene_io.h"
#include "number_check.h"
#include "report.h"

namespace castor::cli {

void SceneInput::build(const std::vector<Device>& devices, BuildOptions options, bool quiet,
                       const ProgramsOfScene& programs) {
    if (built) return;
    Phase phase("building the trees", quiet);
    options.progress = phase.hook();
    built = BuiltSceneAccess::build(std::move(scene), devices, options, programs);
    scene = built->description();
    if (!strict) return;
    const std::vector<Warning>& of_geometry = contents_of(*built).arrays().warnings;
    print_warnings(of_geometry);
    refuse_warnings(scene.file, of_geometry.size());
}

void SceneInput::refuse_warnings(const std::string& file, std::size_t count) const {
    if (strict && count > 0)
        throw SceneError(file, 0,
                         fmt::format("has {} warning{}, which --strict takes as errors", count, count == 1 ? "" : "s"));
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
    CLI::Option* const time = command.add_option(
        "--time", options.time_seconds, "seconds at which a glTF file's animation is shown; without it, the rest pose");
    time->check(finite_number());
    command
        .add_option("--animation", options.animation,
                    "which animation of a glTF file --time shows: a number from 1 on, a name, or all together")
        ->type_name("NUMBER|NAME|all")
        ->needs(time);
    command
        .add_option("--material-variant", options.material_variant,
                    "which material variant of a glTF file is shown: a number from 1 on or a name")
        ->type_name("NUMBER|NAME");
    command
        .add_option_function<float>(
            "--sun-angle", [&options](float degrees) { options.sun_angle_radians = glm::radians(degrees); },
            "degrees under which directional lights are seen (the sun: 0.53): their shadows have soft edges")
        ->type_name("DEGREES")
        ->check(number_in(0.0, 180.0));
}

SceneInput read_scene_input(const std::string& file, TreeQuality quality, const ReadingOptions& options) {
    SceneInput input;
    input.strict = options.strict;
    const bool is_built = is_built_scene(file);
    if (is_built && quality != TreeQuality::medium)
        throw UsageError(
            fmt::format("--quality: the trees of {} are built already; castor build takes the option", file));
    if (is_built && !options.load.environment.empty())
        throw UsageError(fmt::format("--environment: {} is built already; castor build takes the option", file));
    if (is_built && options.load.time_seconds)
        throw UsageError(fmt::format("--time: {} is built already; castor build takes the option", file));
    if (is_built && options.load.material_variant)
        throw UsageError(fmt::format("--material-variant: {} is built already; castor build takes the option", file));
    if (is_built && options.load.sun_angle_radians)
        throw UsageError(fmt::format("--sun-angle: {} is built already; castor build takes the option", file));
    if (!is_built) {
        input.scene = read_scene(file, options.quiet, options.load);
        input.refuse_warnings(file, input.scene.warnings.size());
        return input;
    }
    {
        Phase phase("checking " + file, options.quiet);
        input.built = load_built_scene(file, phase.hook());
    }
    input.scene = input.built->description();
    print_warnings(input.scene.warnings);
    const std::vector<Warning>& of_geometry = contents_of(*input.built).arrays().warnings;
    if (options.strict) print_warnings(of_geometry);
    input.refuse_warnings(file, input.scene.warnings.size() + of_geometry.size());
    return input;
}

}  // namespace castor::cli
