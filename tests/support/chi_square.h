#pragma once

#include <cmath>

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

}  // namespace castor::test
