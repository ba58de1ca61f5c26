#include "scene/environment_table.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "castor/shared/constants.h"

namespace castor {

namespace {

constexpr std::uint64_t kMostCells = std::uint64_t{1} << 19;
constexpr std::uint32_t kParts = CASTOR_EMITTER_PARTS;
constexpr double kPi = std::numbers::pi;

/// How a picture is cut into cells.
struct Grid {
    Grid(std::uint32_t picture_width, std::uint32_t picture_height) : width(picture_width), height(picture_height) {
        while (std::uint64_t{columns()} * rows() > kMostCells) ++texel_bits;
        across_bits = static_cast<std::uint32_t>(std::bit_width(columns() - 1));
        down_bits = static_cast<std::uint32_t>(std::bit_width(rows() - 1));
    }

    std::uint32_t columns() const { return ((width - 1) >> texel_bits) + 1; }
    std::uint32_t rows() const { return ((height - 1) >> texel_bits) + 1; }
    std::uint32_t bits() const { return across_bits + down_bits; }
    std::uint32_t levels() const { return std::max((bits() + 1) / 2, 1u); }
    /// Words of the level that has so many below it.
    std::uint32_t words_of_level(std::uint32_t below) const { return std::max(1u << (bits() - 2 * below), 4u); }
    std::uint32_t words_of_tree() const {
        std::uint32_t words = 4;
        for (std::uint32_t below = 0; below < levels(); ++below) words += words_of_level(below);
        return words;
    }
    std::uint32_t words() const { return CASTOR_ENVIRONMENT_HEADER + 2 * words_of_tree(); }

