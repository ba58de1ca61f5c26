// The C interface gives the bytes of the C++ interface, stops where it is told to, and keeps what handles need.
#include <CL/cl.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <glm/geometric.hpp>
#include <string>
#include <thread>

#include "c/session.h"
#include "castor/built_scene.h"
#include "castor/renderer.h"
#include "castor/tone_map.h"
#include "castor/tracer.h"
#include "support/gltf_builder.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor::test {
namespace {

template <class Value>
bool same_memory(const Value* a, const void* b, std::size_t count) {
    return std::memcmp(a, b, count * sizeof(Value)) == 0;
}

std::vector<Ray> in_cpp(const std::vector<castor_ray>& rays) {
    std::vector<Ray> same(rays.size());
    std::memcpy(same.data(), rays.data(), rays.size() * sizeof(Ray));
    return same;
}

castor_render_options all_planes() {
    auto options = sized<castor_render_options>();
    options.samples_per_pixel = 2;
    options.planes = castor_plane_names();
    options.rules = CASTOR_RULE_SET_R795;
    options.seed = 3;
    return options;
}

void check_same(const castor_film* film, const Film& expected) {
    auto info = sized<castor_film_info>();
    done(castor_film_get_info(film, &info));
    REQUIRE(info.width == expected.width);
    REQUIRE(info.height == expected.height);
    CHECK(info.samples_per_pixel == expected.samples_per_pixel);
    CHECK(info.complete == expected.complete());
    CHECK(same_memory(info.pixels, expected.pixels.data(), 3 * expected.pixels.size()));
    CHECK(same_memory(info.done, expected.done.data(), expected.done.size()));
    REQUIRE(info.plane_count == expected.planes.size());
    for (std::size_t i = 0; i < info.plane_count; ++i) {
        const FilmPlane& plane = expected.planes[i];
        CAPTURE(plane.name);
        auto found = sized<castor_film_plane>(), by_name = found;
        done(castor_film_get_plane(film, i, &found));
        done(castor_film_find_plane(film, plane.name.c_str(), &by_name));
        CHECK(std::memcmp(&found, &by_name, sizeof(found)) == 0);
        CHECK(found.name == plane.name);
        CHECK(found.channel_count == plane.channels.size());
        CHECK(std::string(found.channels).starts_with(plane.channels[0]));
        REQUIRE((found.values != nullptr) == !plane.values.empty());
        REQUIRE((found.indices != nullptr) == !plane.indices.empty());
        if (found.values) CHECK(same_memory(found.values, plane.values.data(), plane.values.size()));
        if (found.indices) CHECK(same_memory(found.indices, plane.indices.data(), plane.indices.size()));
    }
}

int stop(void*) {
    return 0;
}
int stop_loading(double, void*) {
    return 0;
}

}  // namespace

