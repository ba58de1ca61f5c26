// Scenes in JSON: what the notation itself can hold. That elements mean the same as in XML is in
// scene_elements_test.cpp.
#include <string>
#include <vector>

#include "castor/error.h"
#include "castor/scene_io.h"
#include "scene/json_to_xml.h"
#include "scene/xml_reader.h"
#include "support/catch.h"
#include "support/scene_twins.h"
#include "support/temporary_directory.h"
#include "test_paths.h"

namespace castor {

namespace {

const std::string kScene = R"({
  "Scene": {
    "BackgroundColor": "1 2 3",
    "MaxRecursionDepth": "4",
    "Cameras": {
      "Camera": {
        "_id": "1",
        "Position": "0 0 5",
        "Gaze": "0 0 -1",
        "Up": "0 1 0",
        "NearPlane": "-1 1 -1 1",
        "NearDistance": "1",
        "ImageResolution": "4 4",
        "ImageName": "a & b <c>.png"
      }
    },
    "Lights": {
      "AmbientLight": "1 1 1",
      "PointLight": [
        {
          "_id": "1",
          "Position": "0 1 0",
          "Intensity": "9 9 9"
        },
        {
          "_id": "2",
          "Position": "0 2 0",
          "Intensity": "9 9 9"
        }
      ]
    },
    "Materials": {
      "Material": {
        "_id": "1",
        "_type": "mirror"
      }
    },
    "VertexData": {
      "_data": "0 0 0\n1 0 0\n0 1 0",
      "_type": "xyz"
    },
    "Objects": {
      "Mesh": {
        "_id": "1",
        "Material": "1",
        "Faces": {
          "_data": "1 2 3",
          "_type": "triangle"
        }
      }
    }
  }
})";

std::string with(const std::string& from, const std::string& to) {
    std::string text = kScene;
    const std::size_t place = text.find(from);
    REQUIRE(place != text.npos);
    return text.replace(place, from.size(), to);
}

Scene read(const std::string& text) {
    const test::TemporaryDirectory folder;
    return read_xml_scene(folder.write("scene.json", text));
}

struct Refusal {
    std::size_t line = 0;
    std::string reason = "none";
};

Refusal refusal(const std::string& text) {
    try {
        read(text);
    } catch (const SceneError& error) {
        return {error.line(), error.reason()};
    }
    return {};
}

}  // namespace

TEST_CASE("a JSON scene is read", "[json]") {
    const Scene scene = read(kScene);
    CHECK(scene.warnings.empty());
    CHECK(scene.background == glm::vec3(1, 2, 3));
    CHECK(scene.max_recursion_depth == 4);
    CHECK(scene.cameras.at(0).image_name == "a & b <c>.png");
    CHECK(scene.cameras.at(0).line == 6);
    REQUIRE(scene.lights.size() == 2);
    CHECK(scene.lights[1].line == 25);
    CHECK(scene.materials.at(0).kind == MaterialKind::mirror);
    CHECK(scene.meshes.at(0).positions.size() == 3);
    CHECK(scene.meshes.at(0).line == 43);
}

TEST_CASE("the bundled scene in JSON is the one in XML", "[json]") {
    const std::filesystem::path scenes = CASTOR_SOURCE_DIR "/scenes";
    CHECK(test::describe(load_scene(scenes / "spheres.json")) == test::describe(load_scene(scenes / "spheres.xml")));
}

TEST_CASE("values may be numbers, true, false, null and lists of numbers", "[json]") {
    const std::string expected = test::describe(read(kScene));
    CHECK(test::describe(read(with("\"MaxRecursionDepth\": \"4\"", "\"MaxRecursionDepth\": 4"))) == expected);
    CHECK(test::describe(read(with("\"BackgroundColor\": \"1 2 3\"", "\"BackgroundColor\": [1, 2.0, 3e0]"))) ==
          expected);
    CHECK(test::describe(read(with("\"_data\": \"1 2 3\"", "\"_data\": [1,\n2,\n3]"))) == expected);
    CHECK(test::describe(read(with("\"_id\": \"1\",\n        \"_type\"", "\"_id\": 1,\n        \"_type\""))) ==
          expected);
    CHECK(test::describe(read(with("\"_type\": \"mirror\"", "\"_type\": \"mirror\", \"_degamma\": false"))) ==
          expected);
    CHECK(test::describe(read(with("\"Lights\": {", "\"Textures\": null, \"Lights\": {"))) == expected);
    CHECK(test::describe(read("\xef\xbb\xbf" + kScene)) == expected);
}

TEST_CASE("numbers keep every digit of their text", "[json]") {
    const Scene scene = read(with("\"1 2 3\"", "[0.1, 16777217, 1e-3]"));
    CHECK(scene.background == glm::vec3(0.1f, 16777217.0f, 1e-3f));
}

TEST_CASE("a JSON scene is known by its name and by its content", "[json]") {
    const test::TemporaryDirectory folder;
    CHECK(load_scene(folder.write("a.json", kScene)).meshes.size() == 1);
    CHECK(load_scene(folder.write("a.JSON", kScene)).meshes.size() == 1);
    CHECK(load_scene(folder.write("a.scene", "\n  " + kScene)).meshes.size() == 1);
    CHECK(load_scene(folder.write("a.xml", kScene)).meshes.size() == 1);
}

TEST_CASE("what a JSON scene says beside the scene is ignored with a warning", "[json]") {
    const std::vector<Warning> warnings =
        read(with("{\n  \"Scene\"", "{\n  \"_comment\": \"mine\", \"Author\": {},\n  \"Scene\"")).warnings;
    REQUIRE(warnings.size() == 2);
    CHECK(warnings[0].text == "<Author> outside <Scene> is ignored");
    CHECK(warnings[1].text == "<_comment> outside <Scene> is ignored");
    CHECK(warnings[0].line == 2);
}

