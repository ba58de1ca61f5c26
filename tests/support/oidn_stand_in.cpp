// Stands in for Open Image Denoise in tests: the functions of its C interface that Castor calls, which check how they
// are called, and a filter whose result tells which values it was given. OIDN_STAND_IN_VERSION (10403 for 1.4.3) is
// what it says of itself; before 2.0 some functions have their old names. Without OIDN_STAND_IN_EXECUTES it lacks a
// function. The environment variable OIDN_STAND_IN_FAILS names a function that reports an error.
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <utility>

namespace {

constexpr int kError = 1, kCpu = 1, kFloat3 = 3;

struct Image {
    unsigned char* bytes;
    std::size_t width, height, bytes_to_next_pixel, bytes_to_next_row;
};

bool is_to_fail(const char* function) {
    const char* const named = std::getenv("OIDN_STAND_IN_FAILS");
    return named && std::strcmp(named, function) == 0;
}

}  // namespace

struct OIDNDeviceImpl {
    bool is_committed = false;
    std::string error{};  // the first that was not asked for
    int filters = 0;
};
struct OIDNFilterImpl {
    OIDNDeviceImpl* device;
    std::map<std::string, Image> images{};
    std::map<std::string, int> numbers{};
    bool is_committed = false;
};

namespace {

OIDNDeviceImpl no_device;  // errors of what is no device's

void report(OIDNDeviceImpl* device, const std::string& error) {
    if (device->error.empty()) device->error = error;
}

/// The values of one input become 0.5 of themselves plus 0.25. Those of a picture, its light times albedo plus normal.
[[maybe_unused]] void execute(OIDNFilterImpl& filter) {
    const auto refuse = [&](const char* what) { report(filter.device, what); };
    const auto is_there = [&](const char* name) { return filter.images.count(name) > 0; };
    if (!filter.is_committed) return refuse("the filter is not committed");
    if (!is_there("output")) return refuse("there is no output");
    const Image& output = filter.images.at("output");
    for (const auto& [name, image] : filter.images)
        if (image.width != output.width || image.height != output.height) return refuse("images differ in size");
    const bool is_picture = is_there("color");
    if (is_picture && !(is_there("albedo") && is_there("normal"))) return refuse("albedo or normal is missing");
    if (!is_picture && filter.images.size() != 2) return refuse("one input is expected");
    if (is_picture != (filter.numbers["hdr"] == 1) || is_picture != (filter.numbers["cleanAux"] == 1))
        return refuse("hdr and cleanAux are of pictures");
    if (filter.numbers["maxMemoryMB"] < 1) return refuse("memory is not limited");
    const auto value = [&](const char* name, std::size_t x, std::size_t y, std::size_t c) -> float& {
        const Image& image = filter.images.at(name);
        unsigned char* const pixel = image.bytes + y * image.bytes_to_next_row + x * image.bytes_to_next_pixel;
        return reinterpret_cast<float*>(pixel)[c];
    };
    for (std::size_t y = 0; y < output.height; ++y)
        for (std::size_t x = 0; x < output.width; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                value("output", x, y, c) =
                    is_picture ? value("color", x, y, c) * value("albedo", x, y, c) + value("normal", x, y, c)
                               : 0.5f * value(is_there("albedo") ? "albedo" : "normal", x, y, c) + 0.25f;
}

}  // namespace

extern "C" {

OIDNDeviceImpl* oidnNewDevice(int type) {
    if (type != kCpu) report(&no_device, "memory of the process is for the CPU's device alone");
    if (is_to_fail("oidnNewDevice")) report(&no_device, "no device today");
    return no_device.error.empty() ? new OIDNDeviceImpl : nullptr;
}

void oidnReleaseDevice(OIDNDeviceImpl* device) {
    if (device->filters > 0) std::abort();
    delete device;
}

void oidnCommitDevice(OIDNDeviceImpl* device) {
    device->is_committed = true;
    if (is_to_fail("oidnCommitDevice")) report(device, "not on this processor");
}

#if OIDN_STAND_IN_VERSION >= 20000
int oidnGetDeviceInt(OIDNDeviceImpl*, const char* name) {
#else
int oidnGetDevice1i(OIDNDeviceImpl*, const char* name) {
#endif
    return std::strcmp(name, "version") == 0 ? OIDN_STAND_IN_VERSION : -1;
}

int oidnGetDeviceError(OIDNDeviceImpl* device, const char** message) {
    static thread_local std::string told;
    if (!device) device = &no_device;
    told = std::exchange(device->error, {});
    *message = told.empty() ? nullptr : told.c_str();
    return told.empty() ? 0 : kError;
}

OIDNFilterImpl* oidnNewFilter(OIDNDeviceImpl* device, const char* type) {
    if (!device->is_committed) report(device, "the device is not committed");
    if (std::strcmp(type, "RT") != 0) report(device, "there is no such filter");
    if (!device->error.empty()) return nullptr;
    ++device->filters;
    return new OIDNFilterImpl{device};
}

void oidnReleaseFilter(OIDNFilterImpl* filter) {
    --filter->device->filters;
    delete filter;
}

void oidnSetSharedFilterImage(OIDNFilterImpl* filter, const char* name, void* pixels, int format, std::size_t width,
                              std::size_t height, std::size_t first_byte, std::size_t bytes_to_next_pixel,
                              std::size_t bytes_to_next_row) {
    if (format != kFloat3 || !pixels) report(filter->device, "images have three floats a pixel");
    Image image{static_cast<unsigned char*>(pixels) + first_byte, width, height, bytes_to_next_pixel,
                bytes_to_next_row};
    if (image.bytes_to_next_pixel == 0) image.bytes_to_next_pixel = 3 * sizeof(float);
    if (image.bytes_to_next_row == 0) image.bytes_to_next_row = width * image.bytes_to_next_pixel;
    filter->images[name] = image;
    filter->is_committed = false;
}

#if OIDN_STAND_IN_VERSION >= 20000
void oidnSetFilterBool(OIDNFilterImpl* filter, const char* name, bool value) {
#else
void oidnSetFilter1b(OIDNFilterImpl* filter, const char* name, bool value) {
#endif
    filter->numbers[name] = value;
    filter->is_committed = false;
}

#if OIDN_STAND_IN_VERSION >= 20000
void oidnSetFilterInt(OIDNFilterImpl* filter, const char* name, int value) {
#else
void oidnSetFilter1i(OIDNFilterImpl* filter, const char* name, int value) {
#endif
    filter->numbers[name] = value;
    filter->is_committed = false;
}

void oidnCommitFilter(OIDNFilterImpl* filter) {
    filter->is_committed = true;
}

#ifdef OIDN_STAND_IN_EXECUTES
void oidnExecuteFilter(OIDNFilterImpl* filter) {
    if (is_to_fail("oidnExecuteFilter")) return report(filter->device, "out of luck");
    execute(*filter);
}
#endif

}  // extern "C"
