// What ContextsAhead promises: contexts whose programs are built, once, and nothing lost where building fails.
#include "opencl/contexts_ahead.h"

#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

namespace {

void wait_until_built() {
    while (programs_being_built() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// Such a device has no context ahead, and a thread of its own must not touch it.
bool has_no_context(const Device& device) {
    if (!device_quirks(device).stays_in_thread) return false;
    ContextsAhead contexts;
    contexts.begin(device, {{"resolve", ""}});
    CHECK(contexts.take(device) == nullptr);
    return true;
}

}  // namespace

TEST_CASE("contexts that are made ahead have their programs, and are taken once", "[programs]") {
    const Device device = test_device();
    if (has_no_context(device)) return;
    ContextsAhead contexts;
    CHECK(contexts.take(device) == nullptr);
    contexts.begin(device, {{"resolve", ""}, {"add_samples", "-DCASTOR_HAS_SLOT_SUMS=1"}});
    const std::shared_ptr<DeviceContext> context = contexts.take(device);
    REQUIRE(context);
    context->kernel("add_samples", "-DCASTOR_HAS_SLOT_SUMS=1");  // waits for it, or is first
    wait_until_built();
    CHECK(context->program_count() == 2);
    context->kernel("resolve");
    CHECK(context->program_count() == 2);
    CHECK(contexts.take(device) == nullptr);

    contexts.begin(device, {});
    Device other = device;
    other.max_allocation_bytes /= 2;
    CHECK(contexts.take(other) == nullptr);
    CHECK(contexts.take(device) != nullptr);
    wait_until_built();
}

TEST_CASE("a program that cannot be built ahead is left to who needs it", "[programs]") {
    const Device device = test_device();
    if (has_no_context(device)) return;
    ContextsAhead contexts;
    contexts.begin(device, {{"resolve", ""}, {"there_is_none", ""}, {"add_samples", ""}});
    const std::shared_ptr<DeviceContext> context = contexts.take(device);
    REQUIRE(context);
    wait_until_built();
    CHECK(context->program_count() == 2);
    CHECK_THROWS_AS(context->kernel("there_is_none"), DeviceError);
}

TEST_CASE("a device without a context has none ahead", "[programs]") {
    Device device = test_device();
    device.id = nullptr;
    ContextsAhead contexts;
    contexts.begin(device, {{"resolve", ""}});
    CHECK(contexts.take(device) == nullptr);
    wait_until_built();
}

TEST_CASE("contexts that nobody takes are left in the middle, and not waited for", "[programs]") {
    const Device device = test_device();
    if (has_no_context(device)) return;
    std::vector<KernelProgram> many;
    for (int i = 0; i < 1000; ++i) many.push_back({"resolve", "-DNUMBER=" + std::to_string(i)});
    {
        ContextsAhead contexts, others;
        contexts.begin(device, many);
        others = std::move(contexts);
        CHECK(programs_being_built() == 1);
    }
    wait_until_built();  // all of them would take minutes
    CHECK(programs_being_built() == 0);
}

}  // namespace castor::test
