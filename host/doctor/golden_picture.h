#pragma once

#include <cstdint>

#include "castor/film.h"
#include "castor/renderer.h"

namespace castor::doctor {

/// A small picture with everything that kernels do: triangles, spheres, planes and instances, all kinds of lights and
/// mirrors, several samples a pixel, and all further planes. It is the same, bit for bit, on every device.
Scene golden_scene();
RenderOptions golden_options();

/// A checksum of all of its values.
std::uint64_t film_checksum(const Film& film);

/// That of the golden picture. A change of kernels that is meant to change pictures changes it: the test "the golden
/// picture is the one that castor doctor expects" tells the new number.
inline constexpr std::uint64_t kGoldenChecksum = 0x7a53f84f09ab5c52;

}  // namespace castor::doctor
