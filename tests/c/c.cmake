# The C interface: its ABI is the recorded one, and the program of host/c/README.md runs, found by CMake and pkg-config.
if(NOT TARGET castor_c)
  return()
endif()

if(CASTOR_PYTHON AND NOT CASTOR_SANITIZE)
  add_test(NAME "c: header and library are the recorded ABI"
    COMMAND "${CASTOR_PYTHON}" "${CMAKE_CURRENT_LIST_DIR}/abi_test" "$<TARGET_FILE:castor_c>")
endif()
