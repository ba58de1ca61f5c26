// Decodes KHR_draco_mesh_compression with Draco. Only this file includes its headers. The library trusts some of what
// it reads: sizes that it would ask memory for are checked before it does, and everything that it makes afterwards.
#include "scene/gltf_draco.h"

#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <optional>
#include <utility>

#ifdef CASTOR_HAS_DRACO
#include <draco/compression/config/decoder_options.h>
#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>
#include <draco/mesh/mesh.h>
#endif

namespace castor {

#ifdef CASTOR_HAS_DRACO

namespace {

/// What stands before a mesh's data.
struct Header {
    bool is_sequential = false;
    std::string bytes;  // the data without metadata, of which nothing is needed
    std::uint32_t triangles = 0, vertices = 0;
};

/// Reads past the metadata: a tree of names and values, in the order in which Draco writes it.
bool skip_metadata(draco::DecoderBuffer& buffer) {
    const auto skip = [&](std::uint64_t size) {
        if (size > static_cast<std::uint64_t>(buffer.remaining_size())) return false;
        buffer.Advance(static_cast<std::int64_t>(size));
        return true;
    };
    const auto skip_name = [&] {
        std::uint8_t size = 0;
        return buffer.Decode(&size) && skip(size);
    };
    const auto skip_tree = [&] {
        bool is_root = true;
        for (std::uint64_t left = 1; left > 0; --left) {
            std::uint32_t entries = 0, children = 0;
            if (!std::exchange(is_root, false) && !skip_name()) return false;
            if (!draco::DecodeVarint(&entries, &buffer)) return false;
            for (std::uint32_t i = 0; i < entries; ++i) {
                std::uint32_t size = 0;
                if (!skip_name() || !draco::DecodeVarint(&size, &buffer) || !skip(size)) return false;
            }
            if (!draco::DecodeVarint(&children, &buffer)) return false;
            left += children;
        }
        return true;
    };
    std::uint32_t attributes = 0;
    if (!draco::DecodeVarint(&attributes, &buffer)) return false;
    for (std::uint32_t i = 0; i < attributes; ++i) {
        std::uint32_t id = 0;
        if (!draco::DecodeVarint(&id, &buffer) || !skip_tree()) return false;
    }
    return skip_tree();
}

Header read_header(const GltfValue& extension, std::string_view bytes) {
    // "DRACO", the version in two bytes, the kind of geometry, the method, and flags in two bytes.
    constexpr std::size_t kSize = 11, kKind = 7, kMethod = 8, kFlags = 9;
    constexpr char kMajor = 2, kMinor = 2, kMesh = 1, kSequential = 0, kEdgebreaker = 1;
    constexpr unsigned char kHasMetadata = 0x80;
    if (bytes.size() < kSize || !bytes.starts_with("DRACO")) extension.reject("its bytes do not begin as Draco's do");
    if (bytes[5] != kMajor || bytes[6] != kMinor)
        extension.reject(fmt::format("its bytes are of Draco's version {}.{}, expected 2.2",
                                     static_cast<unsigned char>(bytes[5]), static_cast<unsigned char>(bytes[6])));
    if (bytes[kKind] != kMesh || (bytes[kMethod] != kSequential && bytes[kMethod] != kEdgebreaker))
        extension.reject("its bytes are no mesh of Draco's");
    Header header;
    header.is_sequential = bytes[kMethod] == kSequential;
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data() + kSize, bytes.size() - kSize, DRACO_BITSTREAM_VERSION(kMajor, kMinor));
    if ((static_cast<unsigned char>(bytes[kFlags + 1]) & kHasMetadata) != 0 && !skip_metadata(buffer))
        extension.reject("its Draco data end within metadata");
    header.bytes = std::string(bytes.substr(0, kFlags)) + std::string(2, '\0') +
                   std::string(buffer.data_head(), static_cast<std::size_t>(buffer.remaining_size()));
    std::uint8_t traversal = 0;
    const bool has_counts =
        header.is_sequential
            ? draco::DecodeVarint(&header.triangles, &buffer) && draco::DecodeVarint(&header.vertices, &buffer)
            : buffer.Decode(&traversal) && draco::DecodeVarint(&header.vertices, &buffer) &&
                  draco::DecodeVarint(&header.triangles, &buffer);
    if (!has_counts) extension.reject("its Draco data end within their header");
    return header;
}

/// What a mesh may be made of, so that few bytes do not ask for much memory.
struct Limits {
    std::size_t vertices = 0;
    std::uint64_t bytes = 0;  // of all attributes
    std::string broken{};     // what was wrong
};

/// A decoder that looks at what was announced before it decodes attributes.
template <class Base>
class CheckedDecoder : public Base {
public:
    explicit CheckedDecoder(Limits& limits) : limits_(limits) {}

protected:
    bool DecodeAllAttributes() override {
        const draco::PointCloud& mesh = *this->point_cloud();
        if (mesh.num_points() != limits_.vertices) {
            limits_.broken = fmt::format("its Draco data have {} vertices, but POSITION has {} elements",
                                         mesh.num_points(), limits_.vertices);
            return false;
        }
        // Draco trusts some counts in the data of an attribute: a broken one may take a second.
        constexpr int kMostAttributes = 16;
        if (mesh.num_attributes() > kMostAttributes) {
            limits_.broken = fmt::format("its Draco data have {} attributes, expected at most {}",
                                         mesh.num_attributes(), kMostAttributes);
            return false;
        }
        std::uint64_t bytes = 0;
        for (int i = 0; i < mesh.num_attributes(); ++i) {
            const draco::PointAttribute& attribute = *mesh.attribute(i);
            constexpr int kMostComponents = 4;
            if (attribute.num_components() > kMostComponents) {
                limits_.broken = fmt::format("attribute {} of its Draco data has {} components, expected at most {}",
                                             attribute.unique_id(), attribute.num_components(), kMostComponents);
                return false;
            }
            bytes += static_cast<std::uint64_t>(attribute.byte_stride()) * mesh.num_points();
        }
        if (bytes > limits_.bytes) {
            limits_.broken =
                fmt::format("its Draco data would become {} bytes, expected at most {}", bytes, limits_.bytes);
            return false;
        }
        return Base::DecodeAllAttributes();
    }

private:
    Limits& limits_;
};

template <class Decoder>
void decode(const GltfValue& extension, const Header& header, Limits& limits, draco::Mesh& mesh) {
    draco::DecoderBuffer buffer;
    buffer.Init(header.bytes.data(), header.bytes.size());
    const draco::DecoderOptions options;
    std::string reason;
    try {
        CheckedDecoder<Decoder> decoder(limits);
        const draco::Status status = decoder.Decode(options, &buffer, &mesh);
        if (status.ok()) return;
        reason = limits.broken.empty() ? fmt::format("its Draco data are broken: {}", status.error_msg_string())
                                       : limits.broken;
    } catch (const std::exception& error) {
        reason = fmt::format("its Draco data cannot be decoded: {}", error.what());
    }
    extension.reject(reason);
}

DracoAttribute read_attribute(const GltfValue& name, const draco::Mesh& mesh) {
    const auto id = static_cast<std::uint32_t>(name.whole(0xffffffffu));
    const draco::PointAttribute* const from = mesh.GetAttributeByUniqueId(id);
    if (from == nullptr || from->buffer() == nullptr)
        name.reject(fmt::format("the Draco data have no attribute {}", id));
    DracoAttribute to;
    to.components = from->num_components();
    to.has_floats = from->data_type() == draco::DT_FLOAT32 || from->data_type() == draco::DT_FLOAT64;
    const std::size_t count = mesh.num_points();
    const auto stride = static_cast<std::uint64_t>(from->byte_stride());
    const std::uint64_t size = from->buffer()->data_size();
    const bool is_mapped = !from->is_mapping_identity();
    if ((is_mapped && from->indices_map_size() < count) || from->byte_offset() < 0)
        name.reject(fmt::format("attribute {} of the Draco data lacks values", id));
    draco::GeometryAttribute plain(*from);  // whole numbers as they are: the accessor says what they mean
    plain.set_normalized(false);
    to.values.resize(count * to.components);
    for (std::size_t i = 0; i < count; ++i) {
        const auto value = from->mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));
        const bool is_there =
            value.value() < from->size() &&
            static_cast<std::uint64_t>(from->byte_offset()) + stride * (std::uint64_t{value.value()} + 1) <= size;
        if (!is_there ||
            !plain.ConvertValue(value, static_cast<std::int8_t>(to.components), to.values.data() + i * to.components))
            name.reject(fmt::format("attribute {} of the Draco data has no value for vertex {}", id, i));
    }
    return to;
}

}  // namespace