TEST_CASE("a tracer in C answers as one in C++, of a scene that is built, saved or neither", "[c]") {
    const Scene same = same_scene_in_cpp();
    const std::vector<castor_ray> rays = test_rays();
    const std::vector<Ray> same_rays = in_cpp(rays);
    Tracer expected(same, {test_device()});
    std::vector<Hit> expected_hits(rays.size());
    std::vector<std::uint8_t> expected_occluded(rays.size());
    expected.closest_hit(same_rays, expected_hits);
    expected.any_hit(same_rays, expected_occluded);
    std::vector<Surface> expected_surfaces(rays.size());
    expected.find_surfaces(same_rays, expected_hits, expected_surfaces);
    // Everything is met: meshes, instances, what its transform places, spheres, planes, and nothing.
    for (const std::uint32_t instance : {0u, 1u, 2u, 3u, 4u, CASTOR_MISS})
        CHECK(std::any_of(expected_hits.begin(), expected_hits.end(),
                          [&](const Hit& hit) { return hit.instance == instance; }));

    const TemporaryDirectory folder;
    const std::string file = (folder.path() / "scene.castor").string();
    const DevicesHandle devices(select_test_devices);
    const auto make = [&](castor_tracer** tracer) {
        const int how = GENERATE(0, 1, 2);
        CAPTURE(how);
        const SceneHandle scene(make_test_scene);
        if (how == 0) return castor_tracer_create(scene, devices, nullptr, tracer);
        auto options = sized<castor_build_options>();
        options.take_geometry = how == 1;
        const BuiltSceneHandle built(
            [&](auto** handle) { return castor_built_scene_create(scene, devices, &options, handle); });
        auto counts = sized<castor_scene_counts>();
        done(castor_scene_get_counts(scene, &counts));
        CHECK(counts.meshes == (how == 1 ? 0u : 2u));
        CHECK(counts.triangles == (how == 1 ? 0u : 4u));
        CHECK(counts.materials == 3);
        done(castor_built_scene_get_counts(built, &counts));
        CHECK(counts.triangles == 4);
        CHECK(counts.planes == 1);
        CHECK(counts.instances == 4);
        if (how == 1) return castor_tracer_create_from_built(built, devices, nullptr, tracer);
        std::uint32_t is_one = 2;
        done(castor_is_built_scene(file.c_str(), &is_one));
        CHECK(is_one == 0);
        done(castor_built_scene_save(built, file.c_str(), nullptr, nullptr));
        done(castor_is_built_scene(file.c_str(), &is_one));
        CHECK(is_one == 1);
        const BuiltSceneHandle loaded(
            [&](auto** handle) { return castor_built_scene_load(file.c_str(), nullptr, nullptr, handle); });
        return castor_tracer_create_from_built(loaded, devices, nullptr, tracer);
    };
    const TracerHandle tracer(make);  // and what it was made from is gone

    std::vector<castor_hit> hits(rays.size());
    std::vector<std::uint8_t> occluded(rays.size());
    done(castor_tracer_closest_hit(tracer, rays.data(), rays.size(), hits.data(), nullptr));
    CHECK(same_memory(hits.data(), expected_hits.data(), hits.size()));
    auto batch = sized<castor_batch_options>();
    batch.coherence = CASTOR_COHERENCE_COHERENT;
    done(castor_tracer_any_hit(tracer, rays.data(), rays.size(), occluded.data(), &batch));
    CHECK(occluded == expected_occluded);

    std::vector<glm::vec3> points(rays.size()), geometric(rays.size()), shading(rays.size());
    std::vector<std::uint32_t> materials(rays.size());
    done(castor_tracer_find_surfaces(tracer, rays.data(), hits.data(), rays.size(), &points[0].x, &geometric[0].x,
                                     &shading[0].x, materials.data(), nullptr));
    for (std::size_t i = 0; i < rays.size(); ++i) {
        REQUIRE(points[i] == expected_surfaces[i].position);
        REQUIRE(geometric[i] == expected_surfaces[i].normal_geometric);
        REQUIRE(shading[i] == expected_surfaces[i].normal_shading);
        REQUIRE(materials[i] == expected_surfaces[i].material);
    }

    constexpr std::size_t kLimit = 2;
    const std::optional<CrossingLists> expected_all = expected.list_all_crossings(same_rays);
    std::vector<std::uint32_t> counts(rays.size()), list_counts(rays.size()), expected_counts(rays.size());
    std::vector<castor_hit> crossings(kLimit * rays.size());
    std::vector<Hit> expected_crossings(kLimit * rays.size());
    expected.list_crossings(same_rays, kLimit, expected_crossings, expected_counts);
    done(castor_tracer_count_crossings(tracer, rays.data(), rays.size(), counts.data(), nullptr));
    CHECK(counts == expected_counts);
    CHECK(std::count(counts.begin(), counts.end(), 3u) > 0);
    done(castor_tracer_list_crossings(tracer, rays.data(), rays.size(), kLimit, crossings.data(), list_counts.data(),
                                      &batch));
    CHECK(list_counts == expected_counts);
    CHECK(same_memory(crossings.data(), expected_crossings.data(), crossings.size()));
    const CrossingsHandle all([&](auto** handle) {
        return castor_tracer_list_all_crossings(tracer, rays.data(), rays.size(), nullptr, handle);
    });
    auto arrays = sized<castor_crossings_arrays>();
    done(castor_crossings_get_arrays(all, &arrays));
    REQUIRE(arrays.ray_count == rays.size());
    CHECK(same_memory(arrays.first, expected_all->first.data(), expected_all->first.size()));
    CHECK(same_memory(arrays.hits, expected_all->crossings.data(), expected_all->crossings.size()));

    castor_strategy strategy = 0;
    done(castor_tracer_get_strategy(tracer, 0, CASTOR_QUERY_CLOSEST, CASTOR_COHERENCE_INCOHERENT, &strategy));
    CHECK(strategy == static_cast<castor_strategy>(expected.strategy()));
    auto share = sized<castor_device_share>();
    done(castor_tracer_get_share(tracer, 0, &share));
    CHECK(share.rays >= 5 * rays.size());
    CHECK(share.device == test_device().name);
    CHECK(std::string(share.failure).empty());
    auto info = sized<castor_tracer_info>();
    done(castor_tracer_get_info(tracer, &info));
    CHECK(info.device_count == 1);
    CHECK(info.setup_seconds > 0);
}

