#include "render/light_planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <functional>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/name_list.h"
#include "castor/error.h"

namespace castor {

namespace {

std::string_view name_of(Light::Kind kind) {
    switch (kind) {
        case Light::Kind::point:
            return "point";
        case Light::Kind::directional:
            return "directional";
        case Light::Kind::spot:
            return "spot";
        case Light::Kind::area:
            return "area";
        case Light::Kind::mesh:
            return "mesh";
        case Light::Kind::sphere:
            return "sphere";
        case Light::Kind::instance:
            return "instance";
        case Light::Kind::environment:
            break;
    }
    return "environment";
}

using LightsOfNames = std::map<std::string, std::vector<std::uint32_t>, std::less<>>;

std::string no_such_light(std::string_view word, std::size_t light_count, const LightsOfNames& lights_of_names) {
    if (light_count == 0) return fmt::format("there is no light \"{}\": the scene has none", word);
    std::vector<std::string> names;
    for (const auto& [name, lights] : lights_of_names) names.push_back(fmt::format("\"{}\"", name));
    return fmt::format("there is no light \"{}\": expected a number below {}{}{}", word, light_count,
                       names.empty() ? "; none has a name" : ", or one of " + list_some(names),
                       names.size() > kMostNamesListed ? ", which castor info --json lists" : "");
}

constexpr const char* kRest = "rest";  // the last group: see RenderOptions::light_groups

void add(DeviceShare& sum, const DeviceShare& other) {
    sum.tiles += other.tiles;
    sum.samples += other.samples;
    sum.rays += other.rays;
    sum.retries += other.retries;
    sum.left_busy += other.left_busy;
    sum.busy_seconds += other.busy_seconds;
    sum.setup_seconds = std::max(sum.setup_seconds, other.setup_seconds);
}

}  // namespace

std::vector<std::string> names_of(const Light& light) {
    std::vector<std::string> names = light.names;
    const std::string kind(name_of(light.kind));
    if (light.kind == Light::Kind::environment && std::find(names.begin(), names.end(), kind) == names.end())
        names.push_back(kind);
    return names;
}

std::vector<std::uint32_t> find_lights(const std::vector<Light>& lights, const std::vector<std::string>& words) {
    LightsOfNames lights_of_names;
    for (std::uint32_t number = 0; number < lights.size(); ++number)
        for (std::string& name : names_of(lights[number])) lights_of_names[std::move(name)].push_back(number);
    std::vector<std::uint32_t> found;
    std::vector<bool> is_found(lights.size());
    const auto add = [&](std::uint32_t number) {
        if (!is_found[number]) found.push_back(number);
        is_found[number] = true;
    };
    for (const std::string& word : words) {
        std::uint32_t number = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
        const bool is_number = error == std::errc() && end == word.data() + word.size();
        if (is_number && number < lights.size()) {
            add(number);
            continue;
        }
        const auto named = lights_of_names.find(word);
        if (named == lights_of_names.end()) throw UsageError(no_such_light(word, lights.size(), lights_of_names));
        for (const std::uint32_t light : named->second) add(light);
    }
    return found;
}

std::vector<std::string> light_group_planes(const std::vector<LightGroup>& groups) {
    std::vector<std::string> names;
    for (const LightGroup& group : groups) names.push_back(std::string(kGroupPlane) + group.name);
    if (!groups.empty()) names.push_back(std::string(kGroupPlane) + kRest);
    return names;
}

void check_light_groups(const RenderOptions& options, std::size_t light_count) {
    const std::vector<LightGroup>& groups = options.light_groups;
    for (const std::string& name : options.aovs)
        if (name.starts_with(kGroupPlane))
            throw UsageError(fmt::format("the plane \"{}\" is made where there is such a group of lights", name));
    constexpr std::size_t kMostGroups = 31;  // with the rest, so many rows of terms as waves have memory for
    if (groups.size() > kMostGroups)
        throw UsageError(fmt::format("{} groups of lights, expected {} at most", groups.size(), kMostGroups));
    constexpr std::size_t kLongestName = 100;  // of files, and of channels
    std::set<std::string> names;
    std::set<std::uint32_t> lights;
    for (const LightGroup& group : groups) {
        if (group.name.size() > kLongestName)
            throw UsageError(fmt::format("the group of lights \"{}...\" has a name of {} letters, expected {} at most",
                                         group.name.substr(0, 40), group.name.size(), kLongestName));
        const bool is_name = !group.name.empty() && std::all_of(group.name.begin(), group.name.end(), [](char c) {
            return std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_';
        });
        if (!is_name)
            throw UsageError(
                fmt::format("the group of lights \"{}\" has no name of letters, digits, '-' and '_'", group.name));
        if (group.name == kRest)
            throw UsageError(fmt::format(
                "a group of lights cannot have the name \"{}\": it is that of the plane with all other light", kRest));
        if (!names.insert(group.name).second)
            throw UsageError(fmt::format("there are two groups of lights \"{}\"", group.name));
        for (const std::uint32_t light : group.lights) {
            if (light >= light_count)
                throw UsageError(fmt::format("the group \"{}\" has the light {}, expected lights below {}", group.name,
                                             light, light_count));
            if (!lights.insert(light).second) throw UsageError(fmt::format("the light {} is in two groups", light));
        }
    }
}

std::vector<std::uint32_t> groups_of_lights(const std::vector<LightGroup>& groups, std::size_t light_count) {
    if (groups.empty()) return {};
    std::vector<std::uint32_t> numbers(light_count + 1, static_cast<std::uint32_t>(groups.size()));
    for (std::uint32_t number = 0; number < groups.size(); ++number)
        for (const std::uint32_t light : groups[number].lights) numbers[light] = number;
    return numbers;
}

bool wants_light_planes(const RenderOptions& options) {
    return std::find(options.aovs.begin(), options.aovs.end(), kLightPlanes) != options.aovs.end();
}

void check_light_planes(const RenderOptions& options, bool is_alone) {
    const auto refuse = [](const char* what) {
        throw UsageError(fmt::format("the planes \"{}\" cannot be made {}", kLightPlanes, what));
    };
    if (!wants_light_planes(options)) return;
    if (!is_alone) refuse("by several processes");
    if (options.part) refuse("of a part of a picture");
    if (!options.checkpoint_file.empty() || !options.resume_file.empty())
        refuse("with a checkpoint, which keeps nothing of them");
    if (options.verify_share > 0.0) refuse("in a picture that is verified");
}

std::vector<std::string> light_plane_names(const std::vector<Light>& lights) {
    std::vector<std::string> names;
    for (const Light& light : lights) names.push_back(fmt::format("light-{}-{}", names.size(), name_of(light.kind)));
    names.emplace_back("light-none");
    return names;
}

std::vector<std::string> plane_names(const Scene& scene, const std::vector<std::string>& aovs) {
    std::vector<std::string> names;
    for (const std::string& aov : aovs)
        if (aov != kLightPlanes) names.push_back(aov);
    if (names.size() == aovs.size()) return names;
    const std::vector<std::string> of_lights = light_plane_names(scene.lights);
    names.insert(names.end(), of_lights.begin(), of_lights.end());
    return names;
}

LightPass LightPasses::pass(std::size_t number) const {
    const std::size_t lights = names_.size() - 1;
    if (number == 0) return {{0, lights}, true};
    if (number <= lights) return {{number - 1, number}, false};
    return {{0, 0}, true};
}

std::vector<FilmPlane> LightPasses::planes(const Film& film) const {
    std::vector<FilmPlane> planes;
    for (const std::string& name : names_)
        planes.push_back({name, {"R", "G", "B"}, std::vector<float>(3 * film.pixels.size(), 0.0f), {}});
    return planes;
}

ProgressCallback LightPasses::progress_of(std::size_t number, const ProgressCallback& on_progress,
                                          const RenderStatistics& before, const Film* picture) const {
    return [=, count = count(), seconds = before.render_seconds, rays = before.rays](const RenderProgress& progress) {
        RenderProgress of_all = progress;
        of_all.samples_done += number * progress.samples_total;
        of_all.samples_total *= count;
        of_all.rays += rays;
        of_all.seconds += seconds;
        if (picture) of_all.snapshot = [picture] { return *picture; };
        return on_progress(of_all);
    };
}

void add_passes(RenderStatistics& last, const RenderStatistics& before) {
    last.render_seconds += before.render_seconds;
    last.rays += before.rays;
    last.samples_done = before.samples_done;
    last.part_complete &= before.part_complete;
    last.notices.insert(last.notices.begin(), before.notices.begin(), before.notices.end());
    for (std::size_t i = 0; i < std::min(last.devices.size(), before.devices.size()); ++i)
        add(last.devices[i], before.devices[i]);
}

}  // namespace castor
