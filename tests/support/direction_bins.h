#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <utility>
#include <vector>

#include "reference/random_source.h"
#include "support/chi_square.h"

namespace castor::test {

/// A map from the unit square to directions, which need not be how directions are drawn: bins of directions are the
/// squares of a grid.
struct Chart {
    std::function<glm::dvec2(const glm::dvec3& wi)> to_square;  // outside of it where wi is not on the chart
    /// Returns wi and the solid angle for an area of the square.
    std::function<std::pair<glm::dvec3, double>(const glm::dvec2& at)> from_square;
};

/// Angle (x = sqrt(1 - cos)) and azimuth, of the upper side (+1) or the lower (-1).
inline Chart hemisphere(double side) {
    return {[side](const glm::dvec3& wi) {
                return wi.z * side > 0.0 ? glm::dvec2(std::sqrt(std::max(1 - std::fabs(wi.z), 0.0)),
                                                      0.5 + std::atan2(wi.y, wi.x) / (2 * std::numbers::pi))
                                         : glm::dvec2(-1);
            },
            [side](const glm::dvec2& at) {
                const double phi = 2 * std::numbers::pi * (at.y - 0.5), z = 1 - at.x * at.x, r = std::sqrt(1 - z * z);
                return std::pair(glm::dvec3(r * std::cos(phi), r * std::sin(phi), side * z),
                                 4 * std::numbers::pi * at.x);
            }};
}

/// The part of a chart that lies before x = `end`.
inline Chart up_to(const Chart& chart, double end) {
    return {[=](const glm::dvec3& wi) {
                const glm::dvec2 at = chart.to_square(wi);
                return at.x < end ? glm::dvec2(at.x / end, at.y) : glm::dvec2(-1);
            },
            [=](const glm::dvec2& at) {
                const auto [wi, angle] = chart.from_square({at.x * end, at.y});
                return std::pair(wi, angle * end);
            }};
}

/// A chart without what lies on others.
inline Chart without(const Chart& chart, const std::vector<Chart>& others) {
    return {[=](const glm::dvec3& wi) {
                for (const Chart& other : others)
                    if (other.to_square(wi).x >= 0.0) return glm::dvec2(-1);
                return chart.to_square(wi);
            },
            chart.from_square};
}

/// The expected and found numbers of directions in the bins of a chart.
struct Bins {
    std::vector<double> expected, found;
};

inline constexpr int kColumns = 12, kRows = 20;

/// Adds the bins of one chart. What lies on none is left out of the sums.
/// `samples`: of which wi() is drawn with the density pdf(); 0: went nowhere. `densities_of`: returns the densities of
/// directions, whose number is a multiple of 16. `points`: in a row and a column of a bin, for the integral of the
/// density.
template <class Samples, class Densities>
void add_chart(Bins& bins, const Chart& chart, const Samples& samples, const Densities& densities_of, int points) {
    const std::size_t first = bins.expected.size();
    bins.expected.resize(first + kColumns * kRows);
    bins.found.resize(first + kColumns * kRows);
    for (const auto& sample : samples) {
        if (!(sample.pdf() > 0.0)) continue;
        const glm::dvec2 at = chart.to_square(sample.wi());
        if (at.x < 0.0) continue;
        const int x = std::min(int(at.x * kColumns), kColumns - 1), y = std::min(int(at.y * kRows), kRows - 1);
        ++bins.found[first + x * kRows + y];
    }
    // Midpoints. In bins that the horizon cuts points lie closer, and anywhere in their cells: in lines along the
    // horizon, all of them would be wrong alike.
    reference::RandomSource random(99);
    struct Cell {
        std::size_t bin;
        int points;
    };
    std::vector<Cell> cells;
    for (int x = 0; x < kColumns; ++x)
        for (int y = 0; y < kRows; ++y) {
            int above = 0;
            for (int i = 0; i < 36; ++i) {
                const glm::dvec2 at((x + (i / 6 + 0.02) / 5.04) / kColumns, (y + (i % 6 + 0.02) / 5.04) / kRows);
                const auto [wi, angle] = chart.from_square(glm::min(at, glm::dvec2(1 - 1e-9)));
                above += angle > 0.0 && chart.to_square(wi).x >= 0.0;
            }
            if (above > 0)
                cells.push_back({first + std::size_t(x) * kRows + std::size_t(y), above == 36 ? points : 4 * points});
        }
    std::vector<glm::vec3> wis;
    std::vector<std::pair<std::size_t, double>> shares;  // bin and solid angle
    for (const Cell& cell : cells) {
        const std::size_t place = cell.bin - first;
        const auto offset = [&] { return cell.points == points ? 0.5 : random.uniform(0, 1); };
        for (int i = 0; i < cell.points * cell.points; ++i) {
            const glm::dvec2 at((double(place / kRows) + (i / cell.points + offset()) / cell.points) / kColumns,
                                (double(place % kRows) + (i % cell.points + offset()) / cell.points) / kRows);
            const auto [wi, angle] = chart.from_square(at);
            if (!(angle > 0.0) || chart.to_square(wi).x < 0.0) continue;
            wis.push_back(glm::vec3(wi));
            shares.emplace_back(cell.bin, angle / (kColumns * kRows * cell.points * cell.points));
        }
    }
    if (wis.empty()) return;
    wis.resize((wis.size() + 15) / 16 * 16, glm::vec3(0, 0, 1));
    const std::vector<double> densities = densities_of(wis);
    for (std::size_t i = 0; i < shares.size(); ++i)
        bins.expected[shares[i].first] += double(samples.size()) * densities[i] * shares[i].second;
}

/// Pearson's test of `count` directions; bins of few are joined, and those that went nowhere are a bin too.
inline double chi_square(const Bins& bins, std::size_t count) {
    std::vector<std::size_t> order(bins.expected.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return bins.expected[a] < bins.expected[b]; });
    double sum = 0.0, expected = 0.0, found = 0.0, all_expected = 0.0, all_found = 0.0;
    int used = 0;
    const auto close = [&] {
        sum += (found - expected) * (found - expected) / expected;
        ++used;
        expected = found = 0.0;
    };
    for (const std::size_t i : order) {
        expected += bins.expected[i];
        found += bins.found[i];
        all_expected += bins.expected[i];
        all_found += bins.found[i];
        if (expected >= 20.0) close();
    }
    expected += std::max(double(count) - all_expected, 0.0);  // that went nowhere
    found += double(count) - all_found;
    if (expected >= 5.0)
        close();
    else if (found > 30.0)
        return 0.0;
    return used < 2 ? 1.0 : chi_square_tail(sum, used - 1);
}

}  // namespace castor::test
