#include "trace/chunk.h"

#include <oneapi/tbb/parallel_invoke.h>

#include <algorithm>
#include <limits>
#include <span>

namespace castor {

namespace {

constexpr BytesPerPrimitive kMedium{95, 54, 48, 13}, kHigh{140, 78, 70, 19};

// Numbers of blocks have 27 bits (CASTOR_WIDE_FIRST_MASK): what a column may have at most, whatever the device.
constexpr std::uint64_t kMostColumnBytes = std::uint64_t{CASTOR_WIDE_FIRST_MASK} * sizeof(shared::SphereBlock);

// How full chunks are made that are cut by estimates.
constexpr double kFilling = 0.9;

// Parts of fewer primitives are cut by one task.
constexpr std::size_t kTaskSize = 16384;

std::uint64_t times(std::uint64_t count, double bytes) {
    return static_cast<std::uint64_t>(static_cast<double>(count) * bytes);
}

template <class T>
std::uint64_t bytes_of(const Column<T>& column) {
    return column.size() * sizeof(T);
}

/// A primitive to be put into a chunk.
struct Place {
    float center2[3];
    std::uint32_t primitive;  // triangles, then spheres
};

std::vector<Place> places_of(const SceneArrays& arrays, const shared::Geometry& geometry) {
    std::vector<Place> places;
    places.reserve(std::size_t{geometry.triangle_count} + geometry.sphere_count);
    const auto add = [&](const Box& box, std::size_t primitive) {
        const Float4 center2 = box.lower + box.upper;
        places.push_back({{center2[0], center2[1], center2[2]}, static_cast<std::uint32_t>(primitive)});
    };
    for (std::size_t i = geometry.first_triangle; i < std::size_t{geometry.first_triangle} + geometry.triangle_count;
         ++i) {
        const glm::uvec3& t = arrays.triangle_vertices[i];
        if (t.x == t.y) continue;  // degenerate
        add(triangle_box(arrays.vertex_position[t.x], arrays.vertex_position[t.y], arrays.vertex_position[t.z]), i);
    }
    for (std::size_t i = geometry.first_sphere; i < std::size_t{geometry.first_sphere} + geometry.sphere_count; ++i)
        add(sphere_box(arrays.sphere_center_radius[i]), arrays.triangle_count() + i);
    return places;
}

int longest_axis(std::span<const Place> places) {
    Box box;
    for (const Place& place : places) box.extend(make_float4(place.center2[0], place.center2[1], place.center2[2]));
    const Float4 extent = box.upper - box.lower;
    int axis = 0;
    for (int i = 1; i < 3; ++i)
        if (extent[i] > extent[axis]) axis = i;
    return axis;
}

/// Divides the places into parts of equal numbers that are apart in space.
void divide(std::span<Place> places, std::span<std::span<const Place>> parts) {
    if (parts.size() == 1) {
        parts.front() = places;
        return;
    }
    const int axis = longest_axis(places);
    const std::size_t left_parts = parts.size() / 2, middle = places.size() * left_parts / parts.size();
    std::nth_element(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(middle), places.end(),
                     [axis](const Place& a, const Place& b) {
                         return a.center2[axis] < b.center2[axis] ||
                                (a.center2[axis] == b.center2[axis] && a.primitive < b.primitive);
                     });
    const auto left = [&] { divide(places.first(middle), parts.first(left_parts)); };
    const auto right = [&] { divide(places.subspan(middle), parts.subspan(left_parts)); };
    if (places.size() > kTaskSize)
        tbb::parallel_invoke(left, right);
    else
        left(), right();
}

/// The primitives of each of about so many chunks. What is small shares one with what comes before it.
std::vector<std::vector<std::uint32_t>> assign(const SceneArrays& arrays, std::size_t chunk_count) {
    std::vector<std::vector<Place>> places;
    std::size_t total = 0;
    for (const shared::Geometry& geometry : arrays.geometries) {
        places.push_back(places_of(arrays, geometry));
        total += places.back().size();
    }
    const std::size_t most = std::max<std::size_t>(1, (total + chunk_count - 1) / chunk_count);
    std::vector<std::vector<std::uint32_t>> chunks(1);
    for (std::vector<Place>& each : places) {
        std::vector<std::span<const Place>> parts((each.size() + most - 1) / most);
        if (!parts.empty()) divide(each, parts);
        for (const std::span<const Place> part : parts) {
            if (!chunks.back().empty() && chunks.back().size() + part.size() > most) chunks.emplace_back();
            for (const Place& place : part) chunks.back().push_back(place.primitive);
        }
        each = {};
    }
    for (std::vector<std::uint32_t>& chunk : chunks) std::sort(chunk.begin(), chunk.end());
    return chunks;
}

/// Copies primitives of a chunk to smaller ones.
class Cutter {
public:
    explicit Cutter(const Chunk& whole) : whole_(whole), vertex_stamps_(whole.arrays.vertex_position.size(), 0) {}