    std::uint32_t width, height;  // in texels
    std::uint32_t texel_bits = 0, across_bits = 0, down_bits = 0;
};

struct Cell {
    std::uint32_t x = 0, y = 0;
};

Cell cell_of_number(const Grid& grid, std::uint32_t number) {
    const std::uint32_t bits = std::min(grid.across_bits, grid.down_bits);
    Cell cell;
    for (std::uint32_t bit = 0; bit < bits; ++bit) {
        cell.x |= (number >> (2 * bit) & 1) << bit;
        cell.y |= (number >> (2 * bit + 1) & 1) << bit;
    }
    (grid.across_bits > grid.down_bits ? cell.x : cell.y) |= number >> (2 * bits) << bits;
    return cell;
}

bool is_in_picture(const Grid& grid, const Cell& cell) {
    return cell.x < grid.columns() && cell.y < grid.rows();
}

/// Returns the solid angle of a texel.
double solid_angle(const Image& image, EnvironmentMapping mapping, std::uint32_t x, std::uint32_t y) {
    if (mapping == EnvironmentMapping::latlong) {
        const double half_row = 0.5 * kPi / image.height;
        return 4.0 * kPi / image.width * std::sin((2.0 * y + 1.0) * half_row) * std::sin(half_row);
    }
    const auto nearest = [](std::uint32_t i, std::uint32_t size) {  // to the middle, from -1 to 1
        return std::clamp(0.0, 2.0 * i / size - 1.0, 2.0 * (i + 1.0) / size - 1.0);
    };
    const double radius = std::hypot(nearest(x, image.width), nearest(y, image.height));
    if (radius >= 1.0) return 0.0;
    const double widening = radius > 0.0 ? std::sin(kPi * radius) / radius : kPi;
    return 4.0 * kPi * widening / (double(image.width) * image.height);
}

double brightness(const Image& image, std::size_t texel) {
    double sum = 0.0;
    for (std::size_t i = 3 * texel; i < 3 * texel + 3; ++i)
        sum += image.floats.empty() ? image.bytes[i] : double(image.floats[i]);
    return sum;
}

struct CellSums {
    double light = 0.0, angle = 0.0;
};

/// Texels [begin, end) along an axis, and the texels beside them, since light is interpolated: a texel's own place gets
/// 3/4 of it, and each neighbour's 1/8.
struct Span {
    std::int64_t begin, end;
    std::uint32_t nearest(std::int64_t texel) const {
        return static_cast<std::uint32_t>(std::clamp(texel, begin, end - 1));
    }
    /// Returns the share of the light of a texel from begin - 1 to end that falls on the texels.
    double share(std::int64_t texel) const {
        double share = texel >= begin && texel < end ? 0.75 : 0.0;
        for (const std::int64_t beside : {texel - 1, texel + 1})
            if (beside >= begin && beside < end) share += 0.125;
        return share;
    }
};

CellSums sums_of_cell(const Grid& grid, const Image& image, EnvironmentMapping mapping, const Cell& cell) {
    const auto span_of = [&](std::uint32_t number, std::int64_t size) {
        const std::int64_t begin = std::int64_t{number} << grid.texel_bits;
        return Span{begin, std::min(begin + (std::int64_t{1} << grid.texel_bits), size)};
    };
    const std::int64_t width = image.width, height = image.height;
    const Span columns = span_of(cell.x, width), rows = span_of(cell.y, height);
    const bool is_latlong = mapping == EnvironmentMapping::latlong;
    CellSums sums;
    for (std::int64_t row = rows.begin - 1; row <= rows.end; ++row) {
        const std::int64_t y = std::clamp<std::int64_t>(row, 0, height - 1), inner_y = rows.nearest(row);
        const double of_row = is_latlong ? solid_angle(image, mapping, 0, inner_y) : 0.0;
        for (std::int64_t column = columns.begin - 1; column <= columns.end; ++column) {
            const std::int64_t x =
                is_latlong ? (column + width) % width : std::clamp<std::int64_t>(column, 0, width - 1);
            const std::int64_t inner_x = columns.nearest(column);
            const double angle = is_latlong ? of_row : solid_angle(image, mapping, inner_x, inner_y);
            if (inner_x == column && inner_y == row) sums.angle += angle;
            sums.light += angle * rows.share(row) * columns.share(column) *
                          brightness(image, static_cast<std::size_t>(y * width + x));
        }
    }
    return sums;
}

/// Deals the parts out: one to each cell that has a weight, the others by the sums of the weights up to each cell.
/// Returns the first part of each cell.
std::vector<std::uint32_t> first_parts(const std::vector<double>& weights) {
    double total = 0.0;
    std::uint32_t spare = kParts;
    for (const double weight : weights) {
        total += weight;
        if (weight > 0.0) --spare;
    }
    std::vector<std::uint32_t> first;
    first.reserve(weights.size());
    double sum = 0.0;
    std::uint32_t ones = 0;
    for (const double weight : weights) {
        first.push_back(ones + static_cast<std::uint32_t>(std::min(1.0, sum / total) * spare + 0.5));
        sum += weight;
        if (weight > 0.0) ++ones;
    }
    return first;
}

/// Returns a tree over the first parts of the cells.
std::vector<std::uint32_t> tree_over(const Grid& grid, std::span<const std::uint32_t> first) {
    std::vector<std::uint32_t> tree;
    tree.reserve(grid.words_of_tree());
    for (std::uint32_t below = grid.levels(); below-- > 0;) {
        const std::size_t end = tree.size() + grid.words_of_level(below);
        for (std::size_t cell = 0; cell < first.size(); cell += std::size_t{1} << (2 * below))
            tree.push_back(first[cell]);
        tree.resize(end, kParts);
    }
    tree.resize(tree.size() + 4, kParts);
    return tree;
}

bool is_black(const std::vector<double>& weights) {
    return std::all_of(weights.begin(), weights.end(), [](double weight) { return !(weight > 0.0); });
}

}  // namespace

std::uint64_t environment_table_words(std::uint32_t width, std::uint32_t height) {
    return Grid(width, height).words();
}

std::uint64_t environment_table_words(const Scene& scene) {
    std::uint64_t words = 0;
    for (const Light& light : scene.lights) {
        if (light.kind != Light::Kind::environment || light.environment.sampling != EnvironmentSampling::picture)
            continue;
        const Image& image = scene.images[light.environment.image];
        words += environment_table_words(image.width, image.height);
    }
    return words;
}

std::uint32_t append_environment_table(Column<std::uint32_t>& parts, const Image& image, EnvironmentMapping mapping) {
    const Grid grid(image.width, image.height);
    const std::size_t cell_count = std::size_t{1} << grid.bits();
    std::vector<CellSums> sums(cell_count);
    tbb::parallel_for(std::size_t{0}, cell_count, [&](std::size_t number) {
        const Cell cell = cell_of_number(grid, static_cast<std::uint32_t>(number));
        if (is_in_picture(grid, cell)) sums[number] = sums_of_cell(grid, image, mapping, cell);
    });
    double light = 0.0, angle = 0.0;
    for (const CellSums& cell : sums) {
        light += cell.light;
        angle += cell.angle;
    }
    std::vector<double> plain, compensated;
    plain.reserve(cell_count);
    compensated.reserve(cell_count);
    // What is above the average by rounding alone is not.
    const double average = light / angle * (1.0 + 1e-9);
    for (const CellSums& cell : sums) {
        plain.push_back(light > 0.0 ? cell.light : cell.angle);
        compensated.push_back(std::max(0.0, cell.light - cell.angle * average));
    }
    if (is_black(compensated)) compensated = plain;

    const auto first_word = static_cast<std::uint32_t>(parts.size());
    for (const std::uint32_t word : {grid.across_bits, grid.down_bits, grid.texel_bits, grid.words_of_tree()})
        parts.push_back(word);
    for (const std::vector<double>& weights : {plain, compensated}) {
        const std::vector<std::uint32_t> tree = tree_over(grid, first_parts(weights));
        parts.insert(parts.end(), tree.begin(), tree.end());
    }
    return first_word;
}

double mean_radiance(const Image& image, EnvironmentMapping mapping) {
    std::vector<CellSums> rows(image.height);
    tbb::parallel_for(std::uint32_t{0}, image.height, [&](std::uint32_t y) {
        for (std::uint32_t x = 0; x < image.width; ++x) {
            const double angle = solid_angle(image, mapping, x, y);
            rows[y].angle += angle;
            rows[y].light += angle * brightness(image, std::size_t{y} * image.width + x);
        }
    });
    CellSums sum;
    for (const CellSums& row : rows) {
        sum.light += row.light;
        sum.angle += row.angle;
    }
    return sum.light / (3.0 * sum.angle);
}

std::string problem_of_environment_table(std::span<const std::uint32_t> table, std::uint32_t width,
                                         std::uint32_t height) {
    const Grid grid(width, height);
    if (table.size() < grid.words())
        return fmt::format("a table of {} words, expected {} for {} x {} texels", table.size(), grid.words(), width,
                           height);
    if (table[0] != grid.across_bits || table[1] != grid.down_bits || table[2] != grid.texel_bits ||
        table[3] != grid.words_of_tree())
        return fmt::format("a table for 2^{} x 2^{} cells of 2^{} texels, expected 2^{} x 2^{} of 2^{}", table[0],
                           table[1], table[2], grid.across_bits, grid.down_bits, grid.texel_bits);
    const std::size_t cell_count = std::size_t{1} << grid.bits();
    for (int number = 0; number < 2; ++number) {
        const auto tree =
            table.subspan(CASTOR_ENVIRONMENT_HEADER + number * grid.words_of_tree(), grid.words_of_tree());
        const auto first = tree.subspan(tree.size() - 4 - grid.words_of_level(0));
        if (first[0] != 0) return "a table whose first part is not 0";
        for (std::size_t cell = 0; cell < cell_count; ++cell) {
            const std::uint32_t end = cell + 1 < cell_count ? first[cell + 1] : kParts;
            const bool is_empty = first[cell] == end;
            if (first[cell] > end || end > kParts ||
                !(is_empty || is_in_picture(grid, cell_of_number(grid, static_cast<std::uint32_t>(cell)))))
                return fmt::format("a table whose cell {} has the parts {} to {} of {}", cell, first[cell], end,
                                   kParts);
        }
        if (!std::ranges::equal(tree_over(grid, first.first(cell_count)), tree))
            return "a table whose tree does not lead to its cells";
    }
    return "";
}

}  // namespace castor
