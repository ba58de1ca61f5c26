#include "trace/device_scene.h"

#include <algorithm>
#include <mutex>
#include <numeric>
#include <span>
#include <utility>

namespace castor {

namespace {

/// Whether all chunks use the same buffer for a column, by its `place` in the list of columns.
struct IsOfScene {
    static constexpr bool cut = false, chunk = false, scene = true;
};

/// A column of a chunk on the host, and where its buffer goes.
struct ColumnSource {
    void (*put)(DeviceColumns&, cl::Buffer);
    const char* name;
    const void* data;
    std::size_t bytes;
    bool is_of_scene;

    void upload(DeviceContext& context, DeviceColumns& target) const {
        put(target, context.upload_bytes(data, bytes, name));
    }
};

std::vector<ColumnSource> column_sources(const Chunk& chunk) {
    std::vector<ColumnSource> sources;
#define CASTOR_ADD_SOURCE(name, host, device, per, place, made, trace, surface)                    \
    {                                                                                              \
        const Column<host>& column = CASTOR_COLUMN_OF_CHUNK_##made(chunk, name);                   \
        sources.push_back({[](DeviceColumns& target, cl::Buffer buffer) {                          \
                               target.name = DeviceColumn<columns::name>(std::move(buffer));       \
                           },                                                                      \
                           #name, column.data(), column.size() * sizeof(host), IsOfScene::place}); \
    }
    CASTOR_SCENE_COLUMNS(CASTOR_ADD_SOURCE)
#undef CASTOR_ADD_SOURCE
    return sources;
}

/// A chunk as it was when the scene came to the device: trees that another device's strategies add later are none of
/// it.
struct ChunkSource {
    std::vector<ColumnSource> columns;
    std::uint64_t bytes = 0;
    std::uint64_t brute_tests = 0;
    shared::TraceParams params{};
    Box bounds;

    ChunkSource(const Chunk& chunk, std::span<const shared::Instance> instances)
        : columns(column_sources(chunk)), bounds(chunk.bounds) {
        std::erase_if(columns, [](const ColumnSource& column) { return column.is_of_scene; });
        for (const ColumnSource& column : columns) bytes += column.bytes;
        const SceneArrays& arrays = chunk.arrays;
        params.instance_count = static_cast<std::uint32_t>(instances.size());
        params.triangle_count = static_cast<std::uint32_t>(arrays.triangle_count());
        params.sphere_count = static_cast<std::uint32_t>(arrays.sphere_count());
        params.plane_count = static_cast<std::uint32_t>(arrays.plane_count());
        params.mesh_count = static_cast<std::uint32_t>(arrays.mesh_ranges.size());
        params.number_count = static_cast<std::uint32_t>(chunk.primitive_numbers.size());
        params.node_count = static_cast<std::uint32_t>(chunk.compressed_nodes.size());
        params.wide_root = chunk.wide_root;
        params.largest_coordinate = arrays.largest_coordinate();
        params.instance_node_count = static_cast<std::uint32_t>(chunk.instance_nodes.size());
        if (instances.empty()) brute_tests = std::uint64_t{params.triangle_count} + params.sphere_count;
        for (const shared::Instance& instance : instances) {
            const shared::Geometry& geometry = arrays.geometries[instance.geometry];
            brute_tests += std::uint64_t{geometry.triangle_count} + geometry.sphere_count;
        }
    }

    /// `scene_columns`: those of the whole scene, which are on the device already.
    DeviceColumns upload(DeviceContext& context, const DeviceColumns& scene_columns) const {
        DeviceColumns chunk = scene_columns;
        for (const ColumnSource& column : columns) column.upload(context, chunk);
        return chunk;
    }
};

DeviceColumns upload_scene_columns(DeviceContext& context, const Chunk& first_chunk) {
    DeviceColumns uploaded;
    for (const ColumnSource& column : column_sources(first_chunk))
        if (column.is_of_scene) column.upload(context, uploaded);
    return uploaded;
}

/// From a point to a box, squared; infinite for an empty one. What is not a number counts as 0.
float squared_distance(const Box& box, const glm::vec3& point) {
    float sum = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        const float outside = std::max(0.0f, std::max(box.lower[axis] - point[axis], point[axis] - box.upper[axis]));
        sum += outside * outside;
    }
    return sum;
}

}  // namespace

struct DeviceScene::Implementation {
    DeviceContext& context;
    const SceneContents& contents;
    DeviceColumns scene_columns;
    std::vector<ChunkSource> sources;
    std::vector<DeviceColumns> chunks;  // without buffers where one is not on the device
    std::vector<bool> stays;            // one a chunk
    std::size_t streaming_count = 0;    // of those that may stay
    std::mutex mutex;                   // held while chunks stream
    std::optional<std::size_t> guest;   // the other one that is on the device now
    bool has_spheres = false;
    bool has_instances = false;
    std::uint32_t compressed_levels = 0;

    Implementation(DeviceContext& device_context, const SceneContents& scene_contents, const Range& kept)
        : context(device_context),
          contents(scene_contents),
          scene_columns(upload_scene_columns(context, contents.chunks.front())) {
        const std::span<const shared::Instance> all_instances(contents.arrays().instances);
        has_instances = !all_instances.empty();
        for (const Chunk& chunk : contents.chunks) {
            sources.emplace_back(chunk, all_instances);
            has_spheres |= chunk.arrays.sphere_count() > 0;
            compressed_levels = std::max(compressed_levels, chunk.compressed_levels);
        }
        chunks.resize(sources.size());
        stays.resize(sources.size());
        choose_residents({kept.begin, std::min<std::uint64_t>(kept.end, sources.size())},
                         limits_of(context.device()).without(scene_column_bytes(contents.chunks.front())).scene_bytes);
        for (std::size_t i = 0; i < sources.size(); ++i)
            if (stays[i]) chunks[i] = sources[i].upload(context, scene_columns);
    }

