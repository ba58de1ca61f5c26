// Open Image Denoise as the command line tool's users meet it, with libraries that stand in for it.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

namespace castor::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kScene = std::string(CASTOR_SOURCE_DIR) + "/scenes/area.xml";

/// Runs the tool in `folder` with these variables.
ProcessResult render(const TemporaryDirectory& folder, const Environment& variables,
                     const std::vector<std::string>& more, const std::string& scene = kScene) {
    std::vector<std::string> words{"render",    scene, "--integrator", "path",       "--size", "24x18",
                                   "--samples", "4",   "-o",           "picture.pfm"};
    if (!device_under_test().empty()) words.insert(words.end(), {"--device", device_under_test()});
    words.insert(words.end(), more.begin(), more.end());
    return run_castor(words, folder.path().string(), variables);
}

Environment library(const std::string& file, const std::string& fails = "") {
    return {{"CASTOR_OIDN_LIBRARY", file}, {"OIDN_STAND_IN_FAILS", fails}};
}

std::string picture_of(const TemporaryDirectory& folder, const char* name = "picture.pfm") {
    return file_contents((folder.path() / name).string());
}

}  // namespace

TEST_CASE("castor render removes noise by Open Image Denoise, and tells its version", "[cli][oidn]") {
    const TemporaryDirectory folder;
    CHECK_RESULT(render(folder, {}, {}), 0, "");
    const std::string noisy = picture_of(folder);
    CHECK_RESULT(render(folder, {}, {"--denoise"}), 0, "noise was removed from it in ");
    const std::string own = picture_of(folder);
    const ProcessResult named = render(folder, {}, {"--denoiser", "castor", "--json"});
    CHECK_RESULT(named, 0, "noise was removed from it in ");
    CHECK((picture_of(folder) == own));
    CHECK(Json::parse(named.out)["pictures"][0]["denoiser"] == "castor");

    const ProcessResult result =
        render(folder, library(CASTOR_OIDN_1), {"--denoiser=oidn", "--aov", "noisy", "--json"});
    CHECK_RESULT(result, 0,
                 "noise was removed from it by Open Image Denoise 1.4.3 (bytes may differ between machines) in ");
    const Json entry = Json::parse(result.out)["pictures"][0];
    CHECK(entry["denoiser"] == "Open Image Denoise 1.4.3");
    CHECK(entry["denoise_seconds"] > 0.0);
    CHECK(fs::exists(folder.path() / "picture.noisy.exr"));
    const std::string clean = picture_of(folder);
    CHECK((clean != own));
    CHECK((clean != noisy));
    CHECK_RESULT(render(folder, library(CASTOR_OIDN_2), {"--denoise", "--denoiser", "oidn"}), 0,
                 "Open Image Denoise 2.3.3");
    CHECK((picture_of(folder) == clean));
    CHECK(Json::parse(render(folder, {}, {"--json"}).out)["pictures"][0]["denoiser"].is_null());
}

TEST_CASE("castor finds Open Image Denoise where the system looks for libraries", "[cli][oidn]") {
    const TemporaryDirectory folder;
    fs::create_symlink(CASTOR_OIDN_2, folder.path() / "libOpenImageDenoise.so.2");
    const Environment variables{{"LD_LIBRARY_PATH", folder.path().string()}, {"CASTOR_OIDN_LIBRARY", ""}};
    CHECK_RESULT(render(folder, variables, {"--denoiser", "oidn"}), 0, "Open Image Denoise 2.3.3");
    // One that cannot be loaded does not hide an older one.
    fs::remove(folder.path() / "libOpenImageDenoise.so.2");
    folder.write("libOpenImageDenoise.so.2", "this is no library");
    fs::create_symlink(CASTOR_OIDN_1, folder.path() / "libOpenImageDenoise.so.1");
    CHECK_RESULT(render(folder, variables, {"--denoiser", "oidn"}), 0, "Open Image Denoise 1.4.3");
    fs::remove(folder.path() / "libOpenImageDenoise.so.1");
    for (const char* const name : {"libOpenImageDenoise.so.1", "libOpenImageDenoise.so"})
        folder.write(name, "neither is this");
    CHECK_RESULT(render(folder, variables, {"--denoiser", "oidn"}), 2, "CASTOR_OIDN_LIBRARY may name");
    CHECK_RESULT(render(folder, variables, {"--denoiser", "oidn"}), 2, "libOpenImageDenoise.so.2: ");
}

