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

# The comparison beside Embree says by status 77 that something for it is not installed.
find_program(CASTOR_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)
if(CASTOR_PYTHON)
  add_test(NAME "check_includes: folders include from those before them alone"
    COMMAND "${CASTOR_PYTHON}" "${PROJECT_SOURCE_DIR}/scripts/check_includes")
  add_test(NAME "check_format: sources are laid out, and no line is too long"
    COMMAND "${CASTOR_PYTHON}" "${PROJECT_SOURCE_DIR}/scripts/check_format")
  set_tests_properties("check_format: sources are laid out, and no line is too long" PROPERTIES SKIP_RETURN_CODE 77)
  add_test(NAME "check_regression: finds what became slower"
    COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/check_regression_test")
  add_test(NAME "check_counters: finds what costs more"
    COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/check_counters_test")
  if(TARGET castor_cli)
    add_test(NAME "counters: rays cost no more nodes, tests, bytes and operations than recorded"
      COMMAND "${CASTOR_PYTHON}" "${PROJECT_SOURCE_DIR}/scripts/check_counters" --build "${PROJECT_BINARY_DIR}")
  endif()
  # Instructions are recorded for one compiler: the script names another one.
  find_program(CASTOR_VALGRIND valgrind)
  if(TARGET castor_cli AND CASTOR_VALGRIND AND NOT CASTOR_SANITIZE)
    add_test(NAME "instructions: kernels execute no more than recorded"
      COMMAND "${CASTOR_PYTHON}" "${PROJECT_SOURCE_DIR}/scripts/check_counters" --instructions
              --build "${PROJECT_BINARY_DIR}")
    set_tests_properties("instructions: kernels execute no more than recorded"
      PROPERTIES SKIP_REGULAR_EXPRESSION "holds bounds of another compiler")
  else()
    message(STATUS "Instructions of kernels are not counted: Valgrind is not installed, or this build is sanitized")
  endif()
  if(TARGET castor_cli AND NOT CASTOR_SANITIZE)
    add_test(NAME "check_films: films are equal in all ways, and differences are found"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/check_films_test" "${PROJECT_BINARY_DIR}")
  endif()
  if(TARGET castor_cli AND NOT CASTOR_SANITIZE)
    add_test(NAME "compare_throughput: writes a whole page from tiny scenes"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/compare_throughput_test" "${PROJECT_BINARY_DIR}")
    set_tests_properties("compare_throughput: writes a whole page from tiny scenes" PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  if(TARGET castor_cli AND NOT CASTOR_SANITIZE)
    add_test(NAME "compare_renders: compares pictures, and says what is missing"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/compare_renders_test" "${PROJECT_BINARY_DIR}")
    set_tests_properties("compare_renders: compares pictures, and says what is missing" PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  if(TARGET castor_cli AND NOT CASTOR_SANITIZE)
    add_test(NAME "compare_paths: compares path-traced pictures, and measures right"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/compare_paths_test" "${PROJECT_BINARY_DIR}")
    set_tests_properties("compare_paths: compares path-traced pictures, and measures right"
      PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  if(TARGET castor_mpi AND NOT CASTOR_SANITIZE)
    add_test(NAME "castor-mpi: hosts render the bytes of one process, also when one is lost"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/mpi/castor_mpi_test" --build "${PROJECT_BINARY_DIR}")
    set_tests_properties("castor-mpi: hosts render the bytes of one process, also when one is lost"
      PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  add_test(NAME "make_scan: surfaces are closed, and the same everywhere"
    COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/make_scan_test")
  set_tests_properties("make_scan: surfaces are closed, and the same everywhere" PROPERTIES SKIP_RETURN_CODE 77)
  if(TARGET castor_cli AND NOT CASTOR_SANITIZE)
    add_test(NAME "run_stanford: tells times and memory"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/run_stanford_test" "${PROJECT_BINARY_DIR}")
    set_tests_properties("run_stanford: tells times and memory" PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  if(TARGET castor_cli AND NOT CASTOR_SANITIZE)
    add_test(NAME "test_kill: renders that are killed go on"
      COMMAND "${CASTOR_PYTHON}" "${PROJECT_SOURCE_DIR}/scripts/test_kill" "$<TARGET_FILE:castor_cli>" 6)
    # It bounds the seconds of work that are lost.
    set_tests_properties("test_kill: renders that are killed go on" PROPERTIES RUN_SERIAL TRUE)
    add_test(NAME "chunks: a scan of two million triangles is the same whole, cut and streamed"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/cli/chunks_test" "${PROJECT_BINARY_DIR}")
    set_tests_properties("chunks: a scan of two million triangles is the same whole, cut and streamed"
      PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  if(TARGET castor_python)
    add_test(NAME "python: declarations are those of castor_c.h"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/python/header_test.py" "${CMAKE_C_COMPILER}")
    add_test(NAME "python: package and examples are typed"
      COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/python/typing_test"
              "$<TARGET_PROPERTY:castor_python,PACKAGE>")
    set_tests_properties("python: package and examples are typed" PROPERTIES SKIP_RETURN_CODE 77)
  endif()
  # Of sanitized builds only those tests that do not wait for moments: AddressSanitizer's runtime is loaded before
  # Python, with the C++ library, whose functions it looks for when it begins.
  set(python_tests tracer renderer manners drop_in examples)
  set(python_environment "")
  if(CASTOR_SANITIZE)
    set(python_tests "")
    if(CASTOR_SANITIZE MATCHES "address" AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      set(python_tests tracer renderer drop_in)
      foreach(library IN ITEMS libasan.so libstdc++.so)
        execute_process(COMMAND "${CMAKE_CXX_COMPILER}" "-print-file-name=${library}"
          OUTPUT_VARIABLE library_file OUTPUT_STRIP_TRAILING_WHITESPACE)
        list(APPEND preloaded "${library_file}")
      endforeach()
      list(JOIN preloaded ":" preloaded)
      set(python_environment "LD_PRELOAD=${preloaded};ASAN_OPTIONS=detect_leaks=0:use_sigaltstack=0")
    endif()
  endif()
  if(TARGET castor_python)
    foreach(test IN LISTS python_tests)
      add_test(NAME "python: ${test}"
        COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/python/${test}_test.py")
      set_tests_properties("python: ${test}" PROPERTIES ENVIRONMENT
        "PYTHONPATH=$<TARGET_PROPERTY:castor_python,PACKAGE>;PYTHONDONTWRITEBYTECODE=1;${python_environment};\
CASTOR_TEST_OIDN=$<TARGET_FILE:castor_oidn_2>")
    endforeach()
  endif()
  add_test(NAME "compare_throughput: a browser lays its page out"
    COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/bench/report_page_test")
  set_tests_properties("compare_throughput: a browser lays its page out" PROPERTIES SKIP_RETURN_CODE 77)
else()
  message(STATUS "Scripts that measure or check sources are not tested: there is no /usr/bin/python3")
endif()

# What takes long begins first: at the end it would leave cores idle. The first two share hardly any work with others.
set(cost 100000)
foreach(test IN ITEMS
    "castor-mpi: hosts render the bytes of one process, also when one is lost"
    "oclgrind: kernels have no data race and read nothing uninitialised"
    "readme: the program and the commands are the tested ones"
    "forge: files that lie give a message or a picture"
    "instructions: kernels execute no more than recorded"
    "counters: rays cost no more nodes, tests, bytes and operations than recorded"
    "compare_throughput: writes a whole page from tiny scenes"
    "chunks: a scan of two million triangles is the same whole, cut and streamed"
    "python: manners"
    "compare_renders: compares pictures, and says what is missing"
    "compare_throughput: a browser lays its page out")
  if(TEST "${test}")
    set_tests_properties("${test}" PROPERTIES COST ${cost})
    math(EXPR cost "${cost} - 1")
  endif()
endforeach()