TEST_CASE("a tracer in C works on the caller's queue and buffers", "[c]") {
    const DevicesHandle devices(select_test_devices);
    const SceneHandle scene(make_test_scene);
    const TracerHandle tracer([&](auto** made) { return castor_tracer_create(scene, devices, nullptr, made); });
    std::vector<castor_ray> rays = test_rays();
    std::vector<castor_hit> expected(rays.size()), hits(rays.size());
    std::vector<std::uint8_t> occluded(rays.size());
    done(castor_tracer_closest_hit(tracer, rays.data(), rays.size(), expected.data(), nullptr));
    cl_context context = nullptr;
    cl_command_queue queue = nullptr;
    done(castor_tracer_get_context(tracer, 0, &context));
    done(castor_tracer_get_queue(tracer, 0, &queue));
    const auto buffer = [&](cl_mem_flags flags, std::size_t bytes, void* host) {
        const cl_mem made = clCreateBuffer(context, flags, bytes, host, nullptr);
        REQUIRE(made);
        return made;
    };
    const cl_mem ray_buffer = buffer(CL_MEM_COPY_HOST_PTR, rays.size() * sizeof(castor_ray), rays.data());
    const cl_mem hit_buffer = buffer(CL_MEM_READ_WRITE, rays.size() * sizeof(castor_hit), nullptr);
    const cl_mem occluded_buffer = buffer(CL_MEM_READ_WRITE, rays.size(), nullptr);
    const cl_mem count_buffer = buffer(CL_MEM_READ_WRITE, 4 * rays.size(), nullptr);
    cl_event event = nullptr;
    done(castor_tracer_enqueue_closest_hit(tracer, queue, ray_buffer, hit_buffer, 0, rays.size(),
                                           CASTOR_COHERENCE_COHERENT, &event));
    REQUIRE(clWaitForEvents(1, &event) == CL_SUCCESS);
    clReleaseEvent(event);
    done(castor_tracer_enqueue_any_hit(tracer, queue, ray_buffer, occluded_buffer, 0, rays.size(),
                                       CASTOR_COHERENCE_INCOHERENT, nullptr));
    clEnqueueReadBuffer(queue, hit_buffer, CL_TRUE, 0, hits.size() * sizeof(castor_hit), hits.data(), 0, nullptr,
                        nullptr);
    clEnqueueReadBuffer(queue, occluded_buffer, CL_TRUE, 0, occluded.size(), occluded.data(), 0, nullptr, nullptr);
    CHECK(same_memory(hits.data(), expected.data(), hits.size()));
    for (std::size_t i = 0; i < rays.size(); ++i) REQUIRE(occluded[i] == (expected[i].primitive != CASTOR_MISS));
    std::vector<std::uint32_t> counts(rays.size()), expected_counts(rays.size());
    done(castor_tracer_list_crossings(tracer, rays.data(), rays.size(), 1, expected.data(), expected_counts.data(),
                                      nullptr));
    const auto check_counts = [&] {
        counts.assign(rays.size(), 99);
        clEnqueueReadBuffer(queue, count_buffer, CL_TRUE, 0, 4 * rays.size(), counts.data(), 0, nullptr, nullptr);
        CHECK(counts == expected_counts);
    };
    done(castor_tracer_enqueue_count_crossings(tracer, queue, ray_buffer, count_buffer, 0, rays.size(), 0, nullptr));
    check_counts();
    done(castor_tracer_enqueue_list_crossings(tracer, queue, ray_buffer, 1, hit_buffer, count_buffer, 0, rays.size(), 0,
                                              nullptr));
    check_counts();
    clEnqueueReadBuffer(queue, hit_buffer, CL_TRUE, 0, hits.size() * sizeof(castor_hit), hits.data(), 0, nullptr,
                        nullptr);
    CHECK(same_memory(hits.data(), expected.data(), hits.size()));
    CHECK(castor_tracer_enqueue_any_hit(tracer, queue, ray_buffer, occluded_buffer, 0, ~std::size_t{0}, 0, nullptr) ==
          CASTOR_STATUS_USAGE_ERROR);
    for (const cl_mem made : {ray_buffer, hit_buffer, occluded_buffer, count_buffer}) clReleaseMemObject(made);
}