    /// All of `kept` stay, or the first of them, so that there is room for the largest of the others.
    void choose_residents(const Range& kept, std::uint64_t most) {
        std::uint64_t total = 0, largest = 0;
        for (const ChunkSource& source : sources) {
            total += source.bytes;
            largest = std::max(largest, source.bytes);
        }
        std::uint64_t taken = total <= most ? 0 : largest;
        for (std::uint64_t i = kept.begin; i < kept.end; ++i) {
            stays[i] = i == kept.begin || taken + sources[i].bytes <= most;
            if (!stays[i]) {
                streaming_count = kept.end - i;
                break;
            }
            taken += sources[i].bytes;
        }
    }

    bool is_on_device(std::size_t chunk) const { return stays[chunk] || chunk == guest; }

    void take_in(std::size_t chunk) {
        if (guest)
            std::exchange(chunks[*guest],
                          {});  // not assigned over: a buffer whose release fails would be released again
        guest.reset();
        chunks[chunk] = sources[chunk].upload(context, scene_columns);
        guest = chunk;
    }

    std::vector<std::size_t> order_from(const std::optional<glm::vec3>& from) const {
        std::vector<std::size_t> order(sources.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        if (!from) return order;
        std::vector<float> distances;
        for (const ChunkSource& source : sources) distances.push_back(squared_distance(source.bounds, *from));
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return distances[a] < distances[b]; });
        return order;
    }

    void visit(const cl::CommandQueue& queue, const std::vector<std::size_t>& order,
               const std::function<void(const Turn&)>& visit, const Subset* subset) {
        const bool goes_on = subset && subset->goes_on, more_follows = subset && subset->more_follows;
        for (std::size_t i = 0; i < order.size(); ++i) {
            const std::size_t chunk = order[i];
            const bool is_last = i + 1 == order.size();
            if (!is_on_device(chunk)) take_in(chunk);
            // The caller's queue may run commands in any order.
            if (i > 0) context.guarded("clEnqueueBarrierWithWaitList", [&] { queue.enqueueBarrierWithWaitList(); });
            Turn turn{chunks[chunk], sources[chunk].params, sources[chunk].brute_tests, is_last};
            turn.params.flags = (i > 0 || goes_on ? CASTOR_TRACE_GOES_ON : 0u) |
                                (is_last && !more_follows ? 0u : CASTOR_TRACE_MORE_FOLLOWS);
            visit(turn);
            if (!stays[chunk]) context.guarded("clFinish", [&] { queue.finish(); });
        }
    }
};

DeviceScene::DeviceScene(DeviceContext& context, const SceneContents& contents, const Range& kept)
    : implementation_(std::make_unique<Implementation>(context, contents, kept)) {}

DeviceScene::DeviceScene(DeviceScene&&) noexcept = default;
DeviceScene::~DeviceScene() = default;

const DeviceColumns& DeviceScene::columns() const {
    return implementation_->scene_columns;
}
std::size_t DeviceScene::chunk_count() const {
    return implementation_->sources.size();
}
std::size_t DeviceScene::streaming_count() const {
    return implementation_->streaming_count;
}
bool DeviceScene::has_spheres() const {
    return implementation_->has_spheres;
}
bool DeviceScene::has_planes() const {
    return implementation_->sources.front().params.plane_count > 0;
}
bool DeviceScene::has_instances() const {
    return implementation_->has_instances;
}
std::uint32_t DeviceScene::compressed_levels() const {
    return implementation_->compressed_levels;
}

std::uint64_t DeviceScene::most_brute_tests() const {
    std::uint64_t most = 0;
    for (const ChunkSource& source : implementation_->sources) most = std::max(most, source.brute_tests);
    return most;
}

bool DeviceScene::has_pieces() const {
    const SceneContents& contents = implementation_->contents;
    std::lock_guard lock(*contents.mutex);
    return std::any_of(contents.chunks.begin(), contents.chunks.end(),
                       [](const Chunk& chunk) { return castor::has_pieces(chunk); });
}

void DeviceScene::visit_chunks(const cl::CommandQueue& queue, const std::optional<glm::vec3>& from,
                               const std::function<void(const Turn&)>& visit, const Subset* subset) const {
    Implementation& self = *implementation_;
    std::vector<std::size_t> order = self.order_from(from);
    if (subset)
        std::erase_if(order, [&](std::size_t chunk) {
            return std::find(subset->chunks.begin(), subset->chunks.end(), chunk) == subset->chunks.end();
        });
    if (std::all_of(order.begin(), order.end(), [&](std::size_t chunk) { return self.stays[chunk]; }))
        return self.visit(queue, order, visit, subset);
    std::lock_guard lock(self.mutex);
    std::stable_partition(order.begin(), order.end(), [&](std::size_t chunk) { return self.is_on_device(chunk); });
    self.visit(queue, order, visit, subset);
}

std::vector<std::size_t> DeviceScene::order_from(const std::optional<glm::vec3>& from) const {
    return implementation_->order_from(from);
}

}  // namespace castor
