#include "render/wave.h"

#include <numeric>

#include "render/pixel_blocks.h"

namespace castor {

namespace {

// Eye rays of a block of pixels run alike, and so do the shadow rays of what they meet; mirrors scatter them.
Coherence coherence_at(std::uint32_t depth) {
    return depth == 0 ? Coherence::coherent : Coherence::incoherent;
}

}  // namespace

Wave::Wave(DeviceContext& context, const DeviceScene& scene, const Tuning& tuning, const WaveSettings& settings,
           std::size_t most_blocks)
    : context_(context),
      scene_(scene),
      settings_(settings),
      params_(settings.params),
      trace_kernels_(context, scene, tuning),
      generate_rays_kernel_(context.kernel_of("render", "generate_rays")),
      find_surface_kernel_(context),
      shade_kernel_(context.kernel_of("render", "shade")),
      generate_shadow_rays_kernel_(context.kernel_of("render", "generate_shadow_rays")),
      accumulate_kernel_(context.kernel_of("render", "accumulate")),
      scatter_kernel_(context.kernel_of("render", "scatter")),
      resolve_kernel_(context.kernel_of("render", "resolve")) {
    const std::size_t count = most_blocks * PixelBlocks::kPixels;
    constexpr std::size_t kFloat4 = 16;
    const auto column = [&](std::size_t element, const char* name) {
        return context.make_buffer(count * element, name);
    };
    rays_.origin_tmin = make_column<columns::ray_origin_tmin>(context, count);
    rays_.direction_tmax = make_column<columns::ray_direction_tmax>(context, count);
    shadow_rays_.origin_tmin = DeviceColumn<columns::ray_origin_tmin>(column(kFloat4, "shadow_origin_tmin"));
    shadow_rays_.direction_tmax = DeviceColumn<columns::ray_direction_tmax>(column(kFloat4, "shadow_direction_tmax"));
    hits_ = make_column<columns::hits>(context, count);
    occluded_ = make_column<columns::occluded>(context, count);
    path_throughput_ = column(kFloat4, "path_throughput");
    surface_position_ = make_column<columns::surface_position>(context, count);
    surface_normal_ = make_column<columns::surface_normal>(context, count);
    surface_wo_ = column(kFloat4, "surface_wo");
    surface_material_ = make_column<columns::surface_material>(context, count);
    shadow_contribution_ = column(kFloat4, "shadow_contribution");
    film_sum_ = column(kFloat4, "film_sum");
    ray_counts_ = column(sizeof(cl_uint), "ray_counts");
    pixel_means_ = column(3 * sizeof(float), "pixel_means");
    pixel_blocks_ = context.make_buffer(most_blocks * sizeof(cl_uint), "pixel_blocks");
    alive_count_ = context.make_buffer(sizeof(cl_uint), "alive_count");
}

void Wave::begin(std::span<const std::uint32_t> blocks, std::span<const glm::vec4> sums_before) {
    params_.slot_count = static_cast<std::uint32_t>(blocks.size()) * PixelBlocks::kPixels;
    context_.write(pixel_blocks_, blocks.data(), blocks.size_bytes());
    context_.fill_zero(film_sum_, params_.slot_count * sizeof(cl_float4));
    context_.fill_zero(ray_counts_, params_.slot_count * sizeof(cl_uint));
    context_.write(film_sum_, sums_before.data(), sums_before.size_bytes());
}

void Wave::trace_sample(std::uint32_t sample) {
    params_.sample = sample;
    generate_rays();
    std::uint32_t alive = params_.slot_count;
    for (std::uint32_t depth = 0; alive > 0; ++depth) {
        trace_closest_hits(depth);
        find_surfaces();
        shade(depth);
        for (std::uint32_t light = 0; light < params_.light_count; ++light) add_light(light, depth);
        const bool goes_on = settings_.any_reflective && depth < settings_.max_depth;
        alive = goes_on ? scatter() : 0;
    }
}

void Wave::generate_rays() {
    context_.enqueue(generate_rays_kernel_, params_.slot_count, params_, settings_.camera, pixel_blocks_,
                     rays_.origin_tmin, rays_.direction_tmax, path_throughput_, ray_counts_);
}

void Wave::trace_closest_hits(std::uint32_t depth) {
    const bool culls = params_.flags & CASTOR_RENDER_CULL_BACK_FACES;
    rays_.from.reset();
    if (depth == 0)
        rays_.from = {settings_.camera.position[0], settings_.camera.position[1], settings_.camera.position[2]};
    trace_kernels_.closest_hit(context_.queue(), scene_, rays_, hits_, 0, params_.slot_count,
                               culls ? CASTOR_TRACE_CULL_BACK_FACES : 0, coherence_at(depth));
}

void Wave::find_surfaces() {
    scene_.visit_chunks(context_.queue(), std::nullopt, [&](const DeviceScene::Turn& turn) {
        find_surface_kernel_.enqueue(params_.slot_count, {.slot_count = params_.slot_count,
                                                          .params = turn.params,
                                                          .scene = turn.chunk,
                                                          .ray_origin_tmin = rays_.origin_tmin,
                                                          .ray_direction_tmax = rays_.direction_tmax,
                                                          .hits = hits_,
                                                          .surface_position = surface_position_,
                                                          .surface_normal = surface_normal_,
                                                          .surface_material = surface_material_});
    });
}

void Wave::shade(std::uint32_t depth) {
    context_.enqueue(shade_kernel_, params_.slot_count, params_, depth, scene_.columns.materials, rays_.direction_tmax,
                     surface_material_, path_throughput_, film_sum_, surface_wo_);
}

void Wave::add_light(std::uint32_t light, std::uint32_t depth) {
    context_.enqueue(generate_shadow_rays_kernel_, params_.slot_count, params_, light, scene_.columns.lights,
                     scene_.columns.materials, surface_position_, surface_normal_, surface_wo_, surface_material_,
                     path_throughput_, shadow_rays_.origin_tmin, shadow_rays_.direction_tmax, shadow_contribution_,
                     ray_counts_);
    trace_kernels_.any_hit(context_.queue(), scene_, shadow_rays_, occluded_, 0, params_.slot_count, 0,
                           coherence_at(depth));
    context_.enqueue(accumulate_kernel_, params_.slot_count, params_, shadow_contribution_, occluded_, film_sum_);
}

std::uint32_t Wave::scatter() {
    std::uint32_t alive = 0;
    context_.write(alive_count_, &alive, sizeof(alive));
    context_.enqueue(scatter_kernel_, params_.slot_count, params_, scene_.columns.materials, surface_position_,
                     surface_normal_, surface_wo_, surface_material_, path_throughput_, rays_.origin_tmin,
                     rays_.direction_tmax, ray_counts_, alive_count_);
    context_.read(alive_count_, &alive, sizeof(alive));
    return alive;
}

std::vector<glm::vec3> Wave::resolve(std::uint32_t sample_count) {
    context_.enqueue(resolve_kernel_, params_.slot_count, params_, sample_count, film_sum_, pixel_means_);
    std::vector<glm::vec3> means(params_.slot_count);
    context_.read(pixel_means_, means.data(), means.size() * sizeof(glm::vec3));
    return means;
}

std::vector<glm::vec4> Wave::sums() {
    std::vector<glm::vec4> sums(params_.slot_count);
    context_.read(film_sum_, sums.data(), sums.size() * sizeof(glm::vec4));
    return sums;
}

std::uint64_t Wave::ray_count() {
    std::vector<std::uint32_t> counts(params_.slot_count);
    context_.read(ray_counts_, counts.data(), counts.size() * sizeof(std::uint32_t));
    return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
}

WaveAovs Wave::trace_aovs(std::span<const std::uint32_t> blocks) {
    begin(blocks);
    const std::size_t bytes = std::size_t{params_.slot_count} * 4 * sizeof(float);
    const cl::Buffer position_depth = context_.make_buffer(bytes, "aov_position_depth");
    const cl::Buffer normal = context_.make_buffer(bytes, "aov_normal");
    const cl::Buffer barycentric_t = context_.make_buffer(bytes, "aov_barycentric_t");
    const cl::Buffer indices = context_.make_buffer(bytes, "aov_primitive_instance_material");

    const std::uint32_t flags = params_.flags;
    params_.flags |= CASTOR_RENDER_PIXEL_CENTRES;
    generate_rays();
    trace_closest_hits(0);
    find_surfaces();
    cl::Kernel kernel = context_.kernel("write_aovs");
    context_.enqueue(kernel, params_.slot_count, params_, rays_.origin_tmin, hits_, surface_position_, surface_normal_,
                     surface_material_, position_depth, normal, barycentric_t, indices);
    params_.flags = flags;

    WaveAovs aovs;
    for (std::vector<float>* column : {&aovs.position_depth, &aovs.normal, &aovs.barycentric_t})
        column->resize(4 * std::size_t{params_.slot_count});
    aovs.primitive_instance_material.resize(4 * std::size_t{params_.slot_count});
    context_.read(position_depth, aovs.position_depth.data(), bytes);
    context_.read(normal, aovs.normal.data(), bytes);
    context_.read(barycentric_t, aovs.barycentric_t.data(), bytes);
    context_.read(indices, aovs.primitive_instance_material.data(), bytes);
    return aovs;
}

}  // namespace castor
