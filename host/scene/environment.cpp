#include "scene/environment.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <utility>

#include "castor/image_io.h"
#include "image/srgb.h"

namespace castor {

namespace {

constexpr float kWhite = 255.0f;

void add(Scene& scene, Image image) {
    Light light;
    light.kind = Light::Kind::environment;
    light.environment.image = static_cast<std::uint32_t>(scene.images.size());
    scene.images.push_back(std::move(image));
    scene.lights.push_back(light);
}

double lobe(const glm::dvec3& d, const glm::dvec3& towards, double power) {
    const double cosine = glm::dot(d, glm::normalize(towards));
    return cosine > 0.0 ? std::pow(cosine, power) : 0.0;
}

double studio_radiance(const glm::dvec3& d) {
    return 0.31 + 0.09 * d.y + 2.2 * lobe(d, {-0.5, 0.6, 0.62}, 12) + 0.9 * lobe(d, {0.8, 0.25, 0.55}, 8) +
           1.2 * lobe(d, {0.4, 0.5, -0.77}, 16);
}

}  // namespace

void add_environment(Scene& scene, const std::filesystem::path& picture) {
    Image image = read_image(picture);
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
    image.width = 256;
    image.height = 128;
    for (std::uint32_t y = 0; y < image.height; ++y)
        for (std::uint32_t x = 0; x < image.width; ++x) {
            const double down = std::numbers::pi * (y + 0.5) / image.height;
            const double around = std::numbers::pi * (2.0 * (x + 0.5) / image.width - 1.0);
            const glm::dvec3 d(std::sin(down) * std::sin(around), std::cos(down), -std::sin(down) * std::cos(around));
            image.floats.insert(image.floats.end(), 3, kWhite * static_cast<float>(studio_radiance(d)));
        }
    add(scene, std::move(image));
}

}  // namespace castor