    /// The chunk of these primitives, ascending.
    Chunk make(const std::vector<std::uint32_t>& primitives, bool is_first) {
        const SceneArrays& from = whole_.arrays;
        part_ = {};
        begin_vertices(primitives.size());
        part_.arrays.geometries = from.geometries;
        auto next = primitives.begin();
        for (shared::Geometry& geometry : part_.arrays.geometries) {
            const std::uint32_t end = geometry.first_triangle + geometry.triangle_count;
            const std::size_t first = part_.arrays.triangle_count();
            for (; next != primitives.end() && *next < end; ++next) add_triangle(*next, geometry);
            geometry.first_triangle = static_cast<std::uint32_t>(first);
            geometry.triangle_count = static_cast<std::uint32_t>(part_.arrays.triangle_count() - first);
        }
        for (std::size_t g = 0; g < from.geometries.size(); ++g) {
            shared::Geometry& geometry = part_.arrays.geometries[g];
            const std::size_t end = from.triangle_count() + geometry.first_sphere + geometry.sphere_count;
            const std::size_t first = part_.arrays.sphere_count();
            for (; next != primitives.end() && *next < end; ++next) add_sphere(*next, from.geometries[g]);
            geometry.first_sphere = static_cast<std::uint32_t>(first);
            geometry.sphere_count = static_cast<std::uint32_t>(part_.arrays.sphere_count() - first);
        }
        if (is_first) add_what_is_not_cut();
        return std::move(part_);
    }

private:
    // A vertex has its number in the part, plus first_stamp_, where it is there already: so nothing is cleared between
    // parts.
    void begin_vertices(std::size_t primitives) {
        first_stamp_ = next_stamp_;
        mesh_ = 0;
        has_range_ = false;
        if (std::uint64_t{first_stamp_} + 3 * std::uint64_t{primitives} <= std::numeric_limits<std::uint32_t>::max())
            return;
        std::fill(vertex_stamps_.begin(), vertex_stamps_.end(), 0);
        first_stamp_ = next_stamp_ = 1;
    }

    void add_triangle(std::uint32_t triangle, const shared::Geometry& geometry) {
        const SceneArrays& from = whole_.arrays;
        while (mesh_ + 1 < from.mesh_ranges.size() && from.mesh_ranges[mesh_ + 1].first_triangle <= triangle) {
            ++mesh_;
            has_range_ = false;
        }
        if (!has_range_) begin_range();
        glm::uvec3 corners;
        for (int i = 0; i < 3; ++i) corners[i] = vertex(from.triangle_vertices[triangle][i]);
        part_.arrays.triangle_vertices.push_back(corners);
        part_.primitive_numbers.push_back(whole_.primitive_numbers.empty() ? triangle - geometry.first_triangle
                                                                           : whole_.primitive_numbers[triangle]);
    }

