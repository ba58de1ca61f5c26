# Castor as a shared library, from the same objects: it exports what the public headers declare, and nothing else, and
# the program of README.md runs with it.
add_library(castor_shared SHARED $<TARGET_OBJECTS:castor_objects>)
target_include_directories(castor_shared INTERFACE ${PROJECT_SOURCE_DIR}/include)
target_compile_features(castor_shared INTERFACE cxx_std_20)
target_link_libraries(castor_shared
  PUBLIC OpenCL::OpenCL glm::glm
  PRIVATE castor_options fmt::fmt pugixml::pugixml TBB::tbb tinyobjloader::tinyobjloader tinyexr::tinyexr
          Threads::Threads ${CMAKE_DL_LIBS})
foreach(name IN LISTS CASTOR_DECODERS)
  target_link_libraries(castor_shared PRIVATE "${CASTOR_${name}_LIBRARY}")
endforeach()
add_executable(castor_shared_user install/main.cpp)
target_link_libraries(castor_shared_user PRIVATE castor_shared castor_options)
add_test(NAME "shared library: the program of README.md runs with it" COMMAND castor_shared_user)
set_tests_properties("shared library: the program of README.md runs with it" PROPERTIES
  PASS_REGULAR_EXPRESSION "sphere.png: [1-9][0-9]* rays")
if(CASTOR_PYTHON AND NOT CASTOR_SANITIZE)
  add_test(NAME "shared library: it exports the public interface alone"
    COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/install/exports_test" "$<TARGET_FILE:castor_shared>")
endif()
