// castor render: renders a scene file, one picture a camera.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <glm/vec4.hpp>
#include <memory>
#include <numeric>
#include <set>
#include <sstream>
#include <system_error>

#include "base/atomic_file.h"
#include "base/name_table.h"
#include "base/section_file.h"
#include "base/stopwatch.h"
#include "castor/denoise.h"
#include "castor/error.h"
#include "castor/image_io.h"
#include "castor/renderer.h"
#include "castor/shared/constants.h"
#include "castor/tone_map.h"
#include "commands.h"
#include "interrupt.h"
#include "memory_options.h"
#include "number_check.h"
#include "part.h"
#include "picture_files.h"
#include "picture_names.h"
#include "progress_bar.h"
#include "render/film_comparison.h"
#include "render/light_planes.h"
#include "render/programs_ahead.h"
#include "render/remote_render.h"
#include "report.h"
#include "scene/scene_limits.h"
#include "scene_input.h"
#include "team.h"
#include "tuning_report.h"

namespace castor::cli {

namespace {

namespace fs = std::filesystem;

constexpr const char* kRenderFooter =
    R"(The picture's file: without -o, the camera's image name in the current folder, or SCENE's stem and .png (with the
camera's number if there are several). -o FOLDER/ puts these names into a folder and makes it if need be. -o FILE names
the picture itself; with several cameras their numbers come before the extension. Names that would be equal get numbers.
Formats: .png and .ppm (8 bits), .pfm, .hdr and .exr (linear floats). Each tone map of the camera goes to STEM and its
extension, or .png; a picture of 8 bits is itself the first one's. A plane of --aov goes to STEM.NAME.exr beside the
picture, or with --layers into the picture itself, an .exr.

Ctrl-C stops early: the picture so far is written, and the exit status is 130. A second Ctrl-C ends at once.
--checkpoint FILE keeps what is done every minute, and when the render stops early. --resume FILE goes on from there, on
any devices, to the same picture. FILE is removed when the picture is written. Several devices share a picture by their
speeds; a device that fails is dropped, and the others do its work. --checkpoint and --resume with the same FILE go on
from there if it exists, and begin if not.

--part i/n renders the i-th of n parts of the picture, which may run at any time and anywhere, and keeps it in the
checkpoint; castor merge makes the picture of these.

Examples:
  castor render scene.xml
  castor render bunny.ply -o bunny.png --size 1920x1080 --samples 16
  castor render scene.xml -o pictures/ --camera 2 --aov depth,normal,primitive
  castor render scene.xml -o linear.exr --device gpu --json
  castor render scene.xml -o picture.png --device all --samples 4096 --checkpoint picture.checkpoint
  castor render scene.xml --camera 1 --part 2/8 --checkpoint part2 --resume part2)";

/// A picture's size in pixels; zeros mean the camera's own.
struct Size {
    std::uint32_t width = 0, height = 0;
};

struct RenderCommandOptions {
    std::string scene;
    std::string output;
    std::string device;
    std::string size;
    std::string camera = "all";
    std::string filter;
    std::string strategy = "auto";
    std::string quality = "medium";
    bool use_profiles = true;
    std::string rules = "r2022";
    std::string order = "pieces";
    std::string sample_order = "pixel";
    std::vector<std::string> light_groups;
    PlaneFiles plane_files = PlaneFiles::beside;
    std::string integrator;
    std::string light_choice;
    std::string denoiser;
    std::optional<std::uint32_t> max_depth;
    std::string tone;
    std::optional<double> exposure;
    RenderOptions render;
    std::optional<std::uint64_t> memory_limit;
    std::string checkpoint, resume;
    std::optional<std::string> part;
    double verify_percent = 0.0;
    bool distributes_scene = false;
    double deadline_seconds = RendererOptions().deadline_seconds;
    DeviceLimits device_limits;
    bool strict = false;
    LoadOptions load;
    ReportOptions report;
};

std::optional<std::uint64_t> whole_number(std::string_view text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

Size parse_size(const std::string& text) {
    const std::size_t cross = text.find('x');
    if (cross != std::string::npos) {
        const auto width = whole_number(std::string_view(text).substr(0, cross));
        const auto height = whole_number(std::string_view(text).substr(cross + 1));
        const auto is_good = [](const auto& edge) {
            return edge && *edge >= 1 && *edge <= std::uint64_t{kMaxImageResolution};
        };
        if (is_good(width) && is_good(height))
            return {static_cast<std::uint32_t>(*width), static_cast<std::uint32_t>(*height)};
    }
    throw UsageError(fmt::format("--size: \"{}\" is not WIDTHxHEIGHT with numbers from 1 to {}, such as 800x600", text,
                                 kMaxImageResolution));
}

/// What --light-group says.
struct LightGroupWords {
    std::string name;
    std::vector<std::string> lights;  // numbers and names
};

/// Reads "NAME=LIGHT,LIGHT...".
LightGroupWords parse_light_group(const std::string& text) {
    const std::size_t equals = text.find('=');
    LightGroupWords group{text.substr(0, equals), {}};
    std::istringstream words(equals == std::string::npos ? "" : text.substr(equals + 1));
    for (std::string word; std::getline(words, word, ',');) group.lights.push_back(word);
    if (group.lights.empty() || std::count(group.lights.begin(), group.lights.end(), "") > 0)
        throw UsageError(
            fmt::format("--light-group: \"{}\" is not NAME=LIGHT,LIGHT... with numbers of lights from 0 on, or their "
                        "names, such as key=0,2 or sky=environment",
                        text));
    return group;
}

std::vector<std::size_t> camera_numbers(const std::string& word, const Scene& scene) {
    if (scene.cameras.empty()) throw SceneError(scene.file, 0, "the scene has no camera");
    if (word == "all") {
        std::vector<std::size_t> numbers(scene.cameras.size());
        std::iota(numbers.begin(), numbers.end(), 1);
        return numbers;
    }
    const auto number = whole_number(word);
    if (!number || *number < 1 || *number > scene.cameras.size())
        throw UsageError(fmt::format("--camera: there is no camera \"{}\"; {} has cameras 1 to {}, and \"all\"", word,
                                     scene.file, scene.cameras.size()));
    return {static_cast<std::size_t>(*number)};
}

void check_aov_names(const std::vector<std::string>& names) {
    const std::vector<std::string>& known = aov_names();
    std::set<std::string> seen;
    for (const std::string& name : names) {
        if (std::find(known.begin(), known.end(), name) == known.end())
            throw UsageError(
                fmt::format("--aov: there is no plane \"{}\"; there are {}", name, fmt::join(known, ", ")));
        if (!seen.insert(name).second)
            throw UsageError(fmt::format("--aov: the plane \"{}\" is asked for twice", name));
    }
}

/// Throws, before the work begins, if a file cannot be written. `checkpoint` is empty if there is none.
void check_outputs(const std::vector<Picture>& pictures, const std::vector<std::string>& planes, PlaneFiles plane_files,
                   const fs::path& checkpoint) {
    std::set<fs::path> files;
    const auto check = [&](const fs::path& file) {
        std::error_code ignored;
        if (!files.insert(fs::weakly_canonical(file, ignored)).second)
            throw UsageError(fmt::format("two outputs would be written to {}", file.string()));
        check_writable(file);
    };
    for (const Picture& picture : pictures) {
        check(picture.file);
        for (const ToneMappedFile& tone_mapped : picture.tone_mapped)
            if (tone_mapped.file != picture.file) check(tone_mapped.file);
    }
    for (const Picture& picture : pictures) {
        if (plane_files == PlaneFiles::layers) {
            check_layers_extension(picture.file);
            continue;
        }
        for (const std::string& plane : planes) check(plane_file(picture.file, plane));
    }
    if (!checkpoint.empty()) check(checkpoint);
}

void make_folder(const std::string& output) {
    if (!is_folder(output)) return;
    std::error_code error;
    fs::create_directories(output, error);
    if (error) throw FileError(output, "the folder cannot be made: " + error.message());
}

/// Throws UsageError for a picture that the machine's memory cannot hold. A system that promises more memory than it
/// has would end the process instead.
void check_memory(const PlannedPicture& picture) {
    const Camera& camera = picture.camera;
    const std::uint64_t needed = picture_bytes(picture);
    const std::uint64_t present = std::uint64_t(::sysconf(_SC_PHYS_PAGES)) * std::uint64_t(::sysconf(_SC_PAGESIZE));
    if (needed > present)
        throw UsageError(fmt::format("a picture of {}x{} pixels needs {} of memory, and this machine has {}",
                                     camera.width, camera.height, byte_count(needed), byte_count(present)));
}

/// Sets the files of --checkpoint and --resume. Only --resume accepts an existing file, because the checkpoint is
/// replaced, and removed in the end. Both together also accept one that is not there.
void set_checkpoint(RenderCommandOptions& options, std::size_t picture_count) {
    if (options.checkpoint.empty() && options.resume.empty()) return;
    if (picture_count != 1)
        throw UsageError(
            fmt::format("a checkpoint is of one picture, and these are {}; name one by --camera", picture_count));
    if (!options.checkpoint.empty() && !options.resume.empty() && options.checkpoint != options.resume)
        throw UsageError("--checkpoint and --resume name different files; --resume alone goes on in its file");
    std::error_code ignored;
    if (!options.checkpoint.empty() && !fs::exists(options.resume, ignored)) options.resume.clear();
    if (options.resume.empty() && fs::exists(options.checkpoint, ignored)) {
        if (is_section_file(options.checkpoint) && !is_built_scene(options.checkpoint))
            throw UsageError(
                fmt::format("--checkpoint: {} is there already; --resume {} goes on from it. Delete it to begin anew",
                            options.checkpoint, options.checkpoint));
        throw UsageError(fmt::format("--checkpoint: {} is there already, and is no checkpoint", options.checkpoint));
    }
    options.render.resume_file = options.resume;
    options.render.checkpoint_file = options.resume.empty() ? options.checkpoint : options.resume;
}

/// Sets --part. A part is kept in a checkpoint, and has no picture.
void set_part(RenderCommandOptions& options) {
    const Part part = parse_part(*options.part);
    options.render.part = PicturePart{part.number, part.count};
    if (options.checkpoint.empty() && options.resume.empty())
        throw UsageError(
            "--part: name a file for the part by --checkpoint; castor merge makes the picture of the parts");
    if (!options.output.empty()) throw UsageError("-o: a part has no picture; castor merge makes it of all parts");
    if (options.plane_files == PlaneFiles::layers)
        throw UsageError("--layers: a part has no picture; castor merge --layers makes it of all parts");
}

/// The figures that --json prints, gathered stage by stage.
struct Report {
    double load_seconds = 0.0;
    double write_seconds = 0.0;
    double render_seconds = 0.0;
    std::uint64_t rays = 0;
    bool interrupted = false;
    std::optional<DeviceError> failure;  // the last device's failure, or a difference between two devices
    Json pictures = Json::array();
};

double mrays_per_second(std::uint64_t rays, double seconds) {
    return seconds > 0.0 ? double(rays) / seconds / 1e6 : 0.0;
}

/// Writes the files of the picture, unless no sample is done: such a picture might replace a good one. Returns the
/// picture's entry in the report.
Json write_outputs(const Picture& picture, const Film& film, RuleSet rules, PlaneFiles plane_files, bool is_begun) {
    Json picture_file;
    FurtherFiles further;
    if (is_begun) {
        further = write_picture(picture, film, rules, plane_files);
        picture_file = fs::absolute(picture.file).string();
    }
    return {{"camera", picture.camera_number},
            {"file", picture_file},
            {"width", film.width},
            {"height", film.height},
            {"samples_per_pixel", film.samples_per_pixel},
            {"complete", film.complete()},
            {"tone_mapped", further.tone_mapped},
            {"planes", further.planes}};
}

Json verification_json(const Verification& verification) {
    Json json{{"pixels", verification.pixels},
              {"differing_pixels", verification.differing_pixels},
              {"gap", verification.gap},
              {"first", nullptr}};
    if (const auto& first = verification.first)
        json["first"] = {{"x", first->x},
                         {"y", first->y},
                         {"channel", first->channel},
                         {"devices", first->devices},
                         {"values", first->values},
                         {"distance", first->distance}};
    return json;
}

std::optional<DeviceError> failure_of(const Verification& verification, const fs::path& picture) {
    if (!verification.first) return std::nullopt;
    return DeviceError("", "", 0,
                       fmt::format("{} of {} verified pixels of {} differ between devices. The first is {}. castor "
                                   "doctor may tell which device is wrong",
                                   verification.differing_pixels, verification.pixels, picture.string(),
                                   describe(*verification.first)));
}

void render_picture(Renderer& renderer, const Camera& camera, const Picture& picture, const std::string& label,
                    const RenderCommandOptions& options, Manager* manager, Report& report) {
    Film film;
    bool lacks_denoising = false;  // the picture is complete, and its denoiser failed
    try {
        ProgressBar bar(label, options.report.quiet);
        const auto on_progress = [&](const RenderProgress& progress) {
            bar.show(progress);
            return !interrupted();
        };
        film = manager ? render_together(renderer, camera, options.render, on_progress, *manager)
                       : renderer.render(camera, options.render, on_progress);
    } catch (const RenderError& error) {
        film = error.film();
        report.failure = error;
        lacks_denoising = options.render.denoise && film.complete();
    }
    const RenderStatistics statistics = renderer.statistics();
    const Stopwatch write_watch;
    const bool is_part = options.render.part.has_value();
    Json entry = write_outputs(picture, film, options.render.rules, options.plane_files,
                               statistics.samples_done > 0 && !is_part);
    entry["part"] = is_part ? Json(*options.part) : Json();
    entry["part_complete"] = statistics.part_complete;
    report.write_seconds += write_watch.seconds();
    report.render_seconds += statistics.render_seconds;
    report.rays += statistics.rays;
    entry["seconds"] = statistics.render_seconds;
    const bool is_denoised = statistics.denoise_seconds > 0.0;
    entry["denoise_seconds"] = is_denoised ? Json(statistics.denoise_seconds) : Json();
    entry["denoiser"] = is_denoised ? Json(name_of_denoiser(statistics.oidn_version)) : Json();
    entry["rays"] = statistics.rays;
    entry["samples_done"] = statistics.samples_done;
    entry["noise"] = options.render.noise ? Json(*options.render.noise) : Json();
    entry["pixels_by_samples"] = Json::object();
    for (const auto& [samples, pixels] : statistics.pixels_by_samples)
        entry["pixels_by_samples"][std::to_string(samples)] = pixels;
    entry["samples_resumed"] = statistics.samples_resumed;
    entry["mrays_per_second"] = mrays_per_second(statistics.rays, statistics.render_seconds);
    entry["devices"] = json_of(statistics.devices);
    entry["notices"] = statistics.notices;
    if (options.render.verify_share > 0.0) {
        entry["verification"] = verification_json(statistics.verification);
        if (!report.failure) report.failure = failure_of(statistics.verification, picture.file);
        const Verification& verification = statistics.verification;
        if (!options.report.quiet && verification.pixels > 0 && !verification.first)
            note("verified: {} pixels are the same bits on two devices", verification.pixels);
        if (!verification.gap.empty())
            note("warning: not {} verified: {}", verification.pixels > 0 ? "wholly" : "at all", verification.gap);
        report.interrupted |= !verification.gap.empty() && interrupted();
    }
    report.pictures.push_back(entry);
    const fs::path& checkpoint = options.render.checkpoint_file;
    const bool is_done = statistics.part_complete;  // where there is no part: the picture
    if (!options.report.quiet && (is_part ? is_done : statistics.samples_done > 0))
        note("{}: {}{}x{}, {} sample{} a pixel, {:.3f} s, {:.1f} Mray/s",
             fs::absolute(is_part ? checkpoint : picture.file).string(),
             is_part ? fmt::format("part {} of ", *options.part) : "", film.width, film.height, film.samples_per_pixel,
             film.samples_per_pixel == 1 ? "" : "s", statistics.render_seconds,
             mrays_per_second(statistics.rays, statistics.render_seconds));
    if (!options.report.quiet && options.render.noise && is_done && !is_part)
        note("it stopped at noise: {} of {} samples a pixel on average",
             fmt::format("{:.1f}", double(statistics.samples_done) / (double(film.width) * film.height)),
             film.samples_per_pixel);
    if (!options.report.quiet && is_denoised)
        note("noise was removed from it{} in {:.3f} s; --aov noisy keeps what it was",
             note_on_denoiser(statistics.oidn_version), statistics.denoise_seconds);
    if (is_done && lacks_denoising) {
        note("warning: {} is complete, and still has its noise", fs::absolute(picture.file).string());
        if (!checkpoint.empty() && is_section_file(checkpoint))
            note("--resume {} goes on from here", checkpoint.string());
    } else if (!is_done) {
        report.interrupted |= !report.failure;
        const std::string reason = report.failure ? "no device is left" : "interrupted";
        const std::uint64_t samples = std::uint64_t{film.width} * film.height * film.samples_per_pixel;
        if (is_part)
            note("{}: part {} is not complete", reason, *options.part);
        else if (film.complete())
            note("{}: {} is done, but not its planes of lights", reason, fs::absolute(picture.file).string());
        else if (statistics.samples_done > 0)
            note("{}: {} holds the picture so far, {:.1f} % of its samples", reason,
                 fs::absolute(picture.file).string(),
                 100.0 * static_cast<double>(statistics.samples_done) / static_cast<double>(samples));
        else
            note("{}: no sample was done, and {} is not written", reason, fs::absolute(picture.file).string());
        if (!checkpoint.empty() && is_section_file(checkpoint))
            note("--resume {} goes on from here", checkpoint.string());
    } else if (!is_part && !checkpoint.empty()) {
        std::error_code ignored;
        if (is_section_file(checkpoint)) fs::remove(checkpoint, ignored);
    }
}

Json document(const RenderCommandOptions& options, const std::vector<Device>& devices, const Renderer& renderer,
              const Report& report, const MemoryPlan& memory, const std::vector<Warning>& warnings, const Team* team) {
    const RenderStatistics statistics = renderer.statistics();
    return {{"scene", options.scene},
            {"device", names_of(devices)},
            {"devices", json_of(devices)},
            {"strategy", std::string(to_string(renderer.strategy(statistics.eye_rays)))},
            {"rules", std::string(to_string(options.render.rules))},
            {"filter", std::string(to_string(options.render.filter_in_use()))},
            {"triangles", statistics.triangles},
            {"spheres", statistics.spheres},
            {"planes", statistics.planes},
            {"nodes", statistics.nodes},
            {"seconds",
             {{"load", report.load_seconds},
              {"flatten", statistics.flatten_seconds},
              {"build", statistics.build_seconds},
              {"setup", statistics.setup_seconds},
              {"render", report.render_seconds},
              {"write", report.write_seconds}}},
            {"rays", report.rays},
            {"mrays_per_second", mrays_per_second(report.rays, report.render_seconds)},
            {"interrupted", report.interrupted},
            {"pictures", report.pictures},
            {"memory", json_of(memory)},
            {"traffic", team ? json_of(team->traffic()) : Json()},
            {"warnings", json_of(warnings)}};
}

void note_summary(const std::vector<Device>& devices, const Renderer& renderer, const Report& report) {
    const RenderStatistics statistics = renderer.statistics();
    for (std::size_t i = 0; i < devices.size(); ++i)
        note("device: {}, strategy {}", describe(devices[i]),
             to_string(renderer.strategy(statistics.eye_rays, Query::closest, i)));
    if (statistics.devices.size() > 1) note_shares(statistics.devices);
    note("seconds: load {:.3f}, flatten {:.3f}, build {:.3f}, setup {:.3f}, render {:.3f}, write {:.3f}",
         report.load_seconds, statistics.flatten_seconds, statistics.build_seconds, statistics.setup_seconds,
         report.render_seconds, report.write_seconds);
    note("rays: {}, {:.1f} million a second", report.rays, mrays_per_second(report.rays, report.render_seconds));
}

/// Reads the options that are words. `team`: see run.
RendererOptions read_words(RenderCommandOptions& options, const Team* team) {
    if (!options.filter.empty()) options.render.filter = reconstruction_filter_from_string(options.filter);
    options.render.rules = rule_set_from_string(options.rules);
    options.render.order = render_order_from_string(options.order);
    options.render.sample_order = sample_order_from_string(options.sample_order);
    options.render.max_recursion_depth = options.max_depth;
    for (const std::string& group : options.light_groups) parse_light_group(group);
    if (!options.integrator.empty()) options.render.integrator = integrator_from_string(options.integrator);
    if (!options.light_choice.empty()) options.render.light_choice = light_choice_from_string(options.light_choice);
    if (!options.denoiser.empty()) {
        options.render.denoise = true;
        options.render.denoiser = denoiser_from_string(options.denoiser);
    }
    options.render.verify_share = options.verify_percent / 100.0;
    RendererOptions renderer_options{strategy_from_string(options.strategy), tree_quality_from_string(options.quality),
                                     options.use_profiles};
    renderer_options.deadline_seconds = options.deadline_seconds;
    renderer_options.stop_deadline_seconds = kStopDeadlineSeconds;
    if (options.distributes_scene && options.verify_percent > 0.0)
        throw UsageError("--verify: no process has all of a scene that --distribute-scene divides");
    if (options.distributes_scene) renderer_options.scene_share = team->scene_share();
    return renderer_options;
}

/// Finds the lights of --light-group in the scene.
void find_light_groups(const Scene& scene, RenderCommandOptions& options) {
    for (const std::string& text : options.light_groups) {
        const LightGroupWords group = parse_light_group(text);
        options.render.light_groups.push_back({group.name, find_lights(scene.lights, group.lights)});
    }
}

/// Gives all cameras the resolution of --size.
void resize_cameras(Scene& scene, const std::string& text) {
    if (text.empty()) return;
    const Size size = parse_size(text);
    for (Camera& camera : scene.cameras) resize(camera, size.width, size.height);
}

/// Returns the tone map of --tone: as a display that follows sRGB shows it, with white at 255 where the values are not
/// compressed.
ToneMap parse_tone(const std::string& word) {
    struct Tone {
        ToneOperator tone_operator;
        bool is_srgb;
    };
    static constexpr std::array kTones = {
        Named<Tone>{{ToneOperator::agx, true}, "agx"},
        Named<Tone>{{ToneOperator::aces, true}, "aces"},
        Named<Tone>{{ToneOperator::filmic, true}, "filmic"},
        Named<Tone>{{ToneOperator::photographic, true}, "photographic"},
        Named<Tone>{{ToneOperator::linear, true}, "srgb"},
        Named<Tone>{{ToneOperator::linear, false}, "linear"},
    };
    const Tone tone = value_of(kTones, word, "tone map");
    ToneMap map;
    map.tone_operator = tone.tone_operator;
    map.is_srgb = tone.is_srgb;
    if (tone.tone_operator == ToneOperator::linear) map.key = map.gamma = 1.0f;
    return map;
}

/// Makes pictures of 8 bits brighter by so many stops: a tone map's key is multiplied by 2^stops. Cameras without a
/// tone map get one that does nothing else.
void expose(Scene& scene, double stops) {
    for (Camera& camera : scene.cameras) {
        if (camera.tone_maps.empty()) {
            ToneMap& map = camera.tone_maps.emplace_back();
            map.tone_operator = ToneOperator::linear;
            map.key = map.gamma = 1.0f;
        }
        for (ToneMap& map : camera.tone_maps) map.key = static_cast<float>(double{map.key} * std::exp2(stops));
    }
}

/// Changes the cameras as the options say.
void adapt_cameras(Scene& scene, const RenderCommandOptions& options) {
    if (!options.tone.empty())
        for (Camera& camera : scene.cameras) camera.tone_maps = {parse_tone(options.tone)};
    if (options.exposure) expose(scene, *options.exposure);
    resize_cameras(scene, options.size);
}

/// Returns a warning for each option that changes none of the pictures of these cameras, because of how they are
/// traced.
std::vector<Warning> warnings_of_idle_options(const Scene& scene, const std::vector<std::size_t>& camera_numbers,
                                              const RenderOptions& options) {
    const bool has_principled = std::any_of(scene.materials.begin(), scene.materials.end(),
                                            [](const Material& m) { return m.principled.has_value(); });
    const auto is_path_traced = [&](std::size_t number) {
        return has_principled || options.path_tracing_in_use(scene.cameras[number - 1]);
    };
    std::vector<Warning> warnings;
    const auto warn = [&](bool is_given, const char* option, const char* reason) {
        if (is_given) warnings.push_back({"", 0, fmt::format("{} has no effect: {}", option, reason)});
    };
    if (std::all_of(camera_numbers.begin(), camera_numbers.end(), is_path_traced))
        warn(options.max_recursion_depth.has_value(), "--max-depth", "--bounces is the limit where paths are traced");
    if (std::none_of(camera_numbers.begin(), camera_numbers.end(), is_path_traced)) {
        constexpr const char* kReason = "it is for path tracing, as --integrator path asks for";
        warn(options.bounces.has_value(), "--bounces", kReason);
        warn(options.light_choice.has_value(), "--light-choice", kReason);
        warn(options.largest_sample.has_value(), "--clamp", kReason);
    }
    return warnings;
}

ExitStatus run(RenderCommandOptions options, Team* team) {
    const RendererOptions renderer_options = read_words(options, team);
    if (!options.size.empty()) parse_size(options.size);
    if (!options.tone.empty()) parse_tone(options.tone);
    if (options.part) set_part(options);
    check_aov_names(options.render.aovs);
    // Where there is none, that is told before the scene is read. A part leaves it to castor merge.
    if (options.render.denoise && options.render.denoiser == Denoiser::oidn && !options.part) oidn_version();
    if (!options.output.empty() && !is_folder(options.output)) check_image_extension(options.output);
    const std::vector<Device> devices =
        select_devices(options.device, options.device_limits, team ? team->host() : std::string());
    const auto check_verify = [&](std::size_t device_count) {
        if (options.verify_percent > 0.0 && device_count < 2)
            throw UsageError(fmt::format(
                "--verify takes two devices, such as --device all or --device 0/2, and this is {}", names_of(devices)));
    };
    if (!team) check_verify(devices.size());
    catch_interrupts();

    Report report;
    const Stopwatch load_watch;
    SceneInput input =
        read_scene_input(options.scene, renderer_options.quality, {options.report.quiet, options.strict, options.load});
    Scene& scene = input.scene;
    report.load_seconds = load_watch.seconds();
    adapt_cameras(scene, options);
    find_light_groups(scene, options);
    check_light_groups(options.render, scene.lights.size());
    const std::vector<std::size_t> numbers = camera_numbers(options.camera, scene);
    std::vector<Warning> warnings = warnings_of_idle_options(scene, numbers, options.render);
    const bool has_planes = !options.render.aovs.empty() || !options.render.light_groups.empty();
    const std::vector<Picture> pictures = name_pictures(
        scene, numbers, options.output, has_planes && options.plane_files == PlaneFiles::beside, warnings);
    print_warnings(warnings);
    set_checkpoint(options, pictures.size());
    std::vector<PlannedPicture> planned;
    std::vector<Camera> cameras;
    for (const Picture& picture : pictures) {
        cameras.push_back(scene.cameras[picture.camera_number - 1]);
        planned.push_back(
            {cameras.back(), options.render, scene.lights.size(), options.plane_files == PlaneFiles::layers});
    }
    for (const PlannedPicture& picture : planned) check_memory(picture);
    make_folder(options.output);
    check_light_planes(options.render, !team);
    std::vector<std::string> planes = plane_names(scene, options.render.aovs);
    for (std::string& name : light_group_planes(options.render.light_groups)) planes.push_back(std::move(name));
    check_outputs(options.part ? std::vector<Picture>() : pictures, planes, options.plane_files,
                  options.render.checkpoint_file);

    MemoryRequest request{.devices = devices,
                          .strategy = renderer_options.strategy,
                          .use_profiles = options.use_profiles,
                          .quality = renderer_options.quality,
                          .pictures = std::move(planned),
                          .limit = options.memory_limit};
    const MemoryPlan memory = plan_memory(input, request);
    if (!options.report.quiet) note_memory(memory);
    check_memory(memory);
    prepare_scene(input, options.scene, devices,
                  {renderer_options.strategy, renderer_options.quality, options.use_profiles}, team,
                  options.distributes_scene, options.report.quiet, programs_of_pictures(cameras, options.render));
    auto renderer = input.make<Renderer>(devices, renderer_options, options.report.quiet);
    print_warnings(renderer.warnings());
    Manager* const manager = team ? &team->gather(devices, options.deadline_seconds, options.report.quiet) : nullptr;
    if (manager) check_verify(devices.size() + manager->workers().size());
    for (std::size_t i = 0; i < pictures.size() && !interrupted() && !report.failure; ++i) {
        const std::string label = pictures.size() > 1 ? fmt::format("picture {}/{}", i + 1, pictures.size()) : "";
        render_picture(renderer, scene.cameras[pictures[i].camera_number - 1], pictures[i], label, options, manager,
                       report);
    }
    if (report.pictures.size() < pictures.size()) {
        report.interrupted = !report.failure;
        note("{} of {} pictures were not begun", pictures.size() - report.pictures.size(), pictures.size());
    }
    if (!options.report.quiet) note_summary(devices, renderer, report);
    if (!options.report.quiet && team) note_traffic(team->traffic());
    if (options.report.json) {
        warnings.insert(warnings.begin(), scene.warnings.begin(), scene.warnings.end());
        warnings.insert(warnings.end(), renderer.warnings().begin(), renderer.warnings().end());
        print_json(document(options, devices, renderer, report, memory, warnings, team));
    }
    if (report.failure) throw *report.failure;
    return report.interrupted ? ExitStatus::interrupted : ExitStatus::done;
}

/// Renders for the team's leader, which has the same command line.
ExitStatus serve(RenderCommandOptions options, Team& team) {
    const RendererOptions renderer_options = read_words(options, &team);
    return serve_team<Renderer>(
        team, options.device, options.device_limits, options.deadline_seconds,
        [&](const SceneInput& input, const std::vector<Device>& devices) {
            return input.make<Renderer>(devices, renderer_options, true);
        },
        [&](Renderer& renderer, Scene scene, RankServer& server) {
            adapt_cameras(scene, options);
            find_light_groups(scene, options);
            for (const std::size_t number : camera_numbers(options.camera, scene))
                if (!serve_render(renderer, scene.cameras[number - 1], options.render, server)) break;
        });
}

}  // namespace

void add_render(CLI::App& app, Action& action, Team* team) {
    CLI::App* command = app.add_subcommand("render", "Render a scene: one picture a camera");
    const auto options = std::make_shared<RenderCommandOptions>();
    command->add_option("SCENE", options->scene, kSceneHelp)->required();
    command->add_option("-o,--output", options->output, "picture, or folder for the pictures");
    command->add_option(
        "--device", options->device,
        "index, type (cpu, gpu), part of a name, \"all\", or several with commas between; else the first GPU, "
        "else the first device. /N after one splits it into N parts");
    command->add_option(
        "--size", options->size,
        "WIDTHxHEIGHT in pixels instead of the camera's; the view keeps its height and adapts its width");
    command
        ->add_option("--samples", options->render.samples_per_pixel,
                     "samples per pixel instead of the camera's; one goes through the pixel's centre")
        ->check(CLI::Range(std::uint32_t{1}, static_cast<std::uint32_t>(kMaxSamplesPerPixel)));
    command->add_option(
        "--filter", options->filter,
        "weight of samples: box, tent or gaussian; without it gaussian, but box for a NumSamples of the scene's own");
    command
        ->add_option("--strategy", options->strategy, "how rays find hits (auto, brute ...); the picture is the same")
        ->capture_default_str();
    command
        ->add_option("--quality", options->quality,
                     "how much work goes into the tree: medium, or high, which takes longer and makes rays faster; the "
                     "picture is the same")
        ->capture_default_str();
    command->add_option("--rules", options->rules, "shading rules: r2022, r795, r2020 or r2018")->capture_default_str();
    command->add_flag("--cull-back-faces", options->render.cull_back_faces,
                      "camera and mirror rays pass flat triangles seen from behind; --rules r795 implies it");
    command->add_option("--camera", options->camera, "number of one camera, the first being 1, or all")
        ->capture_default_str();
    command
        ->add_option("--aov", options->render.aovs,
                     fmt::format("further planes to write: {}", fmt::join(aov_names(), ", ")))
        ->delimiter(',');
    command->add_flag_callback(
        "--layers", [options] { options->plane_files = PlaneFiles::layers; },
        "write all planes into the picture, an .exr, as layers");
    command
        ->add_option("--light-group", options->light_groups,
                     "NAME=LIGHT,LIGHT...: a plane group-NAME of the light of these lights, numbered from 0 on in the "
                     "scene's order or named as castor info lists them, in a path-traced picture; group-rest has what "
                     "is in no group")
        ->allow_extra_args(false);
    command->add_option("--integrator", options->integrator,
                        "whitted: light from lights, mirrors and glass alone, by the rules; path: from everywhere, by "
                        "path tracing; without it what the camera says, but path for principled materials, as "
                        "glTF has; else whitted");
    command->add_option("--bounces", options->render.bounces, "of paths, at most; without it the camera's, or 12")
        ->check(CLI::Range(std::uint32_t{0}, CASTOR_MOST_BOUNCES));
    command->add_option("--light-choice", options->light_choice,
                        "which light paths send rays to: tree, by what each may give; uniform, any; without it the "
                        "camera's, or tree");
    command->add_option("--clamp", options->render.largest_sample, "largest value of a path-traced sample")
        ->check(positive_float());
    command->add_option("--max-depth", options->max_depth, "mirror reflections in a row instead of the scene's number")
        ->check(CLI::Range(std::uint32_t{0}, static_cast<std::uint32_t>(kMaxRecursionDepth)));
    command->add_option("--tone", options->tone,
                        "one tone map in place of the camera's: agx, aces, filmic, photographic, srgb (no more than "
                        "its curve) or linear");
    command
        ->add_option("--exposure", options->exposure,
                     "stops by which pictures of 8 bits become brighter: 1 is twice as bright, -1 half")
        ->check(number_in(-100.0, 100.0));
    command->add_flag("--denoise", options->render.denoise,
                      "remove noise from the picture; --aov noisy keeps what it was");
    command->add_option("--denoiser", options->denoiser,
                        "what removes it, as --denoise does by castor, the same bytes everywhere; oidn: Open Image "
                        "Denoise, where it is installed, whose bytes may differ between machines");
    command
        ->add_option("--tile", options->render.tile_size,
                     "edge of a tile in pixels, a multiple of 8; the picture is the same")
        ->check(CLI::Range(std::uint32_t{8}, std::uint32_t{4096}));
    command
        ->add_option("--order", options->order,
                     "pieces: all samples of a part of the picture, then the next part; progressive: one sample of the "
                     "whole picture, then the next; the picture is the same")
        ->capture_default_str();
    command
        ->add_option("--stop-after", options->render.stop_after_seconds,
                     "seconds after which the picture is complete with the samples that each pixel then has, --samples "
                     "at most; in progressive order")
        ->check(number_in(0.0, 1e9));
    command
        ->add_option("--noise", options->render.noise,
                     "error, relative to the brightness, at which blocks of 8x8 pixels stop, after 16, 32, 64 ... "
                     "samples, --samples at most: 0.01 is one per cent. --aov samples tells how many")
        ->check(number_in(1e-6, 1e3));
    command
        ->add_option("--sample-order", options->sample_order,
                     "pixel: each pixel has samples of its own; z: pixels share a sequence, so that noise is fine and "
                     "vanishes where the picture is smoothed or seen from afar; --samples a power of two suits it")
        ->capture_default_str();
    command->add_option("--seed", options->render.seed, "seed of the sample positions");
    command
        ->add_option("--verify", options->verify_percent,
                     "per cent of the picture (without a number: 5) to render twice, on two devices; status 4 if any "
                     "bit differs")
        ->check(number_in(0.0, 100.0))
        ->expected(0, 1)
        ->default_str("5");
    command
        ->add_option("--deadline", options->deadline_seconds,
                     "seconds after which a device that does not answer is dropped")
        ->check(number_in(0.1, 1e9))
        ->capture_default_str();
    command->add_option("--checkpoint", options->checkpoint, "file that keeps what is done, for --resume");
    command->add_option("--checkpoint-interval", options->render.checkpoint_seconds, "seconds between two checkpoints")
        ->check(number_in(0.0, 1e9))
        ->capture_default_str();
    command->add_option("--resume", options->resume, "checkpoint to go on from; it keeps what is done from then on");
    command->add_option(
        "--part", options->part,
        "i/n: only the i-th of n parts of the picture, from 1 on, into the checkpoint, for castor merge");
    add_memory_option(*command, options->memory_limit);
    add_device_limit_options(*command, options->device_limits);
    add_profile_option(*command, options->use_profiles);
    add_load_options(*command, options->load);
    add_strict_option(*command, options->strict);
    add_report_options(*command, options->report);
    if (team) add_distribute_option(*command, options->distributes_scene);
    command->footer(kRenderFooter);
    command->callback([options, &action, team] {
        action = [options, team] { return team && !team->leads() ? serve(*options, *team) : run(*options, team); };
    });
}

}  // namespace castor::cli
