// Every function of the C interface with wrong arguments: a status and a message, and no crash.
#include <CL/cl.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <set>
#include <tuple>
#include <utility>

#include "c/session.h"
#include "castor/built_scene.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor::test {
namespace {

bool says(const std::string& text) {
    return std::string(castor_last_error_message()).find(text) != std::string::npos;
}

void usage_error(castor_status status, const std::string& text) {
    INFO(castor_status_string(status) << ": " << castor_last_error_message());
    CHECK(status == CASTOR_STATUS_USAGE_ERROR);
    CHECK(says(text));
}

/// Calls functions with one pointer null at a time, and notes which functions.
class NullChecks {
public:
    /// `may_be_null`: numbers of arguments that are not tried, counting from 0.
    template <class... Parameters, class... Arguments>
    void operator()(const std::string& name, castor_status (*function)(Parameters...), const std::set<int>& may_be_null,
                    Arguments&&... arguments) {
        names_.insert(name);
        const std::tuple<Parameters...> given(static_cast<Parameters>(arguments)...);
        each(name, function, may_be_null, given, std::index_sequence_for<Parameters...>());
    }

    const std::set<std::string>& names() const { return names_; }

private:
    template <class Function, class Tuple, std::size_t... I>
    void each(const std::string& name, Function* function, const std::set<int>& may_be_null, const Tuple& given,
              std::index_sequence<I...>) {
        const auto one = [&](auto number) {
            constexpr std::size_t i = decltype(number)::value;
            if constexpr (std::is_pointer_v<std::tuple_element_t<i, Tuple>>) {
                if (may_be_null.contains(static_cast<int>(i))) return;
                CAPTURE(name, i);
                Tuple changed = given;
                std::get<i>(changed) = nullptr;
                usage_error(std::apply(function, changed), name + ": ");
                CHECK(says(" is NULL"));
            }
        };
        (one(std::integral_constant<std::size_t, I>()), ...);
    }

    std::set<std::string> names_;
};

/// Calls a function with a struct whose size is wrong, larger, and smaller. `is_output`: the function writes it.
template <class Struct, class Call>
void check_sizes(const Struct& good, bool is_output, const Call& call) {
    CAPTURE(sizeof(Struct));
    for (const std::size_t wrong : {std::size_t{0}, sizeof(std::size_t) - 1, std::size_t{4097}, ~std::size_t{0}}) {
        Struct given = good;
        given.size = wrong;
        usage_error(call(&given), "size " + std::to_string(wrong));
    }
    struct {
        Struct known;
        std::uint64_t unknown;
    } larger{good, 0};
    larger.known.size = sizeof(larger);
    done(call(&larger.known));
    larger.unknown = 1;
    if (is_output) {
        done(call(&larger.known));
        CHECK(larger.unknown == 0);
        CHECK(larger.known.size == sizeof(larger));
    } else {
        usage_error(call(&larger.known), "does not know");
    }
    Struct smaller = good;
    if (is_output) std::memset(static_cast<void*>(&smaller), 0x55, sizeof(Struct));
    const Struct before = smaller;
    smaller.size = sizeof(std::size_t);
    done(call(&smaller));
    CHECK(smaller.size == sizeof(std::size_t));
    if (is_output)
        CHECK(std::memcmp(reinterpret_cast<const char*>(&smaller) + sizeof(std::size_t),
                          reinterpret_cast<const char*>(&before) + sizeof(std::size_t),
                          sizeof(Struct) - sizeof(std::size_t)) == 0);
}

/// The recorded ABI, line by line.
std::vector<std::string> recorded_lines() {
    std::ifstream file(CASTOR_SOURCE_DIR "/tests/c/abi.txt");
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
}

/// The functions that return a status.
std::set<std::string> recorded_functions() {
    std::set<std::string> names;
    const std::string end = " returns castor_status";
    for (const std::string& line : recorded_lines())
        if (line.ends_with(end)) names.insert(line.substr(0, line.size() - end.size()));
    return names;
}

/// All that the tests below call functions with.
struct Everything {
    DevicesHandle devices{select_test_devices};
    SceneHandle scene{make_test_scene};
    BuiltSceneHandle built{[&](auto** made) { return castor_built_scene_create(scene, devices, nullptr, made); }};
    TracerHandle tracer{[&](auto** made) { return castor_tracer_create(scene, devices, nullptr, made); }};
    RendererHandle renderer{
        [&](auto** made) { return castor_renderer_create_from_built(built, devices, nullptr, made); }};
    castor_camera camera = test_camera();
    FilmHandle film{[&](auto** made) {
        auto options = sized<castor_render_options>();
        options.planes = "depth,primitive";
        return castor_renderer_render(renderer, &camera, &options, made);
    }};
};

}  // namespace

// Calls `function` as NullChecks does; the name is the function's own.
#define CASTOR_CHECK_NULLS(function, ...) check_nulls(#function, function, __VA_ARGS__)

