#include "tune/kernel_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "base/stopwatch.h"
#include "castor/error.h"
#include "castor/scene.h"
#include "opencl/device_context.h"
#include "reference/random_source.h"
#include "reference/shading.h"
#include "reference/textures.h"
#include "render/camera.h"
#include "render/pixel_blocks.h"
#include "render/render_arguments.h"
#include "tune/bench_kernels.h"
#include "tune/kernel_cases.h"

namespace castor {

namespace {

using glm::dvec3;
using glm::vec3;
using glm::vec4;
using shared::Ray;

constexpr std::size_t kPrimitives = 32, kLights = 8, kIndices = 8;
constexpr std::uint32_t kTexels = 512;  // in a row and a column
/// The largest number of rays or points whose answers are checked; they are spread over the batch.
constexpr std::size_t kMostChecked = 4096;

[[noreturn]] void fail_wrong(const Device& device, std::string_view kernel, const std::string& found) {
    throw DeviceError(device.name, "", 0, fmt::format("wrong answer: {}: {}", kernel, found));
}

std::string text(const Ray& ray) {
    return fmt::format("ray from {} {} {} along {} {} {}", ray.origin[0], ray.origin[1], ray.origin[2],
                       ray.direction[0], ray.direction[1], ray.direction[2]);
}

std::string text(const dvec3& v) {
    return fmt::format("({}, {}, {})", v.x, v.y, v.z);
}

/// The answers of the kernel nearest_in_list, one for each ray.
struct Nearest {
    std::vector<float> t;
    std::vector<cl_uint> number;
    std::vector<cl_uint> hits;
};

/// The measurements of functions on one device.
class KernelBench {
public:
    KernelBench(const Device& device, std::uint32_t size, std::uint32_t repeat, std::uint32_t seed,
                const std::function<bool()>& go_on)
        : context_(device, kernels::bench_kernels), size_(size), repeat_(repeat), seed_(seed), go_on_(go_on) {}

    KernelMeasurement tested_function(const TestedFunction& function) {
        const std::vector<Ray> rays = make_case_rays(count(), seed_);
        const std::vector<vec4> primitives = function.make_primitives(kPrimitives, seed_ + 1);
        const cl::Buffer ray_buffer = upload(rays), primitive_buffer = upload(primitives);
        const cl::Buffer t = make_buffer<float>(count()), number = make_buffer<cl_uint>(count()),
                         hits = make_buffer<cl_uint>(count());
        cl::Kernel kernel =
            context_.kernel_of("bench/nearest_in_list", "nearest_in_list",
                               fmt::format("-DCASTOR_TESTED={} -DCASTOR_ROWS={}", function.name, function.rows));
        const auto enqueue = [&] {
            context_.enqueue(kernel, count(), static_cast<cl_uint>(count()), cl_uint{kPrimitives}, kLargestCoordinate,
                             ray_buffer, primitive_buffer, t, number, hits);
        };
        enqueue();
        const Nearest found{read<float>(t), read<cl_uint>(number), read<cl_uint>(hits)};
        for (std::size_t i = 0; i < count(); i += check_step()) check(function, rays[i], primitives, found, i);
        return time(std::string(function.name), "tests", kPrimitives, enqueue);
    }

    KernelMeasurement generate_rays() {
        const Camera camera = picture();
        const shared::Camera device_camera = make_camera(camera, "");
        shared::RenderParams params{};
        params.path_count = params.pixel_count = static_cast<std::uint32_t>(count());
        params.flags = CASTOR_RENDER_PIXEL_CENTRES;
        const auto origins = make_column<columns::ray_origin_tmin>(context_, count());
        const auto directions = make_column<columns::ray_direction_tmax>(context_, count());
        const auto counts = make_column<columns::ray_counts>(context_, count());
        context_.fill_zero(counts, count() * sizeof(cl_uint));
        const PixelBlocks blocks(size_, size_);
        std::vector<cl_uint> codes;
        for (std::uint32_t block = 0; block < blocks.count(); ++block) codes.push_back(blocks.code(block));
        const DeviceColumn<columns::pixel_blocks> pixel_blocks(upload(codes));
        Kernel<GenerateRays> kernel(context_);
        const auto enqueue = [&] {
            kernel.enqueue(count(), {.params = params,
                                     .camera = device_camera,
                                     .pixel_blocks = pixel_blocks,
                                     .ray_origin_tmin = origins,
                                     .ray_direction_tmax = directions,
                                     .ray_counts = counts});
        };
        enqueue();
        const std::vector<vec4> found_origins = read<vec4>(origins), found_directions = read<vec4>(directions);
        for (std::size_t slot = 0; slot < count(); slot += check_step())
            check_eye_ray(camera, device_camera.t_min, device_camera.t_max, slot, found_origins[slot],
                          found_directions[slot]);
        return time("generate_rays", "rays", 1, enqueue);
    }

