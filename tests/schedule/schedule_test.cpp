// How work is divided over workers of different speeds, and what happens where they fail, hang, or are slow.
#include "schedule/schedule.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "base/stopwatch.h"
#include "castor/error.h"
#include "schedule/crew.h"
#include "support/catch.h"
#include "trace/device_pace.h"

namespace castor::test {
namespace {

/// Items that are done by counting them. A worker takes `seconds` for each.
class Counts {
public:
    explicit Counts(std::size_t items) : counts_(items) {}

    WorkerFunction worker(double seconds, std::uint64_t most_items = 1000) {
        return [this, seconds, most_items](Schedule& schedule, std::size_t worker) {
            if (seconds > 0) schedule.set_speed(worker, 1 / seconds);
            while (const auto piece = schedule.take(worker, most_items)) {
                bool is_wanted = true;
                for (std::uint64_t i = piece->begin; i < piece->end && is_wanted; ++i) {
                    if (seconds > 0) std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
                    is_wanted = schedule.is_wanted(worker);
                }
                if (is_wanted) schedule.finish(worker, [&] { count(*piece); });
            }
        };
    }
    void count(const Range& piece) {
        for (std::uint64_t i = piece.begin; i < piece.end; ++i) ++counts_[i];
    }
    bool all_once() const {
        return std::all_of(counts_.begin(), counts_.end(), [](const auto& count) { return count == 1; });
    }
    std::uint64_t total() const {
        std::uint64_t sum = 0;
        for (const auto& count : counts_) sum += count;
        return sum;
    }

private:
    std::vector<std::atomic<int>> counts_;
};

std::shared_ptr<Schedule> schedule_of(std::uint64_t items, std::size_t workers) {
    return std::make_shared<Schedule>(std::vector<Range>{{0, items}}, workers);
}

}  // namespace

TEST_CASE("every item is done once, whatever the number and speed of the workers", "[schedule]") {
    const std::size_t workers = GENERATE(1u, 2u, 5u);
    const std::uint64_t items = GENERATE(0u, 1u, 2u, 7u, 300u);
    CAPTURE(workers, items);
    Counts counts(items);
    std::vector<WorkerFunction> functions;
    for (std::size_t i = 0; i < workers; ++i)
        functions.push_back(counts.worker(i == 0 ? 0.0 : 1e-5 * static_cast<double>(i)));
    run_crew(schedule_of(items, workers), functions, {});
    CHECK(counts.all_once());
}

TEST_CASE("pieces do not reach beyond a range, nor beyond what a worker can hold", "[schedule]") {
    Schedule schedule({{0, 10}, {10, 11}, {20, 50}}, 1);
    std::vector<Range> pieces;
    while (const auto piece = schedule.take(0, 16)) {
        pieces.push_back(*piece);
        schedule.finish(0, [] {});
    }
    CHECK(pieces == std::vector<Range>{{0, 10}, {10, 11}, {20, 36}, {36, 50}});
}

TEST_CASE("shares follow speeds, and pieces shrink towards the end", "[schedule]") {
    Schedule schedule({{0, 100000}}, 2);
    schedule.set_speed(0, 3000.0);
    schedule.set_speed(1, 1000.0);
    const auto fast = schedule.take(0, 1000000), slow = schedule.take(1, 1000000);
    CHECK(fast->size() == 37500);  // half of its three quarters
    CHECK(slow->size() == 62500 / 8);
    schedule.finish(0, [] {});
    std::uint64_t last = fast->size();
    while (last > 15) {  // of 3000 a second in 5 ms
        const auto next = schedule.take(0, 1000000);
        REQUIRE(next);
        CHECK(next->size() <= last);
        last = next->size();
        schedule.finish(0, [] {});
    }
}

TEST_CASE("a worker that fails has its piece done by others, and is told of", "[schedule]") {
    Counts counts(500);
    std::vector<std::string> dropped;
    const WorkerFunction fails = [](Schedule& schedule, std::size_t worker) {
        schedule.take(worker, 100);
        throw DeviceError("broken", "clFinish", -5, "");
    };
    CrewOptions options;
    options.on_drop = [&](std::size_t worker, const DeviceError& why) {
        dropped.push_back(std::to_string(worker) + why.what());
    };
    const auto schedule = schedule_of(500, 3);
    run_crew(schedule, {fails, counts.worker(1e-5), fails}, options);
    CHECK(counts.all_once());
    CHECK(schedule->items_left() == 0);
    REQUIRE(dropped.size() == 2);
    CHECK(dropped[0].find("broken: clFinish failed") != std::string::npos);
}

TEST_CASE("where all workers fail the work is left, and the crew ends", "[schedule]") {
    const WorkerFunction fails = [](Schedule& schedule, std::size_t worker) {
        schedule.take(worker, 10);
        schedule.finish(worker, [] {});
        schedule.take(worker, 10);
        throw DeviceError("broken", "clFinish", -5, "");
    };
    const auto schedule = schedule_of(100, 2);
    run_crew(schedule, {fails, fails}, {});
    CHECK(schedule->items_left() == 80);
}

TEST_CASE("a worker that hangs is left alone after the deadline, and cannot store when it wakes", "[schedule]") {
    auto counts = std::make_shared<Counts>(200);
    auto woken = std::make_shared<std::atomic<int>>(0);
    auto wake = std::make_shared<std::atomic<bool>>(false);
    const WorkerFunction hangs = [=](Schedule& schedule, std::size_t worker) {
        const auto piece = schedule.take(worker, 50);
        while (!*wake) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        const bool stored = schedule.finish(worker, [&] { counts->count(*piece); });
        *woken = stored || schedule.is_wanted(worker) || schedule.take(worker, 50) ? 1 : 2;
    };
    CrewOptions options{.deadlines = {.seconds = 0.1}};
    std::string why;
    options.on_drop = [&](std::size_t, const DeviceError& error) { why = error.what(); };
    options.names = {"stuck", "good"};
    run_crew(schedule_of(200, 2), {hangs, counts->worker(1e-4, 20)}, options);
    CHECK(counts->all_once());
    CHECK(why == "stuck: has not answered for 0.1 s");
    CHECK(threads_left_behind() == 1);
    *wake = true;
    for (int i = 0; i < 20000 && threads_left_behind() > 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    CHECK(threads_left_behind() == 0);
    CHECK(*woken == 2);
    CHECK(counts->all_once());
}

TEST_CASE("an idle worker takes up what a slow one is at, and the first counts", "[schedule]") {
    Schedule schedule({{0, 20}}, 2);
    schedule.set_speed(0, 1000.0);
    schedule.set_speed(1, 10.0);
    const auto slow = schedule.take(1, 10);
    REQUIRE(slow == Range{0, 1});
    std::uint64_t done = 0;
    while (done < 19) {
        const auto piece = schedule.take(0, 100);
        REQUIRE(piece->begin >= 1);
        done += piece->size();
        CHECK(schedule.finish(0, [] {}));
    }
    const auto copy = schedule.take(0, 100);
    CHECK(copy == slow);
    CHECK(schedule.is_wanted(1));
    CHECK(schedule.finish(0, [] {}));
    CHECK_FALSE(schedule.is_wanted(1));
    CHECK_FALSE(schedule.finish(1, [] { FAIL("stored twice"); }));
    CHECK_FALSE(schedule.take(0, 100));
    CHECK_FALSE(schedule.take(1, 100));
}

TEST_CASE("a piece is taken up also where it is larger than what the worker gets at a time", "[schedule]") {
    Schedule schedule({{0, 20}}, 2);
    schedule.set_speed(0, 1000.0);
    const auto slow = schedule.take(1, 20);  // of a worker whose driver compiles
    REQUIRE(slow->size() > 3);
    std::uint64_t done = slow->size();
    while (done < 20) {
        const auto piece = schedule.take(0, 1, 3);
        REQUIRE(piece->size() == 1);
        ++done;
        CHECK(schedule.finish(0, [] {}));
    }
    CHECK(schedule.take(0, 1, slow->size()) == slow);
    CHECK(schedule.finish(0, [] {}));
    CHECK_FALSE(schedule.take(0, 1, 20));
}

TEST_CASE("slices last some 40 ms, and make all of a device work", "[schedule]") {
    Device device;
    device.compute_units = 4;
    device.type = DeviceType::cpu;
    constexpr std::uint64_t kMany = 1'000'000'000;
    Pace pace = first_pace(Strategy::wide, device), brute = first_pace(Strategy::brute, device);
    CHECK(pace.items_in_slice(kMany) == 16);
    CHECK(brute.items_in_slice(kMany) == 4);
    CHECK(brute.items_in_slice(3) == 3);
    pace.add(16, 5.0);  // compiles
    CHECK(pace.items_in_slice(kMany) == 16);
    pace.add(16, 0.001);
    CHECK(pace.items_in_slice(kMany) == 640);
    CHECK(pace.items_in_slice(100) == 100);
    brute.add(4, 1.0);
    brute.add(4, 1.0);
    CHECK(brute.items_in_slice(kMany) == 4);
    CHECK(brute.items_in_slice(3) == 3);
    device.type = DeviceType::gpu;
    CHECK(first_pace(Strategy::wide, device).items_in_slice(kMany) == 128);
    CHECK(first_pace(Strategy::brute, device).items_in_slice(kMany) == 128);
    device.compute_units = 0;
    device.type = DeviceType::cpu;
    CHECK(first_pace(Strategy::brute, device).items_in_slice(kMany) == 1);
}

TEST_CASE("slices are longer where they cost much however few items they have", "[schedule]") {
    constexpr std::uint64_t kMany = 1'000'000'000;
    const auto settled = [](double fixed, double of_item) {
        Pace pace(16, 16);
        for (int i = 0; i < 30; ++i) {
            const std::uint64_t items = pace.items_in_slice(kMany);
            pace.add(items, fixed + of_item * static_cast<double>(items));
        }
        return pace;
    };
    const Pace plain = settled(0.0, 1e-5), costly = settled(0.01, 1e-5), longest = settled(0.036, 1e-5),
               hopeless = settled(1.0, 1e-5);
    CHECK(plain.items_in_slice(kMany) == Approx(4000).epsilon(0.01));
    // 0.2 s, of which a twentieth is fixed.
    CHECK(costly.items_in_slice(kMany) == Approx(19000).epsilon(0.01));
    CHECK(costly.expected_seconds(19000) == Approx(0.2).epsilon(0.01));
    CHECK(costly.items_per_second() == Approx(95000).epsilon(0.01));
    CHECK(longest.items_in_slice(kMany) == Approx(46400).epsilon(0.01));  // 0.5 s
    // Nothing helps where each slice is longer than the longest.
    CHECK(hopeless.items_in_slice(kMany) == 16);
}

TEST_CASE("what two workers have and one gives up is not handed out again", "[schedule]") {
    Schedule schedule({{0, 2}}, 3);
    for (const std::size_t worker : {0u, 1u, 2u}) schedule.set_speed(worker, worker == 1 ? 1e-3 : 1.0);
    const auto piece = schedule.take(1, 2);
    REQUIRE(piece->size() == 1);
    const auto other = schedule.take(0, 2);
    CHECK(schedule.finish(0, [] {}));
    REQUIRE(schedule.take(0, 2) == piece);
    CHECK(schedule.drop(1));
    CHECK(schedule.items_left() == 1);
    CHECK(schedule.finish(0, [] {}));
    CHECK_FALSE(schedule.take(2, 2));
    CHECK(other != piece);
}

TEST_CASE("stopping ends a crew, and keeps what workers have so far", "[schedule]") {
    Counts counts(100000);
    int kept = 0;
    const WorkerFunction keeps = [&](Schedule& schedule, std::size_t worker) {
        while (schedule.take(worker, 100)) {
            while (schedule.is_wanted(worker)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            schedule.keep(worker, [&] { ++kept; });
        }
    };
    CrewOptions options;
    int ticks = 0;
    options.tick = [&] { return ++ticks < 3; };
    run_crew(schedule_of(100000, 1), {keeps}, options);
    CHECK(ticks == 3);
    CHECK(kept == 1);
}

TEST_CASE("a worker has its time from the stop on, not from its last sign", "[schedule]") {
    const auto schedule = schedule_of(1, 1);
    const Stopwatch watch;
    std::string why;
    std::atomic<bool> is_kept = false;
    const WorkerFunction slow = [&](Schedule& s, std::size_t worker) {
        s.take(worker, 1);
        std::this_thread::sleep_for(
            std::chrono::milliseconds(1300));  // longer than the stop's deadline, but not from the stop on
        is_kept = s.keep(worker, [] {});
    };
    run_crew(schedule, {slow},
             {.deadlines = {.stop_seconds = 1.0},
              .names = {"slow"},
              .tick = [&] { return watch.seconds() < 1.1; },
              .on_drop = [&](std::size_t, const DeviceError& error) { why = error.what(); }});
    INFO(why);
    CHECK(is_kept);
}

TEST_CASE("a worker that is busy when all is done is not waited for", "[schedule]") {
    const auto schedule = schedule_of(20, 2);
    const auto counts = std::make_shared<Counts>(20);
    const auto may_end = std::make_shared<std::atomic<bool>>(false);
    std::vector<std::size_t> left, dropped;
    CrewOptions options;
    options.deadlines.stop_seconds = 0.1;
    options.on_leave = [&](std::size_t worker) { left.push_back(worker); };
    options.on_drop = [&](std::size_t worker, const DeviceError&) { dropped.push_back(worker); };
    const WorkerFunction compiles = [may_end](Schedule& s, std::size_t worker) {
        while (!*may_end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        s.take(worker, 1);
    };
    run_crew(schedule, {counts->worker(0.001), compiles}, options);
    CHECK(counts->all_once());
    CHECK(left == std::vector<std::size_t>{1});
    CHECK(dropped.empty());
    CHECK(threads_left_behind() == 1);
    *may_end = true;
    for (int i = 0; i < 60000 && threads_left_behind() > 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    CHECK(threads_left_behind() == 0);
}

TEST_CASE("time in which the process did not run is not the workers' silence", "[schedule]") {
    const auto schedule = schedule_of(1, 1);
    schedule->take(0, 1);
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    CHECK(schedule->silent_workers(0.05) == std::vector<std::size_t>{0});
    schedule->excuse(1.0);
    CHECK(schedule->silent_workers(0.05).empty());
}

TEST_CASE("a single worker can work in the caller's thread, and be watched and stopped", "[schedule]") {
    Counts counts(300);
    std::thread::id id;
    int ticks = 0;
    const WorkerFunction counts_here = [&](Schedule& schedule, std::size_t worker) {
        id = std::this_thread::get_id();
        counts.worker(1e-5, 10)(schedule, worker);
    };
    CrewOptions options;
    options.in_callers_thread = {true};
    options.tick = [&] { return ++ticks < 100; };
    run_crew(schedule_of(300, 1), {counts_here}, options);
    CHECK(id == std::this_thread::get_id());
    CHECK(ticks == 100);
    CHECK(counts.total() == 90);  // eleven ticks for each piece of ten
    std::string why;
    options.tick = {};
    options.on_drop = [&](std::size_t, const DeviceError& error) { why = error.what(); };
    run_crew(schedule_of(5, 1), {[](Schedule&, std::size_t) { throw DeviceError("broken", "clFinish", -5, ""); }},
             options);
    CHECK(why.find("broken: clFinish failed") == 0);
}

TEST_CASE("a worker in the caller's thread watches over those in threads of their own", "[schedule]") {
    auto counts = std::make_shared<Counts>(300);
    std::thread::id id;
    auto other_id = std::make_shared<std::atomic<std::thread::id>>();
    const WorkerFunction stays = [&](Schedule& schedule, std::size_t worker) {
        id = std::this_thread::get_id();
        counts->worker(1e-4, 10)(schedule, worker);
    };
    CrewOptions options;
    options.in_callers_thread = {false, true};
    options.names = {"other", "here"};
    std::string why;
    options.on_drop = [&](std::size_t, const DeviceError& error) { why = error.what(); };

    SECTION("which share the work") {
        const WorkerFunction shares = [&](Schedule& schedule, std::size_t worker) {
            *other_id = std::this_thread::get_id();
            counts->worker(1e-4, 10)(schedule, worker);
        };
        run_crew(schedule_of(300, 2), {shares, stays}, options);
        CHECK(counts->all_once());
        CHECK(id == std::this_thread::get_id());
        CHECK(other_id->load() != id);
        CHECK(why.empty());
    }
    SECTION("and may hang") {
        auto wake = std::make_shared<std::atomic<bool>>(false);
        auto has_piece = std::make_shared<std::atomic<bool>>(false);
        const WorkerFunction hangs = [=](Schedule& schedule, std::size_t worker) {
            schedule.take(worker, 300);
            *has_piece = true;
            while (!*wake) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        };
        const WorkerFunction waits = [&](Schedule& schedule, std::size_t worker) {
            while (!*has_piece) std::this_thread::yield();
            stays(schedule, worker);
        };
        options.deadlines.seconds = 0.1;
        run_crew(schedule_of(300, 2), {hangs, waits}, options);
        CHECK(counts->all_once());
        CHECK(id == std::this_thread::get_id());
        CHECK(why == "other: has not answered for 0.1 s");
        *wake = true;
        for (int i = 0; i < 20000 && threads_left_behind() > 0; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        CHECK(threads_left_behind() == 0);
    }
    SECTION("and has more time than they have") {
        options.deadlines.seconds = 0.05;
        const WorkerFunction is_slow = [&](Schedule& schedule, std::size_t worker) {
            const auto piece = schedule.take(worker, 300);
            std::this_thread::sleep_for(std::chrono::milliseconds(200));
            if (piece) schedule.finish(worker, [&] { counts->count(*piece); });
            stays(schedule, worker);
        };
        run_crew(schedule_of(300, 2), {counts->worker(1e-5, 10), is_slow}, options);
        CHECK(counts->all_once());
        CHECK(why.empty());
    }
}

TEST_CASE("several workers in the caller's thread work one after another", "[schedule]") {
    Counts counts(100);
    CrewOptions options{.deadlines = {.seconds = 0.05}};
    options.in_callers_thread = {true, true};
    std::vector<std::size_t> dropped;
    options.on_drop = [&](std::size_t worker, const DeviceError&) { dropped.push_back(worker); };
    const WorkerFunction fails = [](Schedule& schedule, std::size_t worker) {
        schedule.take(worker, 10);
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        throw DeviceError("broken", "clFinish", -5, "");
    };
    run_crew(schedule_of(100, 2), {fails, counts.worker(1e-5, 10)}, options);
    CHECK(counts.all_once());
    CHECK(dropped == std::vector<std::size_t>{0});
}

TEST_CASE("other exceptions stop the crew and reach the caller", "[schedule]") {
    struct Unforeseen {};
    Counts counts(100000);
    const WorkerFunction throws = [](Schedule&, std::size_t) { throw Unforeseen(); };
    CHECK_THROWS_AS(run_crew(schedule_of(100000, 2), {counts.worker(1e-3, 10), throws}, {}), Unforeseen);
    CHECK(counts.total() < 100000);
    CrewOptions options;
    options.tick = []() -> bool { throw Unforeseen(); };
    CHECK_THROWS_AS(run_crew(schedule_of(100000, 1), {counts.worker(1e-3, 10)}, options), Unforeseen);
}

}  // namespace castor::test
