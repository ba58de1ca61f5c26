#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/mapped_file.h"
#include "castor/scene.h"
#include "scene/gltf_value.h"

namespace castor {

/// A glTF 2.0 file, `.gltf` or `.glb`: its JSON, and the bytes of its buffers, whose sizes are checked. Files that it
/// names are read where they are asked for, and must lie in its own folder.
class GltfDocument {
public:
    /// Throws SceneError.
    explicit GltfDocument(const std::filesystem::path& file);
    GltfDocument(const GltfDocument&) = delete;
    GltfDocument& operator=(const GltfDocument&) = delete;

    const std::filesystem::path& file() const { return file_; }
    GltfValue root() const { return GltfValue(*this, json_, ""); }
    /// The number of elements of an array of the root; 0 without it.
    std::size_t count(const char* array) const;
    GltfValue element(const char* array, std::size_t i) const;

    /// Sets what a JSON pointer (RFC 6901) names, and makes objects on the way where there are none; nullopt removes
    /// the member of an object. Returns false, and changes nothing, if an array has no such element, or what has
    /// members or elements is expected where something else is. GltfValues of what is replaced must not be used any
    /// more.
    bool set(const std::string& pointer, std::optional<nlohmann::json> value);
    /// Where numbers at or in what a JSON pointer names go beyond what is allowed there, readers take the nearest that
    /// is allowed: splines overshoot the keyframes between which they lie.
    void limit(const std::string& pointer) { limited_.insert(pointer); }
    /// Whether this holds for the value with this path.
    bool is_limited(std::string path) const;

    /// Returns the bytes of a buffer view, which are within its buffer.
    std::string_view buffer_view(std::size_t i);
    /// Returns the bytes that an `uri` names: those of a data URI, or of a file of this folder. They live as long as
    /// this document.
    std::string_view resource(const GltfValue& uri);

    /// The file's own bytes and those of all resources that have been read.
    std::uint64_t byte_count() const { return byte_count_; }

    /// Warns, once for each text.
    void warn(const std::string& text);
    /// Warns of something that may be so in many places: the first is named, the others are counted.
    void warn_at(const std::string& path, const std::string& text);
    /// Warns if the member `key`, a list of numbers that glTF limits to 1 and that is used as it is, has larger ones.
    void warn_above_one(const GltfValue& owner, const char* key);
    /// Warns of members for which an object has not been asked since it remembers that: misspelt ones, or those of
    /// another version of an extension. Also of its extensions that are not read, if extensionsUsed does not list them.
    void warn_of_unread_members(const GltfValue& value);
    std::vector<Warning> take_warnings();

private:
    void parse_glb(std::string_view bytes);
    void parse_json(std::string_view text, std::size_t first_byte);
    void check_header();
    std::string_view buffer(std::size_t i);

    std::filesystem::path file_;
    MappedFile mapped_;
    nlohmann::json json_;
    std::optional<std::string_view> glb_buffer_;
    std::vector<std::optional<std::string_view>> buffers_;
    std::map<std::size_t, std::string> decoded_views_;  // of EXT_meshopt_compression
    std::map<std::string, std::unique_ptr<MappedFile>> files_;
    std::deque<std::string> decoded_;          // of data URIs
    std::set<std::string> limited_;            // JSON pointers
    std::set<std::string> unread_extensions_;  // of which a warning tells that the file uses them
    std::uint64_t byte_count_ = 0;
    struct Note {
        std::string path;  // of the first place
        std::string text;
        std::set<std::string> paths;
    };
    std::vector<Note> notes_;
    std::map<std::string, std::size_t> note_of_text_;
};

}  // namespace castor
