#include "scene/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "castor/error.h"
#include "image/decode.h"
#include "scene/gltf_draco.h"
#include "scene/gltf_meshopt.h"
#include "scene/gltf_uri.h"

namespace castor {

namespace {

constexpr int kDeepest = 100;
constexpr std::string_view kMagic = "glTF";
constexpr char kMeshopt[] = "EXT_meshopt_compression";
constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

std::uint32_t word_at(std::string_view bytes, std::size_t i) {
    std::array<unsigned char, 4> b{};
    std::memcpy(b.data(), bytes.data() + i, b.size());
    return b[0] | b[1] << 8 | b[2] << 16 | static_cast<std::uint32_t>(b[3]) << 24;
}

/// What is read of a file, beside what core glTF has.
constexpr std::array kKnownExtensions = {
    "EXT_mesh_gpu_instancing",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_roughness",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_scatter",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
};

/// Whether an extension is read, if need be by a library that this build has.
bool is_known(std::string_view name) {
    if (name == kMeshopt) return decodes_meshopt();
    if (name == "KHR_draco_mesh_compression") return decodes_draco();
    if (name == "EXT_texture_webp") return decodes_webp();
    return std::find(kKnownExtensions.begin(), kKnownExtensions.end(), name) != kKnownExtensions.end();
}

/// Returns the text of the library's "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error".
std::string reason_of(const nlohmann::json::exception& error) {
    const std::string_view text = error.what();
    return std::string(text.starts_with("[") ? text.substr(text.find("] ") + 2) : text);
}

}  // namespace

GltfDocument::GltfDocument(const std::filesystem::path& file) : file_(file), mapped_(file) {
    const std::string_view bytes = mapped_.bytes();
    byte_count_ = bytes.size();
    if (bytes.starts_with(kMagic))
        parse_glb(bytes);
    else
        parse_json(bytes, 0);
    check_header();
    buffers_.resize(count("buffers"));
}

void GltfDocument::parse_glb(std::string_view bytes) {
    const auto refuse = [&](const std::string& reason) { throw SceneError(file_.string(), 0, reason); };
    constexpr std::size_t kHeader = 12, kChunkHeader = 8;
    if (bytes.size() < kHeader + kChunkHeader)
        refuse(fmt::format("has {} bytes: a glb file has {} before its JSON", bytes.size(), kHeader + kChunkHeader));
    if (const std::uint32_t version = word_at(bytes, 4); version != 2)
        refuse(fmt::format("byte 4: is glTF {}, expected version 2", version));
    const std::uint64_t length = word_at(bytes, 8);
    if (length > bytes.size())
        refuse(fmt::format("byte 8: the file should have {} bytes, and ends after {}", length, bytes.size()));
    if (length < kHeader + kChunkHeader)
        refuse(fmt::format("byte 8: the file should have {} bytes, where at least {} were expected", length,
                           kHeader + kChunkHeader));
    bytes = bytes.substr(0, length);
    bool has_json = false;
    for (std::size_t at = kHeader; at < bytes.size();) {
        if (bytes.size() - at < kChunkHeader)
            refuse(fmt::format("byte {}: the file ends within the header of a chunk", at));
        const std::uint64_t size = word_at(bytes, at), left = bytes.size() - at - kChunkHeader;
        const std::uint32_t kind = word_at(bytes, at + 4);
        if (size > left)
            refuse(fmt::format("byte {}: a chunk of {} bytes begins, and {} follow in the file", at, size, left));
        const std::string_view chunk = bytes.substr(at + kChunkHeader, size);
        if (!has_json && kind != kJsonChunk)
            refuse(
                fmt::format("byte {}: the first chunk is of kind {:08x}, expected JSON, {:08x}", at, kind, kJsonChunk));
        if (!has_json)
            parse_json(chunk, at + kChunkHeader);
        else if (kind == kBinaryChunk && !glb_buffer_)
            glb_buffer_ = chunk;
        has_json = true;
        at += kChunkHeader + size;
        at = std::min(bytes.size(), (at + 3) / 4 * 4);
    }
}

void GltfDocument::parse_json(std::string_view text, std::size_t first_byte) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    const auto limit_depth = [&](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
        if (depth > kDeepest)
            throw SceneError(file_.string(), 0, fmt::format("its JSON is nested more than {} deep", kDeepest));
        return true;
    };
    try {
        json_ = nlohmann::json::parse(text.begin(), text.end(), limit_depth);
    } catch (const nlohmann::json::parse_error& error) {
        throw SceneError(file_.string(), 0, fmt::format("byte {}: {}", first_byte + error.byte, reason_of(error)));
    } catch (const nlohmann::json::exception& error) {  // a number that is too large
        throw SceneError(file_.string(), 0, fmt::format("its JSON: {}", reason_of(error)));
    }
    if (!json_.is_object()) throw SceneError(file_.string(), 0, "its JSON is no object");
}

