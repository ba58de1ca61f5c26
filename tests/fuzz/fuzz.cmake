# What scripts/fuzz builds, with Clang: the targets under libFuzzer, and the program that writes their seeds. The same
# targets run over their seeds in castor_tests, in any build.
option(CASTOR_BUILD_FUZZERS "Build the fuzz targets for libFuzzer (needs Clang; see scripts/fuzz)" OFF)
set(castor_fuzz_sources
  fuzz/picture_target.cpp
  fuzz/ray_target.cpp
  fuzz/scene_targets.cpp
  fuzz/section_targets.cpp
  fuzz/targets.cpp
  support/compressed_gltf.cpp
  support/picture_bytes.cpp
  support/scene_twins.cpp
  "${PROJECT_SOURCE_DIR}/host/cli/ray_file.cpp")
target_sources(castor_tests PRIVATE ${castor_fuzz_sources} fuzz/fuzz_test.cpp)
if(CASTOR_BUILD_FUZZERS)
  add_executable(castor_fuzz EXCLUDE_FROM_ALL ${castor_fuzz_sources} fuzz/libfuzzer_main.cpp)
  target_link_options(castor_fuzz PRIVATE -fsanitize=fuzzer)
  add_executable(castor_fuzz_seeds EXCLUDE_FROM_ALL ${castor_fuzz_sources} fuzz/write_seeds.cpp)
  foreach(target castor_fuzz castor_fuzz_seeds)
    target_include_directories(${target} PRIVATE . "${CMAKE_CURRENT_BINARY_DIR}/generated")
    target_link_libraries(${target} PRIVATE castor_objects)
  endforeach()
endif()
