// The pictures of a camera's tone maps as the command line tool's users meet them.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "castor/built_scene.h"
#include "castor/image_io.h"
#include "castor/scene_io.h"
#include "castor/tone_map.h"
#include "support/castor_tool.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

#ifdef CASTOR_CLI

namespace castor::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

ToneMap map_of(ToneOperator tone_operator, const std::string& extension) {
    ToneMap map;
    map.tone_operator = tone_operator;
    map.extension = extension;
    return map;
}

const std::vector<ToneMap>& tone_maps() {
    static const std::vector<ToneMap> kMaps{
        map_of(ToneOperator::photographic, ""), map_of(ToneOperator::aces, "_aces.png"),
        map_of(ToneOperator::filmic, "_aces.png"), map_of(ToneOperator::photographic, "../x/_end")};
    return kMaps;
}

/// A scene whose first camera has the tone maps.
fs::path write_scene(const fs::path& folder, const std::string& image_name) {
    Scene scene = load_scene(fs::path(CASTOR_SOURCE_DIR) / "scenes" / "spheres.xml");
    scene.cameras.resize(1);
    resize(scene.cameras[0], 48, 32);
    scene.cameras[0].image_name = image_name;
    scene.cameras[0].tone_maps = tone_maps();
    const fs::path file = folder / (image_name + ".castor");
    BuiltScene(scene, {test_device()}).save(file);
    return file;
}

ProcessResult castor(std::vector<std::string> words) {
    if (words[0] == "render" && !device_under_test().empty())
        words.insert(words.end(), {"--device", device_under_test()});
    const ProcessResult result = run_castor(words);
    CHECK_RESULT(result, 0, "");
    return result;
}

std::string text_of(const fs::path& file) {
    return file_contents(file.string());
}

Film film_of(const fs::path& exr) {
    const Image linear = read_image(exr);
    Film film;
    film.width = linear.width;
    film.height = linear.height;
    for (std::size_t i = 0; i < linear.floats.size(); i += 3)
        film.pixels.emplace_back(linear.floats[i], linear.floats[i + 1], linear.floats[i + 2]);
    return film;
}

std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace

TEST_CASE("an EXR picture has those of its tone maps beside it", "[cli][tone]") {
    const TemporaryDirectory folder;
    const std::string scene = write_scene(folder.path(), "a.exr").string();
    const fs::path out = folder.path() / "out";
    const ProcessResult result = castor({"render", scene, "-o", out.string() + "/", "--quiet", "--json"});
    const std::vector<std::string> names{"a.png", "a_aces.png", "a_aces-2.png", "a_end.png"};
    CHECK(names_in(out) == std::vector<std::string>{"a.exr", "a.png", "a_aces-2.png", "a_aces.png", "a_end.png"});
    const Json entry = Json::parse(result.out)["pictures"][0];
    CHECK(entry["file"] == (out / "a.exr").string());
    REQUIRE(entry["tone_mapped"].size() == names.size());
    const Film film = film_of(out / "a.exr");
    for (std::size_t i = 0; i < names.size(); ++i) {
        CAPTURE(names[i]);
        CHECK(entry["tone_mapped"][i] == (out / names[i]).string());
        CHECK(read_image(out / names[i]).bytes == apply_tone_map(film, tone_maps()[i]).bytes);
    }
    CHECK(text_of(out / "a.png") == text_of(out / "a_end.png"));
}

TEST_CASE("a picture of 8 bits is the first tone map's", "[cli][tone]") {
    const TemporaryDirectory folder;
    const std::string scene = write_scene(folder.path(), "a.png").string();
    const fs::path out = folder.path() / "out";
    castor({"render", scene, "-o", out.string() + "/", "--quiet"});
    CHECK(names_in(out) == std::vector<std::string>{"a.png", "a_aces-2.png", "a_aces.png", "a_end.png"});
    castor({"render", scene, "-o", (folder.path() / "b.exr").string(), "--quiet"});
    const Film film = film_of(folder.path() / "b.exr");
    CHECK(read_image(out / "a.png").bytes == apply_tone_map(film, tone_maps()[0]).bytes);
    CHECK(text_of(folder.path() / "b_aces.png") == text_of(out / "a_aces.png"));
}

TEST_CASE("the option --tone puts one map in the place of the camera's", "[cli][tone]") {
    const TemporaryDirectory folder;
    const std::string scene = write_scene(folder.path(), "a.exr").string();
    const auto render = [&](const std::string& tone, const std::string& name) {
        const fs::path out = folder.path() / name;
        castor({"render", scene, "--tone", tone, "--exposure", "1", "-o", out.string(), "--quiet"});
        return out;
    };
    const Film film = film_of(render("agx", "linear.exr"));
    ToneMap map = map_of(ToneOperator::agx, "");
    map.is_srgb = true;
    map.key = 0.36f;
    CHECK(read_image(render("agx", "agx.png")).bytes == apply_tone_map(film, map).bytes);
    map.tone_operator = ToneOperator::aces;
    CHECK(read_image(render("aces", "aces.png")).bytes == apply_tone_map(film, map).bytes);
    map.tone_operator = ToneOperator::linear;
    map.key = 2.0f;
    CHECK(read_image(render("srgb", "srgb.png")).bytes == apply_tone_map(film, map).bytes);
    CHECK_FALSE(fs::exists(folder.path() / "agx_aces.png"));
    const ProcessResult refused = run_castor({"render", scene, "--tone", "Reinhard"});
    CHECK_RESULT(refused, 2,
                 "there is no tone map \"Reinhard\"; there are agx, aces, filmic, photographic, srgb, linear");
    const std::string help = run_castor({"render", "--help"}).out;
    for (const char* name : {"agx", "aces", "filmic", "photographic", "srgb", "linear"})
        CHECK(help.find(name, help.find("--tone TEXT")) < help.find("--exposure"));
}

TEST_CASE("castor merge writes the pictures of tone maps that castor render writes", "[cli][tone][merge]") {
    const TemporaryDirectory folder;
    const auto file = [&](const char* name) { return (folder.path() / name).string(); };
    const std::string scene = write_scene(folder.path(), "a.exr").string();
    castor({"render", scene, "-o", file("whole.exr"), "--quiet"});
    for (const char* part : {"1/2", "2/2"})
        castor({"render", scene, "--part", part, "--checkpoint", file(part[0] == '1' ? "one" : "two"), "--quiet"});
    const ProcessResult merged = castor({"merge", file("one"), file("two"), "-o", file("merged.exr"), "--json"});
    CHECK(Json::parse(merged.out)["tone_mapped"].size() == tone_maps().size());
    for (const char* end : {".exr", ".png", "_aces.png", "_aces-2.png", "_end.png"}) {
        CAPTURE(end);
        CHECK(text_of(file(("merged" + std::string(end)).c_str())) ==
              text_of(file(("whole" + std::string(end)).c_str())));
    }
}

}  // namespace castor::test

#endif
