// Checkpoints as the command line tool's users meet them: what is refused, and what is told of them.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "castor/renderer.h"
#include "castor/scene_io.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/picture.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

namespace castor::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr const char* kScene =
    "<Scene><BackgroundColor>10 20 30</BackgroundColor><Cameras><Camera><Position>0 0 3</Position><Gaze>0 0 "
    "-1</Gaze><Up>0 1 0</Up><NearPlane>-1 1 -0.75 0.75"
    "</NearPlane><NearDistance>1</NearDistance><ImageResolution>60 "
    "44</ImageResolution></Camera></Cameras><Lights><AmbientLight>100 100 100</AmbientLight></Lights>"
    "<Materials><Material id=\"1\"><AmbientReflectance>1 1 1</AmbientReflectance></Material></Materials><VertexData>-1 "
    "-1 0  1 -1 0  0 1 0</VertexData><Objects>"
    "<Mesh id=\"1\"><Material>1</Material><Faces>1 2 3</Faces></Mesh></Objects></Scene>";

/// What castor render --samples 3000 of the scene would have left in the middle.
void leave_checkpoint(const fs::path& scene_file, const fs::path& checkpoint) {
    const Scene scene = load_scene(scene_file);
    Renderer renderer(scene, {test_device()});
    RenderOptions options;
    options.samples_per_pixel = 3000;
    options.checkpoint_file = checkpoint;
    const Film film = renderer.render(scene.cameras.at(0), options, [](const RenderProgress& progress) {
        return progress.samples_done < progress.samples_total / 4;
    });
    REQUIRE_FALSE(film.complete());
}

}  // namespace

TEST_CASE("castor info tells how much of a checkpoint is done, and castor render --resume does the rest",
          "[cli][checkpoint]") {
    const TemporaryDirectory folder;
    const fs::path scene = folder.write("s.xml", kScene), checkpoint = folder.path() / "s.checkpoint";
    leave_checkpoint(scene, checkpoint);
    const ProcessResult told = run_castor({"info", checkpoint, "--json"});
    CHECK_RESULT(told, 0, "");
    const Json info = Json::parse(told.out);
    CHECK(info["width"] == 60);
    CHECK(info["height"] == 44);
    CHECK(info["samples_per_pixel"] == 3000);
    CHECK(info["samples"] == 60 * 44 * 3000);
    const auto done = info["samples_done"].get<std::uint64_t>();
    CHECK(done > 0);
    CHECK(done < 60u * 44u * 3000u);
    CHECK(info["picture"].dump().find("\"size 60x44\"") != std::string::npos);
    const ProcessResult text = run_castor({"info", checkpoint});
    CHECK_RESULT(text, 0, "");
    CHECK(text.out.find("samples 3000\n") != std::string::npos);
    CHECK(text.out.find(" of 2640 pixels are done") != std::string::npos);

    const std::vector<std::string> render{"render", scene, "--samples", "3000", "--quiet", "--json", "-o"};
    const auto run = [&](const std::string& picture, std::vector<std::string> more) {
        std::vector<std::string> words = render;
        words.push_back(folder.path() / picture);
        words.insert(words.end(), more.begin(), more.end());
        if (!device_under_test().empty()) words.insert(words.end(), {"--device", device_under_test()});
        return run_castor(words);
    };
    const ProcessResult again = run("a.pfm", {"--checkpoint", checkpoint});
    CHECK_RESULT(again, 2, "is there already; --resume " + checkpoint.string() + " goes on from it");
    const ProcessResult whole = run("whole.pfm", {});
    CHECK_RESULT(whole, 0, "");
    CHECK(Json::parse(whole.out)["pictures"][0]["samples_resumed"] == 0);
    const ProcessResult resumed = run("resumed.pfm", {"--resume", checkpoint});
    CHECK_RESULT(resumed, 0, "");
    CHECK(Json::parse(resumed.out)["pictures"][0]["samples_resumed"] == done);
    CHECK((file_contents(folder.path() / "resumed.pfm") == file_contents(folder.path() / "whole.pfm")));
    CHECK_FALSE(fs::exists(checkpoint));
}

TEST_CASE("a checkpoint is not taken for a scene, nor a scene for a checkpoint", "[cli][checkpoint]") {
    const TemporaryDirectory folder;
    const fs::path scene = folder.write("s.xml", kScene), checkpoint = folder.path() / "s.checkpoint",
                   built = folder.path() / "s.castor";
    leave_checkpoint(scene, checkpoint);
    CHECK_RESULT(run_castor({"render", checkpoint, "-o", folder.path() / "p.png"}), 3,
                 "is a checkpoint; a scene was expected");
    CHECK_RESULT(run_castor({"build", checkpoint, "-o", built}), 3, "is a checkpoint; a scene was expected");
    CHECK_RESULT(run_castor({"build", scene, "-o", built, "--quiet"}), 0, "");
    const std::string bytes = file_contents(built);
    CHECK_RESULT(run_castor({"render", scene, "-o", folder.path() / "p.png", "--resume", built}), 3,
                 "is a built scene; a checkpoint was expected");
    CHECK_RESULT(run_castor({"render", scene, "-o", folder.path() / "p.png", "--checkpoint", built}), 2,
                 "is there already, and is no checkpoint");
    CHECK_RESULT(run_castor({"render", scene, "-o", folder.path() / "p.png", "--checkpoint", scene}), 2,
                 "is there already, and is no checkpoint");
    CHECK_RESULT(
        run_castor({"render", scene, "-o", folder.path() / "p.png", "--checkpoint", folder.path() / "." / "p.png"}), 2,
        "two outputs would be written to");
    CHECK((file_contents(scene) == kScene));
    CHECK((file_contents(built) == bytes));
    CHECK_RESULT(run_castor({"render", scene, "-o", folder.path() / "p.png", "--resume", folder.path() / "none"}), 3,
                 "none: ");
    folder.write("cut", file_contents(checkpoint).substr(0, 5000));
    CHECK_RESULT(run_castor({"info", folder.path() / "cut"}), 3, "cut short");
}

TEST_CASE("a standard error that cannot be written loses nothing", "[cli]") {
    const TemporaryDirectory folder;
    const fs::path scene = folder.write("s.xml", kScene), picture = folder.path() / "p.png";
    for (const char* streams : {" 2>/dev/full", " 2>&-"}) {
        CAPTURE(streams);
        fs::remove(picture);
        CHECK(run_process({"/bin/sh", "-c",
                           std::string("exec ") + CASTOR_CLI + " render " + scene.string() + " -o " + picture.string() +
                               streams})
                  .status == 0);
        CHECK(fs::exists(picture));
        CHECK(run_process({"/bin/sh", "-c", std::string("exec ") + CASTOR_CLI + " render none.xml" + streams}).status ==
              3);
    }
}

}  // namespace castor::test

#endif
