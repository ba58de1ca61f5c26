#include "castor/tracer.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "castor/error.h"
#include "opencl/cl.h"
#include "opencl/quirks.h"
#include "reference/meshes.h"
#include "reference/random_source.h"
#include "reference/rays.h"
#include "remote/memory_network.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/scoped_variable.h"
#include "trace/remote_batch.h"
#include "tune/work_per_ray.h"

namespace castor::test {
namespace {

constexpr std::array kStrategies{Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet};
constexpr std::array kHints{Coherence::incoherent, Coherence::coherent};

Scene scene_of_everything() {
    RandomSource random(91);
    Scene scene = scene_of({random_triangles(random, test_size(300, 60), 0.3f)});
    const std::size_t sphere_count = test_size(20, 3);
    for (std::size_t i = 0; i < sphere_count; ++i)
        scene.spheres.push_back({random.in_box(-1, 1), random.uniform_float(0.05f, 0.3f), 0, 0});
    scene.planes.push_back({{0, -1, 0}, {0, 1, 0}, 0, 0});
    return scene;
}

std::vector<Ray> random_rays(std::uint64_t seed, std::size_t count) {
    RandomSource random(seed);
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::vec3 origin = random.in_box(-2, 2);
        rays.push_back(make_ray(origin, random.in_box(-1, 1) - origin, 0.0f,
                                i % 4 ? std::numeric_limits<float>::infinity() : random.uniform_float(0, 2)));
    }
    return rays;
}

struct Answers {
    std::vector<Hit> hits;
    std::vector<std::uint8_t> occluded;
    explicit Answers(std::size_t count) : hits(count), occluded(count, 0xff) {}
};

struct Listed {
    std::vector<Hit> crossings;
    std::vector<std::uint32_t> counts;
    Listed(std::size_t count, std::size_t limit) : crossings(count * limit), counts(count) {}
};

Listed list(Tracer& tracer, std::span<const Ray> rays, std::size_t limit) {
    Listed listed(rays.size(), limit);
    tracer.list_crossings(rays, limit, listed.crossings, listed.counts);
    return listed;
}

bool same_bytes(const Listed& a, const Listed& b) {
    return a.counts == b.counts && a.crossings.size() == b.crossings.size() &&
           std::memcmp(a.crossings.data(), b.crossings.data(), a.crossings.size() * sizeof(Hit)) == 0;
}

Answers trace(Tracer& tracer, std::span<const Ray> rays, Coherence hint = Coherence::incoherent) {
    Answers answers(rays.size());
    tracer.closest_hit(rays, answers.hits, hint);
    tracer.any_hit(rays, answers.occluded, hint);
    return answers;
}

bool same_bytes(const Answers& a, const Answers& b) {
    return a.hits.size() == b.hits.size() && a.occluded == b.occluded &&
           std::memcmp(a.hits.data(), b.hits.data(), a.hits.size() * sizeof(Hit)) == 0;
}

std::size_t hit_count(const Answers& answers) {
    std::size_t count = 0;
    for (const Hit& hit : answers.hits) count += hit.primitive != CASTOR_INVALID_INDEX;
    return count;
}

/// Buffers and a queue of the caller's own in a Tracer's context.
struct CallersBuffers {
    CallersBuffers(const Tracer& tracer, std::size_t device_index, const std::vector<Ray>& batch)
        : context(tracer.context(device_index), true),
          queue(context, context.getInfo<CL_CONTEXT_DEVICES>().at(0)),
          rays(context, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, batch.size() * sizeof(Ray),
               const_cast<Ray*>(batch.data())),
          hits(context, CL_MEM_READ_WRITE, batch.size() * sizeof(Hit)),
          occluded(context, CL_MEM_READ_WRITE, batch.size()) {}

    Answers read(std::size_t count) const {
        Answers answers(count);
        queue.enqueueReadBuffer(hits, CL_TRUE, 0, count * sizeof(Hit), answers.hits.data());
        queue.enqueueReadBuffer(occluded, CL_TRUE, 0, count, answers.occluded.data());
        return answers;
    }

    cl::Context context;
    cl::CommandQueue queue;
    cl::Buffer rays, hits, occluded;
};

bool is_complete(const cl::Event& event) {
    return event.getInfo<CL_EVENT_COMMAND_EXECUTION_STATUS>() == CL_COMPLETE;
}

}  // namespace

