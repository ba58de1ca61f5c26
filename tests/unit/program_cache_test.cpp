#include "opencl/program_cache.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.h"
#include "support/kernel_fixture.h"
#include "support/scoped_variable.h"
#include "support/temporary_directory.h"

using namespace castor;
using namespace castor::test;
namespace fs = std::filesystem;

namespace {

const std::string kKey = "castor 0\ndevice none\nkernel void f() {}";
const ProgramCache::Binary kBinary = {0, 1, 2, 250, 255, 0, 7};

std::string contents_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

void overwrite(const fs::path& file, const std::string& contents) {
    std::ofstream(file, std::ios::binary) << contents;
}

std::size_t count_files(const fs::path& folder) {
    return fs::is_directory(folder) ? std::distance(fs::directory_iterator(folder), {}) : 0;
}

const kernels::SourceTable kSources = {{"cache_test.cl", R"(
    kernel void cache_test(const uint count, global float *outputs)
    {
        const uint i = get_global_id(0);
        if (i < count) outputs[i] = sqrt((float)i) / 3.0f;
    })"}};

/// What the kernel answers where its program comes from this cache.
std::vector<float> answers_with(const ProgramCache& cache) {
    constexpr std::size_t kCount = 64;
    DeviceContext context(test_device(), kSources, cache);
    cl::Kernel kernel = context.kernel("cache_test");
    const cl::Buffer buffer = context.make_buffer(kCount * sizeof(float), "outputs");
    context.enqueue(kernel, kCount, static_cast<cl_uint>(kCount), buffer);
    std::vector<float> outputs(kCount);
    context.read(buffer, outputs.data(), kCount * sizeof(float));
    return outputs;
}

}  // namespace

TEST_CASE("a program that was stored is found again, and no other", "[program_cache]") {
    const TemporaryDirectory directory;
    const ProgramCache cache(directory.path() / "made" / "when needed");
    CHECK_FALSE(cache.find(kKey));
    cache.store(kKey, kBinary);
    CHECK(cache.find(kKey) == kBinary);
    CHECK_FALSE(cache.find(kKey + " "));
    CHECK(ProgramCache(directory.path() / "made" / "when needed").find(kKey) == kBinary);
    const ProgramCache::Binary other = {9};
    cache.store(kKey, other);
    CHECK(cache.find(kKey) == other);
    cache.forget(kKey);
    CHECK_FALSE(cache.find(kKey));
    CHECK(count_files(directory.path() / "made" / "when needed") == 0);
}

TEST_CASE("a damaged program counts as missing and is removed", "[program_cache]") {
    const TemporaryDirectory directory;
    const ProgramCache cache(directory.path());
    cache.store(kKey, kBinary);
    const fs::path file = cache.file_of(kKey);
    const std::string good = contents_of(file);
    REQUIRE(good.size() > kKey.size() + kBinary.size());

    for (std::size_t size = 1; size < good.size(); ++size) {
        CAPTURE(size);
        overwrite(file, good.substr(0, size));
        CHECK_FALSE(cache.find(kKey));
        CHECK_FALSE(fs::exists(file));
    }
    for (std::size_t at = 0; at < good.size(); ++at) {
        CAPTURE(at);
        std::string bad = good;
        bad[at] ^= 0x10;  // in turn the magic, the version, sizes, checksum, the key and the binary
        overwrite(file, bad);
        CHECK_FALSE(cache.find(kKey));
        CHECK_FALSE(fs::exists(file));
    }
    overwrite(file, good + "x");
    CHECK_FALSE(cache.find(kKey));
    overwrite(file, "");
    CHECK_FALSE(cache.find(kKey));

    cache.store(kKey, kBinary);
    CHECK(cache.find(kKey) == kBinary);
}

TEST_CASE("a program of another key under the same file name counts as missing", "[program_cache]") {
    const TemporaryDirectory directory;
    const ProgramCache cache(directory.path());
    const std::string foreign = "castor 1" + kKey.substr(8);
    REQUIRE(foreign.size() == kKey.size());
    cache.store(foreign, kBinary);
    fs::rename(cache.file_of(foreign), cache.file_of(kKey));
    CHECK_FALSE(cache.find(kKey));
}

TEST_CASE("a cache that cannot be used is as good as an empty one", "[program_cache]") {
    const TemporaryDirectory directory;
    SECTION("it is off") {
        const ProgramCache cache;
        cache.store(kKey, kBinary);
        CHECK_FALSE(cache.is_on());
        CHECK_FALSE(cache.find(kKey));
        cache.forget(kKey);
    }
    SECTION("the folder's place is taken by a file") {
        const ProgramCache cache(directory.write("file", "text") / "programs");
        cache.store(kKey, kBinary);
        CHECK_FALSE(cache.find(kKey));
        cache.forget(kKey);
        CHECK(contents_of(directory.path() / "file") == "text");
    }
    SECTION("the file's place is taken by a folder") {
        const ProgramCache cache(directory.path());
        fs::create_directories(cache.file_of(kKey) / "full");
        cache.store(kKey, kBinary);
        CHECK_FALSE(cache.find(kKey));
    }
    SECTION("the folder and the file cannot be written or read") {
        const ProgramCache cache(directory.path() / "programs");
        cache.store(kKey, kBinary);
        fs::permissions(cache.file_of(kKey), fs::perms::none);
        fs::permissions(directory.path() / "programs", fs::perms::owner_read | fs::perms::owner_exec);
        const bool is_root = ::geteuid() == 0;  // to whom permissions mean nothing
        CHECK(cache.find(kKey).has_value() == is_root);
        cache.store(kKey + "other", kBinary);
        CHECK(cache.find(kKey + "other").has_value() == is_root);
        fs::permissions(directory.path() / "programs", fs::perms::owner_all);
    }
}

TEST_CASE("several threads store and find the same programs", "[program_cache]") {
    const TemporaryDirectory directory;
    const ProgramCache::Binary large(100000, 42);
    std::vector<int> wrong(2, 0), found(2, 0);
    {
        std::vector<std::jthread> threads;
        for (std::size_t t = 0; t < 2; ++t)
            threads.emplace_back([&, t] {
                const ProgramCache cache(directory.path());
                for (int i = 0; i < 40; ++i) {
                    cache.store(kKey, large);
                    if (const auto binary = cache.find(kKey)) {
                        ++found[t];
                        wrong[t] += *binary != large;
                    }
                }
            });
    }
    for (std::size_t t = 0; t < 2; ++t) {
        CHECK(wrong[t] == 0);
        CHECK(found[t] == 40);
    }
    CHECK(count_files(directory.path()) == 1);
}

TEST_CASE("the key tells devices, drivers, options and sources apart", "[program_cache]") {
    Device device;
    device.name = "cpu";
    device.driver_version = "1";
    const std::string key = program_cache_key(device, "source", "-DA");
    CHECK(key == program_cache_key(device, "source", "-DA"));
    CHECK(key != program_cache_key(device, "source ", "-DA"));
    CHECK(key != program_cache_key(device, "source", "-DB"));
    for (std::string Device::*member :
         {&Device::name, &Device::driver_version, &Device::platform_version, &Device::device_version}) {
        Device other = device;
        other.*member += "2";
        CHECK(key != program_cache_key(other, "source", "-DA"));
    }
}

TEST_CASE("the cache's folder follows the environment", "[program_cache]") {
    const ScopedVariable home("HOME", "/home/ada");
    const ScopedVariable xdg("XDG_CACHE_HOME", std::nullopt);
    const ScopedVariable own("CASTOR_CACHE_DIR", std::nullopt);
    CHECK(program_cache_folder() == "/home/ada/.cache/castor/programs");
    {
        const ScopedVariable relative("XDG_CACHE_HOME", "relative");
        CHECK(program_cache_folder() == "/home/ada/.cache/castor/programs");
        const ScopedVariable absolute("XDG_CACHE_HOME", "/var/cache");
        CHECK(program_cache_folder() == "/var/cache/castor/programs");
        const ScopedVariable named("CASTOR_CACHE_DIR", "/tmp/mine");
        CHECK(program_cache_folder() == "/tmp/mine/programs");
        const ScopedVariable off("CASTOR_CACHE_DIR", "");
        CHECK(program_cache_folder().empty());
    }
    const ScopedVariable homeless("HOME", std::nullopt);
    CHECK(program_cache_folder().empty());
}

TEST_CASE("a kept program computes the same bits as a fresh one, and a broken one is built again", "[program_cache]") {
    const TemporaryDirectory directory;
    const ProgramCache cache(directory.path());
    const std::vector<float> fresh = answers_with(ProgramCache());
    CHECK(fresh[36] == 2.0f);
    CHECK(answers_with(cache) == fresh);
    if (count_files(directory.path()) == 0) {
        WARN("this device gives no binaries away");
        return;
    }
    REQUIRE(count_files(directory.path()) == 1);
    const fs::path file = fs::directory_iterator(directory.path())->path();
    const std::string good = contents_of(file);
    CHECK(answers_with(cache) == fresh);
    CHECK(contents_of(file) == good);

    // What the driver refuses, although the file is whole.
    const Device device = test_device();
    const DeviceQuirks quirks = device_quirks(device);
    const std::string source = kernels::expand_kernel_source("cache_test.cl", kSources, quirks.prelude);
    const std::string key = program_cache_key(device, source, quirks.build_options);
    REQUIRE(cache.find(key));
    cache.store(key, {1, 2, 3});
    CHECK(answers_with(cache) == fresh);
    CHECK(cache.find(key) != ProgramCache::Binary{1, 2, 3});

    overwrite(file, good.substr(0, good.size() / 2));
    CHECK(answers_with(cache) == fresh);
    CHECK(cache.find(key));
}
