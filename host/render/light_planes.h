#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/range.h"
#include "castor/renderer.h"

namespace castor {

/// The name among aov_names() of the planes of lights.
inline constexpr const char* kLightPlanes = "lights";

/// The begin of the names of planes of groups of lights.
inline constexpr std::string_view kGroupPlane = "group-";

/// Returns by what words find_lights knows a light.
std::vector<std::string> names_of(const Light& light);

/// Returns the lights that words mean, in the order of words, each once: a word is a number, or the name of one or
/// several. Throws UsageError where it is neither, with ten of the names at most.
std::vector<std::uint32_t> find_lights(const std::vector<Light>& lights, const std::vector<std::string>& words);

/// Throws UsageError where groups are not what RenderOptions says, for a scene of so many lights.
void check_light_groups(const RenderOptions& options, std::size_t light_count);

/// Returns the group of each light, and last that of what is no light's; nothing where there are no groups.
std::vector<std::uint32_t> groups_of_lights(const std::vector<LightGroup>& groups, std::size_t light_count);

bool wants_light_planes(const RenderOptions& options);

/// Throws UsageError where planes of lights are asked for together with what they cannot be made with. `is_alone`: no
/// other process takes part.
void check_light_planes(const RenderOptions& options, bool is_alone);

/// The name of each light's plane, and last that of what no light makes.
std::vector<std::string> light_plane_names(const std::vector<Light>& lights);

/// Whose light a render adds up: that of these lights, and with `others` what no light makes.
struct LightPass {
    Range lights;
    bool others = true;
};

/// The renders of a picture with planes of lights: number 0 is the picture, then one for each plane.
class LightPasses {
public:
    explicit LightPasses(const std::vector<Light>& lights) : names_(light_plane_names(lights)) {}

    std::size_t count() const { return 1 + names_.size(); }
    LightPass pass(std::size_t number) const;
    /// Returns a plane for each but the picture, without light.
    std::vector<FilmPlane> planes(const Film& film) const;
    /// Makes the progress of one render that of all. `before`: statistics of those before it; `picture`: the picture,
    /// once it is made.
    ProgressCallback progress_of(std::size_t number, const ProgressCallback& on_progress,
                                 const RenderStatistics& before, const Film* picture) const;

private:
    std::vector<std::string> names_;
};

/// Adds what earlier renders of the same picture took. The counts of samples stay those of the first.
void add_passes(RenderStatistics& last, const RenderStatistics& before);

}  // namespace castor
