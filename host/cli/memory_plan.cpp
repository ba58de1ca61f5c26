#include "memory_plan.h"

#include <algorithm>

#include "castor/error.h"
#include "host_memory.h"
#include "trace/shared_scene.h"

namespace castor::cli {

namespace {

// Bytes a bounded primitive, somewhat more than was measured on scans of one to four million triangles (82 to 95
// medium, 110 to 140 high). Building counts what is held at its peak, the tree included.
struct BytesPerPrimitive {
    double building, wide_tree, compressed_tree;
};
constexpr BytesPerPrimitive kMedium{95, 54, 13}, kHigh{140, 78, 19};

// Of a render tile, and of programs.
constexpr std::uint64_t kWorkBytes = 64u << 20;

/// Columns as `flatten` is going to make them.
std::vector<MemoryNeed> columns_of(const Scene& scene) {
    std::uint64_t vertices = 0, triangles = 0, normals = 0;
    for (const Mesh& mesh : scene.meshes) {
        vertices += mesh.positions.size();
        triangles += mesh.triangles.size();
        normals += mesh.normals.size();
    }
    return {{"vertices", vertices * sizeof(glm::vec3)},
            {"normals", normals * sizeof(glm::vec3)},
            {"triangles", triangles * sizeof(glm::uvec3)},
            {"spheres", scene.spheres.size() * (sizeof(glm::vec4) + sizeof(std::uint32_t))},
            {"instances", scene.instances.size() * (sizeof(shared::Instance) + 2 * sizeof(shared::InstanceNode))}};
}

struct Sizes {
    std::vector<MemoryNeed> columns;
    std::uint64_t primitives = 0;  // bounded
    bool is_built = false;
    bool has_wide = false, has_compressed = false;
};

Sizes sizes_of(const SceneInput& input) {
    Sizes sizes;
    if (!input.built) {
        sizes.columns = columns_of(input.scene);
        sizes.primitives = input.scene.spheres.size();
        for (const Mesh& mesh : input.scene.meshes) sizes.primitives += mesh.triangles.size();
        return sizes;
    }
    const PreparedScene& prepared = input.built->shared()->prepared;
    for_each_column(prepared, [&](const char* name, const auto& column) {
        sizes.columns.push_back({name, column.size() * sizeof column[0]});
    });
    sizes.is_built = true;
    sizes.primitives = prepared.arrays.triangle_count() + prepared.arrays.sphere_count();
    sizes.has_wide = prepared.has_wide;
    sizes.has_compressed = prepared.has_compressed;
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

std::uint64_t times(std::uint64_t count, double bytes) {
    return static_cast<std::uint64_t>(static_cast<double>(count) * bytes);
}

// The wide tree's, whose chunks are made to fit.
bool is_cut_into_chunks(const std::string& column) {
    return column == "wide_nodes" || column == "triangle_blocks" || column == "sphere_blocks";
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

MemoryPlan plan_memory(const SceneInput& input, const MemoryRequest& request) {
    const Sizes sizes = sizes_of(input);
    const auto uses = [&](Strategy strategy) {
        return std::any_of(request.strategies.begin(), request.strategies.end(),
                           [&](const StrategyChoice& choice) { return choice.uses(strategy); });
    };
    const bool builds_wide = !sizes.has_wide && (uses(Strategy::wide) || uses(Strategy::packet));
    const bool builds_compressed = !sizes.has_compressed && uses(Strategy::simt);
    const BytesPerPrimitive& each = request.quality == TreeQuality::high ? kHigh : kMedium;
    const std::uint64_t wide = builds_wide ? times(sizes.primitives, each.wide_tree) : 0;
    const std::uint64_t compressed = builds_compressed ? times(sizes.primitives, each.compressed_tree) : 0;
    const std::uint64_t columns = sum_of(sizes.columns);

    MemoryBudget host{"host", {}, request.limit.value_or(available_host_memory()), {}, 0};
    if (!sizes.is_built) add(host.needs, "columns", columns);
    if (builds_wide || builds_compressed)
        add(host.needs, "building the trees",
            times(sizes.primitives, each.building) + (builds_wide && builds_compressed ? compressed : 0));
    add(host.needs, "picture", request.picture_bytes);
    MemoryPlan plan{host};

    for (const Device& device : request.devices) {
        MemoryBudget budget{
            device.name, {}, request.limit.value_or(device.global_memory_bytes), {}, device.max_allocation_bytes};
        if (!device.unified_memory) {
            add(budget.needs, sizes.is_built ? "columns and trees" : "columns", columns);
            add(budget.needs, "trees", wide + compressed);
        }
        add(budget.needs, "rays and programs", kWorkBytes);
        for (const MemoryNeed& column : sizes.columns)
            if (!is_cut_into_chunks(column.what) && column.bytes > budget.largest.bytes) budget.largest = column;
        plan.push_back(std::move(budget));
    }
    return plan;
}

void check_memory(const MemoryPlan& plan) {
    for (const MemoryBudget& budget : plan) {
        if (budget.needed() > budget.available)
            throw DeviceError(
                budget.owner, "", 0,
                fmt::format("too little memory: about {} are needed ({}), {} are available; --memory-limit plans with "
                            "another number",
                            byte_count(budget.needed()), list_of(budget.needs), byte_count(budget.available)));
        if (budget.largest_allowed > 0 && budget.largest.bytes > budget.largest_allowed)
            throw DeviceError(
                budget.owner, "", 0,
                fmt::format("the {} need {} in one buffer, the device's largest allocation is {}", budget.largest.what,
                            byte_count(budget.largest.bytes), byte_count(budget.largest_allowed)));
    }
}

std::string memory_line(const MemoryBudget& budget) {
    return fmt::format("{}: about {} of {} ({})", budget.owner, byte_count(budget.needed()),
                       byte_count(budget.available), budget.needs.empty() ? "nothing more" : list_of(budget.needs));
}

void note_memory(const MemoryPlan& plan) {
    for (const MemoryBudget& budget : plan) note("memory, {}", memory_line(budget));
}

Json json_of(const MemoryPlan& plan) {
    Json list = Json::array();
    for (const MemoryBudget& budget : plan) {
        Json parts = Json::object();
        for (const MemoryNeed& need : budget.needs) parts[need.what] = need.bytes;
        list.push_back(
            {{"owner", budget.owner}, {"needed", budget.needed()}, {"available", budget.available}, {"parts", parts}});
    }
    return list;
}

void add_memory_option(CLI::App& command, std::optional<std::uint64_t>& limit) {
    command
        .add_option(
            "--memory-limit", limit,
            "bytes (or 500M, 16G ...) to plan with, on the host and on each device, instead of what they have left")
        ->transform(CLI::AsSizeValue(false));
}

}  // namespace castor::cli
