// The only source that knows Open Image Denoise (openimagedenoise.org): the functions of its C interface that are used,
// by their names in 1.4 and in 2.x. They are looked up when they are needed; Castor is built without the library.
#include "render/oidn.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <glm/vec3.hpp>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "castor/denoise.h"
#include "castor/error.h"
#include "render/denoise.h"

namespace castor {

struct OidnFilter;  // the library's own

namespace {

constexpr const char* kVariable = "CASTOR_OIDN_LIBRARY";
constexpr std::array kLibraries{"libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1", "libOpenImageDenoise.so"};
constexpr std::uint32_t kOldest = 10400;  // the first that filters albedo and normal by themselves

// The library's constants: memory of the CPU's device is the process's own.
constexpr int kCpuDevice = 1, kThreeFloats = 3;
constexpr const char* kFilter = "RT";

// What a filter takes: measured, at most 740 bytes a pixel in 1.4 and 2.3, till it divides the image to stay below a
// limit; and its weights.
constexpr std::uint64_t kBytesOfPixel = 800, kMostMegabytes = 3000, kBytesOfWeights = 64u << 20;

using Filter = std::unique_ptr<OidnFilter, void (*)(OidnFilter*)>;

/// A loaded library, and its name for people. Libraries stay loaded, since their threads may outlive their use.
struct Library {
    void* handle;
    std::string name;
};

std::string told_by_loader() {
    const char* const text = ::dlerror();
    return text ? text : "for no reason that the loader tells";
}

/// Loads the file that the variable names, else the first of kLibraries that the system finds. Throws UsageError.
Library load() {
    const auto open = [](const char* file) { return ::dlopen(file, RTLD_NOW | RTLD_LOCAL); };
    const char* const named = std::getenv(kVariable);
    if (named && *named) {
        if (void* const handle = open(named)) return {handle, named};
        throw UsageError(fmt::format("{}: Open Image Denoise cannot be loaded: {}", kVariable, told_by_loader()));
    }
    std::string reasons;
    for (const char* const file : kLibraries) {
        if (void* const handle = open(file)) return {handle, file};
        const std::string reason = told_by_loader();
        if (!reason.starts_with(fmt::format("{}: cannot open shared object file", file))) reasons += ". " + reason;
    }
    throw UsageError(
        fmt::format("Open Image Denoise is not found: there is no {} where the system looks for libraries; {} may name "
                    "the file of version 1.4 or later{}",
                    fmt::join(kLibraries, ", "), kVariable, reasons));
}

/// Looks up a function by its names in several versions.
template <class Function>
void find(Function*& function, const Library& library, std::initializer_list<const char*> names) {
    for (const char* const name : names)
        if ((function = reinterpret_cast<Function*>(::dlsym(library.handle, name)))) return;
    throw UsageError(fmt::format("{} is no Open Image Denoise of version 1.4 or later: it has no function {}",
                                 library.name, fmt::join(names, " or ")));
}

}  // namespace

struct Oidn::Functions {
    explicit Functions(const Library& library) {
        find(new_device, library, {"oidnNewDevice"});
        find(release_device, library, {"oidnReleaseDevice"});
        find(commit_device, library, {"oidnCommitDevice"});
        find(get_device_int, library, {"oidnGetDeviceInt", "oidnGetDevice1i"});
        find(get_device_error, library, {"oidnGetDeviceError"});
        find(new_filter, library, {"oidnNewFilter"});
        find(release_filter, library, {"oidnReleaseFilter"});
        find(set_shared_filter_image, library, {"oidnSetSharedFilterImage"});
        find(set_filter_bool, library, {"oidnSetFilterBool", "oidnSetFilter1b"});
        find(set_filter_int, library, {"oidnSetFilterInt", "oidnSetFilter1i"});
        find(commit_filter, library, {"oidnCommitFilter"});
        find(execute_filter, library, {"oidnExecuteFilter"});
    }

