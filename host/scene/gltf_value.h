#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace castor {

class GltfDocument;

/// The most that is taken as 1: exporters round.
inline constexpr float kGltfRoundedOne = 1.001f;

/// A value of a glTF file's JSON, with the path by which messages name it, such as `accessors[3].byteOffset`. Every
/// function that is asked for what the value is not throws SceneError with the path, what was found and what was
/// expected. A value must not outlive its document.
class GltfValue {
public:
    GltfValue(const GltfDocument& document, const nlohmann::json& json, std::string path)
        : document_(&document), json_(&json), path_(std::move(path)) {}

    const GltfDocument& document() const { return *document_; }
    const std::string& path() const { return path_; }
    [[noreturn]] void reject(std::string_view reason) const;

    /// Returns a member of an object; nullopt if there is none. `require` throws then.
    std::optional<GltfValue> find(const char* key) const;
    GltfValue require(const char* key) const;
    /// Returns the extension of this name in the member `extensions`.
    std::optional<GltfValue> find_extension(const char* name) const;

    /// From here on this value and its copies remember together for which members they are asked.
    void remember_what_is_read() { read_members_ = std::make_shared<std::set<std::string, std::less<>>>(); }
    /// Returns the members of an object for which it was not asked since then.
    std::vector<std::string> unread_members() const;

    /// The elements of an array; of an object, its values.
    std::size_t size() const;
    GltfValue at(std::size_t i) const;
    /// Calls visit(key, value) for each member of an object.
    template <class Visit>
    void for_each_member(const Visit& visit) const {
        require_object();
        for (const auto& [key, value] : json_->items()) visit(key, GltfValue(*document_, value, path_ + "." + key));
    }

    std::uint64_t whole(std::uint64_t most = std::numeric_limits<std::uint64_t>::max()) const;
    float number() const;  // finite as a float
    bool flag() const;
    const std::string& text() const;
    /// Returns an index of the document's array of this name.
    std::size_t index_of(const char* array) const;

    // Members, or the default where there is none.
    std::uint64_t whole(const char* key, std::uint64_t otherwise, std::uint64_t most = kNoLimit) const;
    float number(const char* key, float otherwise) const;
    /// A number in [least, most].
    float number(const char* key, float otherwise, float least, float most) const;
    bool flag(const char* key, bool otherwise) const;
    std::string text(const char* key, std::string_view otherwise) const;
    /// The member `name`; empty if there is none. What is no text is passed over: nothing depends on names.
    std::string name() const;
    /// A list of so many numbers of at least `least`.
    template <std::size_t n>
    std::array<float, n> numbers(const char* key, std::array<float, n> otherwise,
                                 float least = std::numeric_limits<float>::lowest()) const {
        const auto found = find(key);
        if (found) found->read_numbers(otherwise.data(), n, least);
        return otherwise;
    }

    /// A list of so many numbers from 0 to 1. What is rounded to a little more is 1.
    template <std::size_t n>
    std::array<float, n> shares(const char* key, std::array<float, n> otherwise) const {
        const auto found = find(key);
        if (found) found->read_shares(otherwise.data(), n);
        return otherwise;
    }

    /// The value as it stands in the file, without white space: equal values have equal texts.
    std::string dump() const { return json_->dump(-1, ' ', true, nlohmann::json::error_handler_t::replace); }

private:
    static constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();
    void require_object() const;
    void read_numbers(float* numbers, std::size_t count, float least) const;
    void read_shares(float* shares, std::size_t count) const;
    /// Returns the value's number, which must be in [least, most], or is moved there: see GltfDocument::limit.
    float number(float least, float most) const;
    [[noreturn]] void reject_kind(std::string_view expected) const;

    const GltfDocument* document_;
    const nlohmann::json* json_;
    std::string path_;
    std::shared_ptr<std::set<std::string, std::less<>>> read_members_;
};

}  // namespace castor
