# The C interface: all functions with all that can be wrong, the results of C++, and the recorded ABI. The program of
# host/c/README.md is in install.cmake.
if(NOT TARGET castor_c)
  return()
endif()

# The shim stands between libcastor_c and the OpenCL loader: the program's own functions come first.
add_executable(castor_c_tests
  c/every_function_test.cpp
  c/opencl_failures_test.cpp
  c/out_of_memory_test.cpp
  c/results_test.cpp
  failures/opencl_shim.cpp)
target_include_directories(castor_c_tests PRIVATE . "${CMAKE_CURRENT_BINARY_DIR}/generated")
target_compile_options(castor_c_tests PRIVATE $<$<CONFIG:Release>:-O1>)
target_precompile_headers(castor_c_tests REUSE_FROM castor_tests)
target_link_libraries(castor_c_tests
  PRIVATE castor_shared_programs castor_c castor_objects castor_test_main ${CMAKE_DL_LIBS})
add_dependencies(castor_c_tests castor_oidn_2)
catch_discover_tests(castor_c_tests TEST_PREFIX "c: ")

if(CASTOR_PYTHON AND NOT CASTOR_SANITIZE)
  add_test(NAME "c: header and library are the recorded ABI"
    COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/abi_test" "$<TARGET_FILE:castor_c>")
endif()