    OidnDevice* (*new_device)(int type);
    void (*release_device)(OidnDevice* device);
    void (*commit_device)(OidnDevice* device);
    int (*get_device_int)(OidnDevice* device, const char* name);
    int (*get_device_error)(OidnDevice* device, const char** message);  // and forgets it; 0: none. Null: of no device
    OidnFilter* (*new_filter)(OidnDevice* device, const char* type);
    void (*release_filter)(OidnFilter* filter);
    void (*set_shared_filter_image)(OidnFilter* filter, const char* name, void* pixels, int format, std::size_t width,
                                    std::size_t height, std::size_t first_byte, std::size_t bytes_to_next_pixel,
                                    std::size_t bytes_to_next_row);
    void (*set_filter_bool)(OidnFilter* filter, const char* name, bool value);
    void (*set_filter_int)(OidnFilter* filter, const char* name, int value);
    void (*commit_filter)(OidnFilter* filter);
    void (*execute_filter)(OidnFilter* filter);
};

/// An image of a filter's: three of so many floats of each pixel.
struct Oidn::Image {
    const char* name;
    const float* values;  // of an output too, into which the filter writes
    std::size_t floats_per_pixel;
};

std::string name_of_oidn(std::uint32_t version) {
    return fmt::format("Open Image Denoise {}.{}.{}", version / 10000, version / 100 % 100, version % 100);
}

std::uint64_t bytes_of_oidn(std::uint64_t pixels) {
    const std::uint64_t of_images = 3 * sizeof(glm::vec3) * pixels;  // albedo, normal and picture without noise
    return of_images + std::min(kBytesOfPixel * pixels, kMostMegabytes << 20) + kBytesOfWeights;
}

Oidn::Oidn() {
    const Library library = load();
    functions_ = std::make_unique<const Functions>(library);
    const auto refuse = [&](const std::string& reason) {
        throw UsageError(fmt::format("Open Image Denoise ({}) cannot be used: {}", library.name, reason));
    };
    device_ = {functions_->new_device(kCpuDevice), functions_->release_device};
    if (!device_) refuse(told_error().value_or("it makes no device for the CPU"));
    version_ = static_cast<std::uint32_t>(functions_->get_device_int(device_.get(), "version"));
    if (version_ < kOldest) refuse(fmt::format("it is {}, expected 1.4.0 or later", name_of_oidn(version_)));
    functions_->commit_device(device_.get());
    const Filter filter(functions_->new_filter(device_.get(), kFilter), functions_->release_filter);
    if (const auto error = told_error()) refuse(*error);
}

Oidn::~Oidn() = default;

/// Returns the first error that the library has not told yet.
std::optional<std::string> Oidn::told_error() const {
    const char* message = nullptr;
    const int code = functions_->get_device_error(device_.get(), &message);
    if (code == 0) return std::nullopt;
    return message && *message ? std::string(message) : fmt::format("error {}", code);
}

/// Lets a filter make the image that is the last one. `of_picture`: a picture's, whose albedo and normal have no noise.
void Oidn::run(const Film& film, bool of_picture, std::initializer_list<Image> images) const {
    const Filter filter(functions_->new_filter(device_.get(), kFilter), functions_->release_filter);
    if (filter) {
        for (const Image& image : images) {
            const std::size_t stride = image.floats_per_pixel * sizeof(float);
            functions_->set_shared_filter_image(filter.get(), image.name, const_cast<float*>(image.values),
                                                kThreeFloats, film.width, film.height, 0, stride, stride * film.width);
        }
        if (of_picture)
            for (const char* const name : {"hdr", "cleanAux"}) functions_->set_filter_bool(filter.get(), name, true);
        functions_->set_filter_int(filter.get(), "maxMemoryMB", static_cast<int>(kMostMegabytes));
        functions_->commit_filter(filter.get());
        functions_->execute_filter(filter.get());
    }
    if (const auto error = told_error())
        throw DeviceError(name_of_oidn(version_), "", 0, fmt::format("noise was not removed: {}", *error));
}

void Oidn::denoise(Film& film) const try {
    const float* const albedo = denoiser_plane(film, Denoiser::oidn, "mean-albedo", 4);
    const float* const normal = denoiser_plane(film, Denoiser::oidn, "mean-normal", 3);
    std::vector<glm::vec3> clean_albedo(film.pixels.size()), clean_normal(film.pixels.size()),
        clean(film.pixels.size());
    const auto packed = [](const char* name, const std::vector<glm::vec3>& values) {
        return Image{name, &values.front().x, 3};
    };
    run(film, false, {{"albedo", albedo, 4}, packed("output", clean_albedo)});
    run(film, false, {{"normal", normal, 3}, packed("output", clean_normal)});
    run(film, true,
        {packed("color", film.pixels), packed("albedo", clean_albedo), packed("normal", clean_normal),
         packed("output", clean)});
    film.pixels = std::move(clean);
} catch (const std::bad_alloc&) {
    throw DeviceError(name_of_oidn(version_), "", 0, "noise was not removed: there is too little memory");
}

std::uint32_t oidn_version() {
    return Oidn().version();
}

std::uint32_t denoise_by_oidn(Film& film) {
    const Oidn oidn;
    oidn.denoise(film);
    return oidn.version();
}

}  // namespace castor
