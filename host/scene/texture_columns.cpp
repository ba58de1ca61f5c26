#include "scene/texture_columns.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "image/srgb.h"

namespace castor {

namespace {

constexpr std::uint32_t kChannels = 3;

/// Up to three neighbours in one direction whose weighted sum, divided by `total`, is an element of half the size.
struct Taps {
    std::uint32_t first = 0, count = 1;
    std::array<std::uint32_t, 3> weights{1, 0, 0};
    std::uint32_t total = 1;
};

Taps taps_of(std::uint32_t size, std::uint32_t i) {
    const std::uint32_t half = size / 2;
    if (half == 0) return {};
    if (size % 2 == 0) return {2 * i, 2, {1, 1, 0}, 2};
    return {2 * i, 3, {half - i, half, i + 1}, size};
}

/// Calls put(texel of the smaller picture, horizontal taps, vertical taps), from several threads.
template <class Put>
void for_each_texel_of_half(const Image& half, const Image& image, const Put& put) {
    tbb::parallel_for(std::uint32_t{0}, half.height, [&](std::uint32_t y) {
        const Taps down = taps_of(image.height, y);
        for (std::uint32_t x = 0; x < half.width; ++x)
            put(std::size_t{y} * half.width + x, taps_of(image.width, x), down);
    });
}

/// `value_at(texel)`: of the larger picture.
template <class Sum, class Value>
Sum weighted_sum(const Image& image, const Taps& across, const Taps& down, const Value& value_at) {
    Sum sum{};
    for (std::uint32_t j = 0; j < down.count; ++j)
        for (std::uint32_t i = 0; i < across.count; ++i) {
            const std::size_t texel = std::size_t{down.first + j} * image.width + across.first + i;
            sum += Sum(value_at(texel)) * Sum(across.weights[i]) * Sum(down.weights[j]);
        }
    return sum;
}

std::uint8_t rounded_mean(std::uint64_t sum, std::uint64_t total) {
    return static_cast<std::uint8_t>((2 * sum + total) / (2 * total));
}

/// Returns the byte whose linear value is nearest.
std::uint8_t srgb_of_linear(double linear) {
    static const std::array<double, 255> kMiddles = [] {  // between a byte's linear value and the next one's
        std::array<double, 255> middles{};
        for (std::size_t i = 0; i < middles.size(); ++i)
            middles[i] = 0.5 * (double{linear_of_srgb(static_cast<std::uint8_t>(i))} +
                                double{linear_of_srgb(static_cast<std::uint8_t>(i + 1))});
        return middles;
    }();
    return static_cast<std::uint8_t>(std::upper_bound(kMiddles.begin(), kMiddles.end(), linear) - kMiddles.begin());
}

bool has_bytes(const Image& image) {
    return image.floats.empty();
}

std::uint32_t level_count(const Image& image) {
    return static_cast<std::uint32_t>(std::bit_width(std::max(image.width, image.height)));
}

/// Whether a texture reads smaller pictures of each image.
std::vector<bool> images_with_levels(const Scene& scene) {
    std::vector<bool> result(scene.images.size());
    for (const Texture& texture : scene.textures)
        if (texture.kind == TextureKind::image && texture.filter == TextureFilter::trilinear)
            result[texture.image] = true;
    return result;
}

/// Whether a material reads colours of each image that sRGB's curve encodes.
std::vector<bool> images_of_colours(const Scene& scene) {
    std::vector<bool> result(scene.images.size());
    for (const Material& material : scene.materials) {
        if (!material.principled) continue;
        const PrincipledMaterial& m = *material.principled;
        for (const PrincipledMaterial::TextureIndex& texture :
             {m.base_color_texture, m.emissive_texture, m.specular_color_texture, m.sheen_color_texture,
              m.diffuse_transmission_color_texture})
            if (texture) result[scene.textures[*texture].image] = true;
    }
    return result;
}

/// How many words the texels of an image have.
std::size_t word_count(const Image& image) {
    return has_bytes(image) ? std::size_t{image.width} * image.height : image.floats.size();
}

void store_texels(std::uint32_t* to, const Image& image) {
    if (!has_bytes(image)) {
        std::transform(image.floats.begin(), image.floats.end(), to,
                       [](float value) { return std::bit_cast<std::uint32_t>(value); });
        return;
    }
    for (std::size_t texel = 0; texel < word_count(image); ++texel) {
        const std::uint8_t* const bytes = &image.bytes[texel * kChannels];
        const std::uint32_t alpha = image.alpha.empty() ? 255 : image.alpha[texel];
        to[texel] = static_cast<std::uint32_t>(bytes[0] | bytes[1] << 8 | bytes[2] << 16) | alpha << 24;
    }
}

/// Stores an image and its smaller ones, one after another.
void store_levels(std::uint32_t* to, const Image& image, std::uint32_t levels, bool is_srgb) {
    store_texels(to, image);
    to += word_count(image);
    Image level;
    for (std::uint32_t i = 1; i < levels; ++i) {
        level = half_size(i == 1 ? image : level, is_srgb);
        store_texels(to, level);
        to += word_count(level);
    }
}

shared::Texture to_shared(const Texture& texture) {
    shared::Texture result{};
    result.kind = static_cast<std::uint32_t>(texture.kind);
    result.target = static_cast<std::uint32_t>(texture.target);
    result.image = texture.kind == TextureKind::image ? texture.image : CASTOR_INVALID_INDEX;
    result.filter = static_cast<std::uint32_t>(texture.filter);
    result.wrap = static_cast<std::uint32_t>(texture.wrap) |
                  static_cast<std::uint32_t>(texture.wrap_v.value_or(texture.wrap)) << CASTOR_WRAP_BITS;
    result.normalizer = texture.normalizer;
    result.bump_factor = texture.bump_factor;
    result.noise_scale = texture.noise_scale;
    result.noise_octaves = texture.noise_octaves;
    result.noise_conversion = static_cast<std::uint32_t>(texture.noise_conversion);
    result.checker_scale = texture.checker_scale;
    result.checker_offset = texture.checker_offset;
    for (int i = 0; i < 3; ++i) {
        result.black[i] = texture.black[i];
        result.white[i] = texture.white[i];
        result.transform_u[i] = texture.transform[i][0];
        result.transform_v[i] = texture.transform[i][1];
    }
    result.coordinate_set = texture.coordinate_set;
    return result;
}

}  // namespace

Image half_size(const Image& image, bool is_srgb) {
    Image half{image.file, std::max(1u, image.width / 2), std::max(1u, image.height / 2)};
    const std::size_t values = std::size_t{half.width} * half.height * kChannels;
    (has_bytes(image) ? half.bytes.resize(values) : half.floats.resize(values));
    if (!image.alpha.empty()) half.alpha.resize(values / kChannels);
    for_each_texel_of_half(half, image, [&](std::size_t texel, const Taps& across, const Taps& down) {
        const std::uint64_t total = std::uint64_t{across.total} * down.total;
        for (std::uint32_t channel = 0; channel < kChannels; ++channel) {
            const std::size_t i = texel * kChannels + channel;
            const auto value = [&](std::size_t from) { return from * kChannels + channel; };
            if (!has_bytes(image)) {
                const auto sum = weighted_sum<double>(image, across, down,
                                                      [&](std::size_t from) { return image.floats[value(from)]; });
                half.floats[i] = static_cast<float>(sum / static_cast<double>(total));
            } else if (is_srgb) {
                const auto sum = weighted_sum<double>(
                    image, across, down, [&](std::size_t from) { return linear_of_srgb(image.bytes[value(from)]); });
                half.bytes[i] = srgb_of_linear(sum / static_cast<double>(total));
            } else {
                const auto sum = weighted_sum<std::uint64_t>(
                    image, across, down, [&](std::size_t from) { return image.bytes[value(from)]; });
                half.bytes[i] = rounded_mean(sum, total);
            }
        }
        if (!image.alpha.empty())
            half.alpha[texel] = rounded_mean(
                weighted_sum<std::uint64_t>(image, across, down, [&](std::size_t from) { return image.alpha[from]; }),
                total);
    });
    return half;
}

namespace {

/// The words of an image's texels, with those of so many levels.
std::uint64_t words_of_levels(const Image& image, std::uint32_t levels) {
    std::uint64_t width = image.width, height = image.height, texels = 0;
    for (std::uint32_t level = 0; level < levels; ++level) {
        texels += width * height;
        width = std::max<std::uint64_t>(1, width / 2);
        height = std::max<std::uint64_t>(1, height / 2);
    }
    return texels * (has_bytes(image) ? 1 : kChannels);
}

}  // namespace

std::uint64_t texel_words(const Scene& scene) {
    const std::vector<bool> has_levels = images_with_levels(scene);
    std::uint64_t words = 0;
    for (std::size_t i = 0; i < scene.images.size(); ++i)
        words += words_of_levels(scene.images[i], has_levels[i] ? level_count(scene.images[i]) : 1);
    return words;
}

void append_textures(SceneArrays& arrays, const Scene& scene) {
    for (const Texture& texture : scene.textures) arrays.textures.push_back(to_shared(texture));
    const std::vector<bool> has_levels = images_with_levels(scene), is_srgb = images_of_colours(scene);
    const std::size_t first = arrays.texture_images.size();
    std::uint64_t words = arrays.texels.size();
    for (std::size_t i = 0; i < scene.images.size(); ++i) {
        const Image& image = scene.images[i];
        shared::TextureImage& added = arrays.texture_images.emplace_back();
        added.width = image.width;
        added.height = image.height;
        added.format = has_bytes(image) ? CASTOR_TEXELS_BYTES : CASTOR_TEXELS_FLOATS;
        added.level_count = has_levels[i] ? level_count(image) : 1;
        added.first_texel = static_cast<std::uint32_t>(words);
        words += words_of_levels(image, added.level_count);
    }
    arrays.texels.resize(words);
    tbb::parallel_for(std::size_t{0}, scene.images.size(), [&](std::size_t i) {
        const shared::TextureImage& image = arrays.texture_images[first + i];
        store_levels(arrays.texels.data() + image.first_texel, scene.images[i], image.level_count, is_srgb[i]);
    });
}

}  // namespace castor
