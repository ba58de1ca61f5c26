#include "scene/gltf_choice.h"

#include <fmt/format.h>

#include <charconv>
#include <set>
#include <system_error>

#include "base/name_list.h"
#include "castor/error.h"
#include "scene/gltf_document.h"

namespace castor {

std::vector<std::size_t> choose_gltf_elements(const GltfDocument& document, const std::optional<GltfValue>& list,
                                              const std::string& word, const char* kind, const char* further) {
    const std::vector<std::string> all = names_of_gltf_elements(list);
    const std::size_t count = all.size();
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error == std::errc() && end == word.data() + word.size() && number >= 1 && number <= count) return {number - 1};
    std::vector<std::size_t> found;
    std::vector<std::string> names;
    std::set<std::string> known{""};
    for (std::size_t i = 0; i < count; ++i) {
        if (!word.empty() && all[i] == word) found.push_back(i);
        const std::string shown = all[i].substr(0, 40);
        if (known.insert(shown).second) names.push_back(fmt::format("\"{}\"", shown));
    }
    if (!found.empty()) return found;
    const std::string expected =
        count == 0 ? "the file has none"
                   : fmt::format("expected {}a number from 1 to {}{}", further, count,
                                 names.empty() ? "; none has a name" : ", or one of " + list_some(names));
    throw UsageError(
        fmt::format("{}: there is no {} \"{}\": {}", document.file().string(), kind, word.substr(0, 40), expected));
}

std::vector<std::string> names_of_gltf_elements(const std::optional<GltfValue>& list) {
    std::vector<std::string> names;
    for (std::size_t i = 0; list && i < list->size(); ++i) names.push_back(list->at(i).name());
    return names;
}

std::optional<GltfValue> gltf_material_variants(const GltfDocument& document) {
    const auto extension = document.root().find_extension("KHR_materials_variants");
    return extension ? extension->find("variants") : std::nullopt;
}

}  // namespace castor