    /// `brdf`: of the material, see shared::Material.
    KernelMeasurement shading(const std::string& name, std::uint32_t brdf) {
        const std::vector<Ray> random = make_case_rays(2 * count() + kLights, seed_);
        const auto [positions, normals, wos] = points(random);
        std::vector<shared::Light> lights(kLights);
        for (std::size_t k = 0; k < kLights; ++k) {
            const vec3 position = 3.0f * glm::normalize(vector(random[2 * count() + k].direction));
            std::copy_n(&position.x, 3, lights[k].position);
            std::fill_n(lights[k].intensity, 3, 1.0f + static_cast<float>(k));
            lights[k].kind = CASTOR_LIGHT_POINT;
        }
        shared::Material material{};
        const glm::vec3 diffuse(0.5f, 0.6f, 0.7f), specular(0.3f, 0.2f, 0.1f);
        std::copy_n(&diffuse.x, 3, material.diffuse);
        std::copy_n(&specular.x, 3, material.specular);
        material.phong_exponent = 40.0f;
        material.refraction_index = 1.5f;
        material.kind = CASTOR_MATERIAL_PLAIN;
        material.brdf = brdf;
        const cl::Buffer position = upload(positions), normal = upload(normals), wo = upload(wos),
                         light = upload(lights);
        const cl::Buffer reflected = make_buffer<vec4>(count());
        const std::uint32_t lanes = context_.quirks().lanes;
        cl::Kernel kernel = context_.kernel_of(fmt::format("bench/light_points.x{}", lanes),
                                               fmt::format("light_points{}", lanes > 1 ? fmt::to_string(lanes) : ""),
                                               fmt::format("-DCASTOR_HAS_BRDFS={}", brdf != CASTOR_BRDF_BLINN_PHONG));
        const auto enqueue = [&] {
            context_.enqueue(kernel, count() / lanes, static_cast<cl_uint>(count()), cl_uint{kLights}, material,
                             cl_uint{0}, light, position, normal, wo, reflected);
        };
        enqueue();
        const std::vector<vec4> found = read<vec4>(reflected);
        for (std::size_t i = 0; i < count(); i += check_step())
            check_shading(name, material, lights, dvec3(positions[i]), dvec3(normals[i]), dvec3(wos[i]),
                          dvec3(found[i]));
        return time(name, "samples", kLights, enqueue);
    }

    KernelMeasurement refraction() {
        const auto [positions, normals, wos] = points(make_case_rays(2 * count(), seed_));
        std::vector<float> indices;
        for (std::size_t k = 0; k < kIndices; ++k) indices.push_back(0.6f + 0.3f * static_cast<float>(k));
        const cl::Buffer index = upload(indices), normal = upload(normals), wo = upload(wos);
        const cl::Buffer sums = make_buffer<vec4>(count());
        const std::uint32_t lanes = context_.quirks().lanes;
        cl::Kernel kernel = context_.kernel_of(fmt::format("bench/refract_points.x{}", lanes),
                                               fmt::format("refract_points{}", lanes > 1 ? fmt::to_string(lanes) : ""));
        const auto enqueue = [&] {
            context_.enqueue(kernel, count() / lanes, static_cast<cl_uint>(count()), cl_uint{kIndices}, index, normal,
                             wo, sums);
        };
        enqueue();
        const std::vector<vec4> found = read<vec4>(sums);
        for (std::size_t i = 0; i < count(); i += check_step())
            check_refraction(indices, dvec3(normals[i]), dvec3(wos[i]), found[i]);
        return time("refract", "samples", kIndices, enqueue);
    }

