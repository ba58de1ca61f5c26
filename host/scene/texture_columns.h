#pragma once

#include "castor/scene.h"
#include "scene/scene_arrays.h"

namespace castor {

/// Returns the picture at half the width and height, rounded down, and at least 1. A texel is the mean of what it
/// covers: of two rows or columns, or of three weighted by the part of them where the number is odd (Guthe, Heckbert
/// 2005, "Non-Power-of-Two Mipmapping"). Sums of bytes are exact and rounded to the nearest, halves up; those of floats
/// are in double precision. `is_srgb`: bytes are colours that sRGB's curve encodes, whose means are those of the linear
/// values; alpha is linear in any case.
Image half_size(const Image& image, bool is_srgb = false);

/// Returns how many words of texels the pictures take, with smaller ones for those that trilinear textures read.
std::uint64_t texel_words(const Scene& scene);

/// Appends textures, pictures and texels. The scene is valid.
void append_textures(SceneArrays& arrays, const Scene& scene);

}  // namespace castor
