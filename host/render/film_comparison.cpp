#include "render/film_comparison.h"

#include <fmt/format.h>

#include <bit>
#include <cstdlib>
#include <utility>

namespace castor {

namespace {

/// Maps floats to integers in the same order.
std::int64_t ordered(float value) {
    const auto bits = std::bit_cast<std::int32_t>(value);
    return bits >= 0 ? bits : std::int64_t{INT32_MIN} - bits;
}
std::uint64_t distance(float a, float b) {
    return static_cast<std::uint64_t>(std::abs(ordered(a) - ordered(b)));
}
std::uint64_t distance(std::uint32_t a, std::uint32_t b) {
    return a < b ? b - a : a - b;
}

}  // namespace

void FilmComparison::compare(const Film& second, std::size_t pixel, const std::string& first_maker,
                             const std::string& second_maker) {
    ++result_.pixels;
    bool is_equal = true;
    const auto check = [&](const std::string& channel, const auto& a, const auto& b) {
        if (std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b)) return;
        const auto x = static_cast<std::uint32_t>(pixel % first_.width),
                   y = static_cast<std::uint32_t>(pixel / first_.width);
        if (is_equal) ++result_.differing_pixels;
        is_equal = false;
        if (result_.first && std::pair(result_.first->y, result_.first->x) <= std::pair(y, x)) return;
        result_.first =
            PixelDifference{x, y, channel, {first_maker, second_maker}, {double(a), double(b)}, distance(a, b)};
    };
    for (int i = 0; i < 3; ++i) check(std::string(1, "RGB"[i]), first_.pixels[pixel][i], second.pixels[pixel][i]);
    for (std::size_t p = 0; p < first_.planes.size(); ++p) {
        const FilmPlane &a = first_.planes[p], &b = second.planes[p];
        const std::size_t channels = a.channels.size();
        for (std::size_t c = 0; c < channels; ++c) {
            const std::string name = a.name + "." + a.channels[c];
            if (a.indices.empty())
                check(name, a.values[pixel * channels + c], b.values[pixel * channels + c]);
            else
                check(name, a.indices[pixel * channels + c], b.indices[pixel * channels + c]);
        }
    }
}

std::string describe(const PixelDifference& difference) {
    return fmt::format("({}, {}), {}: {:.9g} from {}, {:.9g} from {}, {} units in the last place apart", difference.x,
                       difference.y, difference.channel, difference.values[0], difference.devices[0],
                       difference.values[1], difference.devices[1], difference.distance);
}

}  // namespace castor
