#include "support/compressed_gltf.h"

#include <stdexcept>

#include "support/picture_bytes.h"

#ifdef CASTOR_HAS_DRACO
#include <draco/compression/encode.h>
#endif
#ifdef CASTOR_HAS_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif
#ifdef CASTOR_HAS_WEBP
#include <webp/encode.h>
#endif

namespace castor::test {

Surface::Surface() {
    for (std::uint32_t i = 0; i < kEdge * kEdge; ++i) {
        const std::uint32_t x = i % kEdge, y = i / kEdge;
        const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
        positions.insert(positions.end(), {fx, fy, fx * fy / 4.0f});
        normals.insert(normals.end(), {0.0f, 0.0f, 1.0f});
        coordinates.insert(coordinates.end(), {fx / 4.0f, fy / 4.0f});
        colors.insert(colors.end(), {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y), 0, 255});
        if (x + 1 < kEdge && y + 1 < kEdge)
            indices.insert(indices.end(), {i, i + 1, i + kEdge, i + 1, i + kEdge + 1, i + kEdge});
    }
}

#ifdef CASTOR_HAS_DRACO

bool has_draco() {
    return true;
}

GltfBuilder draco_gltf(bool is_sequential, int further_attributes) {
    const Surface surface;
    draco::Mesh mesh;
    const auto count = static_cast<std::uint32_t>(surface.vertex_count());
    mesh.set_num_points(count);
    const auto add = [&](draco::GeometryAttribute::Type type, int components, draco::DataType data,
                         const auto& values) {
        draco::GeometryAttribute attribute;
        const auto n = static_cast<std::size_t>(components);
        const std::size_t stride = n * sizeof values[0];
        attribute.Init(type, nullptr, static_cast<std::uint8_t>(components), data, data == draco::DT_UINT8,
                       static_cast<std::int64_t>(stride), 0);
        const int number = mesh.AddAttribute(attribute, true, count);
        for (std::uint32_t i = 0; i < count; ++i)
            mesh.attribute(number)->SetAttributeValue(draco::AttributeValueIndex(i), &values[n * i]);
        return mesh.attribute(number)->unique_id();
    };
    nlohmann::json ids;
    ids["POSITION"] = add(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32, surface.positions);
    ids["NORMAL"] = add(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32, surface.normals);
    ids["TEXCOORD_0"] = add(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32, surface.coordinates);
    ids["COLOR_0"] = add(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8, surface.colors);
    for (int i = 0; i < further_attributes; ++i)
        add(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT8, surface.colors);
    for (std::size_t i = 0; i < surface.indices.size(); i += 3)
        mesh.AddFace({draco::PointIndex(surface.indices[i]), draco::PointIndex(surface.indices[i + 1]),
                      draco::PointIndex(surface.indices[i + 2])});
    draco::Encoder encoder;
    constexpr int kBits = 14;
    encoder.SetEncodingMethod(is_sequential ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
    for (const auto type :
         {draco::GeometryAttribute::POSITION, draco::GeometryAttribute::NORMAL, draco::GeometryAttribute::TEX_COORD})
        encoder.SetAttributeQuantization(type, kBits);
    draco::EncoderBuffer encoded;
    if (!encoder.EncodeMeshToBuffer(mesh, &encoded).ok()) throw std::runtime_error("Draco does not encode a surface");

    GltfBuilder builder = one_triangle();
    const std::size_t view = builder.view(std::vector<char>(encoded.data(), encoded.data() + encoded.size()));
    nlohmann::json attributes;
    const auto accessor = [&](const char* name, const char* type, int component) {
        attributes[name] = builder.json["accessors"].size();
        builder.json["accessors"].push_back({{"componentType", component}, {"count", count}, {"type", type}});
    };
    accessor("POSITION", "VEC3", 5126);
    accessor("NORMAL", "VEC3", 5126);
    accessor("TEXCOORD_0", "VEC2", 5126);
    accessor("COLOR_0", "VEC4", 5121);
    builder.json["accessors"].back()["normalized"] = true;
    const std::size_t indices = builder.json["accessors"].size();
    builder.json["accessors"].push_back(
        {{"componentType", 5123}, {"count", surface.indices.size()}, {"type", "SCALAR"}});
    nlohmann::json primitive = {{"attributes", attributes}, {"indices", indices}};
    primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view}, {"attributes", ids}};
    builder.json["meshes"][0]["primitives"] = {primitive};
    builder.json["extensionsUsed"] = builder.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    return builder;
}

