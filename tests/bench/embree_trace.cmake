# The peer that scripts/compare_throughput runs beside Castor, where Embree and the command line tool's libraries are installed.
find_package(embree 3 QUIET)
find_package(CLI11 QUIET)
if(embree_FOUND AND CLI11_FOUND)
  add_executable(embree_trace bench/embree_trace.cpp ${PROJECT_SOURCE_DIR}/host/cli/ray_file.cpp)
  target_include_directories(embree_trace PRIVATE ${PROJECT_SOURCE_DIR}/host ${PROJECT_SOURCE_DIR}/host/cli)
  target_link_libraries(embree_trace PRIVATE castor::castor castor_options embree CLI11::CLI11 fmt::fmt nlohmann_json::nlohmann_json
                        Threads::Threads)
else()
  message(STATUS "embree_trace is not built: Embree 3 is not installed")
endif()
