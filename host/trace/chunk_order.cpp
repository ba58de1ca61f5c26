#include "trace/chunk_order.h"

#include <algorithm>

#include "castor/error.h"

namespace castor {

std::size_t answer_bytes(ChunkQuestion question) {
    switch (question) {
        case ChunkQuestion::closest:
            return sizeof(Hit);
        case ChunkQuestion::any:
            return 1;
        case ChunkQuestion::surface:
            return sizeof(SurfaceAnswer);
        case ChunkQuestion::textured_surface:
            return sizeof(TexturedSurfaceAnswer);
        case ChunkQuestion::uv:
            return sizeof(UvAnswer);
        case ChunkQuestion::attributes:
            return sizeof(AttributesAnswer);
        case ChunkQuestion::passed:
            return 1;
    }
    return 0;
}

Bytes bytes_of(const ChunkOrder& order) {
    ByteWriter writer;
    writer.add(order.question).add(order.flags).add(order.hint).add(order.chunks).add(order.rays).add(order.hits);
    writer.add(order.times).add(order.pixel_spread);
    writer.add(order.wave).add(order.node).add(order.dimension).add(order.pixel_blocks).add(order.path_slots);
    return writer.take();
}

ChunkOrder chunk_order_of(std::span<const std::byte> bytes, std::size_t chunk_count) {
    ByteReader reader(bytes);
    ChunkOrder order;
    order.question = reader.take<ChunkQuestion>();
    order.flags = reader.take<std::uint32_t>();
    order.hint = reader.take<Coherence>();
    order.chunks = reader.take_vector<std::uint32_t>();
    order.rays = reader.take_vector<Ray>();
    order.hits = reader.take_vector<Hit>();
    order.times = reader.take_vector<float>();
    order.pixel_spread = reader.take<float>();
    order.wave = reader.take<shared::RenderParams>();
    order.node = reader.take<std::uint32_t>();
    order.dimension = reader.take<std::uint32_t>();
    order.pixel_blocks = reader.take_vector<std::uint32_t>();
    order.path_slots = reader.take_vector<std::uint32_t>();
    reader.expect_end();
    const bool has_chunks =
        std::all_of(order.chunks.begin(), order.chunks.end(), [&](std::uint32_t chunk) { return chunk < chunk_count; });
    const std::size_t hits = order.question == ChunkQuestion::any ? 0 : order.rays.size();
    const bool has_times = order.times.empty() || order.times.size() == order.rays.size();
    const std::size_t slots = order.question == ChunkQuestion::passed ? order.rays.size() : 0;
    const bool has_pixels =
        order.wave.sample_shift < 32 &&
        std::all_of(order.path_slots.begin(), order.path_slots.end(), [&](std::uint32_t slot) {
            return (std::uint64_t{order.wave.first_pixel} + (slot >> order.wave.sample_shift)) / CASTOR_BLOCK_SLOTS <
                   order.pixel_blocks.size();
        });
    if (!has_chunks || order.chunks.empty() || order.question > ChunkQuestion::passed || order.hits.size() != hits ||
        !has_times || order.path_slots.size() != slots || !has_pixels)
        throw DeviceError("", "", 0, "the manager sent rays that no chunk can answer");
    return order;
}

}  // namespace castor
