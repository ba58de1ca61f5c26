#include "scene/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "castor/image_io.h"
#include "image/decode.h"
#include "image/srgb.h"
#include "scene/principled.h"

namespace castor {

namespace {

void add(Scene& scene, Image image) {
    Light light;
    light.kind = Light::Kind::environment;
    light.environment.image = static_cast<std::uint32_t>(scene.images.size());
    scene.images.push_back(std::move(image));
    scene.lights.push_back(light);
}

double square(double x) {
    return x * x;
}

double studio_radiance(const glm::dvec3& d) {
    static const glm::dvec3 kKey = glm::normalize(glm::dvec3(-0.5, 0.6, 0.62));
    static const glm::dvec3 kFill = glm::normalize(glm::dvec3(0.8, 0.25, 0.55));
    static const glm::dvec3 kRim = glm::normalize(glm::dvec3(0.4, 0.5, -0.77));
    const auto to_fourth = [&d](const glm::dvec3& towards) {
        return square(square(std::max(glm::dot(d, towards), 0.0)));
    };
    const double key = to_fourth(kKey), fill = to_fourth(kFill), rim = to_fourth(kRim);
    return 0.31 + 0.09 * d.y + 2.2 * square(key) * key + 0.9 * square(fill) + 1.2 * square(square(rim));
}

}  // namespace

void clamp_radiances(Image& image, std::vector<Warning>& warnings) {
    std::size_t count = 0, first = 0;
    for (std::size_t i = 0; i < image.floats.size(); ++i)
        if (image.floats[i] < 0.0f && count++ == 0) first = i;
    if (count == 0) return;
    warnings.push_back({image.file, 0,
                        fmt::format("{}; negative radiances count as 0 ({} of {} values)", describe_value(image, first),
                                    count, image.floats.size())});
    for (float& value : image.floats) value = std::max(value, 0.0f);
}

void add_environment(Scene& scene, const std::filesystem::path& picture) {
    Image image = read_image(picture);
    clamp_radiances(image, scene.warnings);
    if (image.floats.empty()) {
        for (const std::uint8_t byte : image.bytes) image.floats.push_back(linear_of_srgb(byte));
        image.bytes.clear();
        image.alpha.clear();
    }
    for (float& value : image.floats) value *= kWhite;
    add(scene, std::move(image));
}

void add_studio(Scene& scene) {
    Image image;
    image.width = 1024;
    image.height = 512;
    image.floats.reserve(std::size_t{3} * image.width * image.height);
    std::vector<glm::dvec2> around;  // x and z in the plane y = 0
    for (std::uint32_t x = 0; x < image.width; ++x) {
        const double angle = std::numbers::pi * (2.0 * (x + 0.5) / image.width - 1.0);
        around.emplace_back(std::sin(angle), -std::cos(angle));
    }
    for (std::uint32_t y = 0; y < image.height; ++y) {
        const double down = std::numbers::pi * (y + 0.5) / image.height;
        const double sine = std::sin(down), cosine = std::cos(down);
        for (const glm::dvec2& a : around) {
            const double radiance = studio_radiance({sine * a.x, cosine, sine * a.y});
            image.floats.insert(image.floats.end(), 3, kWhite * static_cast<float>(radiance));
        }
    }
    add(scene, std::move(image));
}

}  // namespace castor
