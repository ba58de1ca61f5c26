#include "base/name_list.h"

#include "support/catch.h"

namespace castor::test {

TEST_CASE("lists of names end after some, with the number of the others", "[name_list]") {
    CHECK(list_some({}).empty());
    CHECK(list_some({"a"}) == "a");
    CHECK(list_some({"a", "b", "c"}, 3) == "a, b, c");
    CHECK(list_some({"a", "b", "c", "d"}, 2) == "a, b and 2 more");
    CHECK(list_some(std::vector<std::string>(kMostNamesListed + 7, "a")) == "a, a, a, a, a, a, a, a, a, a and 7 more");
}

}  // namespace castor::test