    /// Looks up points at random: memory is read here and there, as by rays that mirrors scatter.
    KernelMeasurement texture_lookups(const char* name, TextureFilter filter) {
        reference::RandomSource random(seed_);
        Scene scene;
        Image image{"", kTexels, kTexels, {}, {}};
        for (std::uint32_t i = 0; i < 3 * kTexels * kTexels; ++i)
            image.bytes.push_back(static_cast<std::uint8_t>(random.below(256)));
        scene.images = {image};
        scene.textures.emplace_back().filter = filter;
        SceneArrays arrays;
        append_textures(arrays, scene);
        std::vector<vec4> points;
        for (std::size_t i = 0; i < count(); ++i)
            points.emplace_back(random.uniform_float(-1.0f, 2.0f), random.uniform_float(-1.0f, 2.0f),
                                random.uniform_float(0.0f, 4.0f), 0.0f);
        const cl::Buffer images = upload(std::vector(arrays.texture_images.begin(), arrays.texture_images.end())),
                         texels = upload(std::vector(arrays.texels.begin(), arrays.texels.end())),
                         point_buffer = upload(points);
        const cl::Buffer found_buffer = make_buffer<vec4>(count());
        const std::uint32_t lanes = context_.quirks().lanes;
        cl::Kernel kernel =
            context_.kernel_of(fmt::format("bench/texture_lookups.x{}", lanes),
                               fmt::format("texture_lookups{}", lanes > 1 ? fmt::to_string(lanes) : ""));
        const auto enqueue = [&] {
            context_.enqueue(kernel, count() / lanes, static_cast<cl_uint>(count()), arrays.textures.front(), images,
                             texels, point_buffer, found_buffer);
        };
        enqueue();
        const std::vector<vec4> found = read<vec4>(found_buffer);
        const std::vector<Image> levels = reference::levels_of(image);
        for (std::size_t i = 0; i < count(); i += check_step()) check_texel(name, filter, levels, points[i], found[i]);
        return time(name, "lookups", 1, enqueue);
    }

private:
    std::size_t count() const { return std::size_t{size_} * size_; }
    /// Returns an odd step, so that the checked slots do not all have the same place in a pattern.
    std::size_t check_step() const { return count() <= kMostChecked ? 1 : count() / kMostChecked | 1; }
    std::size_t checked() const { return (count() + check_step() - 1) / check_step(); }

    struct Points {
        std::vector<vec4> positions, normals, wos;
    };
    Points points(const std::vector<Ray>& random) const {
        Points made;
        for (std::size_t i = 0; i < count(); ++i) {
            made.positions.emplace_back(vector(random[2 * i].origin), 0.0f);
            made.normals.emplace_back(glm::normalize(vector(random[2 * i].direction)), 0.0f);
            made.wos.emplace_back(glm::normalize(vector(random[2 * i + 1].direction)), 0.0f);
        }
        return made;
    }