#else

bool has_draco() {
    return false;
}

GltfBuilder draco_gltf(bool, int) {
    throw std::logic_error("this build has no Draco");
}

#endif

#ifdef CASTOR_HAS_MESHOPTIMIZER

namespace {

/// Appends compressed elements, and returns the number of the view that they become.
std::size_t meshopt_view(GltfBuilder& builder, const std::vector<unsigned char>& encoded, std::size_t count,
                         std::size_t stride, const char* mode, const char* filter = "NONE") {
    const std::size_t number = builder.view(encoded);
    nlohmann::json& view = builder.json["bufferViews"][number];
    const nlohmann::json compressed = {{"buffer", 0},
                                       {"byteOffset", view["byteOffset"]},
                                       {"byteLength", encoded.size()},
                                       {"byteStride", stride},
                                       {"count", count},
                                       {"mode", mode},
                                       {"filter", filter}};
    // The buffer of what is not compressed need not be there.
    builder.further_buffers = {{{"byteLength", 1 << 20}}};
    view = {{"buffer", 1}, {"byteLength", count * stride}};
    if (std::string(mode) == "ATTRIBUTES") view["byteStride"] = stride;
    view["extensions"]["EXT_meshopt_compression"] = compressed;
    return number;
}

template <class T>
std::size_t meshopt_accessor(GltfBuilder& builder, const std::vector<T>& values, std::size_t count, const char* type,
                             int component, bool is_normalized, const char* filter = "NONE") {
    const std::size_t stride = values.size() * sizeof(T) / count;
    std::vector<unsigned char> encoded(meshopt_encodeVertexBufferBound(count, stride));
    encoded.resize(meshopt_encodeVertexBuffer(encoded.data(), encoded.size(), values.data(), count, stride));
    nlohmann::json accessor = {{"componentType", component}, {"count", count}, {"type", type}};
    accessor["bufferView"] = meshopt_view(builder, encoded, count, stride, "ATTRIBUTES", filter);
    if (is_normalized) accessor["normalized"] = true;
    builder.json["accessors"].push_back(accessor);
    return builder.json["accessors"].size() - 1;
}

}  // namespace

bool has_meshopt() {
    return true;
}

