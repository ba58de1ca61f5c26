#include "castor/tone_map.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/mat3x3.hpp>
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
    Named<ToneOperator>{ToneOperator::agx, "agx"},
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
        case ToneOperator::agx:     // see encode_agx
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

/// Wrensch 2023: the curve of Sobotka's AgX as a polynomial, for x from 0 at the darkest stop to 1 at the brightest.
double agx_curve(double x) {
    constexpr std::array kCoefficients{15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232};
    double value = 0.0;
    for (const double coefficient : kCoefficients) value = value * x + coefficient;
    return value;
}

// Wrensch 2023, by columns: to the primaries in which the curve is applied, and back.
const glm::dmat3 kAgxInset(0.842479062253094, 0.0423282422610123, 0.0423756549057051,  //
                           0.0784335999999992, 0.878468636469772, 0.0784336,           //
                           0.0792237451477643, 0.0791661274605434, 0.879142973793104);
const glm::dmat3 kAgxOutset(1.19687900512017, -0.0528968517574562, -0.0529716355144438,  //
                            -0.0980208811401368, 1.15190312990417, -0.0980434501171241,  //
                            -0.0990297440797205, -0.0989611768448433, 1.15107367264116);

/// Returns what AgX makes of linear values, of which 0.18 is middle grey, as values for a display of gamma 2.2, not yet
/// limited. `saturation` is that of Wrensch's looks.
glm::dvec3 agx(const glm::dvec3& linear, double saturation) {
    constexpr double kDarkest = -12.47393, kBrightest = 4.026069;  // stops
    glm::dvec3 value = kAgxInset * linear;
    for (int c = 0; c < 3; ++c) {
        const double stops = std::clamp(std::log2(value[c]), kDarkest, kBrightest);
        value[c] = agx_curve((stops - kDarkest) / (kBrightest - kDarkest));
    }
    const double grey = 0.2126 * value.x + 0.7152 * value.y + 0.0722 * value.z;
    return kAgxOutset * (grey + saturation * (value - grey));
}

/// Encodes a film of which AgX looks at each pixel alone.
void encode_agx(const Film& film, const ToneMap& map, Image& image) {
    constexpr double kMiddleGrey = 0.18, kDisplayGamma = 2.2;
    const double scale = double{map.key} / kMiddleGrey / 255.0;
    tbb::parallel_for(std::size_t{0}, film.pixels.size(), [&](std::size_t i) {
        const glm::vec3& pixel = film.pixels[i];
        const glm::dvec3 shown =
            agx(scale * glm::dvec3(channel(pixel.x), channel(pixel.y), channel(pixel.z)), double{map.saturation});
        for (int c = 0; c < 3; ++c)
            image.bytes[3 * i + static_cast<std::size_t>(c)] =
                encode(map, std::pow(std::max(shown[c], 0.0), kDisplayGamma));
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
    if (map.tone_operator == ToneOperator::agx) {
        encode_agx(film, map, image);
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
