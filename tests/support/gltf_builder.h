#pragma once

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace castor::test {

inline std::string base64(std::string_view bytes) {
    static constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kLetters[bits >> (18 - 6 * k) & 63u] : '=';
    }
    return text;
}

/// Makes a glTF file: JSON that a test may change, and a buffer to which its accessors' elements are appended.
struct GltfBuilder {
    nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
    std::string bytes;
    nlohmann::json further_buffers = nlohmann::json::array();

    /// Appends values, from a multiple of four on, and returns the number of their buffer view.
    template <class T>
    std::size_t view(const std::vector<T>& values) {
        bytes.resize((bytes.size() + 3) / 4 * 4);
        nlohmann::json& views = json["bufferViews"];
        views.push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", values.size() * sizeof(T)}});
        if (!values.empty()) bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
        return views.size() - 1;
    }

    /// Appends elements and returns the number of their accessor.
    template <class T>
    std::size_t accessor(const std::vector<T>& values, const char* type, std::size_t components, int component_type) {
        const std::size_t number = view(values);
        nlohmann::json& accessors = json["accessors"];
        accessors.push_back({{"bufferView", number},
                             {"componentType", component_type},
                             {"count", values.size() / components},
                             {"type", type}});
        return accessors.size() - 1;
    }
    std::size_t scalars(const std::vector<float>& values) { return accessor(values, "SCALAR", 1, 5126); }
    std::size_t vec2(const std::vector<float>& values) { return accessor(values, "VEC2", 2, 5126); }
    std::size_t vec3(const std::vector<float>& values) { return accessor(values, "VEC3", 3, 5126); }
    std::size_t vec4(const std::vector<float>& values) { return accessor(values, "VEC4", 4, 5126); }
    std::size_t mat4(const std::vector<float>& values) { return accessor(values, "MAT4", 16, 5126); }
    std::size_t indices(const std::vector<std::uint16_t>& values) { return accessor(values, "SCALAR", 1, 5123); }

    /// Appends a picture of 8 bits and returns the number of its texture.
    std::size_t texture(const std::string& picture, const char* type = "image/png") {
        const std::size_t number = view(std::vector<char>(picture.begin(), picture.end()));
        json["images"].push_back({{"bufferView", number}, {"mimeType", type}});
        json["textures"].push_back({{"source", json["images"].size() - 1}});
        return json["textures"].size() - 1;
    }

    /// The file as .gltf, its buffer in a data URI.
    std::string gltf() {
        nlohmann::json complete = json;
        if (!bytes.empty())
            complete["buffers"] = {
                {{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}}};
        for (const nlohmann::json& buffer : further_buffers) complete["buffers"].push_back(buffer);
        return complete.dump();
    }

    /// The file as .glb.
    std::string glb() {
        nlohmann::json complete = json;
        complete["buffers"] = {{{"byteLength", bytes.size()}}};
        for (const nlohmann::json& buffer : further_buffers) complete["buffers"].push_back(buffer);
        std::string text = complete.dump(), binary = bytes;
        text.resize((text.size() + 3) / 4 * 4, ' ');
        binary.resize((binary.size() + 3) / 4 * 4);
        const auto word = [](std::size_t value) {
            const auto bits = static_cast<std::uint32_t>(value);
            std::string four(4, '\0');
            std::memcpy(four.data(), &bits, 4);
            return four;
        };
        return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text +
               word(binary.size()) + std::string("BIN\0", 4) + binary;
    }
};

/// A file of one node with one triangle, (0, 0, 0), (1, 0, 0), (0, 1, 0).
inline GltfBuilder one_triangle() {
    GltfBuilder builder;
    const std::size_t positions = builder.vec3({0, 0, 0, 1, 0, 0, 0, 1, 0});
    builder.json["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", positions}}}}}}}};
    builder.json["nodes"] = {{{"mesh", 0}}};
    builder.json["scenes"] = {{{"nodes", {0}}}};
    builder.json["scene"] = 0;
    return builder;
}

}  // namespace castor::test
