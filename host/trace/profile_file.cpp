#include "trace/profile_file.h"

#include <fmt/format.h>

#include "trace/device_file.h"

namespace castor {

namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat = "castor device profile";
constexpr int kFormatVersion = 1;

/// The one of `allowed` that stands in the file as `name`; `text_of` tells how.
template <class Value, class TextOf>
Value one_of(const DeviceJson& object, std::string_view name, const std::vector<Value>& allowed,
             const TextOf& text_of) {
    const DeviceJson& found = member(object, std::string(name));
    std::string known;
    const std::string found_text = found.dump();
    for (const Value& value : allowed) {
        const DeviceJson text = text_of(value);
        if (found_text == text.dump()) return value;
        known += (known.empty() ? "" : ", ") + shown(text);
    }
    throw DeviceFileProblem(fmt::format("its {} is {}, here it may be {}", name, shown(found), known));
}

Tuning tuning_of(const DeviceJson& document, const Device& device) {
    check_device_document(document, kFormat, kFormatVersion, device);
    const TuningSpace space = tuning_space(device);
    Tuning tuning;
    const DeviceJson& strategies = member(document, "strategies");
    for (const auto& [kind, name] : kRayKindsOfChoice)
        tuning.strategies.*kind =
            one_of(strategies, name, space.strategies, [](Strategy s) { return DeviceJson(to_string(s)); });
    for (const TuningNumber& number : space.numbers)
        tuning.*number.value =
            one_of(document, number.name, number.allowed, [](std::uint32_t value) { return DeviceJson(value); });
    return tuning;
}

}  // namespace

fs::path profile_file(const Device& device) {
    const fs::path folder = device_folder("profiles");
    if (folder.empty()) return {};
    return folder / device_file_name(device, device.platform_name + "\n" + device.name);
}

StoredProfile parse_profile(std::string_view text, const Device& device) {
    try {
        return {tuning_of(parse_device_document(text), device), ""};
    } catch (const DeviceFileProblem& problem) {
        return {std::nullopt, problem.what()};
    }
}

StoredProfile read_profile(const fs::path& file, const Device& device) {
    try {
        const std::string text = read_device_file(file);
        if (text.empty()) return {};
        return parse_profile(text, device);
    } catch (const DeviceFileProblem& problem) {
        return {std::nullopt, problem.what()};
    }
}

std::string profile_text(const Device& device, const Tuning& tuning) {
    DeviceJson document = device_document(kFormat, kFormatVersion, device);
    for (const auto& [kind, name] : kRayKindsOfChoice)
        document["strategies"][std::string(name)] = to_string(tuning.strategies.*kind);
    for (const TuningNumber& number : tuning_space(device).numbers)
        document[std::string(number.name)] = tuning.*number.value;
    return document.dump(2) + "\n";
}

void write_profile(const fs::path& file, const Device& device, const Tuning& tuning) {
    write_device_file(file, profile_text(device, tuning));
}

}  // namespace castor
