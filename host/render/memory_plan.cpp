#include "castor/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/byte_count.h"
#include "base/host_memory.h"
#include "castor/error.h"
#include "opencl/quirks.h"
#include "render/aov.h"
#include "render/checkpoint.h"
#include "render/denoise.h"
#include "render/light_planes.h"
#include "render/oidn.h"
#include "render/wave.h"
#include "scene/environment_table.h"
#include "scene/texture_columns.h"
#include "trace/scene_contents.h"
#include "trace/tuning.h"

namespace castor {

namespace {

// Compiled programs on a device, and what the driver keeps beside them.
constexpr std::uint64_t kProgramBytes = 48u << 20;

// Rays and answers on a device while batches are traced.
constexpr std::uint64_t kBatchBytes = 16u << 20;

// A bounded primitive's, while it is assigned to a chunk.
constexpr double kBytesOfCutting = 24;

/// Columns as `flatten` is going to make them.
std::vector<MemoryNeed> columns_of(const Scene& scene) {
    const MeshCounts counts = mesh_counts(scene);
    return {{"vertices", counts.vertices * sizeof(glm::vec3)},
            {"normals", counts.normals * sizeof(glm::vec3)},
            {"texture coordinates", counts.texture_coordinates * sizeof(glm::vec2)},
            {"attributes", counts.attributes * sizeof(shared::VertexAttributes)},
            {"triangles", counts.triangles * sizeof(glm::uvec3)},
            {"spheres", scene.spheres.size() * (sizeof(glm::vec4) + sizeof(std::uint32_t))},
            // Of the trees over them, the wide one has a node for two instances or more.
            {"instances", scene.instances.size() * (sizeof(shared::Instance) + 2 * sizeof(shared::InstanceNode) +
                                                    sizeof(shared::WideNode) / 2)},
            {"texels", texel_words(scene) * sizeof(std::uint32_t)},
            {"environment parts", environment_table_words(scene) * sizeof(std::uint32_t)},
            {"lights", scene.lights.size() * (sizeof(shared::Light) + 2 * sizeof(shared::LightNode))}};
}

/// Whether all chunks use a column of columns_of.
bool is_of_scene(const MemoryNeed& column) {
    return column.what == "instances" || column.what == "texels" || column.what == "environment parts" ||
           column.what == "lights";
}

struct Sizes {
    std::uint64_t columns = 0;     // of a scene that is built with its trees
    std::uint64_t of_scene = 0;    // of these, what all chunks use
    MemoryNeed largest_uncut;      // column
    SceneSizes on_device;          // of chunks, with the trees that are needed
    std::uint64_t primitives = 0;  // bounded
    TreeNeeds builds;              // trees that are not there
    std::size_t chunks = 1;
    bool is_cut_here = false;
};

void take_larger(MemoryNeed& largest, const MemoryNeed& need) {
    if (need.bytes > largest.bytes) largest = need;
}

Sizes planned_sizes(const Scene& scene, const TreeNeeds& needs, TreeQuality quality, const ChunkLimits& limits) {
    Sizes sizes;
    for (const MemoryNeed& column : columns_of(scene)) {
        sizes.columns += column.bytes;
        if (is_of_scene(column)) {
            take_larger(sizes.largest_uncut, column);
            sizes.of_scene += column.bytes;
        } else {
            sizes.on_device.largest_column = std::max(sizes.on_device.largest_column, column.bytes);
        }
    }
    sizes.primitives = scene.spheres.size();
    for (const Mesh& mesh : scene.meshes) sizes.primitives += mesh.triangles.size();
    sizes.builds = needs;
    sizes.on_device.total = sizes.columns - sizes.of_scene;
    add_estimated_trees(sizes.on_device, sizes.primitives, needs, quality);
    sizes.chunks = chunks_needed(sizes.on_device, sizes.on_device.total, limits.without(sizes.of_scene));
    sizes.is_cut_here = sizes.chunks > 1;
    return sizes;
}

Sizes planned_sizes(const SceneContents& contents, const TreeNeeds& needs, TreeQuality quality,
                    const ChunkLimits& limits) {
    Sizes sizes;
    sizes.builds = {needs.wide && !contents.has_wide(), needs.compressed && !contents.has_compressed()};
    for (const Chunk& chunk : contents.chunks) {
        sizes.on_device.total += sizes_of(chunk, needs, quality).total;
        sizes.primitives += chunk.arrays.triangle_count() + chunk.arrays.sphere_count();
        for_each_column(chunk,
                        [&](const char*, const auto& column) { sizes.columns += column.size() * sizeof column[0]; });
        for_each_uncut_column(chunk, [&](const char* name, const auto& column) {
            take_larger(sizes.largest_uncut, {name, column.size() * sizeof column[0]});
        });
    }
    sizes.chunks = 0;
    sizes.of_scene = scene_column_bytes(contents.chunks.front());
    for (const Chunk& chunk : contents.chunks)
        sizes.chunks +=
            chunks_needed(sizes_of(chunk, needs, quality), sizes.on_device.total, limits.without(sizes.of_scene));
    sizes.is_cut_here = sizes.chunks > contents.chunks.size();
    if (sizes.is_cut_here)
        sizes.builds = {needs.wide || contents.has_wide(), needs.compressed || contents.has_compressed()};
    return sizes;
}

std::uint64_t sum_of(const std::vector<MemoryNeed>& needs) {
    std::uint64_t sum = 0;
    for (const MemoryNeed& need : needs) sum += need.bytes;
    return sum;
}

void add(std::vector<MemoryNeed>& needs, const std::string& what, std::uint64_t bytes) {
    if (bytes > 0) needs.push_back({what, bytes});
}

std::uint32_t samples_per_pixel(const PlannedPicture& picture) {
    const std::uint32_t asked = picture.options.samples_per_pixel;
    return std::max(1u, asked ? asked : picture.camera.samples_per_pixel);
}

std::uint64_t times(std::uint64_t count, double bytes) {
    return static_cast<std::uint64_t>(static_cast<double>(count) * bytes);
}

std::string list_of(const std::vector<MemoryNeed>& needs) {
    std::string list;
    for (const MemoryNeed& need : needs)
        list += fmt::format("{}{} {}", list.empty() ? "" : ", ", need.what, byte_count(need.bytes));
    return list;
}

}  // namespace

std::uint64_t MemoryBudget::needed() const {
    return sum_of(needs);
}

namespace {

/// Returns whether the sums of all pixel blocks are held at once: passes begin all blocks.
bool holds_all_sums(const RenderOptions& options) {
    return options.order == RenderOrder::progressive || options.noise;
}

std::vector<FilmPlane> planes_without_pixels(const PlannedPicture& picture) {
    return make_planes(rendered_aovs(picture.options), 0, 0);
}

/// Waves that a device has at once.
struct WavesOfDevice {
    std::uint64_t count;
    WaveSize size;  // of each
};

/// Returns the waves of all of a device, and those of its teams: it has either.
std::array<WavesOfDevice, 2> waves_of(const PlannedPicture& picture, const Device& device) {
    const std::uint64_t blocks = PixelBlocks(picture.camera.width, picture.camera.height).count();
    const auto size_on = [&](const Device& some) {
        return wave_size(some, blocks, samples_per_pixel(picture), picture.options.tile_size);
    };
    const std::uint32_t teams = device_quirks(device).teams;
    Device team = device;
    team.compute_units = (device.compute_units + teams - 1) / teams;
    return {{{1, size_on(device)}, {teams, size_on(team)}}};
}

/// Returns what checkpoints of a picture take while it is rendered: a copy of the picture, and the sums of the pixel
/// blocks that are begun, which are held, copied and written.
std::uint64_t checkpoint_bytes(const PlannedPicture& picture, const std::vector<Device>& devices) {
    const std::uint64_t blocks = PixelBlocks(picture.camera.width, picture.camera.height).count();
    std::uint64_t begun = 0;
    for (const Device& device : devices) {
        const auto [whole, teams] = waves_of(picture, device);
        begun += std::max(whole.count * whole.size.blocks, teams.count * teams.size.blocks);
    }
    if (holds_all_sums(picture.options)) begun = blocks;
    const std::uint64_t bytes_of_block =
        sizeof(PartialBlock) + rows_of_sums(planes_without_pixels(picture)) * PixelBlocks::kPixels * sizeof(glm::vec4);
    return picture_bytes(picture) + 3 * std::min(begun, blocks) * bytes_of_block;
}

/// What a scene's waves depend on.
struct WaveNeeds {
    bool has_dielectrics = false;
    std::uint32_t max_recursion_depth = 0;
};

WaveNeeds wave_needs(const Scene& scene) {
    const bool has_dielectrics = std::any_of(scene.materials.begin(), scene.materials.end(),
                                             [](const Material& m) { return m.kind == MaterialKind::dielectric; });
    return {has_dielectrics, scene.max_recursion_depth};
}

WaveNeeds wave_needs(const SceneContents& contents) {
    return {features_of(contents.arrays()).has_dielectrics, contents.arrays().max_recursion_depth};
}

/// Returns the bytes of a device's largest waves.
std::uint64_t largest_wave(const std::vector<PlannedPicture>& pictures, const WaveNeeds& needs, const Device& device) {
    std::uint64_t largest = 0;
    for (const PlannedPicture& picture : pictures) {
        RenderFeatures features;
        features.has_dielectrics = needs.has_dielectrics;
        const std::uint32_t depth = picture.options.max_recursion_depth.value_or(needs.max_recursion_depth);
        for (const WavesOfDevice& waves : waves_of(picture, device))
            largest = std::max(largest, waves.count * wave_bytes(waves.size.room, branch_levels(features, depth)));
    }
    return largest;
}

MemoryPlan plan(const Sizes& sizes, const WaveNeeds& waves, bool is_built, const MemoryRequest& request) {
    const BytesPerPrimitive& each = bytes_per_primitive(request.quality);
    const std::uint64_t wide = sizes.builds.wide ? times(sizes.primitives, each.wide_tree) : 0;
    const std::uint64_t compressed = sizes.builds.compressed ? times(sizes.primitives, each.compressed_tree) : 0;

    MemoryBudget host;
    host.owner = "host";
    host.available = request.limit.value_or(available_host_memory());
    if (!is_built) add(host.needs, "columns", sizes.columns);
    const bool builds = sizes.builds.wide || sizes.builds.compressed;
    if (sizes.is_cut_here) {
        // First all columns are copied, and then one chunk after another gets its trees.
        const std::uint64_t cutting = sizes.columns + times(sizes.primitives, kBytesOfCutting);
        const std::uint64_t building =
            wide + compressed + times(builds ? sizes.primitives / sizes.chunks : 0, each.building);
        add(host.needs, "cutting the scene and building the trees",
            std::max(cutting, building + (is_built ? sizes.columns : 0)));
    } else if (builds) {
        add(host.needs, "building the trees", times(sizes.primitives, each.building) + (wide > 0 ? compressed : 0));
    }
    std::uint64_t picture = 0, checkpoints = 0, denoising = 0;
    for (const PlannedPicture& each_picture : request.pictures) {
        picture = std::max(picture, picture_bytes(each_picture));
        if (!each_picture.options.checkpoint_file.empty())
            checkpoints = std::max(checkpoints, checkpoint_bytes(each_picture, request.devices));
        const RenderOptions& options = each_picture.options;
        if (options.denoise && options.denoiser == Denoiser::oidn && !options.part)
            denoising = std::max(denoising,
                                 bytes_of_oidn(std::uint64_t{each_picture.camera.width} * each_picture.camera.height));
    }
    add(host.needs, "picture", picture);
    add(host.needs, "checkpoints", checkpoints);
    add(host.needs, "denoising", denoising);
    MemoryPlan plan{host};

    for (const Device& device : request.devices) {
        MemoryBudget budget;
        budget.owner = device.name;
        budget.available = request.limit.value_or(device.global_memory_bytes);
        const std::uint64_t most = limits_of(device).without(sizes.of_scene).scene_bytes;
        budget.chunks = sizes.chunks;
        budget.streams = sizes.on_device.total > most;
        // Geometry in memory that the device shares is the host's. What all chunks use must fit in any case.
        add(budget.needs, "textures, lights and instances", sizes.of_scene);
        if (!device.unified_memory) add(budget.needs, "columns and trees", std::min(sizes.on_device.total, most));
        const std::uint64_t rays =
            request.pictures.empty() ? kBatchBytes : largest_wave(request.pictures, waves, device);
        add(budget.needs, "rays and programs", kProgramBytes + rays);
        budget.largest = sizes.largest_uncut;
        budget.largest_allowed = device.max_allocation_bytes;
        plan.push_back(std::move(budget));
    }
    return plan;
}

/// Returns the trees that the request's devices traverse.
TreeNeeds tree_needs(const MemoryRequest& request) {
    if (request.devices.empty()) return {.wide = true, .compressed = true};
    return needs_of(strategies_of(choose_tunings(request.strategy, request.devices, request.use_profiles)));
}

}  // namespace

std::uint64_t picture_bytes(const PlannedPicture& picture) {
    constexpr std::uint64_t kBytesPerPixel = sizeof(glm::vec3) + 1;
    const RenderOptions& options = picture.options;
    const std::vector<FilmPlane> planes = planes_without_pixels(picture);
    const std::uint64_t sums = holds_all_sums(options) ? rows_of_sums(planes) * sizeof(glm::vec4) : 0;
    std::uint64_t channels = 0, films = 1;
    for (const FilmPlane& plane : planes) channels += plane.channels.size();
    if (wants_light_planes(options)) {
        channels += 3 * (picture.light_count + 1);  // the last one of what no light makes
        films = 2;                                  // the picture, and the light that is rendered
    }
    // Channels one by one, and the file.
    const std::uint64_t of_layers = picture.has_layers ? 2 * (3 + channels) * sizeof(float) : 0;
    return std::uint64_t{picture.camera.width} * picture.camera.height *
           (films * (kBytesPerPixel + sums) + channels * sizeof(float) + of_layers);
}

MemoryPlan plan_memory(const Scene& scene, const MemoryRequest& request) {
    return plan(planned_sizes(scene, tree_needs(request), request.quality, limits_of(request.devices)),
                wave_needs(scene), false, request);
}

MemoryPlan plan_memory(const BuiltScene& scene, const MemoryRequest& request) {
    return plan(planned_sizes(contents_of(scene), tree_needs(request), request.quality, limits_of(request.devices)),
                wave_needs(contents_of(scene)), true, request);
}

std::string shortage(const MemoryBudget& budget) {
    if (budget.needed() > budget.available)
        return fmt::format(
            "too little memory: about {} are needed ({}), {} are available; --memory-limit plans with another number",
            byte_count(budget.needed()), list_of(budget.needs), byte_count(budget.available));
    if (budget.largest_allowed > 0 && budget.largest.bytes > budget.largest_allowed)
        return fmt::format("the {} need {} in one buffer, the device's largest allocation is {}", budget.largest.what,
                           byte_count(budget.largest.bytes), byte_count(budget.largest_allowed));
    return "";
}

void check_memory(const MemoryPlan& plan) {
    for (const MemoryBudget& budget : plan)
        if (const std::string text = shortage(budget); !text.empty()) throw DeviceError(budget.owner, "", 0, text);
}

std::string to_string(const MemoryBudget& budget) {
    const std::string chunks = budget.chunks == 1 ? ""
                                                  : fmt::format("; the scene is cut into {} chunks{}", budget.chunks,
                                                                budget.streams ? ", which take turns" : "");
    return fmt::format("{}: about {} of {} ({}){}", budget.owner, byte_count(budget.needed()),
                       byte_count(budget.available), budget.needs.empty() ? "nothing more" : list_of(budget.needs),
                       chunks);
}

}  // namespace castor