TEST_CASE("castor tells that Open Image Denoise is not there before it reads the scene", "[cli][oidn]") {
    const TemporaryDirectory folder;
    const std::string none = (folder.path() / "none.so").string(), no_scene = "no_scene.xml";
    CHECK_RESULT(render(folder, library(none), {"--denoiser", "oidn"}, no_scene), 2,
                 "castor: CASTOR_OIDN_LIBRARY: Open Image Denoise cannot be loaded: " + none);
    CHECK_RESULT(render(folder, library(CASTOR_OIDN_old), {"--denoiser", "oidn"}, no_scene), 2, "expected 1.4.0");
    CHECK_RESULT(render(folder, library(CASTOR_OIDN_lacking), {"--denoiser", "oidn"}, no_scene), 2,
                 "oidnExecuteFilter");
    CHECK_RESULT(render(folder, library(CASTOR_OIDN_2, "oidnNewDevice"), {"--denoiser", "oidn"}, no_scene), 2,
                 "no device today");
    CHECK_RESULT(render(folder, {}, {"--denoiser", "optix"}, no_scene), 2,
                 "there is no denoiser \"optix\"; there are castor, oidn");
    CHECK_RESULT(render(folder, library(none), {"--denoise"}), 0, "");  // Castor's own needs none
    // Its memory is planned with the rest.
    CHECK_RESULT(render(folder, library(CASTOR_OIDN_2), {"--denoiser", "oidn", "--memory-limit", "1M"}), 4,
                 "denoising ");
}

TEST_CASE("castor writes the noisy picture where Open Image Denoise fails, and goes on from there", "[cli][oidn]") {
    const TemporaryDirectory folder;
    CHECK_RESULT(render(folder, {}, {}), 0, "");
    const std::string noisy = picture_of(folder);
    fs::remove(folder.path() / "picture.pfm");
    const std::vector<std::string> words{"--denoiser", "oidn", "--checkpoint", "kept", "--resume", "kept", "--json"};
    const ProcessResult failed = render(folder, library(CASTOR_OIDN_2, "oidnExecuteFilter"), words);
    CHECK_RESULT(failed, 4, "castor: Open Image Denoise 2.3.3: noise was not removed: out of luck");
    CHECK_RESULT(failed, 4, "is complete, and still has its noise");
    CHECK_RESULT(failed, 4, "--resume kept goes on from here");
    CHECK((picture_of(folder) == noisy));
    CHECK(Json::parse(failed.out)["pictures"][0]["denoiser"].is_null());

    CHECK_RESULT(run_castor({"merge", "kept", "-o", "merged.pfm"}, folder.path().string(), library("/dev/null")), 2,
                 "Open Image Denoise");
    CHECK_RESULT(run_castor({"merge", "kept", "-o", "merged.pfm"}, folder.path().string(),
                            library(CASTOR_OIDN_1, "oidnExecuteFilter")),
                 4, "out of luck");
    // Who writes no picture needs no library.
    CHECK_RESULT(run_castor({"merge", "kept", "--checkpoint", "copy"}, folder.path().string(), library("/dev/null")), 0,
                 "100.0 % of the samples");
    CHECK_RESULT(run_castor({"info", "kept", "copy"}, folder.path().string(), library("/dev/null")), 0, "");
    const ProcessResult merged =
        run_castor({"merge", "kept", "-o", "merged.pfm", "--json"}, folder.path().string(), library(CASTOR_OIDN_1));
    CHECK_RESULT(merged, 0, "noise was removed by Open Image Denoise 1.4.3 (bytes may differ between machines)\n");
    CHECK(Json::parse(merged.out)["denoiser"] == "Open Image Denoise 1.4.3");
    CHECK(Json::parse(merged.out)["denoised"] == true);
    const ProcessResult finished = render(folder, library(CASTOR_OIDN_2), words);
    CHECK_RESULT(finished, 0, "Open Image Denoise 2.3.3");
    CHECK(Json::parse(finished.out)["rays"] == 0);
    CHECK_FALSE(fs::exists(folder.path() / "kept"));
    CHECK((picture_of(folder) == picture_of(folder, "merged.pfm")));
    CHECK((picture_of(folder) != noisy));
}

}  // namespace castor::test

#endif
