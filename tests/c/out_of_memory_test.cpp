// The host has too little memory under the C interface: it tells so, or does without; nothing leaks, and the
// next calls work.
#include <link.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <new>

#include "c/session.h"
#include "failures/opencl_shim.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"

namespace {

struct Code {
    std::uintptr_t begin = 0, end = 0;
};

/// Where the library's code lies.
Code library_code() {
    Code code;
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t, void* found) {
            if (!std::strstr(info->dlpi_name, "libcastor_c")) return 0;
            for (int i = 0; i < info->dlpi_phnum; ++i) {
                const ElfW(Phdr)& part = info->dlpi_phdr[i];
                if (part.p_type == PT_LOAD && part.p_flags & PF_X)
                    *static_cast<Code*>(found) = {info->dlpi_addr + part.p_vaddr,
                                                  info->dlpi_addr + part.p_vaddr + part.p_memsz};
            }
            return 1;
        },
        &code);
    return code;
}

const Code library = library_code();      // none before this is initialised
std::atomic<long> allocations_left = -1;  // of the library, until one is refused; below 0: none will be
std::atomic<long> live_allocations = 0;   // of the library

/// Before each allocation.
struct Head {
    std::size_t offset;  // of the allocation in the memory that malloc gave
    std::size_t is_of_library;
};

/// Of drivers, which end the process without memory, all allocations succeed.
void* allocate(std::size_t size, std::size_t alignment, const void* caller) {
    constexpr std::size_t kBeyondAllMemory = std::size_t{1} << 46;  // sanitizers end the process where it is asked for
    if (size > kBeyondAllMemory) throw std::bad_alloc();
    const auto from = reinterpret_cast<std::uintptr_t>(caller);
    const bool is_of_library = from >= library.begin && from < library.end;
    if (is_of_library && allocations_left.fetch_sub(1) == 0) throw std::bad_alloc();
    const std::size_t offset = std::max(alignment, sizeof(Head));
    void* memory = nullptr;
    if (posix_memalign(&memory, offset, offset + size) != 0) throw std::bad_alloc();
    auto* const allocated = static_cast<std::byte*>(memory) + offset;
    const Head head{offset, is_of_library};
    std::memcpy(allocated - sizeof(Head), &head, sizeof(Head));
    live_allocations += is_of_library;
    return allocated;
}

void release(void* allocated) {
    if (!allocated) return;
    Head head;
    std::memcpy(&head, static_cast<std::byte*>(allocated) - sizeof(Head), sizeof(Head));
    live_allocations -= static_cast<long>(head.is_of_library);
    std::free(static_cast<std::byte*>(allocated) - head.offset);
}

}  // namespace

void* operator new(std::size_t size) {
    return allocate(size, alignof(std::max_align_t), __builtin_return_address(0));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    return allocate(size, static_cast<std::size_t>(alignment), __builtin_return_address(0));
}
// Drivers use this one, and AddressSanitizer has one that does not call the first.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    try {
        return allocate(size, alignof(std::max_align_t), nullptr);
    } catch (const std::bad_alloc&) {
        return nullptr;
    }
}
void operator delete(void* memory, const std::nothrow_t&) noexcept {
    release(memory);
}
void operator delete(void* memory) noexcept {
    release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
    release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
    release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
    release(memory);
}

namespace castor::test {
namespace {

struct Answers {
    std::vector<castor_hit> hits;
    std::vector<std::uint32_t> counts;
    std::vector<castor_hit> crossings;
    std::vector<float> pixels;

