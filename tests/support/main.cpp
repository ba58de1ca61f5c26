#if __has_include(<catch2/catch_session.hpp>)
#include <catch2/catch_session.hpp>
#else
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>
#endif

#include <cstdlib>

int main(int argc, char** argv) {
    // Profiles of this machine must not influence the tests. A test that needs profiles names a folder.
    ::setenv("CASTOR_PROFILE_DIR", "", 1);
    // No kernel is built with warnings, also by the programs that tests start.
    ::setenv("CASTOR_BUILD_OPTIONS", "-Werror", 0);
    return Catch::Session().run(argc, argv);
}