bool decodes_draco() {
    return true;
}

std::uint64_t draco_triangle_count(const GltfValue& extension, std::string_view bytes) {
    return read_header(extension, bytes).triangles;
}

DracoMesh decode_draco(const GltfValue& extension, std::string_view bytes, std::size_t vertex_count) {
    const Header header = read_header(extension, bytes);
    if (header.vertices > vertex_count)
        extension.reject(fmt::format("its Draco data have {} vertices, but POSITION has {} elements", header.vertices,
                                     vertex_count));
    constexpr std::uint64_t kFew = 1 << 26, kMostOutOfAByte = 1024;
    Limits limits{vertex_count, kFew + kMostOutOfAByte * bytes.size()};
    draco::Mesh mesh;
    if (header.is_sequential)
        decode<draco::MeshSequentialDecoder>(extension, header, limits, mesh);
    else
        decode<draco::MeshEdgebreakerDecoder>(extension, header, limits, mesh);

    DracoMesh result;
    result.triangles.reserve(mesh.num_faces());
    for (std::uint32_t i = 0; i < mesh.num_faces(); ++i) {
        glm::uvec3 triangle;
        for (int corner = 0; corner < 3; ++corner) {
            triangle[corner] = mesh.face(draco::FaceIndex(i))[static_cast<std::size_t>(corner)].value();
            if (triangle[corner] >= vertex_count)
                extension.reject(fmt::format("triangle {} of its Draco data has vertex {}, but there are {}", i,
                                             triangle[corner], vertex_count));
        }
        result.triangles.push_back(triangle);
    }
    extension.require("attributes").for_each_member([&](const std::string& name, const GltfValue& id) {
        result.attributes.emplace(name, read_attribute(id, mesh));
    });
    return result;
}

#else

bool decodes_draco() {
    return false;
}

std::uint64_t draco_triangle_count(const GltfValue& extension, std::string_view) {
    extension.reject("is not read: this build has no Draco");
}

DracoMesh decode_draco(const GltfValue& extension, std::string_view, std::size_t) {
    extension.reject("is not read: this build has no Draco");
}

#endif

}  // namespace castor