TEST_CASE("each pointer of each function may be null only where the header says so", "[c]") {
    const Everything on;
    const TemporaryDirectory folder;
    const std::string path = (folder.path() / "file.png").string();
    const char* const file = path.c_str();
    NullChecks check_nulls;
    std::size_t count = 0;
    std::uint32_t index = 0;
    castor_devices* devices = nullptr;
    castor_scene* scene = nullptr;
    castor_built_scene* built = nullptr;
    castor_tracer* tracer = nullptr;
    castor_renderer* renderer = nullptr;
    castor_film* film = nullptr;
    auto error = sized<castor_error>();
    auto warning = sized<castor_warning>();
    auto info = sized<castor_device_info>();
    auto settings = sized<castor_scene_settings>();
    auto material = sized<castor_material>();
    auto principled = sized<castor_principled_material>();
    auto image = sized<castor_image>();
    auto texture = sized<castor_texture>();
    auto tone_map = sized<castor_tone_map>();
    auto light = sized<castor_light>();
    castor_camera camera = test_camera();
    castor_mesh mesh = flat_mesh();
    auto counts = sized<castor_scene_counts>();
    auto share = sized<castor_device_share>();
    CASTOR_CHECK_NULLS(castor_get_last_error, {}, &error);
    CASTOR_CHECK_NULLS(castor_get_struct_size, {}, "castor_ray", &count);
    CASTOR_CHECK_NULLS(castor_devices_list, {}, &devices);
    CASTOR_CHECK_NULLS(castor_devices_select, {0}, nullptr, &devices);
    CASTOR_CHECK_NULLS(castor_devices_get_count, {}, on.devices, &count);
    CASTOR_CHECK_NULLS(castor_devices_get_info, {}, on.devices, 0, &info);
    CASTOR_CHECK_NULLS(castor_devices_get_warning_count, {}, on.devices, &count);
    CASTOR_CHECK_NULLS(castor_devices_get_warning, {2}, on.devices, 0, &warning);

    CASTOR_CHECK_NULLS(castor_scene_create, {}, &scene);
    CASTOR_CHECK_NULLS(castor_scene_load, {1, 2}, file, nullptr, nullptr, &scene);
    CASTOR_CHECK_NULLS(castor_scene_load_with_options, {1}, file, nullptr, &scene);
    CASTOR_CHECK_NULLS(castor_scene_get_settings, {}, on.scene, &settings);
    CASTOR_CHECK_NULLS(castor_scene_set_settings, {}, on.scene, &settings);
    CASTOR_CHECK_NULLS(castor_scene_add_material, {2}, on.scene, &material, nullptr);
    CASTOR_CHECK_NULLS(castor_principled_material_get_default, {}, &principled);
    CASTOR_CHECK_NULLS(castor_scene_add_principled_material, {2}, on.scene, &principled, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_add_light, {2}, on.scene, &light, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_find_lights, {2}, on.scene, "0", &index, 1, &count);
    CASTOR_CHECK_NULLS(castor_scene_add_image, {2}, on.scene, &image, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_add_image_file, {2}, on.scene, file, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_add_texture, {2}, on.scene, &texture, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_set_background_texture, {}, on.scene, 0);
    CASTOR_CHECK_NULLS(castor_scene_add_tone_map, {3}, on.scene, 0, &tone_map, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_get_tone_map_count, {}, on.scene, 0, &count);
    CASTOR_CHECK_NULLS(castor_scene_get_tone_map, {4}, on.scene, 0, 0, &tone_map, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_set_instance_motions, {}, on.scene, 0, 1, kPlanePoints);
    CASTOR_CHECK_NULLS(castor_scene_set_sphere_motions, {}, on.scene, 0, 1, kPlanePoints);
    CASTOR_CHECK_NULLS(castor_scene_add_camera, {2}, on.scene, &camera, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_get_camera, {}, on.scene, 0, &camera);
    CASTOR_CHECK_NULLS(castor_camera_resize, {}, &camera, 8, 8);
    CASTOR_CHECK_NULLS(castor_scene_add_default_view, {}, on.scene);
    CASTOR_CHECK_NULLS(castor_scene_add_mesh, {2}, on.scene, &mesh, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_add_instances, {3, 5}, on.scene, 2, kInstanceMeshes, nullptr, kInstanceTransforms,
                       nullptr);
    CASTOR_CHECK_NULLS(castor_scene_add_spheres, {3, 4, 5}, on.scene, 2, kSpheres, nullptr, nullptr, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_add_planes, {4, 5}, on.scene, 1, kPlanePoints, kPlaneNormals, nullptr, nullptr);
    CASTOR_CHECK_NULLS(castor_scene_get_counts, {}, on.scene, &counts);
    CASTOR_CHECK_NULLS(castor_scene_get_warning_count, {}, on.scene, &count);
    CASTOR_CHECK_NULLS(castor_scene_get_warning, {2}, on.scene, 0, &warning);
    for (const float* castor_mesh::*member : {&castor_mesh::vertices}) {
        castor_mesh without = flat_mesh();
        without.*member = nullptr;
        usage_error(castor_scene_add_mesh(on.scene, &without, nullptr), "vertices is NULL");
    }
    mesh.triangles = nullptr;
    usage_error(castor_scene_add_mesh(on.scene, &mesh, nullptr), "triangles is NULL");

    CASTOR_CHECK_NULLS(castor_built_scene_create, {1, 2}, on.scene, nullptr, nullptr, &built);
    CASTOR_CHECK_NULLS(castor_built_scene_load, {1, 2}, file, nullptr, nullptr, &built);
    CASTOR_CHECK_NULLS(castor_built_scene_save, {2, 3}, on.built, file, nullptr, nullptr);
    CASTOR_CHECK_NULLS(castor_is_built_scene, {}, file, &index);
    CASTOR_CHECK_NULLS(castor_built_scene_get_counts, {}, on.built, &counts);
    CASTOR_CHECK_NULLS(castor_built_scene_find_lights, {2}, on.built, "0", &index, 1, &count);
    CASTOR_CHECK_NULLS(castor_built_scene_get_camera, {}, on.built, 0, &camera);
    CASTOR_CHECK_NULLS(castor_built_scene_get_tone_map_count, {}, on.built, 0, &count);
    CASTOR_CHECK_NULLS(castor_built_scene_get_tone_map, {4}, on.built, 0, 0, &tone_map, nullptr);
    CASTOR_CHECK_NULLS(castor_built_scene_get_warning_count, {}, on.built, &count);
    CASTOR_CHECK_NULLS(castor_built_scene_get_warning, {2}, on.built, 0, &warning);

    castor_ray ray = test_rays().front();
    castor_hit hit{};
    std::uint8_t occluded = 0;
    float three[3];
    castor_strategy strategy = 0;
    auto tracer_info = sized<castor_tracer_info>();
    cl_context context = nullptr;
    cl_command_queue queue = nullptr;
    CASTOR_CHECK_NULLS(castor_tracer_create, {1, 2}, on.scene, nullptr, nullptr, &tracer);
    CASTOR_CHECK_NULLS(castor_tracer_create_from_built, {1, 2}, on.built, nullptr, nullptr, &tracer);
    CASTOR_CHECK_NULLS(castor_tracer_closest_hit, {4}, on.tracer, &ray, 1, &hit, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_any_hit, {4}, on.tracer, &ray, 1, &occluded, nullptr);
    castor_crossings* crossings = nullptr;
    auto arrays = sized<castor_crossings_arrays>();
    CASTOR_CHECK_NULLS(castor_tracer_count_crossings, {4}, on.tracer, &ray, 1, &index, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_list_crossings, {6}, on.tracer, &ray, 1, 1, &hit, &index, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_list_all_crossings, {3}, on.tracer, &ray, 1, nullptr, &crossings);
    const CrossingsHandle list(
        [&](auto** made) { return castor_tracer_list_all_crossings(on.tracer, &ray, 1, nullptr, made); });
    CASTOR_CHECK_NULLS(castor_crossings_get_arrays, {}, list, &arrays);
    check_sizes(arrays, true, [&](auto* s) { return castor_crossings_get_arrays(list, s); });
    CASTOR_CHECK_NULLS(castor_tracer_find_surfaces, {4, 5, 6, 7, 8}, on.tracer, &ray, &hit, 1, three, three, three,
                       &index, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_get_context, {}, on.tracer, 0, &context);
    CASTOR_CHECK_NULLS(castor_tracer_get_queue, {}, on.tracer, 0, &queue);
    done(castor_tracer_get_context(on.tracer, 0, &context));
    done(castor_tracer_get_queue(on.tracer, 0, &queue));
    const cl_mem buffer = clCreateBuffer(context, CL_MEM_READ_WRITE, 4096, nullptr, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_enqueue_closest_hit, {7}, on.tracer, queue, buffer, buffer, 0, 1, 0, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_enqueue_any_hit, {7}, on.tracer, queue, buffer, buffer, 0, 1, 0, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_enqueue_count_crossings, {7}, on.tracer, queue, buffer, buffer, 0, 1, 0, nullptr);
    CASTOR_CHECK_NULLS(castor_tracer_enqueue_list_crossings, {9}, on.tracer, queue, buffer, 1, buffer, buffer, 0, 1, 0,
                       nullptr);
    clReleaseMemObject(buffer);
    CASTOR_CHECK_NULLS(castor_tracer_get_strategy, {}, on.tracer, 0, 0, 0, &strategy);
    CASTOR_CHECK_NULLS(castor_tracer_get_info, {}, on.tracer, &tracer_info);
    CASTOR_CHECK_NULLS(castor_tracer_get_share, {}, on.tracer, 0, &share);
    CASTOR_CHECK_NULLS(castor_tracer_get_warning_count, {}, on.tracer, &count);
    CASTOR_CHECK_NULLS(castor_tracer_get_warning, {2}, on.tracer, 0, &warning);

    auto statistics = sized<castor_render_statistics>();
    auto film_info = sized<castor_film_info>();
    auto plane = sized<castor_film_plane>();
    auto progress = sized<castor_render_progress>();
    CASTOR_CHECK_NULLS(castor_renderer_create, {1, 2}, on.scene, nullptr, nullptr, &renderer);
    CASTOR_CHECK_NULLS(castor_renderer_create_from_built, {1, 2}, on.built, nullptr, nullptr, &renderer);
    CASTOR_CHECK_NULLS(castor_render_progress_get_film, {}, &progress, &film);
    usage_error(castor_render_progress_get_film(&progress, &film), "render is NULL");
    CASTOR_CHECK_NULLS(castor_renderer_render, {2}, on.renderer, &camera, nullptr, &film);
    CASTOR_CHECK_NULLS(castor_renderer_get_statistics, {}, on.renderer, &statistics);
    CASTOR_CHECK_NULLS(castor_renderer_get_strategy, {}, on.renderer, 0, 0, 0, &strategy);
    CASTOR_CHECK_NULLS(castor_renderer_get_share, {}, on.renderer, 0, &share);
    CASTOR_CHECK_NULLS(castor_renderer_get_warning_count, {}, on.renderer, &count);
    CASTOR_CHECK_NULLS(castor_renderer_get_warning, {2}, on.renderer, 0, &warning);
    CASTOR_CHECK_NULLS(castor_film_get_info, {}, on.film, &film_info);
    CASTOR_CHECK_NULLS(castor_film_get_plane, {}, on.film, 0, &plane);
    CASTOR_CHECK_NULLS(castor_film_find_plane, {}, on.film, "depth", &plane);
    CASTOR_CHECK_NULLS(castor_film_write_image, {2}, on.film, file, nullptr);
    std::vector<std::uint8_t> rgb(3 * 1024 * 1024);
    CASTOR_CHECK_NULLS(castor_film_apply_tone_map, {1}, on.film, nullptr, rgb.data());
    CASTOR_CHECK_NULLS(castor_film_write_tone_mapped, {2}, on.film, file, nullptr);
    CASTOR_CHECK_NULLS(castor_film_write_plane, {}, on.film, "depth", file);
    CASTOR_CHECK_NULLS(castor_film_write_layers, {}, on.film, file);
    CASTOR_CHECK_NULLS(castor_check_image_extension, {}, file);
    CHECK(check_nulls.names() == recorded_functions());

    castor_devices_retain(nullptr), castor_devices_release(nullptr);
    castor_scene_retain(nullptr), castor_scene_release(nullptr);
    castor_built_scene_retain(nullptr), castor_built_scene_release(nullptr);
    castor_tracer_retain(nullptr), castor_tracer_release(nullptr);
    castor_crossings_retain(nullptr), castor_crossings_release(nullptr);
    castor_renderer_retain(nullptr), castor_renderer_release(nullptr);
    castor_film_retain(nullptr), castor_film_release(nullptr);
}

