#include "opencl/kernel_source.h"

#include <fmt/format.h>

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

class Expander {
public:
    explicit Expander(const SourceTable& extra) : extra_(extra) {}

    void append(std::string_view name, std::string_view included_by) {
        if (!done_.insert(std::string(name)).second) return;
        std::istringstream lines(find(name, included_by));
        text_ += fmt::format("#line 1 \"{}\"\n", name);
        std::string line;
        for (int number = 1; std::getline(lines, line); ++number) {
            if (const std::string_view target = include_target(line); !target.empty()) {
                append(std::string(target), name);
                text_ += fmt::format("#line {} \"{}\"\n", number + 1, name);
            } else {
                text_ += line;
                text_ += '\n';
            }
        }
    }

    std::string take() { return std::move(text_); }

private:
    static std::string_view include_target(std::string_view line) {
        constexpr std::string_view kStart = "#include \"";
        if (!line.starts_with(kStart)) return {};
        line.remove_prefix(kStart.size());
        return line.substr(0, line.find('"'));
    }

    std::string find(std::string_view name, std::string_view included_by) const {
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
    std::set<std::string, std::less<>> done_;
    std::string text_;
};

}  // namespace

std::string expand_kernel_source(std::string_view name, const SourceTable& extra) {
    Expander expander(extra);
    expander.append(name, "");
    return "#pragma OPENCL FP_CONTRACT OFF\n" + expander.take();
}

}  // namespace castor::kernels
