// What ContextsAhead promises: contexts whose programs are built, once, and nothing lost where building fails.
#include "opencl/contexts_ahead.h"

#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

TEST_CASE("contexts that are made ahead have their programs, and are taken once", "[programs]") {
    const Device device = test_device();
    if (device_quirks(device).stays_in_thread) return;
    ContextsAhead contexts;
    CHECK(contexts.take(device) == nullptr);
    contexts.begin(device, {{"resolve", ""}, {"add_samples", "-DCASTOR_HAS_SLOT_SUMS=1"}});
    const std::unique_ptr<DeviceContext> context = contexts.take(device);
    REQUIRE(context);
    CHECK(context->program_count() == 2);
    context->kernel("resolve");
    context->kernel("add_samples", "-DCASTOR_HAS_SLOT_SUMS=1");
    CHECK(context->program_count() == 2);
    CHECK(contexts.take(device) == nullptr);
    contexts.begin(device, {});
    Device other = device;
    other.id = nullptr;
    CHECK(contexts.take(other) == nullptr);
    CHECK(contexts.take(device) != nullptr);
}

TEST_CASE("a program that cannot be built ahead is left to who needs it", "[programs]") {
    const Device device = test_device();
    if (device_quirks(device).stays_in_thread) return;
    ContextsAhead contexts;
    contexts.begin(device, {{"resolve", ""}, {"there_is_none", ""}, {"add_samples", ""}});
    const std::unique_ptr<DeviceContext> context = contexts.take(device);
    REQUIRE(context);
    CHECK(context->program_count() == 1);
    CHECK_THROWS_AS(context->kernel("there_is_none"), DeviceError);
    context->kernel("add_samples");
}

TEST_CASE("contexts that nobody takes end with who began them", "[programs]") {
    ContextsAhead contexts;
    contexts.begin(test_device(), {{"resolve", ""}, {"add_samples", ""}, {"limit_samples", ""}});
}

}  // namespace castor::test
