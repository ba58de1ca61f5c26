// Runs the targets of the fuzzer (see scripts/fuzz) over their seeds and over damaged ones, in any build.
#include <random>

#include "fuzz/targets.h"
#include "support/catch.h"

namespace castor::fuzz {

TEST_CASE("every fuzz target takes its seeds, cut short and damaged ones too", "[fuzz]") {
    constexpr unsigned kDamaged = 60;
    for (const Target& target : targets()) {
        const std::vector<std::string> seeds = target.seeds();
        REQUIRE(!seeds.empty());
        for (std::size_t s = 0; s < seeds.size(); ++s) {
            CAPTURE(target.name, s);
            CHECK_NOTHROW(target.run(seeds[s]));
            std::mt19937 random(static_cast<unsigned>(s));
            for (unsigned i = 0; i < kDamaged && !seeds[s].empty(); ++i) {
                CAPTURE(i);
                std::string bytes = seeds[s];
                for (unsigned change = 0; change <= i % 4; ++change)
                    bytes[random() % bytes.size()] = static_cast<char>(random());
                if (i % 3 == 0) bytes.resize(random() % bytes.size());
                CHECK_NOTHROW(target.run(bytes));
            }
        }
    }
}

}  // namespace castor::fuzz