TEST_CASE("a renderer in C makes the picture of one in C++", "[c]") {
    const DevicesHandle devices(select_test_devices);
    const SceneHandle scene(make_test_scene);
    const RendererHandle renderer([&](auto** made) { return castor_renderer_create(scene, devices, nullptr, made); });
    auto camera = sized<castor_camera>();
    done(castor_scene_get_camera(scene, 0, &camera));
    done(castor_camera_resize(&camera, 60, 32));
    castor_render_options options = all_planes();
    const FilmHandle film([&](auto** made) { return castor_renderer_render(renderer, &camera, &options, made); });

    Renderer in_cpp(same_scene_in_cpp(), {test_device()});
    Camera same = same_scene_in_cpp().cameras[0];
    resize(same, 60, 32);
    RenderOptions same_options;
    same_options.samples_per_pixel = 2;
    same_options.aovs = aov_names();
    same_options.rules = RuleSet::r795;
    same_options.seed = 3;
    const Film same_film = in_cpp.render(same, same_options);
    check_same(film, same_film);
    std::vector<std::uint8_t> rgb(3 * 60 * 32);
    done(castor_film_apply_tone_map(film, nullptr, rgb.data()));
    CHECK(rgb == apply_tone_map(same_film, {}).bytes);
    auto tone_map = sized<castor_tone_map>();
    tone_map.tone_operator = CASTOR_TONE_OPERATOR_ACES;
    tone_map.srgb = 1;
    tone_map.key = 0.3f;
    tone_map.saturation = 0.5f;
    done(castor_film_apply_tone_map(film, &tone_map, rgb.data()));
    ToneMap same_map;
    same_map.tone_operator = ToneOperator::aces;
    same_map.is_srgb = true;
    same_map.key = 0.3f;
    same_map.burn_percent = 0.0f;
    same_map.saturation = 0.5f;
    CHECK(rgb == apply_tone_map(same_film, same_map).bytes);

    auto statistics = sized<castor_render_statistics>();
    done(castor_renderer_get_statistics(renderer, &statistics));
    CHECK(statistics.rays == in_cpp.statistics().rays);
    CHECK(statistics.samples_done == 60 * 32 * 2);
    CHECK(statistics.part_complete == 1);
    CHECK(statistics.device_count == 1);

    const TemporaryDirectory folder;
    for (const char* name : {"picture.png", "picture.exr", "picture.pfm"}) {
        const std::filesystem::path path = folder.path() / name;
        done(castor_film_write_image(film, path.c_str(), nullptr));
        CHECK(std::filesystem::file_size(path) > 100);
    }
    const std::filesystem::path plane = folder.path() / "depth.exr";
    done(castor_film_write_plane(film, "depth", plane.c_str()));
    CHECK(std::filesystem::file_size(plane) > 100);
    const std::filesystem::path layers = folder.path() / "layers.exr";
    done(castor_film_write_layers(film, layers.c_str()));
    CHECK(std::filesystem::file_size(layers) > std::filesystem::file_size(plane));
}

TEST_CASE("groups of lights, noise and the order of samples are in C what they are in C++", "[c]") {
    const DevicesHandle devices(select_test_devices);
    const SceneHandle scene(make_test_scene);
    const RendererHandle renderer([&](auto** made) { return castor_renderer_create(scene, devices, nullptr, made); });
    auto camera = sized<castor_camera>();
    done(castor_scene_get_camera(scene, 0, &camera));
    done(castor_camera_resize(&camera, 24, 16));
    const std::uint32_t lights[] = {1, 0};
    std::uint32_t found[2] = {9, 9};
    std::size_t count = 0;
    done(castor_scene_find_lights(scene, "1", found, 2, &count));
    CHECK((count == 1 && found[0] == 1 && found[1] == 9));
    const BuiltSceneHandle built([&](auto** made) { return castor_built_scene_create(scene, devices, nullptr, made); });
    done(castor_built_scene_find_lights(built, "0", nullptr, 0, &count));
    CHECK(count == 1);
    CHECK(castor_scene_find_lights(scene, "Key", found, 2, &count) == CASTOR_STATUS_USAGE_ERROR);
    CHECK(std::string(castor_last_error_message()).find("there is no light \"Key\"") != std::string::npos);
    const castor_light_group group = {"key", lights, 2};
    auto options = sized<castor_render_options>();
    options.integrator = CASTOR_INTEGRATOR_PATH;
    options.samples_per_pixel = 64;
    options.noise = 1.0;
    options.sample_order = CASTOR_SAMPLE_ORDER_Z;
    options.light_groups = &group;
    options.light_group_count = 1;
    options.planes = "samples";
    const FilmHandle film([&](auto** made) { return castor_renderer_render(renderer, &camera, &options, made); });

    Renderer in_cpp(same_scene_in_cpp(), {test_device()});
    Camera same = same_scene_in_cpp().cameras[0];
    resize(same, 24, 16);
    RenderOptions same_options;
    same_options.integrator = Integrator::path;
    same_options.samples_per_pixel = 64;
    same_options.noise = 1.0;
    same_options.sample_order = SampleOrder::z;
    same_options.light_groups = {{"key", {1, 0}}};
    same_options.aovs = {"samples"};
    check_same(film, in_cpp.render(same, same_options));
    auto plane = sized<castor_film_plane>();
    done(castor_film_find_plane(film, "samples", &plane));
    CHECK(*std::min_element(plane.indices, plane.indices + 24 * 16) < 64);  // some blocks stopped
    done(castor_film_find_plane(film, "group-key", &plane));
    done(castor_film_find_plane(film, "group-rest", &plane));

    castor_film* other = nullptr;
    options.noise = 0;
    options.stop_after_seconds = 1e-9;
    done(castor_renderer_render(renderer, &camera, &options, &other));
    auto info = sized<castor_film_info>();
    done(castor_film_get_info(other, &info));
    CHECK(info.samples_per_pixel < 64);
    CHECK(info.complete == 1);
    castor_film_release(other);
}