void GltfDocument::check_header() {
    const GltfValue asset = root().require("asset");
    const auto refuse_version = [&](const GltfValue& version) {
        version.reject(fmt::format("\"{}\" where 2.0 was expected", version.text().substr(0, 20)));
    };
    const GltfValue version = asset.require("version");
    if (!version.text().starts_with("2.")) refuse_version(version);
    if (const auto least = asset.find("minVersion"); least && least->text() != "2.0") refuse_version(*least);
    std::set<std::string> required;
    if (const auto list = root().find("extensionsRequired"))
        for (std::size_t i = 0; i < list->size(); ++i) {
            const std::string& name = list->at(i).text();
            required.insert(name);
            if (!is_known(name)) list->at(i).reject(fmt::format("the file requires \"{}\", which is not read", name));
        }
    if (const auto list = root().find("extensionsUsed"))
        for (std::size_t i = 0; i < list->size(); ++i) {
            const std::string& name = list->at(i).text();
            if (!is_known(name) && required.count(name) == 0) {
                warn(fmt::format("the extension \"{}\" is not read", name));
                unread_extensions_.insert(name);
            }
        }
}

std::size_t GltfDocument::count(const char* array) const {
    const auto found = root().find(array);
    return found ? found->size() : 0;
}

GltfValue GltfDocument::element(const char* array, std::size_t i) const {
    return root().require(array).at(i);
}

bool GltfDocument::set(const std::string& pointer, std::optional<nlohmann::json> value) {
    using nlohmann::json;
    if (!pointer.starts_with('/') || std::ranges::count(pointer, '/') > kDeepest) return false;
    try {
        json::json_pointer at(pointer);
        for (; value && !json_.contains(at.parent_pointer()); at.pop_back())
            value = json::object({{at.back(), std::move(*value)}});
        json& parent = json_.at(at.parent_pointer());
        if (!parent.is_object() && !json_.contains(at)) return false;
        if (value)
            json_[at] = std::move(*value);
        else if (parent.is_object())
            parent.erase(at.back());
        return true;
    } catch (const json::exception&) {  // no JSON pointer, or no number where an element's is expected
        return false;
    }
}

bool GltfDocument::is_limited(std::string path) const {
    if (limited_.empty()) return false;
    std::erase(path, ']');
    std::ranges::replace_if(
        path, [](char c) { return c == '.' || c == '['; }, '/');
    path.insert(0, 1, '/');
    return limited_.contains(path) || limited_.contains(path.substr(0, path.rfind('/')));
}

std::string_view GltfDocument::resource(const GltfValue& value) {
    const std::string& uri = value.text();
    if (is_data_uri(uri)) {
        if (uri.find(',') == uri.npos) value.reject("a data URI without a comma");
        auto decoded = data_of_uri(uri);
        if (!decoded) value.reject("the data of its data URI are broken");
        return decoded_.emplace_back(std::move(*decoded));
    }
    const std::string shown = uri.substr(0, 100);
    const auto path = percent_decoded(uri);
    if (!path) value.reject(fmt::format("the URI \"{}\" has a broken %", shown));
    if (path->find('\0') != path->npos) value.reject(fmt::format("the URI \"{}\" has a byte 0", shown));
    if (path->find("://") != path->npos)
        value.reject(fmt::format("the URI \"{}\" is not of a file, and nothing is fetched", shown));
    if (path->empty()) value.reject("an empty URI");
    if (path->find('\\') != path->npos)
        value.reject(fmt::format("the URI \"{}\" has a backslash where / was expected", shown));
    const auto file = path_in_folder(file_.parent_path(), *path);
    if (!file) value.reject(fmt::format("the URI \"{}\" leads out of the file's folder", shown));
    std::unique_ptr<MappedFile>& mapped = files_[*path];
    if (!mapped) {
        try {
            mapped = std::make_unique<MappedFile>(*file);
        } catch (const SceneError& error) {
            files_.erase(*path);
            value.reject(fmt::format("{}: {}", error.file(), error.reason()));
        }
        byte_count_ += mapped->bytes().size();
    }
    return mapped->bytes();
}

