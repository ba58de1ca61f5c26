# Tests that are scripts, so that ctest runs all there is.
if(TARGET castor_cli)
  add_test(NAME "readme: the program and the commands are the tested ones"
    COMMAND "${PROJECT_SOURCE_DIR}/scripts/check_readme" "${PROJECT_BINARY_DIR}")
endif()

# Oclgrind brings an OpenCL implementation of its own, which a sanitizer's runtime cannot live with.
find_program(CASTOR_OCLGRIND oclgrind)
if(CASTOR_OCLGRIND AND NOT CASTOR_SANITIZE)
  add_test(NAME "oclgrind: kernels have no data race and read nothing uninitialised"
    COMMAND "${PROJECT_SOURCE_DIR}/scripts/test_oclgrind" "$<TARGET_FILE:castor_tests>")
else()
  message(STATUS "Kernels are not tested under Oclgrind: it is not installed, or this build is sanitized")
endif()