TEST_CASE("noise is removed in C as in C++, and the noisy film stays where that fails", "[c]") {
    const DevicesHandle devices(select_test_devices);
    const SceneHandle scene(make_test_scene);
    const RendererHandle renderer([&](auto** made) { return castor_renderer_create(scene, devices, nullptr, made); });
    auto camera = sized<castor_camera>();
    done(castor_scene_get_camera(scene, 0, &camera));
    done(castor_camera_resize(&camera, 24, 16));
    auto options = sized<castor_render_options>();
    options.integrator = CASTOR_INTEGRATOR_PATH;
    options.samples_per_pixel = 4;
    options.planes = "noisy";
    Renderer in_cpp(same_scene_in_cpp(), {test_device()});
    Camera same = same_scene_in_cpp().cameras[0];
    resize(same, 24, 16);
    RenderOptions same_options;
    same_options.integrator = Integrator::path;
    same_options.samples_per_pixel = 4;
    same_options.aovs = {"noisy"};
    same_options.denoise = true;
    const ScopedVariable library("CASTOR_OIDN_LIBRARY", CASTOR_OIDN_2);
    for (const castor_denoiser denoiser : {CASTOR_DENOISER_CASTOR, CASTOR_DENOISER_OIDN}) {
        options.denoise = denoiser;
        same_options.denoiser = denoiser == CASTOR_DENOISER_OIDN ? Denoiser::oidn : Denoiser::castor;
        const FilmHandle film([&](auto** made) { return castor_renderer_render(renderer, &camera, &options, made); });
        check_same(film, in_cpp.render(same, same_options));
        auto statistics = sized<castor_render_statistics>();
        done(castor_renderer_get_statistics(renderer, &statistics));
        CHECK(statistics.denoise_seconds > 0.0);
        CHECK(statistics.oidn_version == (denoiser == CASTOR_DENOISER_OIDN ? 20303u : 0u));
    }
    castor_film* film = nullptr;
    {
        const ScopedVariable nothing("CASTOR_OIDN_LIBRARY", "/dev/null");
        CHECK(castor_renderer_render(renderer, &camera, &options, &film) == CASTOR_STATUS_USAGE_ERROR);
        CHECK(std::string(castor_last_error_message()).find("Open Image Denoise cannot be loaded") !=
              std::string::npos);
        CHECK(film == nullptr);
    }
    const ScopedVariable fails("OIDN_STAND_IN_FAILS", "oidnExecuteFilter");
    CHECK(castor_renderer_render(renderer, &camera, &options, &film) == CASTOR_STATUS_DEVICE_ERROR);
    CHECK(std::string(castor_last_error_message()).find("out of luck") != std::string::npos);
    REQUIRE(film);
    auto info = sized<castor_film_info>();
    done(castor_film_get_info(film, &info));
    CHECK(info.complete == 1);
    auto noisy = sized<castor_film_plane>();
    done(castor_film_find_plane(film, "noisy", &noisy));
    CHECK(std::memcmp(noisy.values, info.pixels, 3 * sizeof(float) * info.width * info.height) == 0);
    castor_film_release(film);
}

