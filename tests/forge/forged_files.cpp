// Loads forged files, one after the other, and traces and renders what loads: the process must end by itself.
//
//     forged_files [--first N] [--count N] [--seconds S] [--small] [--verbose]
//
// File N is the same in every run. --small: fewer rays, and the strategies brute and simt alone, as Oclgrind wants.
// Each file must be refused with a message or give hits and a picture. Before a file is loaded its number and changes
// are written to standard error with --verbose; a file that takes more than --seconds (60) ends the process with
// SIGALRM. The exit status is 1 if anything but SceneError was thrown.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "castor/built_scene.h"
#include "castor/error.h"
#include "castor/renderer.h"
#include "castor/tracer.h"
#include "forge/forge.h"
#include "reference/meshes.h"
#include "reference/rays.h"
#include "render/checkpoint.h"
#include "support/reference.h"
#include "support/temporary_directory.h"
#include "trace/saved_scene.h"
#include "trace/scene_contents.h"

namespace castor::test {
namespace {

namespace fs = std::filesystem;

struct Options {
    std::uint64_t first = 0, count = 300;
    unsigned seconds = 60;
    bool is_small = false, is_verbose = false;
};

Options options_of(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string_view name = argv[i];
        const auto number = [&] { return std::strtoull(i + 1 < argc ? argv[++i] : "0", nullptr, 10); };
        if (name == "--first")
            options.first = number();
        else if (name == "--count")
            options.count = number();
        else if (name == "--seconds")
            options.seconds = static_cast<unsigned>(number());
        else if (name == "--small")
            options.is_small = true;
        else if (name == "--verbose")
            options.is_verbose = true;
        else
            throw UsageError(fmt::format("unknown option {}", name));
    }
    return options;
}

Device device_under_test() {
    const char* selection = std::getenv("CASTOR_TEST_DEVICE");
    return select_devices(selection ? selection : "").at(0);
}

// ---- The scenes ----

Material mirror() {
    Material material;
    material.kind = MaterialKind::mirror;
    material.diffuse = material.ambient = {0.4f, 0.5f, 0.6f};
    material.mirror = {0.5f, 0.5f, 0.5f};
    return material;
}

Scene with_looks(Scene scene) {
    scene.materials.push_back(mirror());
    scene.lights.resize(3);
    scene.lights[0].point = {{2, 3, 4}, {900, 800, 700}};
    scene.lights[1].kind = Light::Kind::directional;
    scene.lights[1].directional.radiance = {90, 90, 90};
    scene.lights[2].kind = Light::Kind::spot;
    scene.lights[2].spot.position = {0, 4, 0};
    scene.lights[2].spot.intensity = {500, 500, 500};
    scene.ambient_light = {20, 20, 20};
    scene.max_recursion_depth = 2;
    scene.cameras.resize(1);
    scene.cameras[0].position = {0, 0, 4};
    scene.cameras[0].image_name = "picture.png";
    scene.warnings.push_back({"file", 3, "text"});
    return scene;
}

/// Meshes, flat and smooth, spheres, a plane, and instances of a mesh and of an ellipsoid.
Scene scene_of_everything(int detail) {
    RandomSource random(51);
    Mesh smooth = bumpy_sphere(detail);
    compute_smooth_normals(smooth);
    smooth.material = 1;
    Mesh placed = cube_grid(2);
    Scene scene = with_looks(scene_of({random_triangles(random, 60, 0.5f), smooth, placed}));
    for (int i = 0; i < 12; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.05f, 0.3f), 1, 7});
    scene.planes.push_back({{0, -1, 0}, {0, 1, 0}, 0, 0});
    scene.planes.push_back({{0, 0, -3}, {0, 0, 1}, 1, 0});
    for (int i = 0; i < 9; ++i)
        scene.instances.push_back(
            {2, Transform(glm::vec3(0, 0.3f, 0), glm::vec3(-0.3f, 0, 0), glm::vec3(0, 0, 0.25f), random.in_box(-1, 1)),
             1});
    scene.spheres.back().transform[1] *= 2.0f;
    return scene;
}

Scene scene_of_spheres() {
    RandomSource random(52);
    Scene scene = with_looks(scene_of({}));
    for (int i = 0; i < 40; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.05f, 0.3f), 0, 7});
    return scene;
}

Scene scene_of_meshes() {
    RandomSource random(53);
    Mesh smooth = bumpy_sphere(2);
    compute_smooth_normals(smooth);
    return with_looks(scene_of({smooth, random_triangles(random, 100, 0.5f)}));
}

std::vector<StrategyChoice> trees(std::initializer_list<Strategy> strategies) {
    std::vector<StrategyChoice> choices;
    for (const Strategy strategy : strategies) choices.push_back(StrategyChoice::all(strategy));
    return choices;
}