    void begin_range() {
        shared::MeshRange range = whole_.arrays.mesh_ranges[mesh_];
        range.first_triangle = static_cast<std::uint32_t>(part_.arrays.triangle_count());
        range.first_vertex = static_cast<std::uint32_t>(part_.arrays.vertex_position.size());
        if (range.first_normal != CASTOR_INVALID_INDEX)
            range.first_normal = static_cast<std::uint32_t>(part_.arrays.vertex_normal.size());
        if (range.first_uv != CASTOR_INVALID_INDEX)
            range.first_uv = static_cast<std::uint32_t>(part_.arrays.vertex_uv.size());
        if (range.first_attributes != CASTOR_INVALID_INDEX)
            range.first_attributes = static_cast<std::uint32_t>(part_.arrays.vertex_attributes.size());
        part_.arrays.mesh_ranges.push_back(range);
        has_range_ = true;
    }

    std::uint32_t vertex(std::uint32_t number) {
        std::uint32_t& stamp = vertex_stamps_[number];
        if (stamp < first_stamp_) {
            stamp = next_stamp_++;
            const SceneArrays& from = whole_.arrays;
            const shared::MeshRange& range = from.mesh_ranges[mesh_];
            part_.arrays.vertex_position.push_back(from.vertex_position[number]);
            if (range.first_normal != CASTOR_INVALID_INDEX)
                part_.arrays.vertex_normal.push_back(
                    from.vertex_normal[range.first_normal + (number - range.first_vertex)]);
            if (range.first_uv != CASTOR_INVALID_INDEX)
                part_.arrays.vertex_uv.push_back(from.vertex_uv[range.first_uv + (number - range.first_vertex)]);
            if (range.first_attributes != CASTOR_INVALID_INDEX)
                part_.arrays.vertex_attributes.push_back(
                    from.vertex_attributes[range.first_attributes + (number - range.first_vertex)]);
        }
        return stamp - first_stamp_;
    }

    void add_sphere(std::uint32_t primitive, const shared::Geometry& geometry) {
        const SceneArrays& from = whole_.arrays;
        const auto sphere = static_cast<std::uint32_t>(primitive - from.triangle_count());
        part_.arrays.sphere_center_radius.push_back(from.sphere_center_radius[sphere]);
        part_.arrays.sphere_material.push_back(from.sphere_material[sphere]);
        part_.primitive_numbers.push_back(whole_.primitive_numbers.empty()
                                              ? geometry.triangle_count + sphere - geometry.first_sphere
                                              : whole_.primitive_numbers[primitive]);
    }

    void add_what_is_not_cut() {
        const SceneArrays& from = whole_.arrays;
        SceneArrays& to = part_.arrays;
        static_cast<SceneSettings&>(to) = from;
        to.plane_point = from.plane_point;
        to.plane_normal = from.plane_normal;
        to.plane_material = from.plane_material;
        to.instances = from.instances;
        to.materials = from.materials;
        to.principled_materials = from.principled_materials;
        to.lights = from.lights;
        to.textures = from.textures;
        to.texture_uses = from.texture_uses;
        to.texture_images = from.texture_images;
        to.texels = from.texels;
        to.emitters = from.emitters;
        to.environment_parts = from.environment_parts;
        to.light_nodes = from.light_nodes;
        const shared::Geometry& geometry = from.geometries.front();
        const std::size_t first = from.triangle_count() + from.sphere_count();
        for (std::size_t i = 0; i < from.plane_count(); ++i)
            part_.primitive_numbers.push_back(
                whole_.primitive_numbers.empty()
                    ? static_cast<std::uint32_t>(geometry.triangle_count + geometry.sphere_count + i)
                    : whole_.primitive_numbers[first + i]);
    }

