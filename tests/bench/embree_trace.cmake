# The peers that scripts/compare_throughput runs beside Castor, where Embree and the command line tool's libraries are
# installed.
find_package(embree 3 QUIET)
find_package(CLI11 QUIET)
if(embree_FOUND AND CLI11_FOUND)
  foreach(program embree_trace embree_build)
    add_executable(${program} bench/${program}.cpp ${PROJECT_SOURCE_DIR}/host/cli/ray_file.cpp)
    target_include_directories(${program} PRIVATE ${PROJECT_SOURCE_DIR}/host/cli)
    target_compile_options(${program} PRIVATE $<$<CONFIG:Release>:-O2>)  # at -O3 CLI11 takes a compiler longer
    target_link_libraries(${program} PRIVATE castor_objects embree CLI11::CLI11)
  endforeach()
else()
  message(STATUS "embree_trace and embree_build are not built: Embree 3 is not installed")
endif()
