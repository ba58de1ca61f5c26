// `castor bench`: what it measures is right before it is fast.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "castor/scene_io.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

using castor::test::file_contents;
using castor::test::ProcessResult;
using castor::test::TemporaryDirectory;
using Json = nlohmann::json;

namespace {

ProcessResult bench(std::vector<std::string> arguments, const castor::test::Environment& changes = {}) {
    arguments.insert(arguments.begin(), {"bench", "--device", castor::test::device_under_test()});
    return castor::test::run_castor(arguments, "", changes);
}

const std::string kMesh = std::string(CASTOR_SOURCE_DIR) + "/scenes/meshes/block.obj";

}  // namespace

TEST_CASE("bench measures every ray set with every strategy", "[cli][bench]") {
    const ProcessResult result =
        bench({kMesh, "spheres:100", "--size", "16", "--repeat", "3", "--strategy", "packet,wide", "--json"});
    INFO(result.err);
    REQUIRE(result.status == 0);
    const Json document = Json::parse(result.out);
    CHECK(document["castor_version"].is_string());
    CHECK(document["machine"]["cores"] > 0);
    for (const char* key : {"cpu", "os", "kernel"}) CHECK(document["machine"][key].is_string());
    CHECK(document["devices"].size() == 1);
    CHECK(document["devices"][0]["driver_version"].is_string());
    REQUIRE(document["results"].size() == 2 * 4 * 2);
    for (const Json& measured : document["results"]) {
        CAPTURE(measured.dump());
        CHECK(measured["seconds"].size() == 3);
        CHECK(measured["mrays_per_second"]["median"] > 0.0);
        CHECK(measured["mrays_per_second"]["best"] >= measured["mrays_per_second"]["median"]);
        CHECK(measured["hits"] <= measured["ray_count"]);
        CHECK(measured["checked_against_brute_force"] == measured["ray_count"]);
        CHECK(measured["query"] == (measured["rays"] == "shadow" ? "any" : "closest"));
        CHECK(measured["hint"] ==
              (measured["rays"] == "shadow" || measured["rays"] == "primary" ? "coherent" : "incoherent"));
        if (measured["rays"] == "primary" || measured["rays"] == "random") CHECK(measured["ray_count"] == 256);

        // What a ray takes, and how near to the roofs that is.
        CHECK(measured["nodes_per_ray"] > 0.0);
        CHECK(measured["tests_per_ray"] > 0.0);
        double bytes = 32 + (measured["query"] == "any" ? 1 : 20), flops = document["work_figures"]["ray"]["flops"];
        for (const auto& [kind, count] : measured["work"].items()) {
            bytes += count.get<double>() / measured["ray_count"].get<double>() *
                     document["work_figures"][kind]["bytes"].get<double>();
            flops += count.get<double>() / measured["ray_count"].get<double>() *
                     document["work_figures"][kind]["flops"].get<double>();
        }
        CHECK(std::abs(measured["bytes_per_ray"].get<double>() / bytes - 1.0) < 1e-9);
        CHECK(std::abs(measured["flops_per_ray"].get<double>() / flops - 1.0) < 1e-9);
        const double rate = measured["mrays_per_second"]["best"].get<double>() * 1e6;
        const Json &shares = measured["share_of_roofs"], &roofs = document["roofs"][0];
        CHECK(std::abs(shares["memory"].get<double>() * roofs["bytes_per_second"].get<double>() / (rate * bytes) -
                       1.0) < 1e-9);
        CHECK(std::abs(shares["flops"].get<double>() * roofs["flops_per_second"].get<double>() / (rate * flops) - 1.0) <
              1e-9);
    }
    REQUIRE(document["roofs"].size() == 1);
    CHECK(document["roofs"][0]["bytes_per_second"] > 1e8);
    CHECK(document["roofs"][0]["flops_per_second"] > 1e8);
    // Shadow and diffuse rays start at the primary hits.
    const Json& results = document["results"];
    for (const std::size_t scene : {0, 8})
        for (const std::size_t dependent : {2, 4})
            CHECK(results[scene + dependent]["ray_count"] == results[scene]["hits"]);
}