TEST_CASE("structs of other headers are read and written as far as both know them", "[c]") {
    const Everything on;
    const TemporaryDirectory folder;
    castor_scene* const scene = on.scene;
    castor_camera camera = test_camera();
    castor_ray ray = test_rays().front();
    castor_hit hit{};
    check_sizes(sized<castor_error>(), true, castor_get_last_error);
    check_sizes(sized<castor_device_info>(), true, [&](auto* s) { return castor_devices_get_info(on.devices, 0, s); });
    check_sizes(sized<castor_scene_settings>(), true, [&](auto* s) { return castor_scene_get_settings(scene, s); });
    check_sizes(sized<castor_scene_counts>(), true, [&](auto* s) { return castor_scene_get_counts(scene, s); });
    check_sizes(sized<castor_camera>(), true, [&](auto* s) { return castor_scene_get_camera(scene, 0, s); });
    check_sizes(sized<castor_tracer_info>(), true, [&](auto* s) { return castor_tracer_get_info(on.tracer, s); });
    check_sizes(sized<castor_device_share>(), true,
                [&](auto* s) { return castor_renderer_get_share(on.renderer, 0, s); });
    check_sizes(sized<castor_render_statistics>(), true,
                [&](auto* s) { return castor_renderer_get_statistics(on.renderer, s); });
    check_sizes(sized<castor_film_info>(), true, [&](auto* s) { return castor_film_get_info(on.film, s); });
    check_sizes(sized<castor_film_plane>(), true, [&](auto* s) { return castor_film_get_plane(on.film, 0, s); });

    check_sizes(sized<castor_material>(), false, [&](auto* s) { return castor_scene_add_material(scene, s, nullptr); });
    check_sizes(sized<castor_principled_material>(), true,
                [&](auto* s) { return castor_principled_material_get_default(s); });
    auto principled = sized<castor_principled_material>();
    done(castor_principled_material_get_default(&principled));
    check_sizes(principled, false, [&](auto* s) { return castor_scene_add_principled_material(scene, s, nullptr); });
    check_sizes(sized<castor_light>(), false, [&](auto* s) { return castor_scene_add_light(scene, s, nullptr); });
    const std::uint8_t texel[3] = {1, 2, 3};  // of the image that these textures name
    auto image = sized<castor_image>();
    image.width = image.height = 1;
    image.bytes = texel;
    done(castor_scene_add_image(scene, &image, nullptr));
    check_sizes(sized<castor_texture>(), false, [&](auto* s) { return castor_scene_add_texture(scene, s, nullptr); });
    check_sizes(sized<castor_tone_map>(), false,
                [&](auto* s) { return castor_scene_add_tone_map(scene, 0, s, nullptr); });
    check_sizes(sized<castor_tone_map>(), true,
                [&](auto* s) { return castor_scene_get_tone_map(scene, 0, 0, s, nullptr); });
    check_sizes(sized<castor_camera>(), false, [&](auto* s) { return castor_scene_add_camera(scene, s, nullptr); });
    check_sizes(flat_mesh(), false, [&](auto* s) { return castor_scene_add_mesh(scene, s, nullptr); });
    const std::string mesh = folder.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").string();
    check_sizes(sized<castor_load_options>(), false, [&](auto* s) {
        castor_scene* loaded = nullptr;
        const castor_status status = castor_scene_load_with_options(mesh.c_str(), s, &loaded);
        castor_scene_release(loaded);
        return status;
    });
    check_sizes(sized<castor_build_options>(), false, [&](auto* s) {
        castor_built_scene* built = nullptr;
        const castor_status status = castor_built_scene_create(scene, on.devices, s, &built);
        castor_built_scene_release(built);
        return status;
    });
    check_sizes(sized<castor_tracer_options>(), false, [&](auto* s) {
        castor_tracer* tracer = nullptr;
        const castor_status status = castor_tracer_create_from_built(on.built, on.devices, s, &tracer);
        castor_tracer_release(tracer);
        return status;
    });
    check_sizes(sized<castor_renderer_options>(), false, [&](auto* s) {
        castor_renderer* renderer = nullptr;
        const castor_status status = castor_renderer_create_from_built(on.built, on.devices, s, &renderer);
        castor_renderer_release(renderer);
        return status;
    });
    check_sizes(sized<castor_batch_options>(), false,
                [&](auto* s) { return castor_tracer_closest_hit(on.tracer, &ray, 1, &hit, s); });
    check_sizes(sized<castor_render_options>(), false, [&](auto* s) {
        castor_film* film = nullptr;
        const castor_status status = castor_renderer_render(on.renderer, &camera, s, &film);
        castor_film_release(film);
        return status;
    });
    check_sizes(sized<castor_image_options>(), false,
                [&](auto* s) { return castor_film_write_image(on.film, (folder.path() / "image.png").c_str(), s); });
    check_sizes(sized<castor_tone_map>(), false, [&](auto* s) {
        return castor_film_write_tone_mapped(on.film, (folder.path() / "image.png").c_str(), s);
    });
    castor_scene_settings settings = sized<castor_scene_settings>();
    check_sizes(settings, false, [&](auto* s) { return castor_scene_set_settings(scene, s); });
}

