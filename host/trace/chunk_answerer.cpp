#include "trace/chunk_answerer.h"

#include <cstring>
#include <limits>

#include "castor/error.h"

namespace castor {

namespace {

class OrderedChunkAnswerer : public OrderedWorker {
public:
    /// `lock` is that of the device.
    OrderedChunkAnswerer(std::shared_ptr<SceneDevice> device, std::unique_lock<std::timed_mutex> lock)
        : device_(std::move(device)),
          lock_(std::move(lock)),
          answerer_(device_->context, device_->scene, device_->tuning) {}

    WorkerState state() const override { return {.setup_seconds = device_->setup_seconds}; }
    Bytes work(std::span<const std::byte> order, const OnProgress&) override {
        return with_device_errors(
            *device_, [&] { return answerer_.answer(chunk_order_of(order, device_->scene.chunk_count())); });
    }

private:
    std::shared_ptr<SceneDevice> device_;
    std::unique_lock<std::timed_mutex> lock_;
    ChunkAnswerer answerer_;
};

}  // namespace

ChunkAnswerer::ChunkAnswerer(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning)
    : context_(context), scene_(scene), trace_kernels_(context, scene, tuning) {}

Bytes ChunkAnswerer::answer(const ChunkOrder& order) {
    const DeviceScene::Subset subset{
        .chunks = {order.chunks.begin(), order.chunks.end()}, .goes_on = true, .more_follows = true};
    const std::size_t count = order.rays.size();
    Bytes answers(count * answer_bytes(order.question));
    if (answers.empty()) return answers;
    if (order.question != ChunkQuestion::closest && order.question != ChunkQuestion::any)
        return find_surfaces(order, subset);
    const cl::Buffer rays = context_.make_buffer(count * sizeof(Ray), "rays");
    context_.write(rays, order.rays.data(), count * sizeof(Ray));
    const cl::Buffer target = context_.make_buffer(answers.size(), "answers");
    auto columns = TraceKernels::RayBuffers::records(rays);
    columns.subset = &subset;
    if (!order.times.empty()) {
        columns.time = make_column<columns::ray_time>(context_, count);
        context_.write(*columns.time, order.times.data(), count * sizeof order.times[0]);
    }
    if (order.question == ChunkQuestion::any) {
        context_.write(target, answers.data(), answers.size());  // no ray is occluded yet
        trace_kernels_.any_hit(context_.queue(), scene_, columns, TraceKernels::Occluded(target), 0, count, order.flags,
                               order.hint);
    } else {
        context_.write(target, order.hits.data(), answers.size());
        trace_kernels_.closest_hit(context_.queue(), scene_, columns, TraceKernels::Hits(target), 0, count, order.flags,
                                   order.hint);
    }
    context_.read(target, answers.data(), answers.size());
    return answers;
}

Bytes ChunkAnswerer::find_surfaces(const ChunkOrder& order, const DeviceScene::Subset& subset) {
    const std::size_t count = order.rays.size();
    // Kernels in lanes read and write what the last lanes would have.
    const std::size_t room = (count + CASTOR_BLOCK_SLOTS - 1) / CASTOR_BLOCK_SLOTS * CASTOR_BLOCK_SLOTS;
    std::vector<glm::vec4> origins, directions;
    for (const Ray& ray : order.rays) {
        origins.emplace_back(ray.origin[0], ray.origin[1], ray.origin[2], ray.t_min);
        directions.emplace_back(ray.direction[0], ray.direction[1], ray.direction[2], ray.t_max);
    }
    const SurfaceKernels::Query query{make_column<columns::ray_origin_tmin>(context_, room),
                                      make_column<columns::ray_direction_tmax>(context_, room),
                                      make_column<columns::hits>(context_, room),
                                      count,
                                      &subset,
                                      order.flags};
    context_.write(query.origin_tmin, origins.data(), count * sizeof origins[0]);
    context_.write(query.direction_tmax, directions.data(), count * sizeof directions[0]);
    context_.write(query.hits, order.hits.data(), count * sizeof(Hit));
    if (order.question == ChunkQuestion::uv) {
        const auto uvs = make_column<columns::surface_uv>(context_, room);
        Bytes answers(count * sizeof(UvAnswer));
        context_.write(uvs, answers.data(), answers.size());
        surface_kernels(false).find_uvs(scene_, query, uvs);
        context_.read(uvs, answers.data(), answers.size());
        return answers;
    }
    if (order.question == ChunkQuestion::attributes) return find_attributes(query, room);
    if (order.question == ChunkQuestion::passed) return find_passed(order, query, room);
    const bool has_textures = order.question == ChunkQuestion::textured_surface;
    const std::size_t textured = has_textures ? count : 0;
    const SurfaceKernels::Surfaces surfaces{make_column<columns::surface_position>(context_, room),
                                            make_column<columns::surface_normal>(context_, room),
                                            make_column<columns::surface_material>(context_, room),
                                            make_column<columns::surface_diffuse>(context_, has_textures ? room : 0),
                                            make_column<columns::surface_specular>(context_, has_textures ? room : 0)};
    std::vector<std::uint32_t> materials(count, CASTOR_INVALID_INDEX);
    std::vector<glm::vec4> positions(count), normals(count), diffuses(textured), speculars(textured);
    context_.write(surfaces.material, materials.data(), count * sizeof materials[0]);
    surface_kernels(has_textures).find(scene_, query, surfaces, order.pixel_spread);
    context_.read(surfaces.position, positions.data(), count * sizeof positions[0]);
    context_.read(surfaces.normal, normals.data(), count * sizeof normals[0]);
    context_.read(surfaces.material, materials.data(), count * sizeof materials[0]);
    context_.read(surfaces.diffuse, diffuses.data(), textured * sizeof diffuses[0]);
    context_.read(surfaces.specular, speculars.data(), textured * sizeof speculars[0]);
    ByteWriter answers;
    for (std::size_t i = 0; i < count; ++i) {
        SurfaceAnswer surface{{}, {}, materials[i]};
        std::memcpy(surface.position, &positions[i], sizeof surface.position);
        std::memcpy(surface.normal, &normals[i], sizeof surface.normal);
        if (!has_textures) {
            answers.add(surface);
            continue;
        }
        TexturedSurfaceAnswer answer{surface, {}, {}};
        std::memcpy(answer.diffuse, &diffuses[i], sizeof answer.diffuse);
        std::memcpy(answer.specular, &speculars[i], sizeof answer.specular);
        answers.add(answer);
    }
    return answers.take();
}

Bytes ChunkAnswerer::find_attributes(const SurfaceKernels::Query& query, std::size_t room) {
    const SurfaceKernels::Attributes attributes{make_column<columns::surface_uvs>(context_, room),
                                                make_column<columns::surface_tangent>(context_, room),
                                                make_column<columns::surface_color>(context_, room)};
    std::vector<glm::vec4> uvs(query.count), tangents(query.count),
        colors(query.count, glm::vec4(std::numeric_limits<float>::quiet_NaN()));
    const std::size_t bytes = query.count * sizeof(glm::vec4);
    context_.write(attributes.uvs, uvs.data(), bytes);
    context_.write(attributes.tangent, tangents.data(), bytes);
    context_.write(attributes.color, colors.data(), bytes);
    surface_kernels(false).find_attributes(scene_, query, attributes);
    context_.read(attributes.uvs, uvs.data(), bytes);
    context_.read(attributes.tangent, tangents.data(), bytes);
    context_.read(attributes.color, colors.data(), bytes);
    ByteWriter answers;
    for (std::size_t i = 0; i < query.count; ++i) {
        AttributesAnswer answer{};
        std::memcpy(answer.uvs, &uvs[i], sizeof answer.uvs);
        std::memcpy(answer.tangent, &tangents[i], sizeof answer.tangent);
        std::memcpy(answer.color, &colors[i], sizeof answer.color);
        answers.add(answer);
    }
    return answers.take();
}

Bytes ChunkAnswerer::find_passed(const ChunkOrder& order, const SurfaceKernels::Query& query, std::size_t room) {
    const SurfaceKernels::Bounce bounce{
        .params =
            [&] {
                shared::RenderParams wave = order.wave;
                wave.path_count = static_cast<std::uint32_t>(query.count);
                return wave;
            }(),
        .node = order.node,
        .dimension = order.dimension,
        .pixel_blocks = make_column<columns::pixel_blocks>(context_, order.pixel_blocks.size()),
        .path_slot = make_column<columns::path_slot>(context_, room),
        .block_count = order.pixel_blocks.size()};
    const auto passed = make_column<columns::passed>(context_, room);
    Bytes answers(query.count);
    context_.write(bounce.pixel_blocks, order.pixel_blocks.data(), order.pixel_blocks.size() * sizeof(std::uint32_t));
    context_.write(bounce.path_slot, order.path_slots.data(), query.count * sizeof(std::uint32_t));
    context_.write(passed, answers.data(), answers.size());
    surface_kernels(false).find_passed(scene_, query, bounce, passed);
    context_.read(passed, answers.data(), answers.size());
    return answers;
}

/// The kernels are built when they are first needed: all that one process asks is for the same scene.
SurfaceKernels& ChunkAnswerer::surface_kernels(bool has_textures) {
    if (!surface_kernels_ || (has_textures && !surface_kernels_->has_textures()))
        surface_kernels_.emplace(context_, has_textures);
    return *surface_kernels_;
}

OrderedWorkerOffer chunk_answerer_offer(const std::shared_ptr<SceneDevice>& device) {
    return {device->context.quirks().stays_in_thread,
            [=](const std::function<bool()>& is_needed) -> std::unique_ptr<OrderedWorker> {
                auto lock = lock_for_work(device->mutex, is_needed);
                if (!lock) return nullptr;
                return with_device_errors(
                    *device, [&] { return std::make_unique<OrderedChunkAnswerer>(device, std::move(lock)); });
            }};
}

}  // namespace castor
