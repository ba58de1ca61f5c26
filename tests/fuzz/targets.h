#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace castor::fuzz {

/// A reader that is given bytes nobody has checked. It may refuse them with a castor::Error; any other exception, a
/// crash, a report of a sanitizer, a hang, or memory out of proportion to the bytes is a fault of the reader.
struct Target {
    const char* name;
    /// Writes the bytes to a file, reads it, and checks what the reader promises about its result.
    void (*run)(std::string_view bytes);
    /// Valid inputs, small ones, from which a fuzzer starts.
    std::vector<std::string> (*seeds)();
};

/// All targets, in the order of `scripts/fuzz --help`.
std::span<const Target> targets();

/// Throws std::logic_error where a reader broke a promise.
void require(bool kept, const char* promise);

void run_ply(std::string_view bytes);
void run_obj(std::string_view bytes);
void run_stl(std::string_view bytes);
void run_gltf(std::string_view bytes);
void run_xml(std::string_view bytes);
void run_json(std::string_view bytes);
void run_built_scene(std::string_view bytes);
void run_checkpoint(std::string_view bytes);
void run_picture(std::string_view bytes);
void run_rays(std::string_view bytes);

std::vector<std::string> ply_seeds();
std::vector<std::string> obj_seeds();
std::vector<std::string> stl_seeds();
std::vector<std::string> gltf_seeds();
std::vector<std::string> xml_seeds();
std::vector<std::string> json_seeds();
std::vector<std::string> built_scene_seeds();
std::vector<std::string> checkpoint_seeds();
std::vector<std::string> picture_seeds();
std::vector<std::string> ray_seeds();

}  // namespace castor::fuzz
