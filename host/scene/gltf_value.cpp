#include "scene/gltf_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "castor/error.h"
#include "scene/gltf_document.h"

namespace castor {

void GltfValue::reject(std::string_view reason) const {
    throw SceneError(document_->file().string(), 0,
                     path_.empty() ? std::string(reason) : fmt::format("{}: {}", path_, reason));
}

void GltfValue::reject_kind(std::string_view expected) const {
    constexpr std::size_t kLongest = 60;
    std::string found = dump();
    if (found.size() > kLongest) found = found.substr(0, kLongest) + "...";
    reject(fmt::format("{} where {} was expected", found, expected));
}

void GltfValue::require_object() const {
    if (!json_->is_object()) reject_kind("an object");
}

std::optional<GltfValue> GltfValue::find(const char* key) const {
    require_object();
    if (read_members_) read_members_->emplace(key);
    const auto found = json_->find(key);
    if (found == json_->end()) return std::nullopt;
    return GltfValue(*document_, *found, path_.empty() ? key : fmt::format("{}.{}", path_, key));
}

GltfValue GltfValue::require(const char* key) const {
    if (auto found = find(key)) return std::move(*found);
    reject(fmt::format("has no member \"{}\"", key));
}

std::optional<GltfValue> GltfValue::find_extension(const char* name) const {
    const auto extensions = find("extensions");
    return extensions ? extensions->find(name) : std::nullopt;
}

std::vector<std::string> GltfValue::unread_members() const {
    std::vector<std::string> names;
    for_each_member([&](const std::string& key, const GltfValue&) {
        if (!read_members_ || !read_members_->contains(key)) names.push_back(key);
    });
    return names;
}

std::size_t GltfValue::size() const {
    if (!json_->is_array()) reject_kind("an array");
    return json_->size();
}

GltfValue GltfValue::at(std::size_t i) const {
    return GltfValue(*document_, json_->at(i), fmt::format("{}[{}]", path_, i));
}

std::uint64_t GltfValue::whole(std::uint64_t most) const {
    std::uint64_t value = 0;
    if (json_->is_number_unsigned()) {
        value = json_->get<std::uint64_t>();
    } else {
        // Some exporters write 3 as 3.0.
        constexpr double kExact = 9007199254740992.0;
        const double number = json_->is_number_float() ? json_->get<double>() : -1.0;
        if (!(number >= 0.0 && number <= kExact && number == std::floor(number)))
            reject_kind("a whole number of at least 0");
        value = static_cast<std::uint64_t>(number);
    }
    if (value > most) reject(fmt::format("{} where at most {} was expected", value, most));
    return value;
}

float GltfValue::number() const {
    if (!json_->is_number()) reject_kind("a number");
    const float value = static_cast<float>(json_->get<double>());
    if (!std::isfinite(value)) reject_kind("a number that 32 bits hold");
    return value;
}

bool GltfValue::flag() const {
    if (!json_->is_boolean()) reject_kind("true or false");
    return json_->get<bool>();
}

const std::string& GltfValue::text() const {
    if (!json_->is_string()) reject_kind("a string");
    return json_->get_ref<const std::string&>();
}

std::size_t GltfValue::index_of(const char* array) const {
    const std::size_t count = document_->count(array);
    const std::uint64_t index = whole();
    if (index >= count) reject(fmt::format("{} is no index of {}, of which there are {}", index, array, count));
    return static_cast<std::size_t>(index);
}

std::uint64_t GltfValue::whole(const char* key, std::uint64_t otherwise, std::uint64_t most) const {
    const auto found = find(key);
    return found ? found->whole(most) : otherwise;
}

float GltfValue::number(const char* key, float otherwise) const {
    const auto found = find(key);
    return found ? found->number() : otherwise;
}

float GltfValue::number(float least, float most) const {
    const float value = number();
    if (value >= least && value <= most) return value;
    if (document_->is_limited(path_)) return std::clamp(value, least, most);
    reject(std::isinf(most) ? fmt::format("{} where at least {} was expected", value, least)
                            : fmt::format("{} where {} to {} was expected", value, least, most));
}

float GltfValue::number(const char* key, float otherwise, float least, float most) const {
    const auto found = find(key);
    return found ? found->number(least, most) : otherwise;
}

bool GltfValue::flag(const char* key, bool otherwise) const {
    const auto found = find(key);
    return found ? found->flag() : otherwise;
}

std::string GltfValue::text(const char* key, std::string_view otherwise) const {
    const auto found = find(key);
    return found ? found->text() : std::string(otherwise);
}

std::string GltfValue::name() const {
    const auto found = find("name");
    return found && found->json_->is_string() ? found->text() : std::string();
}

void GltfValue::read_numbers(float* numbers, std::size_t count, float least) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (size() != count) reject(fmt::format("{} numbers where {} were expected", size(), count));
    for (std::size_t i = 0; i < count; ++i) numbers[i] = at(i).number(least, kInfinity);
}

void GltfValue::read_shares(float* shares, std::size_t count) const {
    read_numbers(shares, count, std::numeric_limits<float>::lowest());
    for (std::size_t i = 0; i < count; ++i) {
        const bool is_share = shares[i] >= 0.0f && shares[i] <= kGltfRoundedOne;
        if (!is_share && !document_->is_limited(at(i).path()))
            at(i).reject(fmt::format("{} where 0 to 1 was expected", shares[i]));
        shares[i] = std::clamp(shares[i], 0.0f, 1.0f);
    }
}

}  // namespace castor
