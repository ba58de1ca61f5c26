#include "opencl/kernel_source.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include "castor/error.h"
#include "opencl/device_context.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"

namespace castor::test {
namespace {

using kernels::expand_kernel_source;
using kernels::SourceTable;

/// CASTOR_KERNEL_DIR with another value until the end of the scope; empty: not set.
class KernelDirectory {
public:
    explicit KernelDirectory(const std::string& value) {
        if (const char* old = std::getenv(kName)) old_ = old;
        set(value);
    }
    ~KernelDirectory() { set(old_); }

private:
    static constexpr const char* kName = "CASTOR_KERNEL_DIR";

    static void set(const std::string& value) {
        if (value.empty())
            ::unsetenv(kName);
        else
            ::setenv(kName, value.c_str(), 1);
    }
    std::string old_;
};

std::size_t occurrences(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
    return count;
}

std::string device_error_of(const std::string& name, const SourceTable& sources) {
    try {
        expand_kernel_source(name, sources);
    } catch (const DeviceError& error) {
        return error.what();
    }
    return "no error";
}

}  // namespace

TEST_CASE("a prelude stands before all else", "[kernel_source]") {
    const KernelDirectory none("");
    const SourceTable sources{{"main.cl", "main\n"}, {"prelude.cl", "declared\n"}};
    CHECK(expand_kernel_source("main.cl", sources, "prelude.cl") ==
          "#pragma OPENCL FP_CONTRACT OFF\n"
          "#line 1 \"prelude.cl\"\ndeclared\n"
          "#line 1 \"main.cl\"\nmain\n");
}

TEST_CASE("an expanded source has each file once, and #line names where lines are from", "[kernel_source]") {
    const KernelDirectory none("");
    const SourceTable sources{{"main.cl", "// main\n#include \"a.h\"\n#include \"b.h\"\nkernel code\n"},
                              {"a.h", "first a\n#include \"b.h\"\nlast a\n"},
                              {"b.h", "all of b"}};
    CHECK(expand_kernel_source("main.cl", sources) ==
          "#pragma OPENCL FP_CONTRACT OFF\n"
          "#line 1 \"main.cl\"\n// main\n"
          "#line 1 \"a.h\"\nfirst a\n"
          "#line 1 \"b.h\"\nall of b\n"
          "#line 3 \"a.h\"\nlast a\n"
          "#line 3 \"main.cl\"\n"
          "#line 4 \"main.cl\"\nkernel code\n");
}

TEST_CASE("files that include each other, or themselves, end", "[kernel_source]") {
    const KernelDirectory none("");
    const SourceTable sources{{"a.h", "#include \"b.h\"\na\n"}, {"b.h", "#include \"a.h\"\n#include \"b.h\"\nb\n"}};
    const std::string text = expand_kernel_source("a.h", sources);
    CHECK(occurrences(text, "\na\n") == 1);
    CHECK(occurrences(text, "\nb\n") == 1);
    CHECK(occurrences(text, "#include \"") == 0);
}

TEST_CASE("a template is expanded once for each number of lanes", "[kernel_source]") {
    const KernelDirectory none("");
    const SourceTable sources{
        {"main.cl",
         "#include \"outer.x4.cl\"\n#include \"inner.x4.cl\"\n#include \"inner.x16.cl\"\nend CASTOR_LANES\n"},
        {"outer.lanes.cl", "#include \"inner.lanes.cl\"\n#include \"plain.cl\"\nouter CASTOR_LANES\n"},
        {"inner.lanes.cl", "inner CASTOR_LANES\n"},
        {"plain.cl", "#include \"inner.x1.cl\"\nplain\n"}};
    CHECK(expand_kernel_source("main.cl", sources) ==
          "#pragma OPENCL FP_CONTRACT OFF\n"
          "#line 1 \"main.cl\"\n"
          "#define CASTOR_LANES 4\n"
          "#line 1 \"outer.lanes.cl\"\n"
          "#line 1 \"inner.lanes.cl\"\ninner CASTOR_LANES\n"
          "#line 2 \"outer.lanes.cl\"\n"
          "#undef CASTOR_LANES\n"
          "#line 1 \"plain.cl\"\n"
          "#define CASTOR_LANES 1\n"
          "#line 1 \"inner.lanes.cl\"\ninner CASTOR_LANES\n"
          "#undef CASTOR_LANES\n"
          "#line 2 \"plain.cl\"\nplain\n"
          "#define CASTOR_LANES 4\n"
          "#line 3 \"outer.lanes.cl\"\nouter CASTOR_LANES\n"
          "#undef CASTOR_LANES\n"
          "#line 2 \"main.cl\"\n"
          "#line 3 \"main.cl\"\n"
          "#define CASTOR_LANES 16\n"
          "#line 1 \"inner.lanes.cl\"\ninner CASTOR_LANES\n"
          "#undef CASTOR_LANES\n"
          "#line 4 \"main.cl\"\nend CASTOR_LANES\n");
}

TEST_CASE("names and types of a template are those of its lanes", "[kernel_source]") {
    const KernelDirectory none("");
    const auto expanded = [](const std::string& line, const std::string& lanes) {
        const std::string main = "#include \"a.x" + lanes + ".cl\"\n";
        const std::string text = expand_kernel_source("main.cl", {{"main.cl", main}, {"a.lanes.cl", line}});
        const std::string begin = "#line 1 \"a.lanes.cl\"\n";
        return text.substr(text.find(begin) + begin.size(), text.find("\n#undef") - text.find(begin) - begin.size());
    };
    const std::string line = "Real LANES(dot)(const LANES(Vectors) v, Whole *w, Int i, Mask m) // LANES(x)";
    CHECK(expanded(line, "16") == "float16 dot16(const Vectors16 v, uint16 *w, int16 i, int16 m) // x16");
    CHECK(expanded(line, "4") == "float4 dot4(const Vectors4 v, uint4 *w, int4 i, int4 m) // x4");
    CHECK(expanded(line, "1") == "float dot(const Vectors v, uint *w, int i, int m) // x");
    // What only looks like it.
    const std::string other = "Reals aReal Real_ LANES LANES() LANES(a + b) LANES(a CASTOR_LANES(a) 0x1Mask";
    CHECK(expanded(other, "16") == other);
    // In no other files.
    const SourceTable sources{{"main.cl", "LANES(a) Real\n#include \"a.x4.cl\"\n"},
                              {"a.lanes.cl", "#include \"b.cl\"\n"},
                              {"b.cl", "LANES(b) Mask\n"}};
    CHECK(occurrences(expand_kernel_source("main.cl", sources), "LANES(a) Real\n") == 1);
    CHECK(occurrences(expand_kernel_source("main.cl", sources), "LANES(b) Mask\n") == 1);
}

TEST_CASE("a template that is included without a number of lanes, or is missing, is named", "[kernel_source]") {
    const KernelDirectory none("");
    CHECK(device_error_of("main.cl", {{"main.cl", "#include \"a.lanes.cl\"\n"}, {"a.lanes.cl", "a\n"}}) ==
          "main.cl includes a.lanes.cl without a number of lanes");
    CHECK(device_error_of("main.cl", {{"main.cl", "#include \"device/a.x4.cl\"\n"}}) ==
          "main.cl includes device/a.lanes.cl, which does not exist");
    // Names that only look like it.
    CHECK(device_error_of("main.cl", {{"main.cl", "#include \"a.x.cl\"\n#include \"x4.cl\"\n"}, {"a.x.cl", "a\n"}}) ==
          "main.cl includes x4.cl, which does not exist");
}

TEST_CASE("every kernel of the library expands, after the pragma and without an include", "[kernel_source]") {
    const KernelDirectory none("");
    std::size_t kernel_count = 0;
    for (const auto& [name, unused] : kernels::library_kernels) {
        if (name.find('/') != std::string_view::npos) continue;
        CAPTURE(name);
        ++kernel_count;
        // A template is expanded for sixteen lanes.
        std::string asked(name);
        if (const std::size_t end = asked.find(".lanes.cl"); end != std::string::npos) asked.replace(end, 6, ".x16");
        const std::string text = expand_kernel_source(asked);
        CHECK(text.starts_with("#pragma OPENCL FP_CONTRACT OFF\n"));
        CHECK(text.find("#line 1 \"" + std::string(name) + "\"\n") < 80);
        CHECK(occurrences(text, "#include \"") == 0);
        CHECK(occurrences(text, "#line 1 \"castor/shared/layout.h\"") == 1);
    }
    CHECK(kernel_count > 0);
}

TEST_CASE("a source that is missing is named, with the file that includes it", "[kernel_source]") {
    const KernelDirectory none("");
    CHECK(device_error_of("nowhere.cl", {}) == "there is no kernel source nowhere.cl");
    CHECK(device_error_of("main.cl", {{"main.cl", "#include \"a.h\"\n"}, {"a.h", "#include \"device/gone.cl\"\n"}}) ==
          "a.h includes device/gone.cl, which does not exist");
}

TEST_CASE("CASTOR_KERNEL_DIR comes before what is embedded, file by file", "[kernel_source]") {
    const TemporaryDirectory root;
    for (const char* folder : {"kernels/device", "include/castor", "tests/kernels"})
        std::filesystem::create_directories(root.path() / folder);
    root.write("kernels/device/a.cl", "a of the folder\n");
    root.write("include/castor/b.h", "b of the folder\n");
    root.write("tests/kernels/c.h", "c of the folder\n");
    const SourceTable sources{
        {"main.cl", "#include \"device/a.cl\"\n#include \"castor/b.h\"\n#include \"c.h\"\n#include \"d.h\"\n"},
        {"device/a.cl", "embedded a\n"},
        {"castor/b.h", "embedded b\n"},
        {"c.h", "embedded c\n"},
        {"d.h", "embedded d\n"}};
    {
        const KernelDirectory directory(root.path().string());
        const std::string text = expand_kernel_source("main.cl", sources);
        CHECK(occurrences(text, "a of the folder") == 1);
        CHECK(occurrences(text, "b of the folder") == 1);
        CHECK(occurrences(text, "c of the folder") == 1);
        CHECK(occurrences(text, "embedded d") == 1);
        CHECK(occurrences(text, "embedded a") + occurrences(text, "embedded b") + occurrences(text, "embedded c") == 0);
    }
    const KernelDirectory none("");
    CHECK(occurrences(expand_kernel_source("main.cl", sources), "of the folder") == 0);
}

TEST_CASE("CASTOR_KERNEL_DIR that is not the folder above kernels/ is refused with what was found", "[kernel_source]") {
    const TemporaryDirectory root;
    const auto error_with = [&](const std::filesystem::path& folder) {
        const KernelDirectory directory(folder.string());
        return device_error_of("main.cl", {{"main.cl", "all\n"}});
    };
    const std::string place = root.path().string();
    CHECK(error_with(root.path() / "missing") == "CASTOR_KERNEL_DIR is " + place + "/missing, which is no folder");
    CHECK(error_with(root.write("file", "text")) == "CASTOR_KERNEL_DIR is " + place + "/file, which is no folder");
    CHECK(error_with(root.path()) == "CASTOR_KERNEL_DIR is " + place + ", which has no folder kernels/");
    std::filesystem::create_directory(root.path() / "kernels");
    CHECK(error_with(root.path()) == "no error");
    root.write("kernels/shade.cl", "text");
    CHECK(error_with(root.path() / "kernels") ==
          "CASTOR_KERNEL_DIR is " + place +
              "/kernels, which holds kernels itself; it has to be the folder above kernels/");
}

TEST_CASE("a kernel that does not compile is a DeviceError with file and line in its log", "[kernel_source]") {
    const KernelDirectory none("");
    const SourceTable sources{
        {"broken.cl", "#include \"part.h\"\nkernel void broken(global int *out) { out[0] = part(); }\n"},
        {"part.h", "// a comment\nint part(void)\n{\n    return no_such_name;\n}\n"},
        {"warned.cl",
         "kernel void warned(global int *out)\n{\n    int mark = 0;\n    if (mark = out[1]) out[0] = mark;\n}\n"}};
    DeviceContext context(test_device(), sources);
    const auto log_of = [&](const std::string& name) -> std::string {
        try {
            context.kernel(name);
        } catch (const DeviceError& error) {
            CHECK(error.device() == context.device().name);
            CHECK(error.call() == "clBuildProgram");
            CHECK(error.code() == CL_BUILD_PROGRAM_FAILURE);
            return error.what();
        }
        return "no error";
    };
    const std::string broken = log_of("broken");
    CAPTURE(broken);
    CHECK(broken.find("broken.cl does not compile") != std::string::npos);
    CHECK(broken.find("part.h:4") != std::string::npos);
    CHECK(broken.find("no_such_name") != std::string::npos);
    const std::string warned = log_of("warned");  // warnings are errors in tests, and nowhere else
    CAPTURE(warned);
    CHECK(warned.find("warned.cl:4") != std::string::npos);
    const ScopedVariable no_options("CASTOR_BUILD_OPTIONS", std::nullopt);
    CHECK_NOTHROW(DeviceContext(test_device(), sources).kernel("warned"));
}

}  // namespace castor::test