TEST_CASE("a render in C tells how far it is, shows the film, and stops", "[c]") {
    struct Seen {
        castor_film* film = nullptr;
        bool stops = false;
        std::uint64_t total = 0;
    } seen;
    const auto look = [](const castor_render_progress* progress, void* user) -> int {
        Seen& into = *static_cast<Seen*>(user);
        into.total = progress->samples_total;
        if (!into.film) done(castor_render_progress_get_film(progress, &into.film));
        return !into.stops;
    };
    const DevicesHandle devices(select_test_devices);
    const SceneHandle scene(make_test_scene);
    const RendererHandle renderer([&](auto** made) { return castor_renderer_create(scene, devices, nullptr, made); });
    castor_camera camera = test_camera();
    camera.width = camera.height = 512;
    auto options = sized<castor_render_options>();
    options.samples_per_pixel = 1000000;
    options.progress = look;
    options.progress_user = &seen;
    seen.stops = true;
    castor_film* film = nullptr;
    CHECK(castor_renderer_render(renderer, &camera, &options, &film) == CASTOR_STATUS_STOPPED);
    REQUIRE(film);
    REQUIRE(seen.film);
    CHECK(seen.total == std::uint64_t{512 * 512} * 1000000);
    auto info = sized<castor_film_info>();
    for (castor_film* const each : {film, seen.film}) {
        done(castor_film_get_info(each, &info));
        CHECK(info.width == 512);
        CHECK(info.complete == 0);
        castor_film_release(each);
    }
}

TEST_CASE("tone maps of cameras are told of scenes, and of built scenes that were saved", "[c]") {
    const TemporaryDirectory folder;
    const std::string file = (folder.path() / "scene.castor").string();
    const DevicesHandle devices(select_test_devices);
    const SceneHandle scene(make_test_scene);
    const castor_camera camera = test_camera();
    std::uint32_t number = 0;
    done(castor_scene_add_camera(scene, &camera, &number));
    auto filmic = sized<castor_tone_map>();
    filmic.tone_operator = CASTOR_TONE_OPERATOR_FILMIC;
    filmic.key = 0.25f;
    filmic.burn_percent = 2.0f;
    filmic.saturation = 0.5f;
    filmic.gamma = 1.8f;
    done(castor_scene_add_tone_map(scene, number, &filmic, "_f.png"));
    const BuiltSceneHandle built([&](auto** made) { return castor_built_scene_create(scene, devices, nullptr, made); });
    done(castor_built_scene_save(built, file.c_str(), nullptr, nullptr));
    const BuiltSceneHandle loaded(
        [&](auto** made) { return castor_built_scene_load(file.c_str(), nullptr, nullptr, made); });
    const auto check = [&](const auto& get_count, const auto& get, const auto& handle) {
        std::size_t count = 0;
        done(get_count(handle, number, &count));
        CHECK(count == 1);
        auto told = sized<castor_tone_map>();
        const char* extension = nullptr;
        done(get(handle, number, 0, &told, &extension));
        CHECK(std::memcmp(&told, &filmic, sizeof told) == 0);
        CHECK(extension == std::string("_f.png"));
        CHECK(get(handle, number, 1, &told, nullptr) == CASTOR_STATUS_USAGE_ERROR);
        CHECK(get_count(handle, number + 1, &count) == CASTOR_STATUS_USAGE_ERROR);
    };
    check(castor_scene_get_tone_map_count, castor_scene_get_tone_map, scene);
    check(castor_built_scene_get_tone_map_count, castor_built_scene_get_tone_map, loaded);
}

