#include "opencl/kernel_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

#include "castor/error.h"

namespace castor::kernels {

namespace {

namespace fs = std::filesystem;

/// Says why the folder is not the root of a source tree.
std::string fault_of_root(const fs::path& root) {
    std::error_code error;
    if (!fs::is_directory(root, error)) return "which is no folder";
    for (const fs::directory_entry& entry : fs::directory_iterator(root, error))
        if (entry.path().extension() == ".cl")
            return "which holds kernels itself; it has to be the folder above kernels/";
    return "which has no folder kernels/";
}

/// Returns the folder that CASTOR_KERNEL_DIR names, or nullopt where it is not set. Throws DeviceError where it is not
/// the root of a source tree: its sources would not be found.
std::optional<fs::path> kernel_root() {
    const char* variable = std::getenv("CASTOR_KERNEL_DIR");
    if (!variable || !*variable) return std::nullopt;
    const fs::path root = variable;
    std::error_code error;
    if (fs::is_directory(root / "kernels", error)) return root;
    throw DeviceError("", "", 0, fmt::format("CASTOR_KERNEL_DIR is {}, {}", root.string(), fault_of_root(root)));
}

std::optional<std::string> find_in_folder(const fs::path& root, std::string_view name) {
    for (const char* folder : {"kernels", "include", "tests/kernels"}) {
        std::ifstream stream(root / folder / name, std::ios::binary);
        if (!stream) continue;
        std::ostringstream text;
        text << stream.rdbuf();
        return text.str();
    }
    return std::nullopt;
}

std::optional<std::string> find_in_table(const SourceTable& table, std::string_view name) {
    for (const auto& [entry, text] : table)
        if (entry == name) return std::string(text);
    return std::nullopt;
}

/// A file, and the number of lanes that its text is expanded for; 0 for an ordinary file.
struct SourceName {
    std::string file;
    std::string lanes;

    auto operator<=>(const SourceName&) const = default;
};

constexpr std::string_view kTemplateEnd = ".lanes.cl";

/// Returns what an include line names: "device/box.x4.cl" is device/box.lanes.cl for 4 lanes. A template that another
/// one includes as "device/box.lanes.cl" has the lanes of the includer.
SourceName resolve_name(std::string_view name, const std::string& lanes_of_includer) {
    if (name.ends_with(kTemplateEnd)) return {std::string(name), lanes_of_includer};
    constexpr std::string_view kEnd = ".cl";
    const std::string_view stem = name.substr(0, name.ends_with(kEnd) ? name.size() - kEnd.size() : 0);
    const std::size_t mark = stem.rfind(".x");
    const std::string_view digits = mark == std::string_view::npos ? std::string_view() : stem.substr(mark + 2);
    if (digits.empty() || digits.find_first_not_of("0123456789") != std::string_view::npos)
        return {std::string(name), ""};
    return {fmt::format("{}{}", stem.substr(0, mark), kTemplateEnd), std::string(digits)};
}

/// Types of templates, of which the name for one lane stands beside them: see kernels/device/lanes.cl.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kTypesOfLanes{
    {{"Real", "float"}, {"Whole", "uint"}, {"Int", "int"}, {"Mask", "int"}}};

/// Returns how many characters at the begin of a text can be in an identifier.
std::size_t length_of_word(std::string_view text) {
    const auto is_in_word = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
    return static_cast<std::size_t>(std::find_if_not(text.begin(), text.end(), is_in_word) - text.begin());
}

/// Appends a line of a template for so many lanes: LANES(name) becomes name16 for 16 and name for one, and the types
/// become theirs. Macros could do so too, but a compiler takes as long to expand them as for all else that it reads
/// before it looks into its cache of compiled programs.
void append_for_lanes(std::string_view line, std::string_view lanes, std::string& text) {
    const std::string_view suffix = lanes == "1" ? "" : lanes;
    constexpr std::string_view kName = "LANES";
    while (!line.empty()) {
        const std::string_view word = line.substr(0, length_of_word(line));
        line.remove_prefix(std::max<std::size_t>(word.size(), 1));
        if (word.empty()) {
            text += *(line.data() - 1);
            continue;
        }
        const auto* const type = std::find_if(kTypesOfLanes.begin(), kTypesOfLanes.end(),
                                              [&](const auto& entry) { return entry.first == word; });
        const std::string_view name =
            word == kName && line.starts_with('(') ? line.substr(1, length_of_word(line.substr(1))) : "";
        if (!name.empty() && line.substr(1 + name.size()).starts_with(')')) {
            text.append(name).append(suffix);
            line.remove_prefix(name.size() + 2);
        } else if (type != kTypesOfLanes.end()) {
            text.append(type->second).append(suffix);
        } else {
            text += word;
        }
    }
}

class Expander {
public:
    explicit Expander(const SourceTable& extra) : extra_(extra) {}

    void append(std::string_view name, const SourceName& includer) {
        const SourceName source = resolve_name(name, includer.lanes);
        if (!done_.insert(source).second) return;
        std::istringstream lines(find(source, includer.file));
        change_lanes(includer.lanes, source.lanes);
        text_ += fmt::format("#line 1 \"{}\"\n", source.file);
        std::string line;
        for (int number = 1; std::getline(lines, line); ++number) {
            if (const std::string_view target = include_target(line); !target.empty()) {
                append(std::string(target), source);
                text_ += fmt::format("#line {} \"{}\"\n", number + 1, source.file);
            } else {
                if (source.lanes.empty())
                    text_ += line;
                else
                    append_for_lanes(line, source.lanes, text_);
                text_ += '\n';
            }
        }
        change_lanes(source.lanes, includer.lanes);
    }

    std::string take() { return std::move(text_); }

private:
    static std::string_view include_target(std::string_view line) {
        constexpr std::string_view kStart = "#include \"";
        if (!line.starts_with(kStart)) return {};
        line.remove_prefix(kStart.size());
        return line.substr(0, line.find('"'));
    }

    void change_lanes(const std::string& from, const std::string& to) {
        if (from == to) return;
        if (!from.empty()) text_ += "#undef CASTOR_LANES\n";
        if (!to.empty()) text_ += fmt::format("#define CASTOR_LANES {}\n", to);
    }

    std::string find(const SourceName& source, std::string_view included_by) const {
        const std::string& name = source.file;
        if (source.lanes.empty() && name.ends_with(kTemplateEnd))
            throw DeviceError("", "", 0, fmt::format("{} includes {} without a number of lanes", included_by, name));
        std::optional<std::string> text;
        if (root_) text = find_in_folder(*root_, name);
        if (!text) text = find_in_table(extra_, name);
        if (!text) text = find_in_table(library_kernels, name);
        if (text) return *std::move(text);
        throw DeviceError("", "", 0,
                          included_by.empty() ? fmt::format("there is no kernel source {}", name)
                                              : fmt::format("{} includes {}, which does not exist", included_by, name));
    }

    const SourceTable& extra_;
    const std::optional<fs::path> root_ = kernel_root();
    std::set<SourceName> done_;
    std::string text_;
};

}  // namespace

std::string expand_kernel_source(std::string_view name, const SourceTable& extra, std::string_view prelude) {
    Expander expander(extra);
    if (!prelude.empty()) expander.append(prelude, {});
    expander.append(name, {});
    return "#pragma OPENCL FP_CONTRACT OFF\n" + expander.take();
}

}  // namespace castor::kernels
