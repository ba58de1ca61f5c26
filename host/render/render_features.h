#pragma once

#include <string>
#include <vector>

#include "opencl/kernel_arguments.h"
#include "scene/scene_arrays.h"

namespace castor {

/// What a scene has that kernels of a wave are built for (kernels/device/features.cl), so that a scene without it pays
/// nothing.
struct RenderFeatures {
    bool has_textures = false;
    bool has_other_textures = false;      // that give more than diffuse reflectances and normals
    bool has_textures_with_axes = false;  // trilinear ones, and those that change normals
    bool has_dielectrics = false;
    bool has_roughness = false;
    bool has_brdfs = false;  // other than Blinn and Phong's
    bool has_emission = false;
    bool has_sampled_lights = false;  // whose rays go to random points of them
    bool has_environment = false;
    bool has_light_shapes = false;  // other lights of which rays go to random points
    bool has_light_tree = false;    // several lights, among which it chooses
    bool has_suns = false;          // directional lights whose disk is seen
    bool has_light_ranges = false;  // point and spot lights with a range
    bool has_motion = false;        // of instances
    bool has_classic = true;        // materials that are not principled
    bool has_principled = false;
    bool has_opacity = false;     // of some principled materials less than 1
    bool has_attributes = false;  // principled materials have textures, or colours of vertices
    bool has_optics =
        false;  // principled: thin films, dispersion, coats with their own normals, glass that is not plain
    bool has_panes = false;  // some principled materials are smooth thin walls that transmit light, or matched
    // Solids of index 1, which the light of lights that no ray meets passes straight.
    bool has_matched_solids = false;
    bool has_scattering = false;  // some principled materials have insides that scatter light
    // Not of the scene, but of the picture: it is path traced.
    bool traces_paths = false;
    bool has_light_groups = false;  // it has planes of groups of lights

    /// Whether what a sample finds is added up in its slot (kernels/device/film.lanes.cl).
    bool has_slot_sums() const { return has_dielectrics || traces_paths; }
    /// Whether shadow rays go on beyond surfaces.
    bool are_shadows_passed() const { return has_opacity || (has_panes && traces_paths); }
    /// Whether some rays of a bounce are put side by side, to be traced once more.
    bool sends_rays_on() const { return are_shadows_passed() || (has_scattering && traces_paths); }
};

RenderFeatures features_of(const SceneArrays& arrays);
/// Tells whether no ray of a path-traced picture can meet the light: points, spots, areas, suns without an angle.
bool is_met_by_none(const shared::Light& light);
/// Tells of each material whether surfaces bound a solid through which light passes. None where no such solid takes
/// anything from the light, so that nobody needs to know where the eye is.
std::vector<bool> solid_materials(const SceneArrays& arrays);
/// Returns the options of the compiler for stages that depend on what the scene has.
std::string build_options(const RenderFeatures& features);
/// Returns the program of the others. The fewer of these differ, the more of them are compiled already.
KernelProgram wave_program(const RenderFeatures& features);

}  // namespace castor