std::string_view GltfDocument::buffer(std::size_t i) {
    if (buffers_[i]) return *buffers_[i];
    const GltfValue value = element("buffers", i);
    const std::uint64_t length = value.require("byteLength").whole();
    std::string_view bytes;
    if (const auto uri = value.find("uri"))
        bytes = resource(*uri);
    else if (i == 0 && glb_buffer_)
        bytes = *glb_buffer_;
    else
        value.reject("has no URI, and is not the one that a glb file holds");
    if (length > bytes.size())
        value.reject(fmt::format("byteLength is {}, but there are {} bytes", length, bytes.size()));
    buffers_[i] = bytes.substr(0, length);
    return *buffers_[i];
}

std::string_view GltfDocument::buffer_view(std::size_t i) {
    if (const auto decoded = decoded_views_.find(i); decoded != decoded_views_.end()) return decoded->second;
    const GltfValue value = element("bufferViews", i);
    const auto slice = [&](const GltfValue& of) {
        const std::string_view bytes = buffer(of.require("buffer").index_of("buffers"));
        const std::uint64_t offset = of.whole("byteOffset", 0), length = of.require("byteLength").whole();
        if (offset > bytes.size() || length > bytes.size() - offset)
            of.reject(fmt::format("bytes {} to {} of a buffer of {}", offset,
                                  length > UINT64_MAX - offset ? UINT64_MAX : offset + length, bytes.size()));
        return bytes.substr(offset, length);
    };
    const auto compressed = value.find_extension(kMeshopt);
    if (!compressed || !decodes_meshopt()) return slice(value);
    std::string& decoded = decoded_views_[i];
    decoded = decode_meshopt(*compressed, slice(*compressed));
    byte_count_ += decoded.size();
    if (decoded.size() < value.require("byteLength").whole())
        value.reject(fmt::format("byteLength is {}, but the compressed data make {} bytes",
                                 value.require("byteLength").whole(), decoded.size()));
    return decoded;
}

void GltfDocument::warn(const std::string& text) {
    warn_at("", text);
}

void GltfDocument::warn_at(const std::string& path, const std::string& text) {
    const auto [known, is_new] = note_of_text_.emplace(text, notes_.size());
    if (is_new) notes_.push_back({path, text, {}});
    notes_[known->second].paths.insert(path);
}

void GltfDocument::warn_above_one(const GltfValue& owner, const char* key) {
    const auto list = owner.find(key);
    if (!list) return;
    for (std::size_t i = 0; i < list->size(); ++i)
        if (list->at(i).number() > kGltfRoundedOne)
            return warn_at(list->path(), "has numbers above 1, which glTF does not allow, and is used as it is");
}

void GltfDocument::warn_of_unread_members(const GltfValue& value) {
    // Paths find for themselves where light does not get to, and rays end nowhere but at surfaces.
    constexpr std::array kPassedOver = {"name", "extras", "occlusionTexture", "znear", "zfar"};
    constexpr std::size_t kMostNamed = 3, kLongest = 40;
    if (const auto extensions = value.find("extensions"))
        extensions->for_each_member([&](const std::string& name, const GltfValue&) {
            if (!is_known(name) && !unread_extensions_.contains(name))
                warn_at(value.path(),
                        fmt::format("has the extension \"{}\", which is not read", name.substr(0, kLongest)));
        });
    std::vector<std::string> unread;
    for (const std::string& name : value.unread_members())
        if (std::ranges::find(kPassedOver, name) == kPassedOver.end())
            unread.push_back(fmt::format("\"{}\"", name.substr(0, kLongest)));
    if (unread.empty()) return;
    const std::size_t named = std::min(unread.size(), kMostNamed);
    std::string names = fmt::format("{}", fmt::join(unread.begin(), unread.begin() + named, ", "));
    if (named < unread.size()) names += fmt::format(" and {} more", unread.size() - named);
    warn_at(value.path(), fmt::format("has members that are not read: {}", names));
}

std::vector<Warning> GltfDocument::take_warnings() {
    std::vector<Warning> warnings;
    note_of_text_.clear();
    for (const Note& note : std::exchange(notes_, {})) {
        std::string text = note.path.empty() ? note.text : note.path + ": " + note.text;
        if (note.paths.size() > 1) text += fmt::format(" (and so for {} more)", note.paths.size() - 1);
        warnings.push_back({file_.string(), 0, text});
    }
    return warnings;
}

}  // namespace castor
