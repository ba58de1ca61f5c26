#include "ray_file.h"

#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <span>
#include <system_error>

#include "base/atomic_file.h"
#include "castor/error.h"

namespace castor::cli {

static_assert(std::endian::native == std::endian::little, "records are copied without conversion");

std::vector<Ray> read_rays(const std::filesystem::path& file) {
    const auto fail = [&](const std::string& step) {
        throw SceneError(file.string(), 0, fmt::format("{}: {}", step, std::generic_category().message(errno)));
    };
    const std::unique_ptr<std::FILE, decltype(&std::fclose)> input(std::fopen(file.c_str(), "rb"), &std::fclose);
    if (!input) fail("the ray file cannot be opened");
    // The size is not queried beforehand, so that pipes work too.
    std::vector<Ray> rays;
    constexpr std::size_t kFirstRays = 1u << 10, kFurtherRays = 1u << 16;
    std::size_t bytes = 0;
    for (bool more = true; more;) {
        if (bytes == rays.size() * sizeof(Ray)) rays.resize(rays.size() + (bytes == 0 ? kFirstRays : kFurtherRays));
        const std::size_t read =
            std::fread(reinterpret_cast<char*>(rays.data()) + bytes, 1, rays.size() * sizeof(Ray) - bytes, input.get());
        bytes += read;
        more = read > 0;
    }
    if (std::ferror(input.get())) fail("the ray file cannot be read");
    if (bytes % sizeof(Ray) != 0)
        throw SceneError(
            file.string(), 0,
            fmt::format(
                "the ray file has {} bytes, which is not a multiple of {}: each ray has eight float32 (origin xyz, "
                "t_min, direction xyz, t_max)",
                bytes, sizeof(Ray)));
    rays.resize(bytes / sizeof(Ray));
    return rays;
}

void write_answers(const std::filesystem::path& file, const RayAnswers& answers) {
    const std::span<const std::byte> pieces[] = {std::as_bytes(std::span(answers.counts)),
                                                 std::as_bytes(std::span(answers.hits))};
    write_file_atomically(file, pieces);
}

}  // namespace castor::cli