TEST_CASE("the library tells the sizes of all structs", "[c]") {
    int structs = 0;
    for (const std::string& line : recorded_lines()) {
        if (!line.starts_with("struct ")) continue;
        const std::size_t end = line.rfind(' ');
        const std::string name = line.substr(7, end - 7);
        std::size_t bytes = 0;
        CAPTURE(name);
        done(castor_get_struct_size(name.c_str(), &bytes));
        CHECK(std::to_string(bytes) == line.substr(end + 1));
        ++structs;
    }
    CHECK(structs > 20);
    std::size_t bytes = 0;
    usage_error(castor_get_struct_size("castor_scene", &bytes), "is no struct of castor_c.h");
}

TEST_CASE("what arguments name must be there, and numbers must be in range", "[c]") {
    const Everything on;
    const TemporaryDirectory folder;
    castor_scene* const scene = on.scene;
    auto material = sized<castor_material>();
    material.kind = 4;
    usage_error(castor_scene_add_material(scene, &material, nullptr), "kind is 4, expected 0 to 3");
    auto light = sized<castor_light>();
    light.kind = 8;
    usage_error(castor_scene_add_light(scene, &light, nullptr), "kind is 8");
    light.kind = CASTOR_LIGHT_KIND_ENVIRONMENT;
    light.mapping = 2;
    usage_error(castor_scene_add_light(scene, &light, nullptr), "mapping is 2, expected 0 to 1");
    material.kind = 0;
    material.brdf = 5;
    usage_error(castor_scene_add_material(scene, &material, nullptr), "brdf is 5, expected 0 to 4");
    material.brdf = 0;
    material.texture_count = 1;
    usage_error(castor_scene_add_material(scene, &material, nullptr), "textures is NULL");
    auto image = sized<castor_image>();
    usage_error(castor_scene_add_image(scene, &image, nullptr), "bytes and floats are both NULL");
    const std::uint8_t texel[3] = {1, 2, 3};
    image.bytes = texel;
    usage_error(castor_scene_add_image(scene, &image, nullptr), "the size is 0x0");
    image.width = image.height = 0xffffffff;
    usage_error(castor_scene_add_image(scene, &image, nullptr), "the size is 4294967295x4294967295");
    auto texture = sized<castor_texture>();
    texture.kind = 3;
    usage_error(castor_scene_add_texture(scene, &texture, nullptr), "kind is 3, expected 0 to 2");
    texture.kind = 0;
    texture.target = 8;
    usage_error(castor_scene_add_texture(scene, &texture, nullptr), "target is 8, expected 0 to 7");
    texture.target = 0;
    texture.clamp = texture.mirror = 1;
    usage_error(castor_scene_add_texture(scene, &texture, nullptr), "mirror and clamp are both 1");
    auto principled = sized<castor_principled_material>();
    done(castor_principled_material_get_default(&principled));
    principled.alpha_mode = 3;
    usage_error(castor_scene_add_principled_material(scene, &principled, nullptr), "alpha_mode is 3, expected 0 to 2");
    light = sized<castor_light>();
    light.square_falloff = 2;
    usage_error(castor_scene_add_light(scene, &light, nullptr), "square_falloff is 2, expected 0 to 1");
    usage_error(castor_scene_set_background_texture(scene, 0), "the textures");
    auto tone_map = sized<castor_tone_map>();
    usage_error(castor_scene_add_tone_map(scene, 1, &tone_map, nullptr), "the cameras");
    tone_map.tone_operator = 5;
    usage_error(castor_scene_add_tone_map(scene, 0, &tone_map, nullptr), "tone_operator is 5, expected 0 to 4");
    usage_error(castor_scene_get_tone_map(scene, 0, 0, &tone_map, nullptr), "the tone maps");
    usage_error(castor_scene_set_sphere_motions(scene, 0, 1000, kPlanePoints), "the spheres are 2: found 1000");
    castor_mesh mesh = flat_mesh();
    mesh.smooth = 2;
    usage_error(castor_scene_add_mesh(scene, &mesh, nullptr), "smooth is 2");
    mesh.smooth = 1;
    mesh.normals = kNormals;
    usage_error(castor_scene_add_mesh(scene, &mesh, nullptr), "normals are given");
    mesh.normals = nullptr;
    const std::uint32_t wrong_triangle[] = {0, 1, 4};
    mesh.triangles = wrong_triangle;
    mesh.triangle_count = 1;
    usage_error(castor_scene_add_mesh(scene, &mesh, nullptr), "name vertex 4, and there are 4");
    mesh = flat_mesh();
    mesh.vertices = reinterpret_cast<const float*>(reinterpret_cast<const char*>(kVertices) + 1);
    mesh.vertex_count = 3;
    usage_error(castor_scene_add_mesh(scene, &mesh, nullptr), "vertices is not aligned");
    mesh.vertices = kVertices;
    mesh.vertex_count = ~std::size_t{0} / 4;
    usage_error(castor_scene_add_mesh(scene, &mesh, nullptr), "vertices cannot have");
    usage_error(castor_scene_add_spheres(scene, std::size_t{1} << 32, kSpheres, nullptr, nullptr, nullptr),
                "numbers have 32 bits");

    castor_camera camera = test_camera();
    usage_error(castor_scene_get_camera(scene, 1, &camera), "the cameras are 1: there is no number 1");
    usage_error(castor_camera_resize(&camera, 0, 10), "0x10");
    camera.left_handed = 7;
    usage_error(castor_scene_add_camera(scene, &camera, nullptr), "left_handed is 7");
    auto warning = sized<castor_warning>();
    usage_error(castor_scene_get_warning(scene, 0, &warning), "the warnings are 0");
    auto share = sized<castor_device_share>();
    usage_error(castor_tracer_get_share(on.tracer, 1, &share), "the devices are 1");
    cl_context context = nullptr;
    usage_error(castor_tracer_get_context(on.tracer, 1, &context), "the devices are 1");
    castor_strategy strategy = 0;
    usage_error(castor_tracer_get_strategy(on.tracer, 1, 0, 0, &strategy), "the devices are 1");
    usage_error(castor_tracer_get_strategy(on.tracer, 0, 4, 0, &strategy), "query is 4");
    usage_error(castor_renderer_get_strategy(on.renderer, 0, 0, 2, &strategy), "coherence is 2");
    castor_devices* devices = nullptr;
    usage_error(castor_devices_select("no such device", &devices), "no device matches");

    castor_tracer* tracer = nullptr;
    auto options = sized<castor_tracer_options>();
    options.strategy = 5;
    usage_error(castor_tracer_create(scene, on.devices, &options, &tracer), "strategy is 5");
    options = sized<castor_tracer_options>();
    options.deadline_seconds = -1;
    usage_error(castor_tracer_create(scene, on.devices, &options, &tracer), "-1 s");
    CHECK(tracer == nullptr);
    auto batch = sized<castor_batch_options>();
    batch.reserved = 1;
    castor_ray ray = test_rays().front();
    castor_hit hit{};
    usage_error(castor_tracer_closest_hit(on.tracer, &ray, 1, &hit, &batch), "reserved is 1");
    usage_error(castor_tracer_closest_hit(on.tracer, &ray, ~std::size_t{0}, &hit, nullptr), "rays cannot have");
    done(castor_tracer_closest_hit(on.tracer, nullptr, 0, nullptr, nullptr));
    std::uint32_t count = 0;
    usage_error(castor_tracer_list_crossings(on.tracer, &ray, 2, ~std::size_t{0}, &hit, &count, nullptr),
                "more than memory can hold");
    done(castor_tracer_list_crossings(on.tracer, &ray, 1, 0, nullptr, &count, nullptr));
    done(castor_tracer_list_crossings(on.tracer, nullptr, 0, 7, nullptr, nullptr, nullptr));
    hit = {1, 0, 0, 1000, 0};
    usage_error(castor_tracer_find_surfaces(on.tracer, &ray, &hit, 1, nullptr, nullptr, nullptr, nullptr, nullptr),
                "there is no primitive 1000 of instance 0");
    hit = {1, 0, 0, 0, 77};
    usage_error(castor_tracer_find_surfaces(on.tracer, &ray, &hit, 1, nullptr, nullptr, nullptr, nullptr, nullptr),
                "there is no primitive 0 of instance 77");

    castor_film* film = nullptr;
    camera = test_camera();
    auto render = sized<castor_render_options>();
    render.planes = "depth,nothing";
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "there is no plane \"nothing\"");
    render = sized<castor_render_options>();
    render.verify_share = 2;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "verify_share is 2");
    render = sized<castor_render_options>();
    render.part_number = 1;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "part_number is 1");
    render = sized<castor_render_options>();
    render.filter = 4;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "filter is 4");
    render = sized<castor_render_options>();
    render.integrator = 3;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "integrator is 3");
    render = sized<castor_render_options>();
    render.sample_order = 2;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "sample_order is 2");
    render.sample_order = 0;
    render.denoise = 3;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "denoise is 3");
    render.denoise = CASTOR_DENOISER_NONE;
    render.noise = NAN;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "noise of nan");
    render.noise = 0;
    render.stop_after_seconds = -1;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "stop after -1 seconds");
    render.stop_after_seconds = 0;
    render.light_group_count = 1;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "light_groups is NULL");
    castor_light_group group = {nullptr, nullptr, 0};
    render.light_groups = &group;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "light_groups.name is NULL");
    group = {"key", nullptr, 1};
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "light_groups.lights is NULL");
    render = sized<castor_render_options>();
    render.integrator = CASTOR_INTEGRATOR_PATH;
    render.largest_sample = -1;
    usage_error(castor_renderer_render(on.renderer, &camera, &render, &film), "samples up to -1");
    camera.path_tracing = CASTOR_PATH_TRACING_WEIGHS;
    usage_error(castor_renderer_render(on.renderer, &camera, nullptr, &film), "path_tracing is 8");
    camera = test_camera();
    camera.gaze[0] = NAN;
    CHECK(castor_renderer_render(on.renderer, &camera, nullptr, &film) == CASTOR_STATUS_SCENE_ERROR);
    CHECK(film == nullptr);
    auto plane = sized<castor_film_plane>();
    usage_error(castor_film_get_plane(on.film, 2, &plane), "the planes are 2");
    usage_error(castor_film_find_plane(on.film, "normal", &plane), "it has depth, primitive");
    usage_error(castor_film_write_image(on.film, "picture.gif", nullptr), ".png");
    usage_error(castor_film_write_tone_mapped(on.film, "picture.exr", nullptr), ".png and .ppm");
    tone_map = sized<castor_tone_map>();
    tone_map.tone_operator = 5;
    usage_error(castor_film_write_tone_mapped(on.film, "picture.png", &tone_map), "tone_operator is 5");
    tone_map = sized<castor_tone_map>();
    tone_map.key = -1;
    usage_error(castor_film_write_tone_mapped(on.film, "picture.png", &tone_map), "key is -1");
    usage_error(castor_check_image_extension("picture.gif"), ".png");
    CHECK(castor_film_write_image(on.film, (folder.path() / "no/picture.png").c_str(), nullptr) ==
          CASTOR_STATUS_FILE_ERROR);
}