TEST_CASE("each strategy finds hits, the same ones, and any_hit agrees", "[tracer][oclgrind]") {
    const Scene scene = scene_of_everything();
    const std::vector<Ray> rays = random_rays(92, test_size(3000, 40));
    const Answers expected = [&] {
        Tracer tracer(scene, {test_device()}, {Strategy::brute});
        return trace(tracer, rays);
    }();
    CHECK(hit_count(expected) > rays.size() / 4);
    CHECK(hit_count(expected) < rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        CAPTURE(i, to_text(rays[i]));
        REQUIRE(int(expected.occluded[i]) == int(expected.hits[i].primitive != CASTOR_INVALID_INDEX));
    }
    for (const Strategy strategy : kStrategies) {
        CAPTURE(to_string(strategy));
        // Oclgrind 21.10 takes a float16 that is passed by value for uninitialised, even a constant.
        if (strategy == Strategy::packet && test_device().platform_name == "Oclgrind") continue;
        Tracer tracer(scene, {test_device()}, {strategy});
        for (const Coherence hint : kHints) {
            CHECK(tracer.strategy(hint) == strategy);
            CHECK(same_bytes(trace(tracer, rays, hint), expected));
        }
    }
}

TEST_CASE("a batch that needs many launches equals its parts and its single rays", "[tracer]") {
    const std::vector<Ray> rays = random_rays(93, 100'000);
    for (const Strategy strategy : {Strategy::simt, Strategy::wide, Strategy::packet}) {
        CAPTURE(to_string(strategy));
        Tracer tracer(scene_of_everything(), {test_device()}, {strategy});
        const Answers whole = trace(tracer, rays);
        Answers parts(rays.size());
        for (std::size_t begin = 0, size = 1; begin < rays.size(); begin += size, size = size * 3 + 1) {
            const std::size_t count = std::min(size, rays.size() - begin);
            tracer.closest_hit(std::span(rays).subspan(begin, count), std::span(parts.hits).subspan(begin, count));
            tracer.any_hit(std::span(rays).subspan(begin, count), std::span(parts.occluded).subspan(begin, count));
        }
        CHECK(same_bytes(parts, whole));
        for (std::size_t i = 0; i < rays.size(); i += 997) {
            const Answers single = trace(tracer, std::span(rays).subspan(i, 1));
            CAPTURE(i, to_text(rays[i]));
            REQUIRE(std::memcmp(&single.hits[0], &whole.hits[i], sizeof(Hit)) == 0);
            REQUIRE(single.occluded[0] == whole.occluded[i]);
        }
    }
}

TEST_CASE("an empty batch is answered", "[tracer]") {
    Tracer tracer(scene_of_everything(), {test_device(), test_device()});
    CHECK_NOTHROW(tracer.closest_hit(std::span<const Ray>(), {}));
    CHECK_NOTHROW(tracer.any_hit(std::span<const Ray>(), {}));
}

TEST_CASE("a batch split over devices has the same bytes", "[tracer]") {
    const ScopedVariable own_contexts("CASTOR_TEST_OWN_CONTEXTS", "1");
    const Scene scene = scene_of_everything();
    Tracer one(scene, {test_device()});
    Tracer three(scene, {test_device(), test_device(), test_device()});
    for (const std::size_t count : {1u, 2u, 3u, 1000u}) {
        CAPTURE(count);
        const std::vector<Ray> rays = random_rays(94, count);
        CHECK(same_bytes(trace(three, rays), trace(one, rays)));
    }
    CHECK(three.context(0) != three.context(2));
    CHECK_THROWS(three.queue(3));
}

TEST_CASE("batches that several ranks answer have the same bytes", "[tracer][remote]") {
    const Scene scene = scene_of_everything();
    const std::vector<Ray> rays = random_rays(7, test_size(20001, 300));
    constexpr std::size_t kLimit = 3;
    MemoryNetwork network(3);
    const auto transport = network.endpoint(0);
    Manager manager(*transport, "v1");
    std::vector<std::thread> others;
    for (std::size_t rank = 1; rank < network.rank_count(); ++rank)
        others.emplace_back([&, rank] {
            const auto endpoint = network.endpoint(rank);
            RankServer server(*endpoint, 60.0, 60.0);
            Tracer tracer(scene, {test_device()});
            server.introduce({"v1", "host", "", {"device"}, {""}});
            for (const Query query : {Query::closest, Query::any, Query::count, Query::list, Query::closest})
                if (!serve_trace(tracer, query, query == Query::list ? kLimit : 0, Coherence::incoherent, server))
                    break;
            server.finish();
        });
    Tracer tracer(scene, {test_device()});
    const Answers alone = trace(tracer, rays);
    Answers together(rays.size());
    manager.gather(60.0, [] { return true; });
    REQUIRE(manager.workers().size() == 2);
    const Coherence hint = Coherence::incoherent;
    CHECK(trace_together(tracer, rays, together.hits, hint, {}, manager));
    CHECK(trace_together(tracer, rays, together.occluded, hint, {}, manager));
    CHECK(same_bytes(together, alone));
    const auto crossings = list(tracer, rays, kLimit);
    Listed listed(rays.size(), kLimit);
    CHECK(count_together(tracer, rays, listed.counts, hint, {}, manager));
    CHECK(listed.counts == crossings.counts);
    CHECK(list_together(tracer, rays, kLimit, listed.crossings, listed.counts, hint, {}, manager));
    CHECK(same_bytes(listed, crossings));
    CHECK(tracer.shares().size() == 3);
    const auto stop = [] { return false; };
    std::vector<Hit> hits(rays.size());
    trace_together(tracer, rays, hits, hint, stop, manager);
    CHECK(manager.end(60.0));
    for (std::thread& other : others) other.join();
}

TEST_CASE("the caller's queue and buffers give what spans give", "[tracer]") {
    const std::vector<Ray> rays = random_rays(95, 40'000);
    for (const Strategy strategy : kStrategies) {
        Tracer tracer(scene_of_everything(), {test_device(), test_device()}, {strategy});
        const Answers expected = trace(tracer, rays);
        for (const std::size_t device : {0u, 1u}) {
            const Coherence hint = kHints[device];
            CAPTURE(to_string(strategy), device);
            const CallersBuffers mine(tracer, device, rays);
            cl_event closest = nullptr, any = nullptr;
            tracer.closest_hit(mine.queue(), mine.rays(), mine.hits(), 0, rays.size(), &closest, hint);
            tracer.any_hit(mine.queue(), mine.rays(), mine.occluded(), 0, rays.size(), &any, hint);
            const cl::Event closest_done(closest, false), any_done(any, false);
            closest_done.wait();
            any_done.wait();
            CHECK(is_complete(closest_done));
            CHECK(is_complete(any_done));
            CHECK(same_bytes(mine.read(rays.size()), expected));
        }
    }
}

TEST_CASE("the caller's queue and buffers give the crossings that spans give", "[tracer]") {
    const std::vector<Ray> rays = random_rays(96, 2'000);
    constexpr std::uint32_t kLimit = 4;
    constexpr std::size_t kFirst = 100;
    Tracer tracer(scene_of_everything(), {test_device()});
    const Listed expected = list(tracer, rays, kLimit);
    const CallersBuffers mine(tracer, 0, rays);
    const cl::Context context(tracer.context(), true);
    const cl::Buffer counts(context, CL_MEM_READ_WRITE, rays.size() * sizeof(std::uint32_t));
    const cl::Buffer crossings(context, CL_MEM_READ_WRITE, rays.size() * kLimit * sizeof(Hit));
    const std::size_t count = rays.size() - kFirst;
    for (const std::uint32_t limit : {0u, kLimit}) {
        tracer.count_crossings(mine.queue(), mine.rays(), counts(), 0, kFirst);
        cl_event done = nullptr;
        tracer.list_crossings(mine.queue(), mine.rays(), limit, crossings(), counts(), kFirst, count, &done);
        cl::Event(done, false).wait();
        Listed found(rays.size(), kLimit);
        mine.queue.enqueueReadBuffer(counts, CL_TRUE, 0, rays.size() * sizeof(std::uint32_t), found.counts.data());
        CHECK(found.counts == expected.counts);
        if (limit == 0) continue;
        mine.queue.enqueueReadBuffer(crossings, CL_TRUE, kFirst * kLimit * sizeof(Hit), count * kLimit * sizeof(Hit),
                                     &found.crossings[kFirst * kLimit]);
        CHECK(std::memcmp(&found.crossings[kFirst * kLimit], &expected.crossings[kFirst * kLimit],
                          count * kLimit * sizeof(Hit)) == 0);
    }
}

TEST_CASE("a part of the caller's rays is answered at its place, and no other is touched", "[tracer]") {
    const std::vector<Ray> rays = random_rays(98, 1000);
    for (const Strategy strategy : kStrategies) {
        CAPTURE(to_string(strategy));
        Tracer tracer(scene_of_everything(), {test_device()}, {strategy});
        const Answers expected = trace(tracer, rays);
        const CallersBuffers mine(tracer, 0, rays);
        Answers parts(rays.size());
        std::memset(parts.hits.data(), 0x55, rays.size() * sizeof(Hit));
        std::fill(parts.occluded.begin(), parts.occluded.end(), std::uint8_t{0x55});
        mine.queue.enqueueWriteBuffer(mine.hits, CL_TRUE, 0, rays.size() * sizeof(Hit), parts.hits.data());
        mine.queue.enqueueWriteBuffer(mine.occluded, CL_TRUE, 0, rays.size(), parts.occluded.data());
        for (const auto& [first, count] : {std::pair<std::size_t, std::size_t>{700, 300}, {1, 7}, {333, 64}}) {
            tracer.closest_hit(mine.queue(), mine.rays(), mine.hits(), first, count);
            tracer.any_hit(mine.queue(), mine.rays(), mine.occluded(), first, count);
            for (std::size_t i = first; i < first + count; ++i) {
                parts.hits[i] = expected.hits[i];
                parts.occluded[i] = expected.occluded[i];
            }
        }
        CHECK(same_bytes(mine.read(rays.size()), parts));
    }
}

TEST_CASE("a batch ends when its caller says so", "[tracer]") {
    // Brute force, by rays that miss all: far more than any device does before the first question, some 20 ms after the
    // begin.
    RandomSource random(99);
    Tracer tracer(scene_of({random_triangles(random, 50'000, 0.1f)}), {test_device(), test_device()},
                  {Strategy::brute});
    const std::vector<Ray> rays(2'000'000, make_ray({0, 0, 9}, {0, 0, 1}, 0.0f, 1.0f));
    Answers answers(rays.size());
    int questions = 0;
    const auto stop = [&] {
        ++questions;
        return false;
    };
    CHECK_FALSE(tracer.closest_hit(rays, answers.hits, Coherence::incoherent, stop));
    CHECK(questions == 1);
    CHECK_FALSE(tracer.any_hit(rays, answers.occluded, Coherence::coherent, stop));
    CHECK(questions == 2);
    // And the next one is whole.
    const std::vector<Ray> few = random_rays(99, 20);
    Answers whole(few.size());
    const auto go_on = [] { return true; };
    CHECK(tracer.closest_hit(few, whole.hits, Coherence::incoherent, go_on));
    CHECK(tracer.any_hit(few, whole.occluded, Coherence::incoherent, go_on));
    CHECK(same_bytes(whole, trace(tracer, few)));
}

TEST_CASE("the Tracer's own queue may be the caller's, with no event, or no rays", "[tracer]") {
    const std::vector<Ray> rays = random_rays(96, 500);
    Tracer tracer(scene_of_everything(), {test_device()});
    const Answers expected = trace(tracer, rays);
    const CallersBuffers mine(tracer, 0, rays);
    tracer.closest_hit(tracer.queue(), mine.rays(), mine.hits(), 0, rays.size());
    tracer.any_hit(tracer.queue(), mine.rays(), mine.occluded(), 0, rays.size());
    clFinish(tracer.queue());
    CHECK(same_bytes(mine.read(rays.size()), expected));

    cl_event event = nullptr;
    tracer.closest_hit(tracer.queue(), mine.rays(), mine.hits(), 0, 0, &event);
    REQUIRE(event != nullptr);
    const cl::Event done(event, false);
    done.wait();
    CHECK(is_complete(done));
    CHECK_NOTHROW(tracer.any_hit(tracer.queue(), mine.rays(), mine.occluded(), 0, 0));
    clFinish(tracer.queue());
    CHECK(same_bytes(mine.read(rays.size()), expected));
}

TEST_CASE("a queue of another context, and more rays than a buffer holds, are refused", "[tracer]") {
    const ScopedVariable own_contexts("CASTOR_TEST_OWN_CONTEXTS", "1");
    const std::vector<Ray> rays = random_rays(97, 10);
    Tracer tracer(scene_of_everything(), {test_device()});
    const Tracer other(scene_of_everything(), {test_device()});
    const CallersBuffers mine(tracer, 0, rays);
    CHECK_THROWS_AS(tracer.closest_hit(other.queue(), mine.rays(), mine.hits(), 0, rays.size()), UsageError);
    CHECK_THROWS_AS(tracer.any_hit(other.queue(), mine.rays(), mine.occluded(), 0, rays.size()), UsageError);
    CHECK_THROWS_AS(tracer.any_hit(mine.queue(), mine.rays(), mine.occluded(), 10, (std::size_t{1} << 31) - 9),
                    UsageError);
    CHECK_THROWS_AS(tracer.closest_hit(mine.queue(), mine.rays(), mine.hits(), std::size_t{1} << 32, 1), UsageError);
    CHECK_THROWS_AS(tracer.any_hit(nullptr, mine.rays(), mine.occluded(), 0, rays.size()), UsageError);
}

TEST_CASE("several threads use one Tracer at once", "[tracer]") {
    Tracer tracer(scene_of_everything(), {test_device(), test_device()});
    constexpr std::size_t kThreads = 3;
    std::vector<std::vector<Ray>> rays;
    std::vector<Answers> expected, found;
    for (std::size_t i = 0; i < kThreads; ++i) {
        rays.push_back(random_rays(100 + i, 2000 + 300 * i));
        expected.push_back(trace(tracer, rays[i]));
        found.emplace_back(0);
    }
    {
        std::vector<std::jthread> threads;
        for (std::size_t i = 0; i < kThreads; ++i)
            threads.emplace_back([&, i] {
                for (int round = 0; round < 5; ++round) found[i] = trace(tracer, rays[i]);
            });
    }
    for (std::size_t i = 0; i < kThreads; ++i) {
        CAPTURE(i);
        CHECK(same_bytes(found[i], expected[i]));
    }
}

TEST_CASE("a Tracer can be moved", "[tracer]") {
    const std::vector<Ray> rays = random_rays(98, 100);
    Tracer tracer(scene_of_everything(), {test_device()});
    const Answers expected = trace(tracer, rays);
    Tracer moved(std::move(tracer));
    CHECK(same_bytes(trace(moved, rays), expected));
    tracer = std::move(moved);
    CHECK(same_bytes(trace(tracer, rays), expected));
}

TEST_CASE("a Tracer needs a device, and a scene that is right", "[tracer]") {
    CHECK_THROWS_AS(Tracer(scene_of_everything(), {}), UsageError);

    struct Wrong {
        const char* name;
        std::function<void(Scene&)> damage;
    };
    const std::vector<Wrong> wrongs{{"vertex index", [](Scene& s) { s.meshes[0].triangles[0].x = 1u << 30; }},
                                    {"material index", [](Scene& s) { s.spheres[0].material = 1; }},
                                    {"radius", [](Scene& s) { s.spheres[0].radius = -1; }},
                                    {"plane normal", [](Scene& s) { s.planes[0].normal = glm::vec3(0); }},
                                    {"no material", [](Scene& s) { s.materials.clear(); }}};
    for (const Wrong& wrong : wrongs) {
        CAPTURE(wrong.name);
        Scene scene = scene_of_everything();
        wrong.damage(scene);
        CHECK_THROWS_AS(Tracer(scene, {test_device()}), SceneError);
    }
}

TEST_CASE("a Tracer hands on what flatten noticed", "[tracer]") {
    Scene scene = scene_of_everything();
    // Beside what the device cannot promise.
    const std::size_t of_device = Tracer(scene, {test_device()}).warnings().size();
    CHECK(of_device == broken_promises(test_device()).size());
    scene.meshes[0].triangles[0].y = scene.meshes[0].triangles[0].x;
    const Tracer tracer(scene, {test_device()});
    REQUIRE(tracer.warnings().size() == of_device + 1);
    CHECK(tracer.warnings()[0].text.find("1 of") != std::string::npos);
    CHECK(tracer.build_seconds() >= 0.0);
    CHECK(tracer.setup_seconds() > 0.0);
}

TEST_CASE("strategies have names", "[tracer]") {
    for (const Strategy strategy :
         {Strategy::automatic, Strategy::brute, Strategy::simt, Strategy::wide, Strategy::packet})
        CHECK(strategy_from_string(to_string(strategy)) == strategy);
    CHECK(to_string(Strategy::automatic) == "auto");
    CHECK_THROWS_WITH(strategy_from_string("fast"),
                      "there is no strategy \"fast\"; there are auto, brute, simt, wide, packet");
    CHECK_THROWS_AS(strategy_from_string(""), UsageError);

    const Device device = test_device();
    const Tracer tracer(scene_of_everything(), {device});
    const bool is_cpu = device.type == DeviceType::cpu && !device_quirks(device).is_like_gpu;
    CHECK(tracer.strategy() == (is_cpu ? Strategy::wide : Strategy::simt));
    CHECK(tracer.strategy(Coherence::coherent) == (is_cpu ? Strategy::packet : Strategy::simt));
}

TEST_CASE("kernels that count give the same answers, and brute force counts every primitive", "[tracer]") {
    const Scene scene = scene_of_everything();
    const std::vector<Ray> rays = random_rays(99, test_size(1000, 40));
    TraceWork brute_work;
    for (const Strategy strategy : kStrategies)
        for (const Coherence hint : kHints) {
            CAPTURE(to_string(strategy), int(hint));
            Tracer tracer(scene, {test_device()}, {strategy});
            const Answers expected = trace(tracer, rays, hint);
            Answers answers(rays.size());
            const TraceWork closest = tracer.count_closest_hit(rays, answers.hits, hint);
            const TraceWork any = tracer.count_any_hit(rays, answers.occluded, hint);
            CHECK(same_bytes(answers, expected));
            CHECK(closest.planes == rays.size() * scene.planes.size());
            for (const WorkFigures& kind : kWorkFigures) {
                CAPTURE(kind.name, any.*kind.count, closest.*kind.count);
                // Which of these rays are bundles depends on those that planes occlude.
                if (!std::string_view(kind.name).starts_with("bundle"))
                    CHECK((any.*kind.count > 0) == (closest.*kind.count > 0));
            }
            if (strategy == Strategy::brute) {
                brute_work = closest;
                CHECK(closest.triangles == rays.size() * scene.meshes[0].triangles.size());
                CHECK(closest.spheres == rays.size() * scene.spheres.size());
                CHECK(any.triangles < closest.triangles);
            } else {
                CHECK(closest.triangles + closest.triangle_blocks < brute_work.triangles / 2);
            }
        }
}

TEST_CASE("what a ray at a single triangle takes is counted once a ray or once a bundle", "[tracer]") {
    Mesh mesh;
    mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    std::vector<Ray> rays;
    RandomSource random(100);
    constexpr std::uint64_t kBundles = 10, kBundle = 16;
    for (std::uint64_t i = 0; i < kBundles * kBundle; ++i)
        rays.push_back(
            make_ray({0, -0.2f, 4}, {random.uniform_float(0.001f, 0.02f), random.uniform_float(0.001f, 0.02f), -1}));
    struct Expected {
        Strategy strategy;
        std::uint64_t TraceWork::*of_tree;
        std::uint64_t TraceWork::*of_primitives;
        std::uint64_t count;
    };
    for (const Expected& expected :
         {Expected{Strategy::simt, &TraceWork::compressed_nodes, &TraceWork::triangles, kBundles * kBundle},
          Expected{Strategy::wide, &TraceWork::wide_nodes, &TraceWork::triangle_blocks, kBundles * kBundle},
          Expected{Strategy::packet, &TraceWork::bundle_nodes, &TraceWork::bundle_triangles, kBundles}}) {
        CAPTURE(to_string(expected.strategy));
        Tracer tracer(scene_of({mesh}), {test_device()}, {expected.strategy});
        std::vector<Hit> hits(rays.size());
        const TraceWork work = tracer.count_closest_hit(rays, hits, Coherence::coherent);
        // Where a register holds sixteen floats, wide tests all eight places of the root, and the leaf, by groups.
        if (expected.strategy == Strategy::wide && work.bundle_triangles > 0) {
            CHECK(work.bundle_boxes == 8 * kBundles);
            CHECK(work.bundle_triangles == kBundles);
            CHECK(work.wide_nodes + work.triangle_blocks == 0);
        } else {
            CHECK(work.*expected.of_tree == expected.count);
            CHECK(work.*expected.of_primitives == expected.count);
        }
        for (const Hit& hit : hits) REQUIRE(hit.primitive == 0);
        if (expected.strategy != Strategy::packet) continue;
        // For any hit too; but the leaf that occluded a bundle is tested before the tree by those that follow.
        std::vector<std::uint8_t> occluded(rays.size());
        const TraceWork any = tracer.count_any_hit(rays, occluded, Coherence::coherent);
        CHECK(any.bundle_triangles == kBundles);
        CHECK(any.bundle_nodes >= 1);
        CHECK(any.bundle_nodes < kBundles);
        CHECK(occluded == std::vector<std::uint8_t>(rays.size(), 1));
    }
}

}  // namespace castor::test
