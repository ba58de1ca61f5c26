#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "scene/gltf_value.h"

namespace castor {

/// Returns the indices of the elements of a list that a word means: a number from 1 on, or a name, which means all that
/// have it. Throws UsageError if it means none: with the kind of the elements, in the singular, with their names, and
/// with `further`, which the word might also be. nullopt is a list without elements.
std::vector<std::size_t> choose_gltf_elements(const GltfDocument& document, const std::optional<GltfValue>& list,
                                              const std::string& word, const char* kind, const char* further = "");

/// Returns the names of a list's elements; "" where one has none.
std::vector<std::string> names_of_gltf_elements(const std::optional<GltfValue>& list);

/// Returns the list of a file's material variants; nullopt if there is none.
std::optional<GltfValue> gltf_material_variants(const GltfDocument& document);

}  // namespace castor