    static vec3 vector(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

    Camera picture() const {
        Camera camera;
        camera.position = {1.0f, 2.0f, 3.0f};
        camera.gaze = {-0.5f, -0.4f, -1.0f};
        camera.width = camera.height = size_;
        return camera;
    }

    template <class T>
    cl::Buffer make_buffer(std::size_t elements) {
        return context_.make_buffer(elements * sizeof(T), "measured data");
    }
    template <class T>
    cl::Buffer upload(const std::vector<T>& values) {
        const cl::Buffer buffer = make_buffer<T>(values.size());
        context_.write(buffer, values.data(), values.size() * sizeof(T));
        return buffer;
    }
    template <class T>
    std::vector<T> read(const cl::Buffer& buffer) {
        std::vector<T> values(count());
        context_.read(buffer, values.data(), values.size() * sizeof(T));
        return values;
    }

    template <class Enqueue>
    KernelMeasurement time(const std::string& kernel, const char* unit, std::size_t of_each, const Enqueue& enqueue) {
        KernelMeasurement measurement{kernel, unit, count() * of_each, checked() * of_each, {}};
        for (std::uint32_t i = 0; i < repeat_ && go_on_(); ++i) {
            const Stopwatch watch;
            enqueue();
            context_.finish();
            measurement.seconds.push_back(watch.seconds());
        }
        return measurement;
    }

    void check(const TestedFunction& function, const Ray& ray, const std::vector<vec4>& primitives,
               const Nearest& found, std::size_t i) const {
        std::size_t least_hits = 0, most_hits = 0;
        double least_t = INFINITY, greatest_t = INFINITY;  // where the nearest hit may lie
        for (std::size_t k = 0; k < kPrimitives; ++k) {
            const Verdict verdict = function.judge(ray, primitives.data() + function.rows * k);
            least_hits += verdict.must_hit;
            most_hits += verdict.may_hit;
            if (verdict.may_hit) least_t = std::min(least_t, verdict.least_t);
            if (verdict.must_hit) greatest_t = std::min(greatest_t, verdict.greatest_t);
        }
        const double t = found.t[i];
        const cl_uint number = found.number[i];
        bool is_right = found.hits[i] >= least_hits && found.hits[i] <= most_hits && t >= least_t && t <= greatest_t;
        if (number == CASTOR_INVALID_INDEX) {
            is_right = is_right && found.hits[i] == 0 && std::isinf(t);
        } else {
            is_right = is_right && number < kPrimitives;
            const Verdict verdict =
                is_right ? function.judge(ray, primitives.data() + function.rows * number) : Verdict{};
            is_right = is_right && verdict.may_hit && t >= verdict.least_t && t <= verdict.greatest_t;
        }
        if (!is_right)
            fail_wrong(context_.device(), function.name,
                       fmt::format("{}: found {} hits, the nearest at t {} of number {}; expected are {} to {} hits, "
                                   "the nearest at t {} to {}",
                                   text(ray), found.hits[i], t, static_cast<std::int32_t>(number), least_hits,
                                   most_hits, least_t, greatest_t));
    }

    /// Checks an eye ray: direction = s - e with m = e - w distance, q = m + l u + t v, s = q + s_u u - s_v v.
    void check_eye_ray(const Camera& camera, float t_min, float t_max, std::size_t slot, const vec4& found_origin,
                       const vec4& found_direction) const {
        const glm::uvec2 corner =
            PixelBlocks(size_, size_).corner(static_cast<std::uint32_t>(slot / PixelBlocks::kPixels));
        const glm::uvec2 pixel =
            corner + PixelBlocks::on_curve(static_cast<std::uint32_t>(slot % PixelBlocks::kPixels));
        const double x = pixel.x + 0.5, y = pixel.y + 0.5;
        const dvec3 w = -glm::normalize(dvec3(camera.gaze)), u = glm::normalize(glm::cross(dvec3(camera.up), w)),
                    v = glm::cross(w, u);
        const dvec3 expected = -w * double(camera.distance) +
                               u * (camera.left + x * (double(camera.right) - camera.left) / size_) +
                               v * (camera.top - y * (double(camera.top) - camera.bottom) / size_);
        const double error = glm::length(dvec3(found_direction) - expected);
        if (!(error <= 16 * 0x1p-24) || vec3(found_origin) != camera.position || found_origin.w != t_min ||
            found_direction.w != t_max)
            fail_wrong(
                context_.device(), "generate_rays",
                fmt::format(
                    "through ({}, {}): found origin {}, direction {}, t from {} to {}; expected {}, {}, {} to {}", x, y,
                    text(dvec3(found_origin)), text(dvec3(found_direction)), found_origin.w, found_direction.w,
                    text(dvec3(camera.position)), text(expected), t_min, t_max));
    }

    void check_shading(const std::string& name, const shared::Material& material,
                       const std::vector<shared::Light>& lights, const dvec3& position, const dvec3& normal,
                       const dvec3& wo, const dvec3& found) const {
        const bool is_blinn_phong = material.brdf == CASTOR_BRDF_BLINN_PHONG;
        // Microfacets are divided by the cosine of the view, and end abruptly where it is zero.
        const double cos_wo = is_blinn_phong ? 1.0 : std::fabs(glm::dot(normal, wo));
        dvec3 expected(0.0);
        double tolerance = 0.0;
        for (const shared::Light& light : lights) {
            const reference::LightSample sample = reference::sample_light(light, position);
            expected += is_blinn_phong ? reference::blinn_phong(material, false, normal, wo, sample)
                                       : reference::brdf(material, normal, wo, sample);
            // The power multiplies a relative error by its exponent. Where the light passes behind the surface, the
            // highlight ends abruptly.
            const double share = std::fabs(glm::dot(normal, sample.wi)) < 1e-5
                                     ? 1.0
                                     : (32 + 32 * double(material.phong_exponent)) * 0x1p-24 / cos_wo;
            tolerance += share * glm::length(sample.irradiance);
        }
        if (!(glm::length(found - expected) <= tolerance))
            fail_wrong(context_.device(), name,
                       fmt::format("the point {} with normal {} reflects {} towards {}; expected is {}", text(position),
                                   text(normal), text(found), text(wo), text(expected)));
    }

    void check_refraction(const std::vector<float>& indices, const dvec3& normal, const dvec3& wo,
                          const vec4& found) const {
        dvec3 refracted(0.0);
        double reflected = 0.0, tolerance = 0.0;
        const double c = std::fabs(glm::dot(normal, wo));
        for (const float index : indices) {
            const reference::Refraction exact = reference::refract(index, normal, wo);
            const double ratio = glm::dot(normal, wo) > 0.0 ? 1.0 / index : index;
            refracted += (1.0 - exact.reflectance) * exact.direction;
            reflected += exact.reflectance;
            // Some roundings of the sine's square become errors of the cosine, the larger the smaller it is.
            const double error = 16 * 0x1p-24 * (1.0 + ratio * ratio) / c;
            const double cos2 = std::fabs(1.0 - ratio * ratio * (1.0 - c * c));
            tolerance +=
                std::min(2.0, error / std::max(cos2, 1e-12)) + 2 * std::sqrt(std::min(1.0, error)) * (cos2 < 1e-4);
        }
        if (!(glm::length(dvec3(found) - refracted) <= tolerance && std::fabs(found.w - reflected) <= tolerance))
            fail_wrong(context_.device(), "refract",
                       fmt::format("a ray towards {} leaves a normal {} along {} with {}; expected is {} with {}",
                                   text(-wo), text(normal), text(dvec3(found)), found.w, text(refracted), reflected));
    }

    void check_texel(const char* name, TextureFilter filter, const std::vector<Image>& levels, const vec4& point,
                     const vec4& found) const {
        const double u = point.x, v = point.y;
        dvec3 expected;
        if (filter == TextureFilter::nearest) {
            if (reference::is_near_border(u, kTexels) || reference::is_near_border(v, kTexels)) return;
            expected = reference::nearest_texel(levels.front(), u, v, TextureWrap::repeat);
        } else {
            const double level = filter == TextureFilter::trilinear ? double{point.z} : 0.0;
            expected = reference::trilinear_texel(levels, u, v, level, TextureWrap::repeat);
        }
        if (!(glm::length(dvec3(found) - expected) <= 2 * reference::texel_tolerance(levels.front(), 255.0)))
            fail_wrong(context_.device(), name,
                       fmt::format("at u {} v {} of level {} the texel {}; expected is {}", point.x, point.y, point.z,
                                   text(dvec3(found)), text(expected)));
    }

    DeviceContext context_;
    std::uint32_t size_, repeat_, seed_;
    const std::function<bool()>& go_on_;
};

}  // namespace

void bench_kernels(const Device& device, std::uint32_t size, std::uint32_t repeat, std::uint32_t seed,
                   const std::function<bool()>& go_on, const std::function<void(const KernelMeasurement&)>& report) {
    KernelBench bench(device, size, repeat, seed, go_on);
    const auto finish = [&](const KernelMeasurement& measurement) {
        if (!measurement.seconds.empty()) report(measurement);
    };
    for (const TestedFunction& function : kTestedFunctions)
        if (go_on()) finish(bench.tested_function(function));
    if (go_on()) finish(bench.generate_rays());
    if (go_on()) finish(bench.shading("blinn_phong", CASTOR_BRDF_BLINN_PHONG));
    if (go_on()) finish(bench.shading("torrance_sparrow", CASTOR_BRDF_TORRANCE_SPARROW | CASTOR_BRDF_DIFFUSE_FRESNEL));
    if (go_on()) finish(bench.refraction());
    if (go_on()) finish(bench.texture_lookups("nearest_texel", TextureFilter::nearest));
    if (go_on()) finish(bench.texture_lookups("bilinear_texel", TextureFilter::bilinear));
    if (go_on()) finish(bench.texture_lookups("trilinear_texel", TextureFilter::trilinear));
}

void check_rays_and_shading(const Device& device, std::uint32_t size, std::uint32_t seed) {
    const std::function<bool()> go_on = [] { return true; };
    KernelBench bench(device, size, 0, seed, go_on);
    bench.generate_rays();
    bench.shading("blinn_phong", CASTOR_BRDF_BLINN_PHONG);
}

}  // namespace castor
