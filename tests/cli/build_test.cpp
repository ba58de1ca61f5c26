// castor build, and what the other commands do with its files.
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

namespace castor::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const std::string kScene = std::string(CASTOR_SOURCE_DIR) + "/scenes/spheres.xml";

}  // namespace

TEST_CASE("castor render, trace and info take what castor build wrote", "[cli][saved]") {
    const TemporaryDirectory directory;
    const std::string folder = directory.path().string();
    const std::string device = device_under_test();
    const ProcessResult built = run_castor({"build", kScene, "-o", "s.castor", "--json", "--device", device}, folder);
    REQUIRE(built.status == 0);
    CHECK(Json::parse(built.out).at("bytes") == fs::file_size(directory.path() / "s.castor"));

    const auto render = [&](const std::string& scene, const std::string& picture) {
        const ProcessResult result =
            run_castor({"render", scene, "-o", picture, "--size", "40x30", "--json", "--device", device}, folder);
        REQUIRE(result.status == 0);
        return Json::parse(result.out);
    };
    const Json plain = render(kScene, "plain.pfm"), saved = render("s.castor", "saved.pfm");
    CHECK(file_contents(directory.path() / "plain.pfm") == file_contents(directory.path() / "saved.pfm"));
    for (const char* key : {"triangles", "spheres", "planes", "nodes", "rays", "warnings", "strategy"}) {
        CAPTURE(key);
        CHECK(plain.at(key) == saved.at(key));
    }
    CHECK(saved.at("seconds").at("flatten") == 0.0);
    CHECK(saved.at("seconds").at("build") == 0.0);
    CHECK(run_castor({"render", "s.castor", "--size", "8x8", "--device", device}, folder).status == 0);

    std::string rays(32, '\0');
    rays[20] = '\x80', rays[21] = '\x3f';  // a ray that is no NaN
    directory.write("rays", rays);
    for (const std::string& scene : {kScene, std::string("s.castor")})
        CHECK(run_castor({"trace", scene, "--rays", "rays", "--hits", fs::path(scene).stem().string() + ".hits",
                          "--device", device},
                         folder)
                  .status == 0);
    CHECK(file_contents(directory.path() / "spheres.hits") == file_contents(directory.path() / "s.hits"));

    const Json plain_info = Json::parse(run_castor({"info", kScene, "--json"}).out);
    const Json saved_info = Json::parse(run_castor({"info", "s.castor", "--json"}, folder).out);
    for (const char* key :
         {"triangles", "spheres", "planes", "meshes", "vertices", "bounds", "cameras", "lights", "materials"}) {
        CAPTURE(key);
        CHECK(plain_info.at(key) == saved_info.at(key));
    }
}

TEST_CASE("castor info of a built scene lists pictures and textures as that of the scene", "[cli][saved]") {
    const TemporaryDirectory directory;
    const std::string folder = directory.path().string();
    const std::string scene = CASTOR_SOURCE_DIR "/scenes/textures.xml";
    REQUIRE(run_castor({"build", scene, "-o", "t.castor", "--device", device_under_test()}, folder).status == 0);
    const Json plain = Json::parse(run_castor({"info", scene, "--json"}).out);
    const Json saved = Json::parse(run_castor({"info", "t.castor", "--json"}, folder).out);
    CHECK(plain.at("images").size() == 4);
    CHECK(plain.at("textures").size() == 5);
    for (const char* key : {"images", "textures", "materials"}) {
        CAPTURE(key);
        CHECK(plain.at(key) == saved.at(key));
    }
}

TEST_CASE("what castor build cannot do it says", "[cli][saved]") {
    const TemporaryDirectory directory;
    const std::string folder = directory.path().string();
    const std::string device = device_under_test();
    const auto build = [&](const std::string& scene, const std::string& output) {
        return run_castor({"build", scene, "-o", output, "--device", device}, folder);
    };
    REQUIRE(build(kScene, "s.castor").status == 0);
    CHECK_RESULT(build("s.castor", "t.castor"), 3, "s.castor: is a built scene; one that is not built was expected");
    CHECK_RESULT(build("missing.xml", "t.castor"), 3, "missing.xml: does not exist");
    CHECK_RESULT(build(kScene, "no/t.castor"), 5, "no/t.castor: cannot be");
    CHECK_RESULT(build("s.castor", "s.castor"), 2, "s.castor would be overwritten, and it is read");
    CHECK_RESULT(run_castor({"render", "s.castor", "--quality", "high"}, folder), 2,
                 "--quality: the trees of s.castor are built already");
    CHECK_RESULT(run_castor({"bench", "s.castor", "--size", "8"}, folder), 3, "is a built scene");

    std::string bytes = file_contents(directory.path() / "s.castor");
    bytes[bytes.size() - 5000] ^= 1;
    directory.write("bad.castor", bytes);
    directory.write("short.castor", bytes.substr(0, 6000));
    for (const char* command : {"render", "info"}) {
        CHECK_RESULT(run_castor({command, "bad.castor"}, folder), 3,
                     "bad.castor: is damaged: the checksum of its section");
        CHECK_RESULT(run_castor({command, "short.castor"}, folder), 3, "short.castor: is cut short or damaged");
    }
}

TEST_CASE("Ctrl-C while a built scene is written leaves status 130", "[cli][saved]") {
    const TemporaryDirectory directory;
    const fs::path pipe = directory.path() / "pipe", errors_file = directory.path() / "err";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    REQUIRE(reader >= 0);
    const int errors = ::open(errors_file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
    const std::string scene = std::string(CASTOR_SOURCE_DIR) + "/scenes/knot.xml";  // megabytes, more than a pipe holds
    const pid_t process = start_process(
        {CASTOR_CLI, "build", scene, "-o", pipe.string(), "--device", device_under_test()}, errors, errors);
    ::close(errors);
    std::size_t size = 0;
    char piece[4096];
    const auto read_piece = [&] {
        const ssize_t got = ::read(reader, piece, sizeof piece);
        if (got > 0) size += static_cast<std::size_t>(got);
        return got;
    };
    for (int tries = 0; tries < 1200 && read_piece() <= 0; ++tries) ::usleep(50000);
    CHECK(size > 0);
    ::kill(process, SIGINT);
    for (ssize_t got; (got = read_piece()) != 0;)  // until nobody writes any more
        if (got < 0) ::usleep(1000);
    ::close(reader);
    CHECK(wait_for(process) == 130);
    const std::string text = file_contents(errors_file);
    INFO(text);
    CHECK(text.find("castor: interrupted") != std::string::npos);
    CHECK(size < 1000000);
}

}  // namespace castor::test

#endif
