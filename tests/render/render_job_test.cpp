// What becomes of a picture where its workers are plain functions: joining, the order of work, early results,
// snapshots.
#include "render/render_job.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "castor/error.h"
#include "reference/random_source.h"
#include "render/picture.h"
#include "support/catch.h"
#include "support/picture.h"

namespace castor::test {
namespace {

constexpr std::uint32_t kWidth = 52, kHeight = 20, kSamples = 40;  // the last blocks reach beyond the picture

Checkpoint nothing(std::uint32_t samples = kSamples) {
    Checkpoint begin;
    begin.picture = "a test\n";
    begin.film.width = kWidth;
    begin.film.height = kHeight;
    begin.film.samples_per_pixel = samples;
    begin.film.pixels.assign(kWidth * kHeight, glm::vec3(0.0f));
    begin.film.done.assign(kWidth * kHeight, 0);
    return begin;
}

/// What a sample of a pixel adds. The sum depends on the order.
glm::vec4 term(std::uint64_t block, std::size_t slot, std::uint32_t sample) {
    const auto x = static_cast<float>(block * 64 + slot + 1);
    return {x * 0.1f, 1.0f / x, static_cast<float>(sample) * 0.3f, 0.0f};
}

std::vector<std::uint32_t> numbers_of(const Range& blocks) {
    std::vector<std::uint32_t> numbers(blocks.size());
    std::iota(numbers.begin(), numbers.end(), static_cast<std::uint32_t>(blocks.begin));
    return numbers;
}

PieceState state_of(const Range& blocks, std::uint32_t samples, std::uint32_t samples_per_pixel = kSamples) {
    PieceState state{numbers_of(blocks), samples, std::vector<glm::vec4>(blocks.size() * 64, glm::vec4(0.0f)), {}};
    for (std::size_t i = 0; i < state.sums.size(); ++i)
        for (std::uint32_t sample = 0; sample < samples; ++sample)
            state.sums[i] += term(blocks.begin + i / 64, i % 64, sample);
    if (samples < samples_per_pixel) return state;
    for (const glm::vec4& sum : state.sums) state.means.push_back(glm::vec3(sum) / static_cast<float>(samples));
    state.sums.clear();
    return state;
}

Film finished_film() {
    Picture picture(nothing());
    picture.join(state_of({0, picture.blocks().count()}, kSamples));
    return picture.film();
}

bool same_state(const Checkpoint& a, const Checkpoint& b) {
    if (!same_bytes(a.film, b.film) || a.partial_blocks.size() != b.partial_blocks.size()) return false;
    return std::equal(
        a.partial_blocks.begin(), a.partial_blocks.end(), b.partial_blocks.begin(), [](const auto& x, const auto& y) {
            return x.first == y.first && x.second.samples == y.second.samples && x.second.sums == y.second.sums;
        });
}

struct Order {
    std::size_t worker;
    std::vector<std::uint32_t> blocks;
    std::uint32_t first, samples;
};

/// The orders that workers were given.
struct Log {
    std::mutex mutex;
    std::vector<Order> orders;
};

/// A worker that adds terms, some samples at a time.
class AddingWorker : public PieceWorker {
public:
    AddingWorker(std::shared_ptr<Log> log, std::size_t number, std::uint64_t most_blocks, std::uint32_t slice)
        : log_(std::move(log)), number_(number), most_blocks_(most_blocks), slice_(slice) {}

