// Parts of a picture and their merging as the command line tool's users meet them.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "base/section_file.h"
#include "reference/random_source.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

namespace castor::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

ProcessResult castor(std::vector<std::string> words) {
    if (words[0] == "render" && !device_under_test().empty())
        words.insert(words.end(), {"--device", device_under_test()});
    return run_castor(words);
}

void expect(const ProcessResult& result, int status, const std::string& text) {
    CHECK_RESULT(result, status, text);
}

}  // namespace

TEST_CASE("parts that castor render leaves become a picture by castor merge", "[cli][merge]") {
    const TemporaryDirectory folder;
    const auto file = [&](const char* name) { return (folder.path() / name).string(); };
    const std::vector<std::string> render{"render",   std::string(CASTOR_SOURCE_DIR) + "/scenes/spheres.xml",
                                          "--camera", "1",
                                          "--size",   "90x60",
                                          "--aov",    "depth",
                                          "--quiet",  "--json"};
    const auto run = [&](std::vector<std::string> more) {
        more.insert(more.begin(), render.begin(), render.end());
        return castor(more);
    };
    expect(run({"-o", file("whole.png")}), 0, "");
    const ProcessResult first = run({"--part", "1/2", "--checkpoint", file("one"), "--resume", file("one")});
    expect(first, 0, "");
    const Json entry = Json::parse(first.out)["pictures"][0];
    CHECK(entry["part"] == "1/2");
    CHECK(entry["part_complete"] == true);
    CHECK(entry["complete"] == false);
    CHECK(entry["file"].is_null());
    expect(run({"--part", "2/2", "--checkpoint", file("two")}), 0, "");
    const ProcessResult again = run({"--part", "1/2", "--checkpoint", file("one"), "--resume", file("one")});
    expect(again, 0, "");
    CHECK(Json::parse(again.out)["rays"] == 0);

    const ProcessResult merged = castor({"merge", file("two"), file("one"), "-o", file("merged.png"), "--json"});
    expect(merged, 0, "2 files: 100.0 % of the samples of 90x60 pixels\n");
    CHECK(Json::parse(merged.out)["complete"] == true);
    CHECK((file_contents(file("merged.png")) == file_contents(file("whole.png"))));
    CHECK((file_contents(file("merged.depth.exr")) == file_contents(file("whole.depth.exr"))));
    expect(run({"-o", file("whole.exr"), "--layers"}), 0, "");
    expect(castor({"merge", file("two"), file("one"), "-o", file("merged.exr"), "--layers"}), 0, "");
    CHECK((file_contents(file("merged.exr")) == file_contents(file("whole.exr"))));
    expect(castor({"merge", file("two"), file("one"), "-o", file("layers.png"), "--layers"}), 2, "there are .exr");
    expect(castor({"merge", file("one"), "--checkpoint", file("more"), "--layers"}), 2, "there is no picture to write");

    expect(castor({"merge", file("one"), "-o", file("half.png")}), 3, "--incomplete writes it all the same");
    CHECK_FALSE(fs::exists(file("half.png")));
    expect(castor({"merge", file("one"), "-o", file("half.png"), "--incomplete"}), 0, "");
    CHECK(fs::exists(file("half.png")));
    expect(castor({"merge", file("one"), "--checkpoint", file("so far")}), 0, "");
    const ProcessResult finished = run({"--resume", file("so far"), "-o", file("finished.png")});
    expect(finished, 0, "");
    CHECK((file_contents(file("finished.png")) == file_contents(file("whole.png"))));

    const ProcessResult told = castor({"info", file("one"), file("two"), "--json"});
    expect(told, 0, "");
    const Json info = Json::parse(told.out);
    CHECK(info["samples"] == 90 * 60);
    CHECK(info["samples_done"] == 90 * 60);
    CHECK(info["checkpoints"].size() == 2);
    CHECK(info["checkpoints"][0]["samples_done"].get<int>() + info["checkpoints"][1]["samples_done"].get<int>() ==
          90 * 60);
    const ProcessResult text = castor({"info", file("one"), file("one")});
    expect(text, 0, "");
    CHECK(text.out.find("together") != std::string::npos);
}

TEST_CASE("wrong parts and merges are refused", "[cli][merge]") {
    const TemporaryDirectory folder;
    const std::string scene = std::string(CASTOR_SOURCE_DIR) + "/scenes/spheres.xml", part = folder.path() / "part";
    const auto render = [&](std::vector<std::string> more) {
        std::vector<std::string> words{"render", scene, "--camera", "1", "--size", "16x16", "--quiet"};
        words.insert(words.end(), more.begin(), more.end());
        return castor(words);
    };
    for (const char* const wrong : {"0/2", "3/2", "1/0", "1", "1/", "/2", "1/2/3", "-1/2", "1/2x", "1/99999999999", ""})
        expect(render({"--part", wrong, "--checkpoint", part}), 2, "");
    expect(render({"--part", "3/2", "--checkpoint", part}), 2, "--part: \"3/2\" is not i/n with i from 1 to n");
    expect(render({"--part", "1/2"}), 2, "name a file for the part by --checkpoint");
    expect(render({"--part", "1/2", "--checkpoint", part, "-o", "a.png"}), 2, "a part has no picture");
    CHECK_FALSE(fs::exists(part));
    expect(castor({"merge"}), 2, "FILE is required");
    expect(castor({"merge", part}), 2, "one of them is needed");
    expect(castor({"merge", part, "-o", folder.path() / "a.png"}), 3, part);
    expect(castor({"merge", scene, "-o", folder.path() / "a.png"}), 3, "spheres.xml");
    expect(castor({"merge", scene, "-o", folder.path() / "a.txt"}), 2, ".txt");
    expect(render({"--part", "1/1", "--checkpoint", part}), 0, "");
    expect(castor({"merge", part, "-o", "/dev/full/a.png"}), 5, "/dev/full");
    expect(castor({"info", part, scene}), 3, "spheres.xml");
}