TEST_CASE("a scene keeps the pictures, textures, lamps and lenses that it is given", "[c]") {
    const Everything on;
    castor_scene* const scene = on.scene;
    const std::uint8_t texels[6] = {1, 2, 3, 4, 5, 6};
    auto image = sized<castor_image>();
    image.name = "two texels";
    image.width = 2;
    image.height = 1;
    image.bytes = texels;
    std::uint32_t picture = 9, pattern = 9, painted = 9, background = 9;
    done(castor_scene_add_image(scene, &image, &picture));
    auto texture = sized<castor_texture>();
    texture.image = picture;
    done(castor_scene_add_texture(scene, &texture, &pattern));
    texture.target = CASTOR_TEXTURE_TARGET_BACKGROUND;
    done(castor_scene_add_texture(scene, &texture, &background));
    done(castor_scene_set_background_texture(scene, background));
    auto material = sized<castor_material>();
    material.textures = &pattern;
    material.texture_count = 1;
    material.emission[0] = 3;
    done(castor_scene_add_material(scene, &material, &painted));
    const float coordinates[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    castor_mesh mesh = flat_mesh();
    mesh.texture_coordinates = coordinates;
    mesh.motion[1] = 2;
    mesh.material = painted;
    std::uint32_t lamp = 0;
    done(castor_scene_add_mesh(scene, &mesh, &lamp));
    auto light = sized<castor_light>();
    light.kind = CASTOR_LIGHT_KIND_MESH;
    light.object = lamp;
    done(castor_scene_add_light(scene, &light, nullptr));
    const float motion[3] = {1, 2, 3};
    done(castor_scene_set_sphere_motions(scene, 1, 1, motion));

    castor_camera camera = test_camera();
    camera.aperture_size = 0.5f;
    camera.focus_distance = 4;
    std::uint32_t with_lens = 0;
    done(castor_scene_add_camera(scene, &camera, &with_lens));
    auto found = sized<castor_camera>();
    done(castor_scene_get_camera(scene, with_lens, &found));
    CHECK(found.aperture_size == 0.5f);
    CHECK(found.focus_distance == 4.0f);
    CHECK(found.path_tracing == 0);
    camera.path_tracing = CASTOR_PATH_TRACING_ON | CASTOR_PATH_TRACING_SAMPLES_LIGHTS | CASTOR_PATH_TRACING_ROULETTE |
                          CASTOR_PATH_TRACING_UNIFORM_LIGHTS;
    camera.roulette_from = 5;
    camera.largest_sample = 9;
    std::uint32_t path_traced = 0;
    done(castor_scene_add_camera(scene, &camera, &path_traced));
    done(castor_scene_get_camera(scene, path_traced, &found));
    CHECK(found.path_tracing == camera.path_tracing);
    CHECK(found.roulette_from == 5);
    CHECK(found.largest_sample == 9.0f);
    auto tone_map = sized<castor_tone_map>();
    tone_map.tone_operator = CASTOR_TONE_OPERATOR_ACES;
    tone_map.saturation = 1;
    tone_map.srgb = 1;
    done(castor_scene_add_tone_map(scene, with_lens, &tone_map, "_aces.png"));
    std::size_t count = 0;
    done(castor_scene_get_tone_map_count(scene, with_lens, &count));
    CHECK(count == 1);
    auto told = sized<castor_tone_map>();
    const char* extension = nullptr;
    done(castor_scene_get_tone_map(scene, with_lens, 0, &told, &extension));
    CHECK(told.tone_operator == CASTOR_TONE_OPERATOR_ACES);
    CHECK(told.key == 0.18f);
    CHECK(told.srgb == 1);
    CHECK(std::string(extension) == "_aces.png");

    auto counts = sized<castor_scene_counts>();
    done(castor_scene_get_counts(scene, &counts));
    CHECK(counts.images == 1);
    CHECK(counts.textures == 2);
    castor_built_scene* built = nullptr;
    done(castor_built_scene_create(scene, on.devices, nullptr, &built));
    castor_built_scene_release(built);
    // What is wrong is found when the scene is built.
    texture.image = 5;
    done(castor_scene_add_texture(scene, &texture, nullptr));
    CHECK(castor_built_scene_create(scene, on.devices, nullptr, &built) == CASTOR_STATUS_SCENE_ERROR);
    CHECK(says("texture 2: image index 5, but the scene has 1 images"));
}

TEST_CASE("a scene keeps the principled materials, and what they need, that it is given", "[c]") {
    const Everything on;
    const TemporaryDirectory folder;
    castor_scene* const scene = on.scene;
    const std::uint8_t texels[3] = {1, 2, 3}, alpha[1] = {77};
    auto image = sized<castor_image>();
    image.width = image.height = 1;
    image.bytes = texels;
    image.alpha = alpha;
    std::uint32_t picture = 9, number = 9;
    done(castor_scene_add_image(scene, &image, &picture));
    auto texture = sized<castor_texture>();
    texture.target = CASTOR_TEXTURE_TARGET_PRINCIPLED;
    texture.image = picture;
    texture.mirror = texture.coordinate_set = 1;
    const float transform[6] = {1, 2, 3, 4, 5, 6};
    texture.transform = transform;
    constexpr std::uint32_t kTextures = 18;
    for (std::uint32_t i = 0; i < kTextures; ++i) done(castor_scene_add_texture(scene, &texture, &number));

    auto given = sized<castor_principled_material>();
    done(castor_principled_material_get_default(&given));
    const castor_principled_material usual = given;
    done(castor_scene_add_principled_material(scene, &given, &number));
    // Every number becomes another one, and every texture too.
    float next = 0.5f;
    const auto change = [&](std::size_t first, std::size_t end) {
        for (std::size_t at = first; at < end; at += sizeof next) {
            next += 1.0f / 128;
            std::memcpy(reinterpret_cast<char*>(&given) + at, &next, sizeof next);
        }
    };
    using C = castor_principled_material;
    change(offsetof(C, base_color), offsetof(C, alpha_mode));
    change(offsetof(C, metallic), offsetof(C, base_color_texture));
    given.alpha_cutoff = 0.25f;
    given.ior = given.iridescence_ior = 1.25f;
    for (std::uint32_t i = 0; i < kTextures; ++i)
        std::memcpy(reinterpret_cast<char*>(&given) + offsetof(C, base_color_texture) + sizeof i * i, &i, sizeof i);
    given.alpha_mode = CASTOR_ALPHA_MODE_MASK;
    given.double_sided = given.unlit = 1;
    given.diffuse_roughness = 0.625f;
    given.diffuse_roughness_texture = 3;
    given.multiscatter_color[1] = 0.75f;
    given.scattering_anisotropy = -0.5f;
    done(castor_scene_add_principled_material(scene, &given, &number));
    // An older header's struct ends before the textures.
    auto older = given;
    older.size = offsetof(C, base_color_texture);
    done(castor_scene_add_principled_material(scene, &older, nullptr));

    const float uvs[8] = {0, 0, 1, 0, 1, 1, 0, 0.5f}, rows[16] = {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1, 1, 0, 0, 1};
    const float colors[16] = {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0, 1};
    castor_mesh mesh = flat_mesh();
    mesh.material = number;
    mesh.texture_coordinates_1 = uvs;
    mesh.colors = colors;
    mesh.tangents = rows;
    done(castor_scene_add_mesh(scene, &mesh, nullptr));
    auto light = sized<castor_light>();
    light.kind = CASTOR_LIGHT_KIND_SPOT;
    light.square_falloff = 1;
    light.range = 5.0f;
    done(castor_scene_add_light(scene, &light, nullptr));
    auto sun = sized<castor_light>();
    sun.kind = CASTOR_LIGHT_KIND_DIRECTIONAL;
    sun.angle_radians = 0.0093f;
    sun.direction[1] = -1;
    done(castor_scene_add_light(scene, &sun, nullptr));

    castor_built_scene* built = nullptr;
    const std::string file = (folder.path() / "scene.castor").string();
    done(castor_built_scene_create(scene, on.devices, nullptr, &built));
    done(castor_built_scene_save(built, file.c_str(), nullptr, nullptr));
    castor_built_scene_release(built);
    const Scene saved = load_built_scene(file).description();
    REQUIRE(saved.materials.size() > number + 1);
    CHECK(saved.lights[saved.lights.size() - 2].spot.falloff == SpotFalloff::square);
    CHECK(saved.lights[saved.lights.size() - 2].spot.range == 5.0f);
    CHECK(std::isinf(saved.lights.back().point.range));
    CHECK(saved.lights.back().directional.angle_radians == 0.0093f);
    const PrincipledMaterial &plain = saved.materials[number - 1].principled.value(),
                             &full = saved.materials[number].principled.value(),
                             &old = saved.materials[number + 1].principled.value();
    CHECK(plain.base_color == PrincipledMaterial{}.base_color);
    CHECK(plain.attenuation_distance == PrincipledMaterial{}.attenuation_distance);
    CHECK(plain.iridescence_ior == PrincipledMaterial{}.iridescence_ior);
    CHECK_FALSE(plain.base_color_texture);
    CHECK(full.base_color == glm::vec3(given.base_color[0], given.base_color[1], given.base_color[2]));
    CHECK(full.metallic == given.metallic);
    CHECK(full.clearcoat_normal_scale == given.clearcoat_normal_scale);
    CHECK(full.dispersion == given.dispersion);
    CHECK(full.iridescence_thickness_maximum == given.iridescence_thickness_maximum);
    CHECK(full.alpha_mode == AlphaMode::mask);
    CHECK((full.is_double_sided && full.is_unlit));
    CHECK(full.base_color_texture == 0u);
    CHECK(full.clearcoat_normal_texture == 12u);
    CHECK(full.iridescence_thickness_texture == 17u);
    CHECK((full.diffuse_roughness == 0.625f && full.diffuse_roughness_texture == 3u));
    CHECK((full.multiscatter_color == glm::vec3(0.0f, 0.75f, 0.0f) && full.scattering_anisotropy == -0.5f));
    CHECK(old.dispersion == given.dispersion);
    CHECK_FALSE(old.iridescence_thickness_texture);
    CHECK(usual.normal_texture == CASTOR_NO_TEXTURE);
}

}  // namespace castor::test