TEST_CASE("what C asks of a glTF file is loaded: its time, animation, variant, lights and environment", "[c]") {
    const TemporaryDirectory folder;
    GltfBuilder builder = one_triangle();
    const std::size_t times = builder.scalars({0, 2}), places = builder.vec3({0, 0, 0, 8, 0, 0});
    const std::size_t others = builder.vec3({0, 0, 0, 0, 8, 0});
    for (const std::size_t output : {places, others})
        builder.json["animations"].push_back(
            {{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}},
             {"samplers", {{{"input", times}, {"output", output}}}}});
    builder.json["materials"] = {{{"name", "own"}}, {{"name", "other"}, {"emissiveFactor", {1, 1, 1}}}};
    builder.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "Bright"}}};
    nlohmann::json& primitive = builder.json["meshes"][0]["primitives"][0];
    primitive["material"] = 0;
    primitive["extensions"]["KHR_materials_variants"]["mappings"] = {{{"material", 1}, {"variants", {0}}}};
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "directional"}}};
    builder.json["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    builder.json["scenes"] = {{{"nodes", {0, 1}}}};
    const std::string file = folder.write("scene.glb", builder.glb()).string();
    const std::string sky = folder.write("sky.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n0000").string();

    auto options = sized<castor_load_options>();
    castor_scene* scene = nullptr;
    const DevicesHandle devices(select_test_devices);
    const auto ray_hits = [&](float x, float y) {
        const TracerHandle tracer([&](auto** made) { return castor_tracer_create(scene, devices, nullptr, made); });
        castor_ray ray{};
        ray.origin[0] = x + 0.25f;
        ray.origin[1] = y + 0.25f;
        ray.origin[2] = 1.0f;
        ray.direction[2] = -1.0f;
        ray.t_max = 2.0f;
        castor_hit hit{};
        done(castor_tracer_closest_hit(tracer, &ray, 1, &hit, nullptr));
        return hit.t == 1.0f;
    };
    const auto lights_named = [&](const char* name) {
        std::size_t count = 0;
        castor_scene_find_lights(scene, name, nullptr, 0, &count);
        return count;
    };
    done(castor_scene_load_with_options(file.c_str(), nullptr, &scene));
    CHECK(ray_hits(0, 0));
    CHECK(lights_named("other") == 0);
    castor_scene_release(scene);

    const double time = 0.5;
    options.time_seconds = &time;
    done(castor_scene_load_with_options(file.c_str(), &options, &scene));
    CHECK(ray_hits(2, 0));
    castor_scene_release(scene);
    options.animation = "2";
    options.material_variant = "Bright";
    options.environment = sky.c_str();
    const float angle = 0.25f;
    options.sun_angle_radians = &angle;
    done(castor_scene_load_with_options(file.c_str(), &options, &scene));
    CHECK(ray_hits(0, 2));
    CHECK(lights_named("other") == 1);
    castor_scene_release(scene);

    const auto refused = [&](const char* text) {
        CHECK(castor_scene_load_with_options(file.c_str(), &options, &scene) == CASTOR_STATUS_USAGE_ERROR);
        CHECK(scene == nullptr);
        CHECK(std::string(castor_last_error_message()).find(text) != std::string::npos);
    };
    options.animation = "Down";
    refused("there is no animation \"Down\"");
    options.animation = nullptr;
    options.material_variant = "Dark";
    refused("there is no material variant \"Dark\"");
    options.material_variant = nullptr;
    const float too_large = 4.0f;
    options.sun_angle_radians = &too_large;
    refused("the sun's angle is 229.");
    options.sun_angle_radians = nullptr;
    options.progress = stop_loading;
    CHECK(castor_scene_load_with_options(file.c_str(), &options, &scene) == CASTOR_STATUS_STOPPED);
    options.progress = nullptr;
    options.environment = "no-such-sky.hdr";
    CHECK(castor_scene_load_with_options(file.c_str(), &options, &scene) == CASTOR_STATUS_SCENE_ERROR);
}

TEST_CASE("loading, building, saving and batches in C stop", "[c]") {
    const TemporaryDirectory folder;
    const std::filesystem::path path = folder.path() / "scene.castor";
    const DevicesHandle devices(select_test_devices);
    const SceneHandle scene(make_test_scene);
    const BuiltSceneHandle built([&](auto** made) { return castor_built_scene_create(scene, devices, nullptr, made); });
    castor_scene* loaded = nullptr;
    const std::filesystem::path mesh = folder.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    CHECK(castor_scene_load(mesh.c_str(), stop_loading, nullptr, &loaded) == CASTOR_STATUS_STOPPED);
    CHECK(loaded == nullptr);
    done(castor_scene_load(mesh.c_str(), nullptr, nullptr, &loaded));
    castor_scene_release(loaded);
    CHECK(castor_built_scene_save(built, path.c_str(), stop_loading, nullptr) == CASTOR_STATUS_STOPPED);
    CHECK(!std::filesystem::exists(path));
    auto options = sized<castor_build_options>();
    options.progress = stop_loading;
    castor_built_scene* stopped = nullptr;
    CHECK(castor_built_scene_create(scene, devices, &options, &stopped) == CASTOR_STATUS_STOPPED);
    CHECK(stopped == nullptr);

    const TracerHandle tracer(
        [&](auto** made) { return castor_tracer_create_from_built(built, devices, nullptr, made); });
    std::vector<castor_ray> rays(1 << 20, test_rays()[2000]);
    std::vector<castor_hit> hits(rays.size());
    auto batch = sized<castor_batch_options>();
    batch.go_on = stop;
    CHECK(castor_tracer_closest_hit(tracer, rays.data(), rays.size(), hits.data(), &batch) == CASTOR_STATUS_STOPPED);
    CHECK(std::string(castor_last_error_message()) == "interrupted");
    castor_crossings* crossings = nullptr;
    CHECK(castor_tracer_list_all_crossings(tracer, rays.data(), rays.size(), &batch, &crossings) ==
          CASTOR_STATUS_STOPPED);
    CHECK(crossings == nullptr);
    std::vector<glm::vec3> points(rays.size());
    hits.assign(hits.size(), {1, 0, 0, 0, 0});
    CHECK(castor_tracer_find_surfaces(tracer, rays.data(), hits.data(), rays.size(), &points[0].x, nullptr, nullptr,
                                      nullptr, &batch) == CASTOR_STATUS_STOPPED);
}

