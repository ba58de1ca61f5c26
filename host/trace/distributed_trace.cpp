#include "trace/distributed_trace.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <numeric>
#include <utility>

#include "castor/error.h"

namespace castor {

namespace {

constexpr Hit kMiss{std::numeric_limits<float>::infinity(), 0.0f, 0.0f, CASTOR_INVALID_INDEX, CASTOR_INVALID_INDEX};

/// As better_answer of kernels/device/scene.cl.
bool is_better(const Hit& a, const Hit& b) {
    if (a.t != b.t) return a.t < b.t;
    if (a.instance != b.instance) return a.instance < b.instance;
    return a.primitive < b.primitive;
}

/// The t of a hit in the caller's units, nearly: for direction d it is in units of d / 2^k, with the largest component
/// of that in [1, 2).
double callers_t(const Ray& ray, float scaled_t) {
    const float largest =
        std::max({std::abs(ray.direction[0]), std::abs(ray.direction[1]), std::abs(ray.direction[2])});
    constexpr float kStrange = 1e30f;  // the scale of such rays has limits
    if (!(largest > 1.0f / kStrange && largest < kStrange)) return std::numeric_limits<double>::infinity();
    return std::ldexp(double{scaled_t}, -std::ilogb(largest));
}

}  // namespace

DistributedTrace::DistributedTrace(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning,
                                   TraceKernels& kernels)
    : context_(context), scene_(scene), tuning_(tuning), kernels_(kernels) {}

void DistributedTrace::set_exchange(std::shared_ptr<ChunkExchange> exchange) {
    exchange_ = std::move(exchange);
    own_chunks_ = {};
    const Range& chunks = exchange_->chunks_of(0);
    for (std::uint64_t i = chunks.begin; i < chunks.end; ++i) own_chunks_.chunks.push_back(i);
}

Bytes DistributedTrace::answer_here(const ChunkOrder& order) {
    if (!answerer_) answerer_.emplace(context_, scene_, tuning_);
    return answerer_->answer(order);
}

std::vector<Ray> DistributedTrace::read_rays(const TraceKernels::RayBuffers& rays, std::size_t count) {
    std::vector<Ray> values(count);
    if (rays.interleaved) {
        context_.read(rays.origin_tmin, values.data(), count * sizeof(Ray));
        return values;
    }
    std::vector<glm::vec4> column(count);
    static_assert(sizeof(Ray) == 2 * sizeof(glm::vec4));
    context_.read(rays.origin_tmin, column.data(), count * sizeof(glm::vec4));
    for (std::size_t i = 0; i < count; ++i) std::memcpy(values[i].origin, &column[i], sizeof(glm::vec4));
    context_.read(rays.direction_tmax, column.data(), count * sizeof(glm::vec4));
    for (std::size_t i = 0; i < count; ++i) std::memcpy(values[i].direction, &column[i], sizeof(glm::vec4));
    return values;
}

std::vector<float> DistributedTrace::read_times(const TraceKernels::RayBuffers& rays, std::size_t count) {
    std::vector<float> times(rays.time ? count : 0);
    if (rays.time) context_.read(*rays.time, times.data(), count * sizeof(float));
    return times;
}

void DistributedTrace::closest_hit(TraceKernels::RayBuffers rays, const TraceKernels::Hits& hits, std::size_t count,
                                   std::uint32_t flags, Coherence hint) {
    // The last chunk here comes after the others' answers: with it, t gets the caller's units.
    DeviceScene::Subset first = own_chunks_, last{.chunks = {}, .goes_on = true, .more_follows = false};
    last.chunks.push_back(first.chunks.back());
    first.chunks.pop_back();
    first.more_follows = true;
    const auto trace = [&](const DeviceScene::Subset& subset) {
        rays.subset = &subset;
        kernels_.closest_hit(context_.queue(), scene_, rays, hits, 0, count, flags, hint);
    };
    std::vector<Hit> best(count, kMiss);
    if (!first.chunks.empty()) {
        trace(first);
        context_.read(hits, best.data(), count * sizeof(Hit));
    }
    const std::vector<Ray> values = read_rays(rays, count);
    const std::vector<Hit> brought = best;
    ask<Hit>(
        {.question = ChunkQuestion::closest, .flags = flags, .hint = hint, .chunks = {}, .rays = {}, .hits = {}},
        values, brought, read_times(rays, count),
        [&](std::size_t share, std::uint32_t i) {
            const double t = brought[i].primitive == CASTOR_INVALID_INDEX ? double{values[i].t_max}
                                                                          : callers_t(values[i], brought[i].t);
            return exchange_->may_meet(share, values[i], t);
        },
        [&](std::uint32_t i, const Hit& hit) {
            if (is_better(hit, best[i])) best[i] = hit;
        });
    context_.write(hits, best.data(), count * sizeof(Hit));
    trace(last);
}

void DistributedTrace::any_hit(TraceKernels::RayBuffers rays, const TraceKernels::Occluded& occluded, std::size_t count,
                               std::uint32_t flags, Coherence hint) {
    rays.subset = &own_chunks_;
    kernels_.any_hit(context_.queue(), scene_, rays, occluded, 0, count, flags, hint);
    std::vector<std::uint8_t> answers(count);
    context_.read(occluded, answers.data(), count);
    const std::vector<Ray> values = read_rays(rays, count);
    const std::vector<std::uint8_t> own = answers;
    ask<std::uint8_t>(
        {.question = ChunkQuestion::any, .flags = flags, .hint = hint, .chunks = {}, .rays = {}, .hits = {}}, values,
        {}, read_times(rays, count),
        [&](std::size_t share, std::uint32_t i) {
            return !own[i] && exchange_->may_meet(share, values[i], values[i].t_max);
        },
        [&](std::uint32_t i, std::uint8_t answer) { answers[i] |= answer; });
    context_.write(occluded, answers.data(), count);
}

void DistributedTrace::find_surfaces(SurfaceKernels& kernels, SurfaceKernels::Query query,
                                     const SurfaceKernels::Surfaces& surfaces, float pixel_spread) {
    const std::size_t count = query.count, textured = kernels.has_textures() ? count : 0;
    std::vector<std::uint32_t> materials(count, CASTOR_INVALID_INDEX);
    context_.write(surfaces.material, materials.data(), count * sizeof materials[0]);
    query.subset = &own_chunks_;
    kernels.find(scene_, query, surfaces, pixel_spread);
    std::vector<Hit> found(count);
    std::vector<glm::vec4> positions(count), normals(count), diffuses(textured), speculars(textured);
    context_.read(query.hits, found.data(), count * sizeof(Hit));
    context_.read(surfaces.material, materials.data(), count * sizeof materials[0]);
    context_.read(surfaces.position, positions.data(), count * sizeof positions[0]);
    context_.read(surfaces.normal, normals.data(), count * sizeof normals[0]);
    if (textured > 0) {
        context_.read(surfaces.diffuse, diffuses.data(), count * sizeof diffuses[0]);
        context_.read(surfaces.specular, speculars.data(), count * sizeof speculars[0]);
    }
    const std::vector<Ray> values = read_rays({query.origin_tmin, query.direction_tmax}, count);
    const std::vector<std::uint32_t> own = materials;
    const auto wants = [&](std::size_t share, std::uint32_t i) {
        return found[i].primitive != CASTOR_INVALID_INDEX && own[i] == CASTOR_INVALID_INDEX &&
               exchange_->may_have(share, values[i], found[i].t);
    };
    const auto take = [&](std::uint32_t i, const SurfaceAnswer& answer) {
        if (answer.material == CASTOR_INVALID_INDEX) return false;
        materials[i] = answer.material;
        std::memcpy(&positions[i], answer.position, sizeof answer.position);
        std::memcpy(&normals[i], answer.normal, sizeof answer.normal);
        return true;
    };
    ChunkOrder order{.question = textured > 0 ? ChunkQuestion::textured_surface : ChunkQuestion::surface,
                     .flags = query.flags,
                     .chunks = {},
                     .rays = {},
                     .hits = {},
                     .pixel_spread = pixel_spread};
    if (textured > 0)
        ask<TexturedSurfaceAnswer>(order, values, found, {}, wants,
                                   [&](std::uint32_t i, const TexturedSurfaceAnswer& answer) {
                                       if (!take(i, answer.surface)) return;
                                       std::memcpy(&diffuses[i], answer.diffuse, sizeof answer.diffuse);
                                       std::memcpy(&speculars[i], answer.specular, sizeof answer.specular);
                                   });
    else
        ask<SurfaceAnswer>(order, values, found, {}, wants, take);
    for (std::size_t i = 0; i < count; ++i)
        if (found[i].primitive != CASTOR_INVALID_INDEX && materials[i] == CASTOR_INVALID_INDEX)
            throw DeviceError("", "", 0, "a ray hit a surface that no process has");
    context_.write(surfaces.material, materials.data(), count * sizeof materials[0]);
    context_.write(surfaces.position, positions.data(), count * sizeof positions[0]);
    context_.write(surfaces.normal, normals.data(), count * sizeof normals[0]);
    if (textured == 0) return;
    context_.write(surfaces.diffuse, diffuses.data(), count * sizeof diffuses[0]);
    context_.write(surfaces.specular, speculars.data(), count * sizeof speculars[0]);
}

void DistributedTrace::find_uvs(SurfaceKernels& kernels, SurfaceKernels::Query query,
                                const DeviceColumn<columns::surface_uv>& uvs) {
    const std::size_t count = query.count;
    query.subset = &own_chunks_;
    kernels.find_uvs(scene_, query, uvs);
    std::vector<Hit> found(count);
    std::vector<glm::vec2> values(count);
    context_.read(query.hits, found.data(), count * sizeof(Hit));
    context_.read(uvs, values.data(), count * sizeof values[0]);
    const std::vector<Ray> rays = read_rays({query.origin_tmin, query.direction_tmax}, count);
    ask<UvAnswer>(
        {.question = ChunkQuestion::uv, .chunks = {}, .rays = {}, .hits = {}}, rays, found, {},
        [&](std::size_t share, std::uint32_t i) {
            return found[i].primitive != CASTOR_INVALID_INDEX && exchange_->may_have(share, rays[i], found[i].t);
        },
        [&](std::uint32_t i, const UvAnswer& answer) {
            if (answer.uv[0] != 0.0f || answer.uv[1] != 0.0f) values[i] = {answer.uv[0], answer.uv[1]};
        });
    context_.write(uvs, values.data(), count * sizeof values[0]);
}

void DistributedTrace::find_attributes(SurfaceKernels& kernels, SurfaceKernels::Query query,
                                       const SurfaceKernels::Attributes& attributes) {
    const std::size_t count = query.count;
    const float unknown = std::numeric_limits<float>::quiet_NaN();
    std::vector<glm::vec4> uvs(count), tangents(count), colors(count, glm::vec4(unknown));
    context_.write(attributes.color, colors.data(), count * sizeof colors[0]);
    query.subset = &own_chunks_;
    kernels.find_attributes(scene_, query, attributes);
    std::vector<Hit> found(count);
    context_.read(query.hits, found.data(), count * sizeof(Hit));
    context_.read(attributes.uvs, uvs.data(), count * sizeof uvs[0]);
    context_.read(attributes.tangent, tangents.data(), count * sizeof tangents[0]);
    context_.read(attributes.color, colors.data(), count * sizeof colors[0]);
    const std::vector<Ray> rays = read_rays({query.origin_tmin, query.direction_tmax}, count);
    const std::vector<glm::vec4> own = colors;
    ask<AttributesAnswer>(
        {.question = ChunkQuestion::attributes, .chunks = {}, .rays = {}, .hits = {}}, rays, found, {},
        [&](std::size_t share, std::uint32_t i) {
            return found[i].primitive != CASTOR_INVALID_INDEX && std::isnan(own[i].x) &&
                   exchange_->may_have(share, rays[i], found[i].t);
        },
        [&](std::uint32_t i, const AttributesAnswer& answer) {
            if (std::isnan(answer.color[0])) return;
            std::memcpy(&uvs[i], answer.uvs, sizeof answer.uvs);
            std::memcpy(&tangents[i], answer.tangent, sizeof answer.tangent);
            std::memcpy(&colors[i], answer.color, sizeof answer.color);
        });
    context_.write(attributes.uvs, uvs.data(), count * sizeof uvs[0]);
    context_.write(attributes.tangent, tangents.data(), count * sizeof tangents[0]);
    context_.write(attributes.color, colors.data(), count * sizeof colors[0]);
}

void DistributedTrace::find_passed(SurfaceKernels& kernels, SurfaceKernels::Query query,
                                   const SurfaceKernels::Bounce& bounce, const DeviceColumn<columns::passed>& passed) {
    const std::size_t count = query.count;
    std::vector<std::uint8_t> answers(count);
    query.subset = &own_chunks_;
    kernels.find_passed(scene_, query, bounce, passed);
    context_.read(passed, answers.data(), count);
    std::vector<Hit> found(count);
    context_.read(query.hits, found.data(), count * sizeof(Hit));
    const std::vector<Ray> rays = read_rays({query.origin_tmin, query.direction_tmax}, count);
    std::vector<std::uint32_t> blocks(bounce.block_count), slots(count);
    context_.read(bounce.pixel_blocks, blocks.data(), blocks.size() * sizeof blocks[0]);
    if (bounce.params.flags & CASTOR_RENDER_FIRST_BOUNCE)
        std::iota(slots.begin(), slots.end(), 0u);
    else
        context_.read(bounce.path_slot, slots.data(), count * sizeof slots[0]);
    const std::vector<std::uint8_t> own = answers;
    ChunkOrder order{.question = ChunkQuestion::passed, .chunks = {}, .rays = {}, .hits = {}};
    order.wave = bounce.params;
    order.wave.flags &= ~CASTOR_RENDER_FIRST_BOUNCE;
    order.node = bounce.node;
    order.dimension = bounce.dimension;
    order.pixel_blocks = std::move(blocks);
    ask<std::uint8_t>(
        order, rays, found, {},
        [&](std::size_t share, std::uint32_t i) {
            return found[i].primitive != CASTOR_INVALID_INDEX && own[i] == 0 &&
                   exchange_->may_have(share, rays[i], found[i].t);
        },
        [&](std::uint32_t i, std::uint8_t answer) { answers[i] |= answer; }, slots);
    for (std::size_t i = 0; i < count; ++i)
        if (found[i].primitive != CASTOR_INVALID_INDEX && answers[i] == 0)
            throw DeviceError("", "", 0, "a ray hit a surface that no process has");
    context_.write(passed, answers.data(), count);
}

}  // namespace castor
