// Prints how well ranks are used on a simulated cluster, from ten ranks to MOST or ten thousand, as a JSON document for
// scripts/compare_throughput --ranks:
//
//     castor_rank_curve [MOST]
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "remote/simulated_cluster.h"

namespace {

using castor::test::ClusterModel;
using castor::test::ClusterOutcome;
using castor::test::SimulatedCluster;

struct Trouble {
    const char* name;
    double dying_share, stalling_share, straggling_share;
};

constexpr Trouble kTroubles[] = {{"nobody fails", 0.0, 0.0, 0.0},
                                 {"1 % die", 0.01, 0.0, 0.0},
                                 {"1 % die, 1 % stand still, 1 % become slow", 0.01, 0.01, 0.01}};
constexpr std::size_t kRanks[] = {10, 30, 100, 300, 1000, 3000, 4096, 10000};
constexpr std::uint32_t kSeeds = 3;

}  // namespace

int main(int argc, char** argv) try {
    const std::size_t most = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : kRanks[std::size(kRanks) - 1];
    // A picture of 7680x4320, for which all ranks together need five minutes.
    const ClusterModel model{.items = 518400, .mean_seconds = 300.0};
    std::string runs;  // a line each
    for (const Trouble& trouble : kTroubles)
        for (const std::size_t ranks : kRanks)
            for (std::uint32_t seed = 1; ranks <= most && seed <= kSeeds; ++seed) {
                ClusterModel of = model;
                of.workers = ranks;
                of.seed = seed;
                of.dying_share = trouble.dying_share;
                of.stalling_share = trouble.stalling_share;
                of.straggling_share = trouble.straggling_share;
                const ClusterOutcome outcome = SimulatedCluster(of).run();
                const nlohmann::ordered_json run{{"trouble", trouble.name},
                                                 {"ranks", ranks},
                                                 {"seed", seed},
                                                 {"seconds", outcome.seconds},
                                                 {"efficiency", outcome.efficiency()},
                                                 {"busy_share", outcome.busy_share},
                                                 {"messages", outcome.messages},
                                                 {"dropped", outcome.dropped}};
                runs += (runs.empty() ? "  " : ",\n  ") + run.dump();
            }
    std::printf("{\"items\": %ju, \"mean_seconds\": %g, \"runs\": [\n%s\n]}\n", std::uintmax_t{model.items},
                model.mean_seconds, runs.c_str());
    return std::fflush(stdout) == 0 ? 0 : 1;
} catch (const std::exception& error) {
    std::fprintf(stderr, "castor_rank_curve: %s\n", error.what());
    return 1;
}
