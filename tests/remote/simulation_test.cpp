// The real schedule and protocol on a simulated cluster, whose clock runs as fast as it can.
#include <algorithm>

#include "remote/simulated_cluster.h"
#include "support/catch.h"

namespace castor::test {
namespace {

bool each_once(const ClusterOutcome& outcome) {
    return std::all_of(outcome.times_done.begin(), outcome.times_done.end(),
                       [](std::uint8_t times) { return times == 1; });
}

}  // namespace

TEST_CASE("every item counts once, whoever dies, stalls or becomes slow", "[remote]") {
    const std::size_t workers = GENERATE(1u, 2u, 7u, 64u);
    const std::uint32_t seed = GENERATE(range(1u, 9u));
    CAPTURE(workers, seed);
    ClusterModel model{.workers = workers, .items = 1000, .mean_seconds = 60.0, .seed = seed};
    if (workers > 2) {
        model.dying_share = 0.2;
        model.stalling_share = 0.3;
        model.straggling_share = 0.2;
        model.stall_seconds = 30.0;  // some beyond the deadline: they are dropped, and come back
    }
    const ClusterOutcome outcome = SimulatedCluster(model).run();
    CAPTURE(outcome.seconds, outcome.ideal_seconds, outcome.dropped);
    CHECK(each_once(outcome));
}

TEST_CASE("thousands of ranks of which some die take 1.05 of the ideal time, and rank 0 has time", "[remote]") {
    // 518400 blocks are a picture of 7680x4320.
    ClusterModel model{.workers = 4096, .items = 518400, .mean_seconds = 300.0, .dying_share = 0.01};
    SECTION("one in a hundred dies") {}
    SECTION("as many stand still for a while, or become five times slower") {
        model.stalling_share = model.straggling_share = 0.01;
    }
    SECTION("ten thousand") {
        model.workers = 10000;
    }
    const ClusterOutcome outcome = SimulatedCluster(model).run();
    CAPTURE(outcome.seconds, outcome.ideal_seconds, outcome.busy_share, outcome.messages, outcome.dropped);
    CHECK(each_once(outcome));
    CHECK(outcome.dropped >= 20);
    CHECK(outcome.seconds <= 1.05 * outcome.ideal_seconds);
    CHECK(outcome.busy_share <= 0.2);
    // Each block's pixels cross the network once, but for those of copies.
    CHECK(static_cast<double>(outcome.item_results) <= 1.01 * static_cast<double>(model.items));
}

}  // namespace castor::test
