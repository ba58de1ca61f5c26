// What manager and ranks tell each other: introductions, jobs one after the other, and all that can go wrong.
#include "remote/manager.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/stopwatch.h"
#include "castor/error.h"
#include "remote/memory_network.h"
#include "remote/rank_server.h"
#include "schedule/crew.h"
#include "support/catch.h"

namespace castor::test {
namespace {

/// A job whose items are done by counting them. Workers send their range back.
class CountingJob : public RemoteJob {
public:
    CountingJob(std::string description, std::uint64_t items) : description_(std::move(description)), counts_(items) {}

    const std::string& description() const override { return description_; }
    void ready(std::size_t worker, const WorkerState& state) override {
        schedule->set_speed(worker, state.items_per_second);
    }
    std::optional<Bytes> begin(std::size_t, const Range& piece) override { return ByteWriter().add(piece).take(); }
    Answer progress(std::size_t worker, std::uint64_t) override {
        if (schedule->is_wanted(worker)) return Answer::go_on;
        return schedule->is_stopped() ? Answer::give_back : Answer::abandon;
    }
    std::optional<Bytes> take(std::size_t worker, std::span<const std::byte> result) override {
        ByteReader reader(result);
        const auto range = reader.take<Range>();
        reader.expect_end();
        schedule->finish(worker, [&] {
            for (std::uint64_t item = range.begin; item < range.end; ++item) ++counts_.at(item);
        });
        return std::nullopt;
    }
    void end(std::size_t) override {}

    bool all_once() const {
        return std::all_of(counts_.begin(), counts_.end(), [](int count) { return count == 1; });
    }
    std::shared_ptr<Schedule> schedule;

private:
    std::string description_;
    std::vector<int> counts_;
};

/// A worker that takes 0.1 ms for each item.
class SlowWorker : public OrderedWorker {
public:
    WorkerState state() const override { return {0.0, 1e4, 50, 50}; }
    Bytes work(std::span<const std::byte> order, const OnProgress& on_progress) override {
        const auto range = ByteReader(order).take<Range>();
        for (std::uint64_t item = range.begin; item < range.end; ++item) {
            std::this_thread::sleep_for(std::chrono::microseconds(100));
            if (!on_progress(item - range.begin)) break;
        }
        return ByteWriter().add(range).take();
    }
};

OrderedWorkerOffer offer(bool stays = false) {
    return {stays, [](const std::function<bool()>&) { return std::make_unique<SlowWorker>(); }};
}

/// What a rank does in a thread of its own.
class RankThread {
public:
    using Jobs = std::vector<std::string>;  // their descriptions

