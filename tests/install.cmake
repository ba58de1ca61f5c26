# Installs the build into a folder of its own, then configures, builds and runs the consumer project against it.
set(prefix "${CMAKE_CURRENT_BINARY_DIR}/prefix")
set(consumer "${CMAKE_CURRENT_BINARY_DIR}/consumer")

add_test(NAME "install: the build installs itself"
  COMMAND "${CMAKE_COMMAND}" --install "${PROJECT_BINARY_DIR}" --prefix "${prefix}")
set_tests_properties("install: the build installs itself" PROPERTIES FIXTURES_SETUP castor_installed)

set(flags "${CMAKE_CXX_FLAGS}")
if(CASTOR_SANITIZE)
  string(APPEND flags " -fsanitize=${CASTOR_SANITIZE}")
endif()
add_test(NAME "install: a project that finds the package builds and renders"
  COMMAND "${CMAKE_CTEST_COMMAND}" --build-and-test "${CMAKE_CURRENT_SOURCE_DIR}/install" "${consumer}"
    --build-generator "${CMAKE_GENERATOR}" --build-makeprogram "${CMAKE_MAKE_PROGRAM}"
    --build-options "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}"
                    "-DCMAKE_CXX_FLAGS=${flags}" "-DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE}"
    --test-command "${consumer}/picture")
set_tests_properties("install: a project that finds the package builds and renders" PROPERTIES
  FIXTURES_REQUIRED castor_installed PASS_REGULAR_EXPRESSION "sphere.png: [1-9][0-9]* rays")