GltfBuilder meshopt_gltf(bool has_index_sequence) {
    const Surface surface;
    const std::size_t count = surface.vertex_count();
    GltfBuilder builder = one_triangle();
    nlohmann::json attributes;
    std::vector<std::int16_t> positions;  // in quarters, each padded to 8 bytes
    std::vector<float> normals;
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            positions.push_back(static_cast<std::int16_t>(4.0f * surface.positions[3 * i + axis]));
        positions.push_back(0);
        for (std::size_t axis = 0; axis < 3; ++axis) normals.push_back(surface.normals[3 * i + axis]);
        normals.push_back(0.0f);
    }
    attributes["POSITION"] = meshopt_accessor(builder, positions, count, "VEC3", 5122, false);
    std::vector<std::int8_t> octahedral(4 * count);
    meshopt_encodeFilterOct(octahedral.data(), count, 4, 8, normals.data());
    attributes["NORMAL"] = meshopt_accessor(builder, octahedral, count, "VEC3", 5120, true, "OCTAHEDRAL");
    std::vector<std::uint32_t> exponential(2 * count);
    meshopt_encodeFilterExp(exponential.data(), count, 8, 15, surface.coordinates.data());
    attributes["TEXCOORD_0"] = meshopt_accessor(builder, exponential, count, "VEC2", 5126, false, "EXPONENTIAL");
    attributes["COLOR_0"] = meshopt_accessor(builder, surface.colors, count, "VEC4", 5121, true);

    const std::vector<unsigned int> indices(surface.indices.begin(), surface.indices.end());
    std::vector<unsigned char> encoded(has_index_sequence ? meshopt_encodeIndexSequenceBound(indices.size(), count)
                                                          : meshopt_encodeIndexBufferBound(indices.size(), count));
    const auto encode =
        has_index_sequence ? meshopt_encodeIndexSequence<unsigned int> : meshopt_encodeIndexBuffer<unsigned int>;
    encoded.resize(encode(encoded.data(), encoded.size(), indices.data(), indices.size()));
    builder.json["accessors"].push_back({{"bufferView", meshopt_view(builder, encoded, indices.size(), 2,
                                                                     has_index_sequence ? "INDICES" : "TRIANGLES")},
                                         {"componentType", 5123},
                                         {"count", indices.size()},
                                         {"type", "SCALAR"}});
    builder.json["meshes"][0]["primitives"] = {
        {{"attributes", attributes}, {"indices", builder.json["accessors"].size() - 1}}};

    const std::vector<float> turns{0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.6f, 0.8f};
    std::vector<std::int16_t> quaternions(turns.size());
    meshopt_encodeFilterQuat(quaternions.data(), 2, 8, 16, turns.data());
    nlohmann::json places;
    places["ROTATION"] = meshopt_accessor(builder, quaternions, 2, "VEC4", 5122, true, "QUATERNION");
    places["TRANSLATION"] = builder.vec3({0, 0, 0, 10, 0, 0});
    builder.json["nodes"][0]["scale"] = {0.25, 0.25, 0.25};
    builder.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = places;
    builder.json["extensionsUsed"] = builder.json["extensionsRequired"] = {
        "EXT_meshopt_compression", "EXT_mesh_gpu_instancing", "KHR_mesh_quantization"};
    return builder;
}

#else

bool has_meshopt() {
    return false;
}

GltfBuilder meshopt_gltf(bool) {
    throw std::logic_error("this build has no meshoptimizer");
}

#endif

#ifdef CASTOR_HAS_WEBP

bool has_webp() {
    return true;
}

std::string webp_bytes(std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& rgba) {
    std::uint8_t* encoded = nullptr;
    const std::size_t size = WebPEncodeLosslessRGBA(rgba.data(), static_cast<int>(width), static_cast<int>(height),
                                                    static_cast<int>(4 * width), &encoded);
    if (size == 0) throw std::runtime_error("libwebp does not encode a picture");
    std::string bytes(reinterpret_cast<const char*>(encoded), size);
    WebPFree(encoded);
    return bytes;
}

#else

bool has_webp() {
    return false;
}

std::string webp_bytes(std::uint32_t, std::uint32_t, const std::vector<std::uint8_t>&) {
    throw std::logic_error("this build has no libwebp");
}

#endif

GltfBuilder webp_gltf() {
    GltfBuilder builder = one_triangle();
    nlohmann::json& primitive = builder.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["TEXCOORD_0"] = builder.vec2({0, 0, 1, 0, 0, 1});
    primitive["material"] = 0;
    builder.texture(png_bytes(1, 1, 3, {1, 2, 3}));
    const std::string picture = webp_bytes(2, 1, {10, 20, 30, 255, 40, 50, 60, 128});
    const std::size_t view = builder.view(std::vector<char>(picture.begin(), picture.end()));
    builder.json["images"].push_back({{"bufferView", view}, {"mimeType", "image/webp"}});
    builder.json["textures"][0]["extensions"]["EXT_texture_webp"]["source"] = 1;
    builder.json["materials"] = {{{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", 0}}}}};
    builder.json["extensionsUsed"] = builder.json["extensionsRequired"] = {"EXT_texture_webp"};
    return builder;
}

std::vector<GltfBuilder> compressed_gltfs() {
    std::vector<GltfBuilder> files;
    for (const bool is_second : {false, true}) {
        if (has_draco()) files.push_back(draco_gltf(is_second));
        if (has_meshopt()) files.push_back(meshopt_gltf(is_second));
    }
    if (has_webp()) files.push_back(webp_gltf());
    return files;
}

}  // namespace castor::test