TEST_CASE("parts of hits that castor trace leaves become a hit file by castor merge", "[cli][merge]") {
    const TemporaryDirectory folder;
    const auto file = [&](const char* name) { return (folder.path() / name).string(); };
    RandomSource random(21);
    std::string rays;
    for (int i = 0; i < 101; ++i) {
        const glm::vec3 o = random.in_box(-2, 2), d = random.in_box(-1, 1);
        const float ray[8] = {o.x, o.y, o.z, 0.0f, d.x, d.y, d.z, 1e9f};
        rays.append(reinterpret_cast<const char*>(ray), sizeof ray);
    }
    folder.write("rays", rays);
    folder.write("other", rays.substr(32) + rays.substr(0, 32));
    const auto trace = [&](const std::string& rays_file, const std::string& hits, std::vector<std::string> more) {
        std::vector<std::string> words{"trace",  std::string(CASTOR_SOURCE_DIR) + "/scenes/meshes.xml",
                                       "--rays", file(rays_file.c_str()),
                                       "--hits", file(hits.c_str()),
                                       "-q"};
        words.insert(words.end(), more.begin(), more.end());
        if (!device_under_test().empty()) words.insert(words.end(), {"--device", device_under_test()});
        return run_castor(words);
    };
    expect(trace("rays", "whole", {}), 0, "");
    expect(trace("rays", "a", {"--part", "1/3"}), 0, "");
    expect(trace("rays", "b", {"--part", "2/3", "--strategy", "brute"}), 0, "");
    expect(trace("rays", "c", {"--part", "3/3"}), 0, "");
    expect(trace("rays", "second half", {"--part", "2/2"}), 0, "");
    expect(castor({"merge", file("c"), file("a"), file("b"), "-o", file("hits")}), 0, "hits of 101 rays\n");
    CHECK((file_contents(file("hits")) == file_contents(file("whole"))));
    CHECK(file_contents(file("hits")).size() == 101 * 20);
    expect(castor({"merge", file("second half"), file("b"), file("a"), file("a"), "-o", file("again")}), 0, "");
    CHECK((file_contents(file("again")) == file_contents(file("whole"))));

    expect(castor({"merge", file("a"), file("c"), "-o", file("gap")}), 3,
           "rays 33 to 66 of 101 are neither here nor in the other files");
    expect(castor({"merge", file("a"), file("b"), "-o", file("gap")}), 3, "rays 67 to 100 of 101");
    expect(castor({"merge", file("b"), file("c"), "-o", file("gap")}), 3, "rays 0 to 32 of 101");
    CHECK_FALSE(fs::exists(file("gap")));
    expect(trace("other", "d", {"--part", "1/3"}), 0, "");
    expect(castor({"merge", file("a"), file("d"), "-o", file("gap")}), 3,
           "has hits of other rays: it has \"rays 101 of");
    expect(trace("rays", "e", {"--part", "1/3", "--query", "any"}), 0, "");
    expect(castor({"merge", file("a"), file("e"), "-o", file("gap")}), 3, "\"query any\"");
    expect(castor({"merge", file("a"), file("whole"), "-o", file("gap")}), 3, "whole");
    expect(castor({"merge", file("a"), "--checkpoint", file("gap")}), 2, "parts of hits take -o alone");
    expect(trace("rays", "f", {"--part", "4/3"}), 2, "--part: \"4/3\" is not i/n");

    // Of crossings, counts and lists of a fixed length.
    for (const std::vector<std::string>& query :
         {std::vector<std::string>{"--query", "count"}, {"--query", "list", "--limit", "3"}}) {
        const auto part = [&](const std::string& hits, std::vector<std::string> more) {
            more.insert(more.end(), query.begin(), query.end());
            expect(trace("rays", hits, more), 0, "");
        };
        part("all", {});
        part("x", {"--part", "1/2"});
        part("y", {"--part", "2/2", "--strategy", "brute"});
        part("z", {"--part", "2/3"});
        expect(castor({"merge", file("y"), file("z"), file("x"), "-o", file("merged")}), 0, "hits of 101 rays\n");
        CHECK((file_contents(file("merged")) == file_contents(file("all"))));
        CHECK(file_contents(file("merged")).size() == 101 * (query.size() == 2 ? 4 : 64));
    }
    expect(trace("rays", "four", {"--part", "1/2", "--query", "list", "--limit", "4"}), 0, "");
    expect(castor({"merge", file("x"), file("four"), "-o", file("gap")}), 3, "query list, 4 of a ray at most");

    // One changed bit under right checksums.
    std::string forged = file_contents(file("b"));
    const std::string hits = file_contents(file("whole"));
    const std::size_t place = forged.find(hits.substr(40 * 20, 20));
    REQUIRE(place != std::string::npos);
    forged[place] ^= 1;
    restore_checksums(std::as_writable_bytes(std::span(forged)));
    folder.write("forged", forged);
    expect(castor({"merge", file("a"), file("b"), file("c"), file("forged"), "-o", file("gap")}), 4,
           "other hits in two files");
}

}  // namespace castor::test

#endif