TEST_CASE("zeros in structs of C are the defaults of C++", "[c]") {
    const SceneHandle scene([](auto** made) { return castor_scene_create(made); });
    auto camera = sized<castor_camera>();
    done(castor_scene_add_camera(scene, &camera, nullptr));
    done(castor_scene_get_camera(scene, 0, &camera));
    const Camera expected;
    CHECK(glm::vec3(camera.gaze[0], camera.gaze[1], camera.gaze[2]) == expected.gaze);
    CHECK(glm::vec3(camera.up[0], camera.up[1], camera.up[2]) == expected.up);
    CHECK(camera.left == expected.left);
    CHECK(camera.top == expected.top);
    CHECK(camera.distance == expected.distance);
    CHECK(camera.t_max == expected.t_max);
    CHECK(camera.width == expected.width);
    CHECK(camera.samples_per_pixel == expected.samples_per_pixel);
    auto settings = sized<castor_scene_settings>();
    done(castor_scene_get_settings(scene, &settings));
    CHECK(settings.shadow_ray_epsilon == Scene().shadow_ray_epsilon);
    CHECK(settings.max_recursion_depth == Scene().max_recursion_depth);
    CHECK(castor_version() == CASTOR_C_VERSION);
    CHECK(std::string(castor_version_string()).find('.') != std::string::npos);
    CHECK(std::string(castor_status_string(CASTOR_STATUS_INTERNAL_ERROR)) == "internal error");
    CHECK(std::string(castor_status_string(99)) == "unknown status");
}

TEST_CASE("the last error in C belongs to the thread", "[c]") {
    std::vector<std::thread> threads;
    std::vector<std::string> messages(8), first_messages(8, "not asked for");
    for (std::size_t i = 0; i < messages.size(); ++i)
        threads.emplace_back([&, i] {
            first_messages[i] = castor_last_error_message();  // checked later, by one thread
            const std::string file = "no-such-file-" + std::to_string(i) + ".ply";
            castor_scene* scene = nullptr;
            for (int k = 0; k < 100; ++k) castor_scene_load(file.c_str(), nullptr, nullptr, &scene);
            auto error = sized<castor_error>();
            castor_get_last_error(&error);
            if (error.status == CASTOR_STATUS_SCENE_ERROR && error.file == file) messages[i] = error.message;
        });
    for (std::thread& thread : threads) thread.join();
    for (std::size_t i = 0; i < messages.size(); ++i) {
        CHECK(first_messages[i].empty());
        CHECK(messages[i].find("no-such-file-" + std::to_string(i)) != std::string::npos);
    }
}

TEST_CASE("handles in C are counted", "[c]") {
    const DevicesHandle devices(select_test_devices);
    castor_scene* scene = nullptr;
    make_test_scene(&scene);
    castor_scene_retain(scene);
    castor_scene_release(scene);
    auto counts = sized<castor_scene_counts>();
    done(castor_scene_get_counts(scene, &counts));  // one reference is left
    castor_tracer* tracer = nullptr;
    done(castor_tracer_create(scene, devices, nullptr, &tracer));
    castor_scene_release(scene);
    std::vector<std::thread> threads;
    const std::vector<castor_ray> rays = test_rays();
    std::vector<std::vector<castor_hit>> hits(4, std::vector<castor_hit>(rays.size()));
    for (std::vector<castor_hit>& each : hits) {
        castor_tracer_retain(tracer);
        threads.emplace_back([&] {
            castor_tracer_closest_hit(tracer, rays.data(), rays.size(), each.data(), nullptr);
            castor_tracer_release(tracer);
        });
    }
    for (std::thread& thread : threads) thread.join();
    castor_tracer_release(tracer);
    for (const std::vector<castor_hit>& each : hits) CHECK(same_memory(each.data(), hits[0].data(), rays.size()));
}

}  // namespace castor::test