TEST_CASE("a wrong JSON scene is refused with its line and what is wrong", "[json]") {
    struct Case {
        std::string text;
        std::size_t line;
        std::string reason;
    };
    std::string objects, arrays;
    for (int i = 0; i < 1'000'000; ++i) {
        objects += "{\"Scene\":";
        arrays += '[';
    }
    const std::vector<Case> cases{
        // The notation.
        {"{", 1, "the file ends too early"},
        {kScene.substr(0, kScene.find("\"Lights\"") + 3), 17, "the file ends too early"},
        {kScene.substr(0, kScene.size() - 1), 52, "the file ends too early"},
        {kScene + "}", 53, "is not well-formed JSON"},
        {with("\"4\",", "\"4\""), 5, "is not well-formed JSON"},
        {with("\"4\"", "NaN"), 4, "is not well-formed JSON"},
        {with("\"4\"", "'4'"), 4, "is not well-formed JSON"},
        {with("\"4\"", "1e999"), 4, "is not well-formed JSON: number overflow"},
        {with("\"4\"", "\"\xff\""), 4, "ill-formed UTF-8"},
        {with("\"4\"", "\"4\n\""), 4, "is not well-formed JSON"},
        {with("\"4\"", "\"4\\u0000\""), 4, "a string has a zero byte"},
        {std::string("{\0}", 3), 1, "byte 1 is zero: this is neither XML nor JSON in UTF-8"},
        {objects, 1, "objects are nested more than 100 deep"},
        {arrays, 1, "begins with an array"},
        {"{\"Scene\":" + arrays, 1, "\"Scene\" holds an array in an array"},
        {"[]", 1, "begins with an array: an object with the key \"Scene\" was expected"},
        {"{}", 1, "has no key \"Scene\""},
        {"\n{\n\"asset\": {}}", 1, "has no key \"Scene\""},
        // The tree.
        {with("\"MaxRecursionDepth\"", "\"BackgroundColor\""), 4,
         "the key \"BackgroundColor\" is in its object twice, before in line 3"},
        {with("\"MaxRecursionDepth\"", "\"Max Depth\""), 4, "the key \"Max Depth\" is not the name of an element"},
        {with("\"MaxRecursionDepth\"", "\"\""), 4, "the key \"\" is not the name of an element"},
        {with("\"_id\": \"1\"", "\"_\": \"1\""), 7, "the key \"_\" is not the name of an element"},
        {with("\"_id\": \"1\"", "\"_id\": {}"), 7, "\"_id\" holds an object: a string was expected"},
        {with("\"_id\": \"1\"", "\"_id\": [1]"), 7, "\"_id\" holds an array: a string was expected"},
        // Values.
        {with("\"4\"", "\"NaN\""), 4, "<MaxRecursionDepth> holds 'NaN': an integer was expected"},
        {with("\"4\"", "4.5"), 4, "<MaxRecursionDepth> holds '4.5': an integer was expected"},
        {with("\"4\"", "null"), 4, "<MaxRecursionDepth> holds 0 numbers"},
        {with("\"4\"", "true"), 4, "<MaxRecursionDepth> holds 'true'"},
        {with("\"0 0 5\"", "[0, 0]"), 8, "<Position> holds 2 numbers: 3 were expected"},
        {with("\"0 2 0\"", "\"0 2 x\""), 27, "<Position> holds 'x': a finite number was expected"},
        {with("\"_type\": \"mirror\"", "\"_type\": \"shiny\""), 35, "type=\"shiny\" of <Material> is not known"},
        {with("\"_id\": \"1\",\n        \"_type\"", "\"_id\": null,\n        \"_type\""), 34,
         "an integer was expected"},
        {with("\"_data\": \"1 2 3\"", "\"_data\": \"1 2 4\""), 47, "the vertex 4 does not exist"},
        {with("\"_data\": \"1 2 3\"", "\"_data\": \"1 &lt; 4\""), 47, "<Faces> holds '&lt;'"},
        {with("\"_data\": \"1 2 3\"", "\"_data\": \"1 <a> 4\""), 47, "<Faces> holds '<a>'"},
    };
    for (const Case& one : cases) {
        CAPTURE(one.text.substr(0, 2000), one.reason);
        const Refusal found = refusal(one.text);
        CHECK(found.line == one.line);
        CHECK_THAT(found.reason, Catch::Contains(one.reason));
    }
}

TEST_CASE("a JSON scene cut short anywhere is refused", "[json]") {
    for (std::size_t size = 1; size < kScene.size(); size += 3) {
        CAPTURE(size);
        CHECK(refusal(kScene.substr(0, size)).reason == "the file ends too early");
    }
}

TEST_CASE("places of JSON are those of the XML that it becomes", "[json]") {
    const XmlFromJson xml = json_to_xml("{\"Scene\":\n{\"A\": [\n{\"_id\":\n\"1\", \"_data\":\n\"<&>\"},\"2\"]}}", "f");
    CHECK(xml.text == "<Scene><A id=\"1\">&lt;&amp;&gt;</A><A>2</A></Scene>");
    const auto line_of = [&](const std::string& part) {
        const std::size_t offset = xml.text.find(part);
        std::size_t line = 0;
        for (const XmlFromJson::Place& place : xml.places)
            if (place.offset <= offset) line = place.line;
        return line;
    };
    CHECK(line_of("<Scene>") == 2);
    CHECK(line_of("<A id") == 3);
    CHECK(line_of("id=") == 4);
    CHECK(line_of("&lt;") == 5);
    CHECK(line_of("<A>2") == 5);
}

}  // namespace castor