    double setup_seconds() const override { return 0.25; }
    double block_samples_per_second() const override { return 1000.0; }
    std::uint64_t blocks_wanted() const override { return most_blocks_; }
    std::uint64_t most_blocks() const override { return most_blocks_; }
    void measure(const Range&, const std::function<bool()>&) override {}
    PieceResult render(const PieceOrder& order, const OnSamples& on_samples) override {
        {
            std::lock_guard lock(log_->mutex);
            log_->orders.push_back({number_, order.begin.blocks, order.begin.samples, order.samples});
        }
        if (order.begin.sums.size() != (order.begin.samples ? order.begin.blocks.size() * 64 : 0))
            throw std::logic_error("an order has as many sums as slots, or no samples");
        PieceResult result;
        result.state = order.begin;
        std::vector<glm::vec4>& sums = result.state.sums;
        sums.resize(order.begin.blocks.size() * 64, glm::vec4(0.0f));
        std::uint32_t& samples = result.state.samples;
        for (bool goes_on = true; goes_on && samples < order.samples; goes_on = on_samples(samples))
            for (const std::uint32_t end = std::min(order.samples, samples + slice_); samples < end; ++samples)
                for (std::size_t i = 0; i < sums.size(); ++i)
                    sums[i] += term(order.begin.blocks[i / 64], i % 64, samples);
        result.rays = sums.size() * (samples - order.begin.samples);
        if (samples < kSamples) return result;
        for (const glm::vec4& sum : sums) result.state.means.push_back(glm::vec3(sum) / static_cast<float>(samples));
        sums.clear();
        return result;
    }

private:
    std::shared_ptr<Log> log_;
    std::size_t number_;
    std::uint64_t most_blocks_;
    std::uint32_t slice_;
};

PieceWorkerOffer adding_worker(const std::shared_ptr<Log>& log, std::size_t number, std::uint64_t most_blocks,
                               std::uint32_t slice) {
    const auto make = [=](const std::function<bool()>&) {
        return std::make_unique<AddingWorker>(log, number, most_blocks, slice);
    };
    return {.name = std::to_string(number), .make = make, .device = number};
}

/// Works on so many blocks at a time, 10 ms for each sample of theirs.
PieceWorkerOffer slow_worker(const std::shared_ptr<Log>& log, std::uint64_t most_blocks = 100) {
    struct Slow : AddingWorker {
        using AddingWorker::AddingWorker;
        PieceResult render(const PieceOrder& order, const OnSamples& on_samples) override {
            return AddingWorker::render(order, [&](std::uint32_t samples) {
                std::this_thread::sleep_for(std::chrono::milliseconds(10));
                return on_samples(samples);
            });
        }
    };
    const auto make = [=](const std::function<bool()>&) { return std::make_unique<Slow>(log, 0, most_blocks, 1); };
    return {.name = "slow", .make = make};
}

}  // namespace

TEST_CASE("joining states of a picture is commutative, associative and idempotent", "[render_job]") {
    RandomSource random(GENERATE(1, 2, 3, 4, 5));
    const auto any_state = [&] {
        Picture picture(nothing());
        for (std::uint32_t block = 0; block < picture.blocks().count(); ++block) {
            const auto samples = static_cast<std::uint32_t>(random.in_box(0, 2.5f).x * kSamples);
            if (samples > 0) picture.join(state_of({block, block + 1}, std::min(samples, kSamples)));
        }
        return picture.copy();
    };
    const auto joined = [](const Checkpoint& a, const Checkpoint& b) {
        Picture picture(a);
        picture.join(b);
        return picture.copy();
    };
    const Checkpoint a = any_state(), b = any_state(), c = any_state();
    REQUIRE_FALSE(same_state(a, b));
    CHECK(same_state(joined(a, b), joined(b, a)));
    CHECK(same_state(joined(joined(a, b), c), joined(a, joined(b, c))));
    CHECK(same_state(joined(a, a), a));
    CHECK(same_state(joined(a, nothing()), a));
    CHECK(same_state(joined(nothing(), a), a));
    const std::uint64_t most = std::max(samples_done(a), samples_done(b));
    CHECK(samples_done(joined(a, b)) >= most);
}

TEST_CASE("late and repeated results of pieces do not take a picture back", "[render_job]") {
    Picture picture(nothing());
    picture.join(state_of({0, 2}, 7));
    picture.join(state_of({0, 2}, 5));
    const std::vector<std::uint32_t> blocks = numbers_of({0, 2});
    const auto order = picture.order(blocks, kSamples);
    REQUIRE(order);
    CHECK(order->begin.samples == 7);
    CHECK(order->begin.sums == state_of({0, 2}, 7).sums);
    CHECK_FALSE(picture.order(blocks, 7));
    picture.join(state_of({1, 2}, kSamples));
    picture.join(state_of({0, 2}, 9));
    const std::uint32_t count = picture.blocks().count();
    CHECK_FALSE(picture.order(blocks, kSamples));
    const BlocksLeft left = picture.work_left(kSamples);
    CHECK(left.ranges == std::vector<Range>{{0, count - 2}, {count - 2, count - 1}});  // the fewest samples first
    CHECK(left.blocks.front() == 2);
    CHECK(left.blocks.back() == 0);
    CHECK(picture.work_left(9).blocks == numbers_of({2, count}));
    CHECK(picture.fewest_samples() == 0);
    CHECK(picture.samples_done() == 64 * (kSamples + 9));
    const Film shown = picture.snapshot();
    CHECK(shown.done[8] == 1);
    CHECK(shown.done[0] == 0);
    CHECK(shown.pixels[0] == glm::vec3(state_of({0, 1}, 9).sums[0]) / 9.0f);
    CHECK(shown.pixels[16] == glm::vec3(0.0f));
    CHECK(picture.film().pixels[0] == glm::vec3(0.0f));
}

TEST_CASE("in both orders of work a picture has the same bytes, whoever does what", "[render_job]") {
    const RenderOrder order = GENERATE(RenderOrder::pieces, RenderOrder::progressive);
    const std::size_t workers = GENERATE(1u, 3u);
    CAPTURE(to_string(order), workers);
    const auto log = std::make_shared<Log>();
    std::vector<PieceWorkerOffer> offers;
    for (std::size_t i = 0; i < workers; ++i)
        offers.push_back(adding_worker(log, i, 4 + i, static_cast<std::uint32_t>(3 + i)));
    RenderOptions options;
    options.order = order;
    const auto job = std::make_shared<RenderJob>(nothing(), offers, options);
    job->run({}, {});
    CHECK(same_bytes(job->picture().film(), finished_film()));
    const std::vector<DeviceShare> shares = job->tally().shares();
    std::uint64_t samples = 0;
    for (const DeviceShare& share : shares) samples += share.samples;
    CHECK(samples == kWidth * kHeight * kSamples);
    std::uint32_t largest = 0, last = 0;
    bool is_in_order = true;
    for (const Order& given : log->orders) {
        largest = std::max(largest, given.samples - given.first);
        is_in_order = is_in_order && given.samples >= last;
        last = given.samples;
    }
    if (order == RenderOrder::progressive) {
        CHECK(log->orders.front().samples == 1);
        CHECK(is_in_order);  // all pixels have as many samples before any has more
        CHECK(largest <= kSamples / 4);
    } else {
        CHECK(largest == kSamples);
    }
}

TEST_CASE("a progressive render shows all of the picture from the first samples on", "[render_job]") {
    const auto log = std::make_shared<Log>();
    RenderOptions options;
    options.order = RenderOrder::progressive;
    const auto job = std::make_shared<RenderJob>(nothing(), std::vector{adding_worker(log, 0, 100, 1)}, options);
    int shown_whole = 0;
    std::uint64_t last = 0;
    job->run({}, [&](const RenderProgress& progress) {
        const Film film = progress.snapshot();
        CHECK(progress.samples_done >= last);
        last = progress.samples_done;
        const auto begun = std::count_if(film.pixels.begin(), film.pixels.end(),
                                         [](const glm::vec3& pixel) { return pixel != glm::vec3(0.0f); });
        const auto done = std::count(film.done.begin(), film.done.end(), 1);
        shown_whole += begun == kWidth * kHeight && done == 0;
        return true;
    });
    CHECK(shown_whole > 5);  // at least one of each pass but the last
    CHECK(last == kWidth * kHeight * kSamples);
}

TEST_CASE("a snapshot makes workers give back what they have", "[render_job]") {
    const auto log = std::make_shared<Log>();
    const PieceWorkerOffer slow = slow_worker(log);
    const bool looks_on = GENERATE(false, true);
    const auto job = std::make_shared<RenderJob>(nothing(), std::vector{slow}, RenderOptions());
    int begun = 0;
    job->run({}, [&](const RenderProgress& progress) {
        if (!looks_on || progress.samples_done == progress.samples_total) return true;
        const Film film = progress.snapshot();
        begun += film.pixels[0] != glm::vec3(0.0f);
        return true;
    });
    CHECK(same_bytes(job->picture().film(), finished_film()));
    CHECK((begun > 3) == looks_on);
    CHECK((log->orders.size() > 3) == looks_on);  // cheap when it is not called
    CHECK(job->tally().shares()[0].tiles == 1);
    CHECK(job->tally().shares()[0].samples == kWidth * kHeight * kSamples);
}

TEST_CASE("a render by passes goes on without a worker that fails in one", "[render_job]") {
    const auto log = std::make_shared<Log>();
    PieceWorkerOffer fails{"broken", 0.0, false, [=](const std::function<bool()>&) {
                               struct Broken : AddingWorker {
                                   using AddingWorker::AddingWorker;
                                   PieceResult render(const PieceOrder& order, const OnSamples& on_samples) override {
                                       if (order.samples > 3) throw DeviceError("broken", "clFinish", -5, "");
                                       return AddingWorker::render(order, on_samples);
                                   }
                               };
                               return std::make_unique<Broken>(log, 1, 2, 1);
                           }};
    fails.device = 1;
    RenderOptions options;
    options.order = RenderOrder::progressive;
    SECTION("beside another") {
        const auto job =
            std::make_shared<RenderJob>(nothing(), std::vector{adding_worker(log, 0, 1, 1), fails}, options);
        job->run({}, {});
        CHECK(same_bytes(job->picture().film(), finished_film()));
        CHECK(job->tally().shares()[1].retries <= 1);
    }
    SECTION("but without the other teams of its device, too") {
        fails.device = 0;
        const auto job = std::make_shared<RenderJob>(nothing(), std::vector{slow_worker(log, 1), fails}, options);
        job->run({}, {});
        CHECK_FALSE(job->picture().film().complete());
        CHECK(job->is_dropped(0));
        CHECK(job->is_dropped(1));
        CHECK(job->tally().notices().size() == 1);  // of the device
        CHECK(job->tally().shares_of_devices().size() == 1);
    }
    SECTION("alone: what is done stays") {
        fails.device = 0;
        const auto job = std::make_shared<RenderJob>(nothing(), std::vector{fails}, options);
        job->run({}, {});
        CHECK_FALSE(job->picture().film().complete());
        CHECK(job->picture().fewest_samples() == 3);
        CHECK(job->tally().shares()[0].retries == 1);
        REQUIRE(job->tally().last_failure());
        CHECK_FALSE(job->is_stopped());
    }
}

}  // namespace castor::test
