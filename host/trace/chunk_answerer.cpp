#include "trace/chunk_answerer.h"

#include <cstring>

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
    if (order.question == ChunkQuestion::surface) return find_surfaces(order, subset);
    const cl::Buffer rays = context_.make_buffer(count * sizeof(Ray), "rays");
    context_.write(rays, order.rays.data(), count * sizeof(Ray));
    const cl::Buffer target = context_.make_buffer(answers.size(), "answers");
    auto columns = TraceKernels::RayBuffers::records(rays);
    columns.subset = &subset;
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
    std::vector<glm::vec4> origins, directions;
    for (const Ray& ray : order.rays) {
        origins.emplace_back(ray.origin[0], ray.origin[1], ray.origin[2], ray.t_min);
        directions.emplace_back(ray.direction[0], ray.direction[1], ray.direction[2], ray.t_max);
    }
    const auto origin_tmin = make_column<columns::ray_origin_tmin>(context_, count);
    const auto direction_tmax = make_column<columns::ray_direction_tmax>(context_, count);
    const auto hits = make_column<columns::hits>(context_, count);
    const auto position = make_column<columns::surface_position>(context_, count);
    const auto normal = make_column<columns::surface_normal>(context_, count);
    const auto material = make_column<columns::surface_material>(context_, count);
    std::vector<std::uint32_t> materials(count, CASTOR_INVALID_INDEX);
    std::vector<glm::vec4> positions(count), normals(count);
    context_.write(origin_tmin, origins.data(), count * sizeof origins[0]);
    context_.write(direction_tmax, directions.data(), count * sizeof directions[0]);
    context_.write(hits, order.hits.data(), count * sizeof(Hit));
    context_.write(material, materials.data(), count * sizeof materials[0]);
    if (!find_surface_kernel_) find_surface_kernel_.emplace(context_);
    scene_.visit_chunks(
        context_.queue(), std::nullopt,
        [&](const DeviceScene::Turn& turn) {
            find_surface_kernel_->enqueue(count, {.path_count = static_cast<cl_uint>(count),
                                                  .params = turn.params,
                                                  .scene = turn.chunk,
                                                  .ray_origin_tmin = origin_tmin,
                                                  .ray_direction_tmax = direction_tmax,
                                                  .hits = hits,
                                                  .surface_position = position,
                                                  .surface_normal = normal,
                                                  .surface_material = material});
        },
        &subset);
    context_.read(position, positions.data(), count * sizeof positions[0]);
    context_.read(normal, normals.data(), count * sizeof normals[0]);
    context_.read(material, materials.data(), count * sizeof materials[0]);
    Bytes answers(count * sizeof(SurfaceAnswer));
    for (std::size_t i = 0; i < count; ++i) {
        SurfaceAnswer answer{{}, {}, materials[i]};
        std::memcpy(answer.position, &positions[i], sizeof answer.position);
        std::memcpy(answer.normal, &normals[i], sizeof answer.normal);
        std::memcpy(answers.data() + i * sizeof answer, &answer, sizeof answer);
    }
    return answers;
}

OrderedWorkerOffer chunk_answerer_offer(const std::shared_ptr<SceneDevice>& device) {
    return {device->context.quirks().stays_in_thread,
            [=](const std::function<bool()>& is_needed) -> std::unique_ptr<OrderedWorker> {
                auto lock = lock_for_work(*device, is_needed);
                if (!lock) return nullptr;
                return with_device_errors(
                    *device, [&] { return std::make_unique<OrderedChunkAnswerer>(device, std::move(lock)); });
            }};
}

}  // namespace castor
