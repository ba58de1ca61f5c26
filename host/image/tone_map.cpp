#include "castor/tone_map.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/name_table.h"
#include "castor/error.h"

namespace castor {

namespace {

constexpr std::array kOperators = {
    Named<ToneOperator>{ToneOperator::photographic, "photographic"},
    Named<ToneOperator>{ToneOperator::aces, "aces"},
    Named<ToneOperator>{ToneOperator::filmic, "filmic"},
    Named<ToneOperator>{ToneOperator::linear, "linear"},
};

/// A channel as the operators take it: finite and not negative.
double channel(float value) {
    return value > 0.0f ? double{std::min(value, std::numeric_limits<float>::max())} : 0.0;  // NaN is not above 0
}

double luminance(const glm::vec3& pixel) {
    return 0.2126 * channel(pixel.x) + 0.7152 * channel(pixel.y) + 0.0722 * channel(pixel.z);
}

std::vector<double> luminances(const Film& film) {
    std::vector<double> values(film.pixels.size());
    std::transform(film.pixels.begin(), film.pixels.end(), values.begin(), luminance);
    return values;
}

double log_average(const std::vector<double>& values) {
    constexpr double kDarkest = 1e-6;  // so that black has a logarithm
    double sum = 0.0;
    for (const double value : values) sum += std::log(kDarkest + value);
    return std::exp(sum / static_cast<double>(values.size()));
}

/// Returns the value that `percent` of the values exceed: the largest one for 0.
double value_exceeded_by(std::vector<double> values, double percent) {
    const double rank = static_cast<double>(values.size() - 1) * (1.0 - percent / 100.0);
    const auto place = values.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(values.begin(), place, values.end());
    return *place;
}

/// Narkowicz 2015.
double aces(double x) {
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
}

/// Hable 2010.
double filmic(double x) {
    return (x * (0.22 * x + 0.03) + 0.002) / (x * (0.22 * x + 0.3) + 0.06) - 0.01 / 0.3;
}

/// What any pixel has where white is black.
constexpr double kBeyondWhite = std::numeric_limits<double>::max();

/// Returns the curve's value, divided by that of white.
template <class Curve>
double relative_to_white(Curve curve, double l, double white) {
    return white > 0.0 ? curve(l) / curve(white) : kBeyondWhite;
}

double photographic(double l, double white, bool burns) {
    const double simple = l / (1.0 + l);
    if (!burns) return simple;
    return white > 0.0 ? simple * (1.0 + l / (white * white)) : kBeyondWhite;
}

double display_luminance(const ToneMap& map, double l, double white) {
    switch (map.tone_operator) {
        case ToneOperator::aces:
            return relative_to_white(aces, l, white);
        case ToneOperator::filmic:
            return relative_to_white(filmic, l, white);
        case ToneOperator::photographic:
        case ToneOperator::linear:  // see encode_linear
            break;
    }
    return photographic(l, white, map.burn_percent > 0.0f);
}

/// IEC 61966-2-1, where 1 stays 1: the difference below is a little less.
double srgb(double value) {
    if (value == 1.0) return value;
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

std::uint8_t encode(const ToneMap& map, double value) {
    const double limited = std::clamp(value, 0.0, 1.0);
    const double encoded = map.is_srgb ? srgb(limited) : std::pow(limited, 1.0 / double{map.gamma});
    return static_cast<std::uint8_t>(255.0 * encoded);
}

void check(const Film& film, const ToneMap& map) {
    if (film.pixels.empty() || film.pixels.size() != std::size_t{film.width} * film.height)
        throw UsageError(fmt::format("the tone map is of a film of {}x{} pixels that has {}", film.width, film.height,
                                     film.pixels.size()));
    const auto require = [](bool holds, const char* name, float value, const char* expected) {
        if (!holds) throw UsageError(fmt::format("the tone map's {} is {}, expected {}", name, value, expected));
    };
    const auto is_positive = [](float value) { return value > 0.0f && std::isfinite(value); };
    require(is_positive(map.key), "key", map.key, "a number above 0");
    require(map.burn_percent >= 0.0f && map.burn_percent <= 100.0f, "burn_percent", map.burn_percent, "0 to 100");
    require(map.saturation == 0.0f || is_positive(map.saturation), "saturation", map.saturation, "at least 0");
    require(map.is_srgb || is_positive(map.gamma), "gamma", map.gamma, "a number above 0");
}

/// Encodes a film whose channels are scaled, and nothing else.
void encode_linear(const Film& film, const ToneMap& map, Image& image) {
    const double scale = double{map.key} / 255.0;
    tbb::parallel_for(std::size_t{0}, film.pixels.size(), [&](std::size_t i) {
        for (int c = 0; c < 3; ++c)
            image.bytes[3 * i + static_cast<std::size_t>(c)] = encode(map, scale * channel(film.pixels[i][c]));
    });
}

}  // namespace

Image apply_tone_map(const Film& film, const ToneMap& map) {
    check(film, map);
    Image image;
    image.width = film.width;
    image.height = film.height;
    image.bytes.resize(film.pixels.size() * 3);
    if (map.tone_operator == ToneOperator::linear) {
        encode_linear(film, map, image);
        return image;
    }
    std::vector<double> scaled = luminances(film);
    const double scale = double{map.key} / log_average(scaled);
    for (double& value : scaled) value *= scale;
    const double white = value_exceeded_by(scaled, map.burn_percent);

    tbb::parallel_for(std::size_t{0}, film.pixels.size(), [&](std::size_t i) {
        const glm::vec3& pixel = film.pixels[i];
        const double y = luminance(pixel);
        if (y == 0.0) return;  // black
        const double display = display_luminance(map, scaled[i], white);
        for (int c = 0; c < 3; ++c) {
            const double ratio = std::pow(channel(pixel[c]) / y, double{map.saturation});
            image.bytes[3 * i + static_cast<std::size_t>(c)] = encode(map, display * ratio);
        }
    });
    return image;
}

ToneOperator tone_operator_from_string(std::string_view word) {
    return value_of(kOperators, word, "tone operator");
}

std::string_view to_string(ToneOperator tone_operator) {
    return name_of(kOperators, tone_operator);
}

}  // namespace castor
