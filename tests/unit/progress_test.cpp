// Whoever waits for something long is told how far it is, and may end it.
#include "castor/progress.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <functional>
#include <map>

#include "base/progress.h"
#include "castor/built_scene.h"
#include "castor/error.h"
#include "castor/scene_io.h"
#include "reference/meshes.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/ply_writer.h"
#include "support/temporary_directory.h"

namespace castor {

namespace {

using test::TemporaryDirectory;

/// Enough for several blocks of every reader.
const Mesh& big_mesh() {
    static const Mesh mesh = test::cube_grid(64);  // 49152 triangles
    return mesh;
}

/// Quads are not what the first face foretells.
std::string ply(test::PlyWriter::Format format, bool ends_with_quad) {
    const Mesh& mesh = big_mesh();
    test::PlyWriter writer(format);
    writer.line(fmt::format("element vertex {}", mesh.positions.size()));
    for (const char* axis : {"x", "y", "z"}) writer.line(fmt::format("property float {}", axis));
    writer.line(fmt::format("element face {}", mesh.triangles.size() + ends_with_quad));
    writer.line("property list uchar int vertex_indices").line("end_header");
    for (const glm::vec3& p : mesh.positions) writer.put("float", {p.x, p.y, p.z}).end_line();
    for (const glm::uvec3& t : mesh.triangles)
        writer.put("uchar", {3}).put("int", {double(t.x), double(t.y), double(t.z)}).end_line();
    if (ends_with_quad) writer.put("uchar", {4}).put("int", {0, 1, 2, 3}).end_line();
    return writer.bytes();
}

std::string obj() {
    std::string text;
    for (const glm::vec3& p : big_mesh().positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
    for (const glm::uvec3& t : big_mesh().triangles) text += fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
    return text;
}

/// One mesh in the text, between two of other files.
std::string xml() {
    std::string text = "<Scene><Materials><Material id='1'/></Materials><VertexData>";
    for (const glm::vec3& p : big_mesh().positions) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
    text +=
        "</VertexData><Objects><Mesh id='1'><Material>1</Material><Faces plyFile='text.ply'/></Mesh>"
        "<Mesh id='2'><Material>1</Material><Faces>";
    for (const glm::uvec3& t : big_mesh().triangles) text += fmt::format("{} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
    return text +
           "</Faces></Mesh><Mesh id='3'><Material>1</Material><Faces objFile='mesh.obj'/></Mesh></Objects></Scene>";
}

Scene big_scene() {
    Scene scene;
    scene.meshes.push_back(big_mesh());
    add_default_view(scene);
    return scene;
}

/// Runs `work`, which must tell what it promises; then again and again, ended a little later each time.
void check_progress(
    const std::function<void(const ProgressHook&)>& work,
    const std::function<void()>& check_after_interruption = [] {}) {
    std::vector<double> told;
    work([&](double fraction) {
        told.push_back(fraction);
        return true;
    });
    CAPTURE(told);
    CHECK(told.size() >= 4);
    CHECK(told.size() <= 1025);
    CHECK(told.front() > 0.0);
    CHECK(std::adjacent_find(told.begin(), told.end(), std::greater_equal<>()) == told.end());
    CHECK(told.back() == 1.0);
    for (const double end : {0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0}) {
        CAPTURE(end);
        bool is_stopped = false;
        int calls_after = 0;
        CHECK_THROWS_AS(work([&](double fraction) {
                            calls_after += is_stopped;
                            is_stopped = fraction >= end;
                            return !is_stopped;
                        }),
                        Interrupted);
        CHECK(is_stopped);
        CHECK(calls_after == 0);
        check_after_interruption();
    }
}

}  // namespace

TEST_CASE("progress of parts grows to 1, in whatever order its steps come", "[progress]") {
    std::vector<double> told;
    const Progress whole([&](double fraction) {
        told.push_back(fraction);
        return true;
    });
    const Progress second_half = whole.part(0.5, 1.0);
    second_half.part(0.5, 1.0).reach(0.5);
    second_half.reach(0.5);  // less than before
    second_half.reach(0.75 + 1e-5);
    second_half.reach(1.0);
    second_half.reach(1.0);
    CHECK(told == std::vector<double>{0.875, 1.0});

    told.clear();
    ProgressCount steps(Progress([&](double fraction) {
                            told.push_back(fraction);
                            return true;
                        }),
                        100000);
    tbb::parallel_for(0, 100000, [&](int) { steps.add(1); });
    CHECK(std::adjacent_find(told.begin(), told.end(), std::greater_equal<>()) == told.end());
    CHECK(told.size() > 10);
    CHECK(told.size() <= 1025);
    CHECK(told.back() == 1.0);
    Progress().reach(0.5);  // nobody waits
}

TEST_CASE("reading a scene tells how far it is, and can be ended", "[progress][load_scene]") {
    using Format = test::PlyWriter::Format;
    const TemporaryDirectory folder;
    const std::map<std::string, std::string> texts{{"text.ply", ply(Format::ascii, false)},
                                                   {"little.ply", ply(Format::little, false)},
                                                   {"big.ply", ply(Format::big, false)},
                                                   {"mixed.ply", ply(Format::little, true)},
                                                   {"mixed_text.ply", ply(Format::ascii, true)},
                                                   {"mesh.obj", obj()},
                                                   {"scene.xml", xml()}};
    for (const auto& [name, text] : texts) folder.write(name, text);
    for (const auto& [name, text] : texts) {
        CAPTURE(name);
        std::size_t triangles = 0;
        check_progress([&, file = folder.path() / name](const ProgressHook& hook) {
            const Scene scene = load_scene(file, hook);
            triangles = 0;
            for (const Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
        });
        const std::size_t expected = name == "scene.xml" ? 3 : 1;
        CHECK(triangles == expected * big_mesh().triangles.size() + (name.starts_with("mixed") ? 2 : 0));
    }
}

TEST_CASE("building tells how far it is, and can be ended", "[progress][bvh]") {
    const std::vector<Device> devices = select_devices(test::device_under_test());
    const Scene plain = big_scene();
    Scene placed = plain;
    placed.meshes.push_back(big_mesh());
    placed.instances.push_back({1, Transform(2.0f), 0, 0});
    placed.meshes.push_back(big_mesh());
    placed.meshes.back().transform = Transform(3.0f);
    for (const Scene* scene : {&plain, &std::as_const(placed)})
        for (const Strategy strategy : {Strategy::brute, Strategy::wide, Strategy::simt}) {
            CAPTURE(to_string(strategy), scene->meshes.size());
            const auto build = [&](const ProgressHook& hook) {
                const BuiltScene built(*scene, devices,
                                       {.strategy = strategy, .use_profiles = false, .progress = hook});
            };
            if (strategy == Strategy::brute) {
                double last = 0.0;
                build([&](double fraction) {
                    last = fraction;
                    return true;
                });
                CHECK(last == 1.0);
            } else {
                check_progress(build);
            }
        }
}

TEST_CASE("saving and checking a built scene tell how far they are, and can be ended", "[progress][saved]") {
    const TemporaryDirectory folder;
    const std::filesystem::path file = folder.path() / "scene.castor";
    const BuiltScene built(big_scene(), select_devices(test::device_under_test()), {.use_profiles = false});
    const auto names = [&] {
        std::vector<std::string> found;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
            found.push_back(entry.path().filename().string());
        return found;
    };
    CHECK_THROWS_AS(built.save(file, [](double) { return false; }), Interrupted);
    CHECK(names().empty());
    CHECK_THROWS_AS(built.save(file, [](double fraction) { return fraction < 0.9; }), Interrupted);
    CHECK(names().empty());
    check_progress(
        [&](const ProgressHook& hook) {
            folder.write("scene.castor", "old");
            built.save(file, hook);
        },
        [&] {
            CHECK(names() == std::vector<std::string>{"scene.castor"});
            CHECK(test::file_contents(file) == "old");
        });
    built.save(file);
    check_progress([&](const ProgressHook& hook) { load_built_scene(file, hook); });
}

}  // namespace castor
