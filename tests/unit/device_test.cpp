#include "castor/device.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <string>
#include <thread>
#include <vector>

#include "castor/error.h"
#include "opencl/cl.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {
namespace {

std::vector<std::size_t> indices(std::string_view selection) {
    std::vector<std::size_t> result;
    for (const Device& device : select_devices(selection)) result.push_back(device.index);
    return result;
}

std::vector<std::size_t> indices_where(bool (*predicate)(const Device&)) {
    std::vector<std::size_t> result;
    for (const Device& device : list_devices())
        if (predicate(device)) result.push_back(device.index);
    return result;
}

std::string upper_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
    return text;
}

bool is_gpu(const Device& device) {
    return device.type == DeviceType::gpu;
}

}  // namespace

// In a process of its own, as ctest runs each test: the first call loads the drivers.
TEST_CASE("threads that begin together list the same devices", "[device]") {
    constexpr std::size_t kThreads = 8;
    std::vector<std::size_t> counts(kThreads);
    std::atomic<std::size_t> waiting = kThreads;
    std::vector<std::thread> threads;
    for (std::size_t& count : counts)
        threads.emplace_back([&] {
            --waiting;
            while (waiting > 0) std::this_thread::yield();
            count = list_devices().size();
        });
    for (std::thread& thread : threads) thread.join();
    const std::size_t expected = list_devices().size();
    REQUIRE(expected > 0);
    CHECK(counts == std::vector(kThreads, expected));
}

TEST_CASE("list_devices describes each device, numbered in order", "[device]") {
    const std::vector<Device> devices = list_devices();
    REQUIRE(!devices.empty());
    for (std::size_t i = 0; i < devices.size(); ++i) {
        const Device& device = devices[i];
        CAPTURE(i, device.name);
        CHECK(device.index == i);
        CHECK(!device.name.empty());
        CHECK(!device.platform_name.empty());
        CHECK(device.platform_version.starts_with("OpenCL "));
        CHECK(device.device_version.starts_with("OpenCL "));
        CHECK(device.opencl_c_version.starts_with("OpenCL C "));
        CHECK(!device.driver_version.empty());
        CHECK(device.compute_units > 0);
        CHECK(device.max_allocation_bytes > 0);
        CHECK(device.max_allocation_bytes <= device.global_memory_bytes);
        CHECK(device.platform != nullptr);
        CHECK(device.id != nullptr);
    }
}

TEST_CASE("devices are selected by index, type, name and all", "[device]") {
    const std::vector<Device> devices = list_devices();
    REQUIRE(!devices.empty());
    std::vector<std::size_t> everything;
    for (const Device& device : devices) everything.push_back(device.index);

    CHECK(indices("all") == everything);
    CHECK(indices(" ALL ") == everything);
    for (const Device& device : devices) {
        CAPTURE(device.name);
        CHECK(indices(std::to_string(device.index)) == std::vector{device.index});
        for (const std::string& name : {device.name, upper_case(device.name), device.platform_name}) {
            if (name.find(',') != std::string::npos) continue;  // cannot be said in a list
            const std::vector<std::size_t> found = indices(name);
            CHECK(std::count(found.begin(), found.end(), device.index) == 1);
        }
        const std::vector<std::size_t> by_type = indices(to_string(device.type));
        CHECK(std::count(by_type.begin(), by_type.end(), device.index) == 1);
    }
}

TEST_CASE("a device that is selected twice comes once, in the order of the list", "[device]") {
    const std::size_t last = list_devices().size() - 1;
    CHECK(indices("0,0") == std::vector<std::size_t>{0});
    std::vector<std::size_t> expected{last};
    for (std::size_t i = 0; i < last; ++i) expected.push_back(i);
    CHECK(indices(std::to_string(last) + ", all, 0") == expected);
}

TEST_CASE("a device is split into parts of as many compute units each as can be", "[device]") {
    const Device whole = test_device();
    const std::string number = std::to_string(whole.index);
    CHECK(select_devices(number + "/1").at(0).id == whole.id);
    CHECK_THROWS_AS(select_devices(number + "/0"), UsageError);
    CHECK_THROWS_WITH(select_devices(fmt::format("{}/{}", number, whole.compute_units + 1)),
                      Catch::Matchers::Contains("cannot be split into"));
    CHECK_THROWS_WITH(select_devices(number + "/two"),
                      Catch::Matchers::Contains("no device matches \"" + number + "/two\""));
    if (whole.type != DeviceType::cpu || whole.compute_units < 2) return;  // others need not be divisible
    const std::vector<Device> parts = select_devices(number + "/2, " + number);
    REQUIRE(parts.size() == 2);
    CHECK(parts[0].id != parts[1].id);
    for (std::uint32_t i = 0; i < 2; ++i) {
        CHECK(parts[i].name == whole.name);
        CHECK(parts[i].compute_units == (whole.compute_units + 1 - i) / 2);
        CHECK(label(parts[i]) == fmt::format("{} (part {} of 2)", whole.name, i + 1));
        CHECK(cl::Device(parts[i].id, true).getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>() == parts[i].compute_units);
    }
    CHECK(select_devices(number + "/2").at(1).id == parts[1].id);
}

TEST_CASE("an empty selection is the first GPU, else the first device", "[device]") {
    const std::vector<std::size_t> gpus = indices_where(is_gpu);
    const std::vector<std::size_t> expected{gpus.empty() ? 0 : gpus.front()};
    CHECK(indices("") == expected);
    CHECK(indices("  ") == expected);
}

TEST_CASE("an unknown device is a UsageError that lists what there is", "[device]") {
    const std::vector<Device> devices = list_devices();
    for (const std::string selection :
         {"no such device", "99999", "99999999999999999999999", "-1", "0,", ",0", "all,quantum"}) {
        CAPTURE(selection);
        try {
            select_devices(selection);
            FAIL_CHECK("no error");
        } catch (const UsageError& error) {
            const std::string text = error.what();
            CAPTURE(text);
            for (const Device& device : devices) CHECK(text.find(device.name) != std::string::npos);
        }
    }
    CHECK_THROWS_WITH(select_devices("0,quantum"),
                      Catch::Matchers::StartsWith("no device matches \"quantum\"; there are:\n  0: "));
}

TEST_CASE("device types have names", "[device]") {
    CHECK(to_string(DeviceType::cpu) == "cpu");
    CHECK(to_string(DeviceType::gpu) == "gpu");
    CHECK(to_string(DeviceType::accelerator) == "accelerator");
    CHECK(to_string(DeviceType::other) == "other");
}

}  // namespace castor::test
