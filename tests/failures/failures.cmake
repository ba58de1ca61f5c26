# A program of its own: what stands between Castor and the OpenCL loader in it is in every call's way.
add_executable(castor_failure_tests failures/failures_test.cpp failures/opencl_shim.cpp)
target_include_directories(castor_failure_tests PRIVATE .)
target_compile_options(castor_failure_tests PRIVATE $<$<CONFIG:Release>:-O1>)
target_precompile_headers(castor_failure_tests REUSE_FROM castor_tests)
target_link_libraries(castor_failure_tests
  PRIVATE castor_shared_programs castor_objects castor_test_main ${CMAKE_DL_LIBS})
catch_discover_tests(castor_failure_tests TEST_PREFIX "failures: ")

# The same between Castor and the loader slows devices down.
add_executable(device_scaling bench/device_scaling.cpp failures/opencl_shim.cpp)
target_include_directories(device_scaling PRIVATE .)
target_compile_options(device_scaling PRIVATE $<$<CONFIG:Release>:-O1>)
target_precompile_headers(device_scaling REUSE_FROM castor_tests)
target_link_libraries(device_scaling PRIVATE castor_objects ${CMAKE_DL_LIBS})
add_test(NAME "device_scaling: devices of different speeds make one picture" COMMAND device_scaling 128 1 1,1 1,3)
