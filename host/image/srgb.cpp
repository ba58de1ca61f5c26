#include "image/srgb.h"

#include <array>
#include <cmath>

namespace castor {

float linear_of_srgb(std::uint8_t byte) {
    static const std::array<float, 256> kTable = [] {
        std::array<float, 256> table{};
        for (std::size_t i = 0; i < table.size(); ++i) {
            const double value = static_cast<double>(i) / 255.0;
            table[i] = static_cast<float>(value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4));
        }
        return table;
    }();
    return kTable[byte];
}

}  // namespace castor
