#include <cstddef>
#include <string>
#include <vector>

#include "castor/shared/types.h"
#include "doctor/layout_test_fields.h"
#include "support/catch.h"
#include "support/kernel_fixture.h"

namespace castor::test {

TEST_CASE("host and device lay out the shared structs alike", "[kernels][oclgrind]") {
    using namespace shared;
    struct Entry {
        std::string name;
        cl_uint number;
    };
#define CASTOR_SIZE_ENTRY(type) {"sizeof " #type, sizeof(type)},
#define CASTOR_OFFSET_ENTRY(type, member) {#type "." #member, offsetof(type, member)},
    const std::vector<Entry> expected{CASTOR_LAYOUT(CASTOR_SIZE_ENTRY, CASTOR_OFFSET_ENTRY)};

    KernelFixture fixture;
    const auto found = fixture.run<cl_uint>("doctor/layout_test", expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
        INFO(expected[i].name);
        CHECK(found[i] == expected[i].number);
    }
}

}  // namespace castor::test