TEST_CASE("bench saves its rays and the scenes that it generates", "[cli][bench]") {
    const TemporaryDirectory folder;
    const std::string rays = (folder.path() / "rays").string();
    std::vector<std::string> arguments{"instances:30x500", "--scene-set", "small",  "--size",      "8",
                                       "--repeat",         "1",           "--json", "--save-rays", rays};
    const ProcessResult result = bench(arguments);
    INFO(result.err);
    REQUIRE(result.status == 0);
    const Json document = Json::parse(result.out);
    REQUIRE(document["results"].size() == 5 * 4);
    for (const Json& measured : document["results"]) {
        CAPTURE(measured.dump());
        const std::string file = measured["ray_file"];
        REQUIRE(std::filesystem::is_regular_file(file));
        CHECK(std::filesystem::file_size(file) == measured["ray_count"].get<std::size_t>() * 32);
        const std::string scene_file = measured["scene_file"];
        const castor::Scene scene = castor::load_scene(scene_file);
        CHECK(scene.spheres.size() == measured["spheres"]);
        CHECK((scene.meshes.empty() ? 0 : scene.meshes.at(0).triangles.size() * (1 + scene.instances.size())) ==
              measured["triangles"]);
        CHECK((scene.instances.size() == 29) == (measured["scene"] == "instances:30x500"));
        // Those files give the hits that were measured.
        const std::string hits = (folder.path() / "hits").string();
        const ProcessResult traced =
            castor::test::run_process({CASTOR_CLI, "trace", scene_file, "--rays", file, "--hits", hits, "--query",
                                       measured["query"], "--json", "--device", document["devices"][0]["name"]});
        CHECK_RESULT(traced, 0, "");
        CHECK(Json::parse(traced.out)["hits"] == measured["hits"]);
    }
}

TEST_CASE("bench prints a table for people", "[cli][bench]") {
    const ProcessResult result = bench({kMesh, "--size", "8", "--repeat", "1", "--rays", "random"});
    INFO(result.err);
    CHECK(result.status == 0);
    CHECK(result.out.find("Mray/s") != std::string::npos);
    CHECK(result.out.find("random") != std::string::npos);
    for (const char* column : {"nodes", "tests", "memory", "flops", "GB/s", "Gflop/s"})
        CHECK(result.out.find(column) != std::string::npos);
}

TEST_CASE("bench refuses what it does not know", "[cli][bench]") {
    CHECK_RESULT(bench({kMesh, "--rays", "primary,green"}), 2, "there are no rays \"green\"");
    CHECK_RESULT(bench({kMesh, "--strategy", "auto,slow"}), 2, "slow");
    CHECK_RESULT(bench({kMesh, "--size", "12"}), 2, "12 is no multiple of 8");
    CHECK_RESULT(bench({kMesh, "--size", "0"}), 2, "--size");
    CHECK_RESULT(bench({kMesh, "--repeat", "0"}), 2, "--repeat");
    CHECK_RESULT(bench({"--scene-set", "huge"}), 2, "there is no set of scenes \"huge\"");
    CHECK_RESULT(bench({"scan:many"}), 2, "must be from 100 to 100000000");
    CHECK_RESULT(bench({"scan:99"}), 2, "\"99\"");
    CHECK_RESULT(bench({"instances:0"}), 2, "the number of instances is \"0\"; it must be from 1 to 1000000");
    CHECK_RESULT(bench({"instances:7x99"}), 2, "the number of primitives is \"99\"");
    CHECK_RESULT(bench({"no such scene.ply"}), 3, "no such scene.ply");
    CHECK_RESULT(bench({kMesh, "--size", "8", "--save-rays", "/dev/null/rays"}), 5, "rays");
}