    const Chunk& whole_;
    Chunk part_;
    std::vector<std::uint32_t> vertex_stamps_;
    std::uint32_t first_stamp_ = 1, next_stamp_ = 1;
    std::size_t mesh_ = 0;    // of the last triangle
    bool has_range_ = false;  // in the part
};

}  // namespace

bool has_pieces(const Chunk& chunk) {
    std::vector<bool> seen(chunk.arrays.triangle_count() + chunk.arrays.sphere_count());
    const auto is_first = [&](std::uint32_t primitive) {
        if (primitive == CASTOR_INVALID_INDEX) return true;  // an unused lane
        const bool is_new = !seen[primitive];
        seen[primitive] = true;
        return is_new;
    };
    const auto is_first_of_block = [&](const auto& block) {
        return std::all_of(std::begin(block.primitive), std::end(block.primitive), is_first);
    };
    if (!std::all_of(chunk.compressed_primitives.begin(), chunk.compressed_primitives.end(), is_first)) return true;
    seen.assign(seen.size(), false);
    return !std::all_of(chunk.triangle_blocks.begin(), chunk.triangle_blocks.end(), is_first_of_block);
}

const BytesPerPrimitive& bytes_per_primitive(TreeQuality quality) {
    return quality == TreeQuality::high ? kHigh : kMedium;
}

void add_estimated_trees(SceneSizes& sizes, std::uint64_t primitives, const TreeNeeds& needs, TreeQuality quality) {
    const BytesPerPrimitive& each = bytes_per_primitive(quality);
    if (needs.wide) {
        sizes.largest_column = std::max(sizes.largest_column, times(primitives, each.wide_blocks));
        sizes.total += times(primitives, each.wide_tree);
    }
    if (needs.compressed) {
        sizes.largest_column = std::max(sizes.largest_column, times(primitives, each.compressed_tree));
        sizes.total += times(primitives, each.compressed_tree);
    }
}

std::uint64_t scene_column_bytes(const Chunk& chunk) {
    std::uint64_t bytes = 0;
#define CASTOR_ADD_cut(column)
#define CASTOR_ADD_chunk(column)
#define CASTOR_ADD_scene(column) bytes += bytes_of(column);
#define CASTOR_ADD(name, host, device, per, place, made, trace, surface) \
    CASTOR_ADD_##place(CASTOR_COLUMN_OF_CHUNK_##made(chunk, name))
    CASTOR_SCENE_COLUMNS(CASTOR_ADD)
#undef CASTOR_ADD_cut
#undef CASTOR_ADD_chunk
#undef CASTOR_ADD_scene
#undef CASTOR_ADD
    return bytes;
}

SceneSizes sizes_of(const Chunk& chunk, const TreeNeeds& needs, TreeQuality quality) {
    SceneSizes sizes;
    for_each_cut_column(chunk, [&](const char*, const auto& column) {
        sizes.largest_column = std::max(sizes.largest_column, bytes_of(column));
    });
    for_each_column(chunk, [&](const char*, const auto& column) { sizes.total += bytes_of(column); });
    sizes.total -= scene_column_bytes(chunk);
    add_estimated_trees(sizes, chunk.arrays.triangle_count() + chunk.arrays.sphere_count(),
                        {needs.wide && !chunk.has_wide, needs.compressed && !chunk.has_compressed}, quality);
    return sizes;
}

std::size_t chunks_needed(const SceneSizes& sizes, std::uint64_t scene_total, const ChunkLimits& limits) {
    const auto parts = [](std::uint64_t bytes, std::uint64_t limit) {
        if (bytes <= limit) return std::size_t{1};
        const double most = std::max(1.0, kFilling * static_cast<double>(limit));
        return std::max<std::size_t>(2, static_cast<std::size_t>(static_cast<double>(bytes) / most + 1.0));
    };
    return std::max(parts(sizes.largest_column, std::min(limits.column_bytes, kMostColumnBytes)),
                    parts(sizes.total, limits.chunk_bytes(scene_total)));
}

std::vector<Chunk> cut(const Chunk& whole, std::size_t parts, const Progress& progress) {
    Cutter cutter(whole);
    std::vector<std::vector<std::uint32_t>> assigned = assign(whole.arrays, parts);
    constexpr double kAssigning = 0.5;
    progress.reach(kAssigning);
    ProgressCount cut_parts(progress.part(kAssigning, 1.0), assigned.size());
    std::vector<Chunk> chunks;
    for (std::vector<std::uint32_t>& primitives : assigned) {
        chunks.push_back(cutter.make(primitives, chunks.empty()));
        primitives = {};
        cut_parts.add(1);
    }
    return chunks;
}

}  // namespace castor