ChunkLimits in_chunks(const Scene& scene, const std::vector<StrategyChoice>& strategies, std::uint64_t count) {
    const SceneContents whole = build_scene(scene, strategies);
    return {sizes_of(whole.chunks.front(), needs_of(strategies), TreeQuality::medium).largest_column / count};
}

/// A valid file, and what is forged of it.
struct Original {
    std::string name;
    Forger forger;
};

void write(const fs::path& file, const std::vector<std::byte>& bytes) {
    fs::remove(file);  // others may have it mapped
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

std::vector<Original> saved_scenes(const fs::path& file) {
    std::vector<Original> originals;
    const auto add = [&](const std::string& name, const Scene& scene, const std::vector<StrategyChoice>& strategies,
                         std::uint64_t chunks = 1) {
        const ChunkLimits limits = chunks > 1 ? in_chunks(scene, strategies, chunks) : ChunkLimits{};
        save_scene(file, build_scene(scene, strategies, TreeQuality::medium, limits));
        originals.push_back({name, Forger(file, kBuiltSceneFile)});
    };
    const auto all = trees({Strategy::wide, Strategy::simt});
    add("everything", scene_of_everything(2), all);
    add("everything in chunks", scene_of_everything(2), all, 4);
    add("everything without trees", scene_of_everything(1), trees({Strategy::brute}));
    add("meshes", scene_of_meshes(), all);
    add("meshes with the wide tree", scene_of_meshes(), trees({Strategy::wide}));
    add("meshes with the compressed tree", scene_of_meshes(), trees({Strategy::simt}));
    add("spheres", scene_of_spheres(), all);
    return originals;
}

// ---- What is done with a file ----

std::vector<Ray> rays_about(std::size_t count) {
    RandomSource random(54);
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) rays.push_back(make_ray(random.in_box(-2, 2), random.in_box(-1, 1)));
    return rays;
}

/// Loads saved scenes, and traces and renders what loads.
class SceneTrial {
public:
    explicit SceneTrial(bool is_small) : is_small_(is_small), device_(device_under_test()) {
        rays_ = rays_about(is_small ? 6 : 96);
        hits_.resize(rays_.size());
        occluded_.resize(rays_.size());
    }

    /// Throws SceneError where the file is refused.
    void run(const fs::path& file, RandomSource& random) { run(file, random, random.below(8) == 0); }
    void run(const fs::path& file, RandomSource& random, bool tries_little_device) {
        const BuiltScene scene = load_built_scene(file);
        // Two for each file: most of the time goes into making devices ready.
        std::vector<Strategy> strategies{Strategy::brute, Strategy::simt};
        if (!is_small_)
            strategies = {random.below(2) ? Strategy::brute : Strategy::simt,
                          random.below(2) ? Strategy::wide : Strategy::packet};
        const TreeQuality quality = random.below(2) ? TreeQuality::high : TreeQuality::medium;
        for (const Strategy strategy : strategies) {
            Tracer tracer(scene, {device_}, {.strategy = strategy, .quality = quality});
            tracer.closest_hit(rays_, hits_, Coherence::incoherent);
            tracer.any_hit(rays_, occluded_, Coherence::coherent);
        }
        render(scene, device_, strategies[random.below(static_cast<std::uint32_t>(strategies.size()))]);
        if (is_small_ || !tries_little_device) return;
        // A device that cannot hold the scene: chunks are cut anew, and stream.
        Device little = device_;
        little.unified_memory = false;
        little.max_allocation_bytes = 1 << 22;
        little.global_memory_bytes = 1 << 17;
        render(scene, little, Strategy::simt);
    }

private:
    void render(const BuiltScene& scene, const Device& device, Strategy strategy) {
        Renderer renderer(scene, {device}, {.strategy = strategy});
        const Scene& description = scene.description();
        Camera camera = description.cameras.empty() ? Camera{} : description.cameras[0];
        // Large pictures, many samples and deep mirrors take long in scenes from any file.
        camera.width = is_small_ ? 3 : 13;
        camera.height = is_small_ ? 2 : 9;
        RenderOptions options;
        options.samples_per_pixel = is_small_ ? 1 : 2;
        options.max_recursion_depth = std::min(description.max_recursion_depth, 3u);
        options.aovs = {"normal", "primitive", "material"};
        renderer.render(camera, options);
    }

    bool is_small_;
    Device device_;
    std::vector<Ray> rays_;
    std::vector<Hit> hits_;
    std::vector<std::uint8_t> occluded_;
};