TEST_CASE("bench ends with status 4 where an answer is wrong", "[cli][bench]") {
    // A kernel whose answers are a bit off takes the place of the true one.
    const std::string name = "kernels/closest_hit_simt.cl";
    std::string source = file_contents(std::string(CASTOR_SOURCE_DIR) + "/" + name);
    const std::size_t end = source.rfind('}');
    REQUIRE(end != std::string::npos);
    source.insert(end, "    hits[ray].instance ^= 2u;\n");
    const TemporaryDirectory folder;
    std::filesystem::create_directory(folder.path() / "kernels");
    folder.write(name, source);
    const castor::test::Environment changes{{"CASTOR_KERNEL_DIR", folder.path().string()}};

    const std::vector<std::string> common{"spheres:100", "--size", "8", "--repeat", "1", "--rays", "random"};
    std::vector<std::string> arguments = common;
    arguments.insert(arguments.end(), {"--strategy", "simt"});
    CHECK_RESULT(bench(arguments, changes), 4, "wrong answer: random rays, strategy simt, ray ");
    CHECK_RESULT(bench(arguments, changes), 4, "but brute force finds t ");
    arguments.back() = "brute,simt";
    CHECK_RESULT(bench(arguments, changes), 4, "but strategy brute on ");
}

TEST_CASE("bench times single kernels whose answers are right", "[cli][bench]") {
    const ProcessResult result = bench({"--kernels", "--size", "24", "--repeat", "2", "--json"});
    INFO(result.err);
    REQUIRE(result.status == 0);
    const Json document = Json::parse(result.out);
    CHECK(document["results"].empty());
    std::vector<std::string> names;
    for (const Json& measured : document["kernels"]) {
        CAPTURE(measured.dump());
        names.push_back(measured["kernel"]);
        CHECK(measured["count"].get<int>() % (24 * 24) == 0);
        CHECK(measured["checked"] == measured["count"]);
        CHECK(measured["seconds"].size() == 2);
        CHECK(measured["millions_per_second"]["median"] > 0.0);
        CHECK(measured["millions_per_second"]["best"] >= measured["millions_per_second"]["median"]);
    }
    CHECK(names == std::vector<std::string>{"intersect_triangle", "intersect_triangle_plane",
                                            "intersect_triangle_cramer", "intersect_sphere", "intersect_plane",
                                            "box_interval", "generate_rays", "blinn_phong", "torrance_sparrow",
                                            "refract", "nearest_texel", "bilinear_texel", "trilinear_texel"});
    CHECK_RESULT(bench({"--kernels", kMesh}), 2, "--kernels");
    CHECK_RESULT(bench({"--kernels", "--rays", "primary"}), 2, "--kernels");
}

TEST_CASE("bench ends with status 4 where a single kernel is wrong", "[cli][bench]") {
    struct Damage {
        std::string file, text, instead, message;
    };
    for (const Damage& damage :
         {Damage{"device/intersect_triangle_cramer.cl", "beta + gamma <= 1.0f", "beta + gamma <= 1.01f",
                 "intersect_triangle_cramer"},
          Damage{"device/shading.lanes.cl", "LANES(sum_of_vectors)(light.wi, wo)", "light.wi", "blinn_phong"},
          Damage{"device/camera.lanes.cl", "(pixel.x) + 0.5f", "(pixel.x) + 0.51f", "generate_rays"},
          Damage{"device/texture_lookup.lanes.cl", "after = i + 1u;", "after = i;", "bilinear_texel"},
          Damage{"bench/fma_chains.cl", "x7 = fma(x7, f, s);", "", "fma_chains"}}) {
        CAPTURE(damage.file, damage.instead);
        const std::string name = "kernels/" + damage.file;
        std::string source = file_contents(std::string(CASTOR_SOURCE_DIR) + "/" + name);
        const std::size_t at = source.find(damage.text);
        REQUIRE(at != std::string::npos);
        source.replace(at, damage.text.size(), damage.instead);
        const TemporaryDirectory folder;
        std::filesystem::create_directories((folder.path() / name).parent_path());
        folder.write(name, source);
        const ProcessResult result =
            bench({"--kernels", "--size", "64", "--repeat", "1"}, {{"CASTOR_KERNEL_DIR", folder.path().string()}});
        CHECK_RESULT(result, 4, "wrong answer: " + damage.message);
    }
}

#endif