    bool operator==(const Answers& other) const {
        const auto same = [](const auto& a, const auto& b) {
            return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
        };
        return same(hits, other.hits) && same(counts, other.counts) && same(crossings, other.crossings) &&
               same(pixels, other.pixels);
    }
};

/// Uses all of the interface that needs much memory; ends at the first call that is not done.
castor_status use_castor(castor_scene* scene, castor_devices* devices, Answers& answers) {
    castor_built_scene* built = nullptr;
    castor_tracer* tracer = nullptr;
    castor_crossings* crossings = nullptr;
    castor_renderer* renderer = nullptr;
    castor_film* film = nullptr;
    castor_status status = CASTOR_STATUS_DONE;
    const auto step = [&](auto&& call) {
        if (status == CASTOR_STATUS_DONE) status = call();
    };
    static const std::vector<castor_ray> rays = test_rays();
    answers.hits.resize(rays.size());
    answers.counts.resize(rays.size());
    const castor_camera camera = test_camera();
    const castor_mesh mesh = flat_mesh();
    step([&] { return castor_scene_add_mesh(scene, &mesh, nullptr); });
    step([&] { return castor_built_scene_create(scene, devices, nullptr, &built); });
    step([&] { return castor_tracer_create_from_built(built, devices, nullptr, &tracer); });
    step([&] { return castor_tracer_closest_hit(tracer, rays.data(), rays.size(), answers.hits.data(), nullptr); });
    step([&] {
        return castor_tracer_count_crossings(tracer, rays.data(), rays.size(), answers.counts.data(), nullptr);
    });
    step([&] { return castor_tracer_list_all_crossings(tracer, rays.data(), rays.size(), nullptr, &crossings); });
    step([&] { return castor_renderer_create_from_built(built, devices, nullptr, &renderer); });
    step([&] { return castor_renderer_render(renderer, &camera, nullptr, &film); });
    if (status == CASTOR_STATUS_DONE) {
        auto arrays = sized<castor_crossings_arrays>();
        done(castor_crossings_get_arrays(crossings, &arrays));
        answers.crossings.assign(arrays.hits, arrays.hits + arrays.first[rays.size()]);
        auto info = sized<castor_film_info>();
        done(castor_film_get_info(film, &info));
        answers.pixels.assign(info.pixels, info.pixels + std::size_t{3} * info.width * info.height);
    }
    castor_built_scene_release(built);
    castor_tracer_release(tracer);
    castor_crossings_release(crossings);
    castor_renderer_release(renderer);
    castor_film_release(film);
    return status;
}

struct Outcome {
    castor_status status = CASTOR_STATUS_DONE;
    bool has_refused = false;
    std::string message;
    Answers answers;
};

/// With the library's allocation of this number refused; below 0: with none.
Outcome use_castor(castor_devices* devices, long refused = -1) {
    const SceneHandle scene(make_test_scene);
    Outcome outcome;
    allocations_left = refused;
    outcome.status = use_castor(scene, devices, outcome.answers);
    outcome.has_refused = refused >= 0 && allocations_left < 0;
    allocations_left = -1;
    outcome.message = castor_last_error_message();
    CHECK(castor_scene_create(nullptr) == CASTOR_STATUS_USAGE_ERROR);  // each error message has its own memory
    return outcome;
}

}  // namespace

TEST_CASE("memory that is refused under the C interface is told, and nothing leaks", "[c]") {
    const TemporaryDirectory cache;
    const ScopedVariable cache_folder("CASTOR_CACHE_DIR", cache.path().string());
    const DevicesHandle devices(select_test_devices);
    REQUIRE(use_castor(devices).status == CASTOR_STATUS_DONE);  // fills the caches
    reset_shim();
    const Outcome expected = use_castor(devices);
    REQUIRE(expected.status == CASTOR_STATUS_DONE);
    const std::map<std::string, long> objects = live_objects();
    const long allocations = live_allocations;
    int told = 0;
    bool has_refused = true;
    for (long number = 0; has_refused; number += 1 + number / 8) {
        CAPTURE(number);
        const Outcome outcome = use_castor(devices, number);
        has_refused = outcome.has_refused;
        INFO(castor_status_string(outcome.status) << ": " << outcome.message);
        if (outcome.status == CASTOR_STATUS_DONE)
            CHECK(outcome.answers == expected.answers);
        else
            CHECK(outcome.status == CASTOR_STATUS_OUT_OF_MEMORY);
        told += outcome.status == CASTOR_STATUS_OUT_OF_MEMORY;
        CHECK(live_objects() == objects);
        CHECK(live_allocations == allocations);
    }
    CHECK(told > 10);
    CHECK(use_castor(devices).answers == expected.answers);
}

TEST_CASE("arrays beyond all memory are refused in C", "[c]") {
    const SceneHandle scene(make_test_scene);
    castor_mesh mesh = flat_mesh();
    mesh.vertex_count = std::numeric_limits<std::ptrdiff_t>::max() / (3 * sizeof(float));
    CHECK(castor_scene_add_mesh(scene, &mesh, nullptr) == CASTOR_STATUS_OUT_OF_MEMORY);
    CHECK_THAT(castor_last_error_message(), Catch::Matchers::Contains("castor_scene_add_mesh"));
    const DevicesHandle devices(select_test_devices);
    const TracerHandle tracer(
        [&](castor_tracer** target) { return castor_tracer_create(scene, devices, nullptr, target); });
    // The counts of so many rays cannot be stored; no ray is read.
    const std::vector<castor_ray> rays = test_rays();
    castor_crossings* crossings = nullptr;
    const std::size_t most = std::numeric_limits<std::ptrdiff_t>::max() / sizeof(castor_ray);
    CHECK(castor_tracer_list_all_crossings(tracer, rays.data(), most, nullptr, &crossings) ==
          CASTOR_STATUS_OUT_OF_MEMORY);
    CHECK(!crossings);
}

}  // namespace castor::test