/// Resumes forged checkpoints of one picture.
class CheckpointTrial {
public:
    explicit CheckpointTrial(const fs::path& file)
        : renderer_(scene_of_meshes(), {device_under_test()}, {.strategy = Strategy::simt}) {
        camera_.position = {0, 0, 4};
        camera_.width = 60;
        camera_.height = 44;
        options_.samples_per_pixel = 4;
        options_.tile_size = 8;
        options_.aovs = {"depth", "primitive"};
        options_.checkpoint_file = file;
        fs::remove(file);
        // Stopped at once: the file says what the picture depends on.
        for (int i = 0; i < 100 && !is_section_file(file); ++i)
            renderer_.render(camera_, options_, [](const RenderProgress&) { return false; });
        // Then the same in every run: two blocks are not begun, and two are half done.
        const Checkpoint checkpoint = part_of(renderer_.render(camera_, options_), file);
        save_checkpoint(file, checkpoint);
        options_.checkpoint_file.clear();
        options_.resume_file = file;
    }

    void run() {
        summarize_checkpoint(options_.resume_file);
        renderer_.render(camera_, options_);
    }

private:
    Checkpoint part_of(Film film, const fs::path& file) {
        Checkpoint checkpoint;
        const SectionFile sections(file, kCheckpointFile);
        for (const SectionPlace& place : sections.places())
            if (place.type == "bytes")
                checkpoint.picture = std::string(sections.mapping()->bytes().substr(place.offset, place.count));
        const PixelBlocks blocks(film.width, film.height);
        for (std::uint32_t number = 2; number < 6; ++number)
            blocks.for_each_row(number, 0, [&](std::size_t pixel, std::size_t, std::uint32_t count) {
                std::fill_n(film.done.begin() + static_cast<std::ptrdiff_t>(pixel), count, std::uint8_t{0});
            });
        checkpoint.film = std::move(film);
        for (const std::uint32_t number : {3u, 5u}) {
            checkpoint.partial_blocks[number].samples = 2;
            checkpoint.partial_blocks[number].sums.assign(PixelBlocks::kPixels, glm::vec4(20.0f));
        }
        return checkpoint;
    }

    Renderer renderer_;
    Camera camera_;
    RenderOptions options_;
};

/// The beginning of a message without its numbers, to count messages by.
std::string kind_of(const std::string& reason) {
    std::string kind;
    for (const char c : reason.substr(0, reason.find(','))) {
        const bool is_digit = c >= '0' && c <= '9';
        if (!is_digit) kind += c;
    }
    return kind.substr(0, 72);
}

int run(const Options& options) {
    const TemporaryDirectory folder;
    const fs::path file = folder.path() / "forged";
    const std::vector<Original> scenes = saved_scenes(file);
    SceneTrial scene_trial(options.is_small);
    std::optional<CheckpointTrial> checkpoint_trial;
    std::optional<Original> checkpoint;
    if (!options.is_small) {
        checkpoint_trial.emplace(file);
        checkpoint = Original{"checkpoint", Forger(file, kCheckpointFile)};
    }
    // Nothing is refused that is not forged, and the driver has compiled what it will need.
    for (const Original& original : scenes) {
        RandomSource random(0);
        write(file, original.forger.original());
        scene_trial.run(file, random, true);
    }
    if (checkpoint) {
        write(file, checkpoint->forger.original());
        checkpoint_trial->run();
    }
    std::uint64_t refused = 0, used = 0, wrong = 0;
    std::map<std::string, std::uint64_t> reasons;
    for (std::uint64_t number = options.first; number < options.first + options.count; ++number) {
        RandomSource random(number);
        const bool is_scene = !checkpoint || random.below(8) > 0;
        const Original& original =
            is_scene ? scenes[random.below(static_cast<std::uint32_t>(scenes.size()))] : *checkpoint;
        const Forgery forgery = original.forger.forge(random);
        write(file, forgery.bytes);
        if (options.is_verbose) fmt::print(stderr, "{}: {}: {}\n", number, original.name, forgery.changes);
        ::alarm(options.seconds);
        try {
            if (is_scene)
                scene_trial.run(file, random);
            else
                checkpoint_trial->run();
            ++used;
        } catch (const SceneError& error) {
            ++refused;
            ++reasons[kind_of(error.reason())];
            if (options.is_verbose) fmt::print(stderr, "    refused: {}\n", error.what());
        } catch (const std::exception& error) {
            ++wrong;
            fmt::print(stderr, "file {} ({}: {}): not a SceneError: {}\n", number, original.name, forgery.changes,
                       error.what());
        }
        ::alarm(0);
    }
    if (options.is_verbose)
        for (const auto& [reason, count] : reasons) fmt::print("{:6} {}\n", count, reason);
    fmt::print("{} files: {} refused, {} traced and rendered, {} wrong\n", options.count, refused, used, wrong);
    return wrong > 0 ? 1 : 0;
}

}  // namespace
}  // namespace castor::test

int main(int argc, char** argv) {
    try {
        ::setenv("CASTOR_PROFILE_DIR", "", 1);  // what was tuned here must not decide what is tested
        return castor::test::run(castor::test::options_of(argc, argv));
    } catch (const std::exception& error) {
        fmt::print(stderr, "forged_files: {}\n", error.what());
        return 2;
    }
}
