#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace castor::test {

/// Returns the upper tail of the chi-square distribution: Q(k/2, x/2), by its continued fraction or series.
inline double chi_square_tail(double x, double degrees) {
    const double a = degrees / 2, z = x / 2;
    if (!(z > 0.0)) return 1.0;
    const double front = std::exp(a * std::log(z) - z - std::lgamma(a));
    if (z < a + 1) {
        double sum = 1 / a, term = sum;
        for (double n = a + 1; term > 1e-15 * sum; ++n) sum += term *= z / n;
        return 1 - front * sum;
    }
    double b = z + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int i = 1; i < 10'000; ++i) {
        const double an = -i * (i - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (std::fabs(d * c - 1) < 1e-14) break;
    }
    return front * h;
}

/// Pearson's test: the probability that numbers found differ as much from those expected by chance. Bins of few are
/// joined.
inline double chi_square(const std::vector<double>& expected, const std::vector<double>& found) {
    std::vector<std::size_t> order(expected.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
    double sum = 0.0, of_bin = 0.0, in_bin = 0.0;
    int used = 0;
    for (const std::size_t i : order) {
        of_bin += expected[i];
        in_bin += found[i];
        if (of_bin < 20.0) continue;
        sum += (in_bin - of_bin) * (in_bin - of_bin) / of_bin;
        ++used;
        of_bin = in_bin = 0.0;
    }
    if (in_bin > 50.0) return 0.0;
    return used < 2 ? 1.0 : chi_square_tail(sum, used - 1);
}

}  // namespace castor::test
