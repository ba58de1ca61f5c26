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

if(TARGET castor_c)
  set(consumer_c "${CMAKE_CURRENT_BINARY_DIR}/consumer_c")
  set(output_c "ray 0: distance 7.5.*ray 3: distance inf.*tetrahedron.png is written")
  set(flags_c "${CMAKE_C_FLAGS}")
  if(CASTOR_SANITIZE)
    string(APPEND flags_c " -fsanitize=${CASTOR_SANITIZE}")
  endif()
  add_test(NAME "install: a project in C that finds the package traces and renders"
    COMMAND "${CMAKE_CTEST_COMMAND}" --build-and-test "${CMAKE_CURRENT_SOURCE_DIR}/install/c" "${consumer_c}"
      --build-generator "${CMAKE_GENERATOR}" --build-makeprogram "${CMAKE_MAKE_PROGRAM}"
      --build-options "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_C_COMPILER=${CMAKE_C_COMPILER}"
                      "-DCMAKE_C_FLAGS=${flags_c}"
      --test-command "${consumer_c}/picture_c")
  set_tests_properties("install: a project in C that finds the package traces and renders" PROPERTIES
    FIXTURES_REQUIRED castor_installed PASS_REGULAR_EXPRESSION "${output_c}")

  find_program(CASTOR_PKG_CONFIG pkg-config)
  if(CASTOR_PKG_CONFIG AND NOT CASTOR_SANITIZE)
    add_test(NAME "install: cc compiles a program in C with what pkg-config says"
      COMMAND "${CMAKE_CURRENT_SOURCE_DIR}/install/pkg_config_test" "${prefix}/${CMAKE_INSTALL_LIBDIR}")
    set_tests_properties("install: cc compiles a program in C with what pkg-config says" PROPERTIES
      FIXTURES_REQUIRED castor_installed PASS_REGULAR_EXPRESSION "${output_c}")
  else()
    message(STATUS "pkg-config is not tested: it is not installed, or this build is sanitized")
  endif()
endif()
