#include "trace/profile_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>

#include "atomic_file.h"
#include "checksum.h"
#include "user_folder.h"

namespace castor {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "castor device profile";
constexpr int kFormatVersion = 1;
constexpr std::size_t kMostBytes = 1 << 16;

/// Drivers may give names that are not UTF-8, which JSON has to be; what is not is replaced.
std::string utf8(const std::string& text) {
    return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

/// What a profile is measured for, beside the version of Castor.
Json identity_of(const Device& device) {
    return {{"name", utf8(device.name)},
            {"device_version", utf8(device.device_version)},
            {"driver_version", utf8(device.driver_version)},
            {"platform", utf8(device.platform_name)},
            {"platform_version", utf8(device.platform_version)}};
}

/// A file that cannot be used, and why.
struct Problem {
    std::string reason;
};

/// The value, for a message: short, whatever it is.
std::string shown(const Json& value) {
    constexpr std::size_t kMost = 60;
    if (value.is_structured()) return fmt::format("an {}", value.type_name());
    const std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
    return text.size() <= kMost ? text : text.substr(0, kMost) + "...";
}

const Json& member(const Json& object, const std::string& name) {
    const auto found = object.is_object() ? object.find(name) : object.end();
    if (found == object.end()) throw Problem{fmt::format("it has no \"{}\"", name)};
    return *found;
}

void expect(const Json& object, const std::string& name, const Json& expected) {
    const Json& found = member(object, name);
    if (found != expected)
        throw Problem{fmt::format("its {} is {}, here it is {}", name, shown(found), shown(expected))};
}

/// The one of `allowed` that stands in the file as `name`; `text_of` tells how.
template <class Value, class TextOf>
Value one_of(const Json& object, std::string_view name, const std::vector<Value>& allowed, const TextOf& text_of) {
    const Json& found = member(object, std::string(name));
    std::string known;
    for (const Value& value : allowed) {
        const Json text = text_of(value);
        if (found.type() == text.type() && found == text) return value;
        known += (known.empty() ? "" : ", ") + shown(text);
    }
    throw Problem{fmt::format("its {} is {}, here it may be {}", name, shown(found), known)};
}

Tuning tuning_of(const Json& document, const Device& device) {
    const Json& format = member(document, "format");
    if (format != kFormat) throw Problem{"it is no device profile"};
    expect(document, "version", kFormatVersion);
    expect(document, "castor_version", CASTOR_VERSION);
    const Json identity = identity_of(device);
    for (const auto& [name, value] : identity.items()) expect(member(document, "device"), name, value);

    const TuningSpace space = tuning_space(device);
    Tuning tuning;
    const Json& strategies = member(document, "strategies");
    for (const auto& [kind, name] : kRayKindsOfChoice)
        tuning.strategies.*kind =
            one_of(strategies, name, space.strategies, [](Strategy s) { return Json(to_string(s)); });
    for (const TuningNumber& number : space.numbers)
        tuning.*number.value =
            one_of(document, number.name, number.allowed, [](std::uint32_t value) { return Json(value); });
    return tuning;
}

std::string slug(std::string_view text) {
    constexpr std::size_t kMost = 80;
    std::string result;
    for (const unsigned char c : text.substr(0, kMost)) {
        if (std::isalnum(c) && c < 128)
            result += static_cast<char>(std::tolower(c));
        else if (!result.empty() && result.back() != '-')
            result += '-';
    }
    return result;
}

}  // namespace

fs::path profile_folder() {
    return user_folder("CASTOR_PROFILE_DIR", "XDG_STATE_HOME", ".local/state", "profiles");
}

fs::path profile_file(const Device& device) {
    const fs::path folder = profile_folder();
    if (folder.empty()) return {};
    const std::string names = device.platform_name + "\n" + device.name;
    return folder / fmt::format("{}-{:08x}.json", slug(device.name), checksum(names) >> 32);
}

StoredProfile parse_profile(std::string_view text, const Device& device) {
    try {
        return {tuning_of(Json::parse(text), device), ""};
    } catch (const Problem& problem) {
        return {std::nullopt, problem.reason};
    } catch (const Json::exception& error) {
        return {std::nullopt, fmt::format("it is damaged ({})", error.what())};
    }
}

StoredProfile read_profile(const fs::path& file, const Device& device) {
    std::error_code error;
    const fs::file_status status = fs::status(file, error);
    if (status.type() == fs::file_type::not_found) return {};
    if (status.type() == fs::file_type::none) return {std::nullopt, "it cannot be read: " + error.message()};
    if (status.type() != fs::file_type::regular) return {std::nullopt, "it is no regular file"};
    errno = 0;
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return {std::nullopt, "it cannot be read: " + std::generic_category().message(errno)};
    std::string text(kMostBytes + 1, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kMostBytes) return {std::nullopt, fmt::format("it has more than {} bytes", kMostBytes)};
    return parse_profile(text, device);
}

std::string profile_text(const Device& device, const Tuning& tuning) {
    Json document = {{"format", kFormat},
                     {"version", kFormatVersion},
                     {"castor_version", CASTOR_VERSION},
                     {"device", identity_of(device)}};
    for (const auto& [kind, name] : kRayKindsOfChoice)
        document["strategies"][std::string(name)] = to_string(tuning.strategies.*kind);
    for (const TuningNumber& number : tuning_space(device).numbers)
        document[std::string(number.name)] = tuning.*number.value;
    return document.dump(2) + "\n";
}

void make_profile_folder(const fs::path& file) {
    try {
        fs::create_directories(file.parent_path());
    } catch (const fs::filesystem_error& error) {
        throw FileError(file.parent_path().string(), "cannot be made: " + error.code().message());
    }
}

void write_profile(const fs::path& file, const Device& device, const Tuning& tuning) {
    make_profile_folder(file);
    const std::string text = profile_text(device, tuning);
    write_file_atomically(file, std::as_bytes(std::span(text)));
}

}  // namespace castor