    RankThread(MemoryNetwork& network, std::size_t rank, RankIntroduction introduction, Jobs jobs,
               std::vector<OrderedWorkerOffer> offers, double deadline_seconds = 60.0)
        : thread_([=, this, &network] {
              const auto transport = network.endpoint(rank);
              RankServer server(*transport, 60.0, deadline_seconds);
              try {
                  server.introduce(introduction);
                  try {
                      for (const std::string& job : jobs)
                          if (!server.serve(job, offers)) break;
                  } catch (const DeviceError& error) {
                      error_ = error.what();
                  }
                  server.finish();
              } catch (const DeviceError& error) {
                  last_error_ = error.what();
              }
          }) {}
    ~RankThread() { join(); }
    void join() {
        if (thread_.joinable()) thread_.join();
    }
    const std::string& error() const { return error_; }            // of a job
    const std::string& last_error() const { return last_error_; }  // of waiting for the end

private:
    std::string error_, last_error_;
    std::thread thread_;
};

RankIntroduction introduction(std::size_t workers = 1) {
    return {"v1", "host", "", std::vector<std::string>(workers, "device"), std::vector<std::string>(workers)};
}

bool go_on() {
    return true;
}

struct JobOutcome {
    std::vector<std::string> failures;
    std::uint64_t items_left = 0;
};

/// Lets the manager's workers alone do a job.
JobOutcome run_job(Manager& manager, CountingJob& job, std::uint64_t items, const std::function<bool()>& tick = {},
                   double deadline_seconds = 60.0) {
    job.schedule = std::make_shared<Schedule>(std::vector<Range>{{0, items}}, manager.workers().size());
    JobOutcome outcome;
    CrewOptions options;
    options.deadlines = {deadline_seconds, 1.0};
    options.serve = [&] { return manager.serve(); };
    options.tick = tick;
    options.on_drop = [&](std::size_t worker, const DeviceError& why) {
        outcome.failures.push_back(why.what());
        manager.drop_worker(worker);
    };
    std::vector<WorkerFunction> functions;
    for (std::size_t i = 0; i < manager.workers().size(); ++i) {
        options.names.push_back(manager.workers()[i].name);
        functions.push_back(manager.is_dropped(i) ? WorkerFunction([](Schedule&, std::size_t) {}) : nullptr);
    }
    manager.begin_job(job);
    manager.begin_schedule(job.schedule, 0);
    run_crew(job.schedule, functions, options);
    manager.end_job();
    outcome.items_left = job.schedule->items_left();
    return outcome;
}

}  // namespace

TEST_CASE("ranks do job after job, and say goodbye", "[remote]") {
    const bool stays = GENERATE(false, true);
    MemoryNetwork network(3);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    RankThread one(network, 1, introduction(2), {"a", "b", "c"}, {offer(), offer(stays)});
    RankThread two(network, 2, introduction(), {"a", "b", "c"}, {offer()});
    manager.gather(60.0, go_on);
    REQUIRE(manager.workers().size() == 3);
    CHECK(manager.workers()[0].name == "device");
    for (const char* description : {"a", "b"}) {
        CountingJob job(description, 1000);
        CHECK(run_job(manager, job, 1000).failures.empty());
        CHECK(job.all_once());
    }
    CHECK(manager.end(60.0));  // although a third was expected
    one.join();
    two.join();
    CHECK(one.error() + two.error() + one.last_error() + two.last_error() == "");
    CHECK(manager.take_notices().empty());
}

TEST_CASE("a rank of another version, without a device, or at another picture is refused by name", "[remote]") {
    MemoryNetwork network(5);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    RankIntroduction other = introduction();
    other.version = "v2";
    other.host = "old";
    RankIntroduction empty{"v1", "bare", "there is no OpenCL platform", {}, {}};
    RankThread old(network, 1, other, {"a"}, {offer()}), bare(network, 2, empty, {}, {});
    RankThread elsewhere(network, 3, introduction(), {"size 9x9\nsamples 4"}, {offer()});
    RankThread good(network, 4, introduction(), {"size 8x8\nsamples 4"}, {offer()});
    manager.gather(60.0, go_on);
    const std::vector<std::string> notices = manager.take_notices();
    REQUIRE(notices.size() == 2);
    const std::string all = notices[0] + notices[1];
    CHECK(all.find("old (rank 1): is refused: it is of another version: v2, and here is v1") != std::string::npos);
    CHECK(all.find("bare (rank 2): there is no OpenCL platform") != std::string::npos);
    CHECK(manager.workers().size() == 2);
    CountingJob job("size 8x8\nsamples 4", 1000);
    const JobOutcome outcome = run_job(manager, job, 1000);
    CHECK(job.all_once());
    REQUIRE(outcome.failures.size() == 1);
    CHECK(
        outcome.failures[0].find("host (rank 3): is refused: its picture or batch is another one: it has \"size 9x9\", "
                                 "and that of rank 0 has \"size 8x8\"") != std::string::npos);
    CHECK(manager.end(60.0));  // those who were refused as well
    old.join();
    elsewhere.join();
    CHECK(old.error().find("another version") != std::string::npos);
    CHECK(elsewhere.error().find("size 9x9") != std::string::npos);
}

TEST_CASE("a rank that is silent is dropped after the deadline, and its work is done by others", "[remote]") {
    MemoryNetwork network(3);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    RankThread cut_off(network, 1, introduction(), {"a"}, {offer()}, 0.5);
    RankThread good(network, 2, introduction(), {"a"}, {offer()});
    manager.gather(60.0, go_on);
    CountingJob job("a", 16000);
    const Stopwatch watch;
    const JobOutcome outcome = run_job(
        manager, job, 16000,
        [&] {
            if (watch.seconds() > 0.05) network.cut(1);
            return true;
        },
        3.0);  // the other one answers sooner, also on a busy machine
    CHECK(job.all_once());
    REQUIRE(outcome.failures.size() == 1);
    CHECK(outcome.failures[0].find("has not answered for 3 s") != std::string::npos);
    CHECK_FALSE(manager.end(0.2));
    cut_off.join();
    CHECK(cut_off.error().find("rank 0 has not answered for 0.5 s") != std::string::npos);
}

TEST_CASE("a rank that never introduces itself is dropped", "[remote]") {
    MemoryNetwork network(2);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    manager.gather(0.05, go_on);
    const std::vector<std::string> notices = manager.take_notices();
    REQUIRE(notices.size() == 1);
    CHECK(notices[0].find("rank 1: has not introduced itself within 0.05 s") != std::string::npos);
    CHECK(manager.workers().empty());
}

TEST_CASE("workers that fail or talk nonsense are dropped, and the others do their work", "[remote]") {
    enum class Fault { throws, throws_at_making, wrong_length, wrong_kind, wrong_worker };
    const auto fault =
        GENERATE(Fault::throws, Fault::throws_at_making, Fault::wrong_length, Fault::wrong_kind, Fault::wrong_worker);
    CAPTURE(static_cast<int>(fault));
    MemoryNetwork network(3);
    const auto transport = network.endpoint(0), voice = network.endpoint(1);
    Manager manager(*transport, "v1");
    struct Faulty : SlowWorker {
        explicit Faulty(Fault of) : fault(of) {}
        Bytes work(std::span<const std::byte> order, const OnProgress& on_progress) override {
            if (fault == Fault::throws) throw DeviceError("gpu", "clFinish", -5, "");
            Bytes bytes = SlowWorker::work(order, on_progress);
            if (fault == Fault::wrong_length) bytes.pop_back();
            return bytes;
        }
        Fault fault;
    };
    const OrderedWorkerOffer faulty{false, [fault](const std::function<bool()>&) -> std::unique_ptr<OrderedWorker> {
                                        if (fault == Fault::throws_at_making) throw DeviceError("gpu", "", 0, "no");
                                        return std::make_unique<Faulty>(fault);
                                    }};
    RankThread bad(network, 1, introduction(), {"a"}, {faulty}, 1.0),
        good(network, 2, introduction(), {"a"}, {offer()});
    manager.gather(60.0, go_on);
    if (fault == Fault::wrong_kind) voice->send(0, {.kind = MessageKind::piece, .job = 1, .payload = {}});
    if (fault == Fault::wrong_worker)
        voice->send(0, {.kind = MessageKind::ready, .job = 1, .worker = 7, .payload = {}});
    CountingJob job("a", 2000);
    const JobOutcome outcome = run_job(manager, job, 2000);
    CHECK(job.all_once());
    REQUIRE(outcome.failures.size() == 1);
    CAPTURE(outcome.failures[0]);
    CHECK(outcome.failures[0].find(fault == Fault::throws       ? "clFinish"
                                   : fault == Fault::wrong_kind ? "only rank 0"
                                                                : "") != std::string::npos);
    manager.end(1.0);
}

TEST_CASE("a job that is stopped ends soon, and the next one goes on", "[remote]") {
    MemoryNetwork network(2);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    RankThread rank(network, 1, introduction(2), {"a", "b"}, {offer(), offer()});
    manager.gather(60.0, go_on);
    CountingJob first("a", 1000000), second("b", 500);
    const Stopwatch watch;
    CHECK(run_job(manager, first, 1000000, [&] { return watch.seconds() < 0.1; }).items_left > 0);
    CHECK(watch.seconds() < 30.0);
    CHECK(run_job(manager, second, 500).items_left == 0);
    CHECK(second.all_once());
    CHECK(manager.end(60.0));
}

TEST_CASE("a warning of several ranks is told once, with their names", "[remote]") {
    const std::size_t ranks = GENERATE(3u, 8u);
    MemoryNetwork network(ranks);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    for (std::size_t rank = 1; rank < ranks; ++rank) {
        RankIntroduction one = introduction();
        one.host = "h" + std::to_string(rank);
        one.warnings = {"a tree is built"};
        if (rank == 2) one.warnings.push_back("the profile does not fit");
        network.endpoint(rank)->send(0, {.kind = MessageKind::hello, .payload = bytes_of(one)});
    }
    manager.gather(60.0, go_on);
    const std::string names =
        ranks == 3 ? "h1 (rank 1), h2 (rank 2)" : "h1 (rank 1), h2 (rank 2), h3 (rank 3), h4 (rank 4) and 3 more";
    CHECK(manager.take_notices() ==
          std::vector<std::string>{names + ": a tree is built", "h2 (rank 2): the profile does not fit"});
    CHECK(manager.take_notices().empty());
}

TEST_CASE("bytes that end too early or too late are refused", "[remote]") {
    const RankIntroduction whole{"v1", "host", "", {"a", "b"}, {"", "bad"}, {"slow"}};
    const Bytes bytes = bytes_of(whole);
    CHECK(introduction_of(bytes).faults == whole.faults);
    CHECK(introduction_of(bytes).warnings == whole.warnings);
    for (std::size_t length = 0; length < bytes.size(); ++length)
        CHECK_THROWS_AS(introduction_of(std::span(bytes).first(length)), DeviceError);
    Bytes longer = bytes;
    longer.push_back(std::byte{0});
    CHECK_THROWS_AS(introduction_of(longer), DeviceError);
    Bytes huge = ByteWriter().add(std::uint64_t{1} << 62).take();
    CHECK_THROWS_AS(ByteReader(huge).take_vector<float>(), DeviceError);
    CHECK_THROWS_AS(ByteReader(huge).take_text(), DeviceError);
}

}  // namespace castor::test
