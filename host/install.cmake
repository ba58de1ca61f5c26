# What `cmake --install` puts where: the libraries with their headers and packages for CMake and
# pkg-config, and the command line tools.
include(CMakePackageConfigHelpers)

set(CASTOR_PACKAGE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/castor")

install(TARGETS castor EXPORT castor-targets)
install(DIRECTORY include/castor DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h")
install(EXPORT castor-targets NAMESPACE castor:: DESTINATION "${CASTOR_PACKAGE_DIR}")

configure_package_config_file(host/castor-config.cmake.in castor-config.cmake
                              INSTALL_DESTINATION "${CASTOR_PACKAGE_DIR}")
write_basic_package_version_file(castor-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/castor-config.cmake"
              "${CMAKE_CURRENT_BINARY_DIR}/castor-config-version.cmake"
        DESTINATION "${CASTOR_PACKAGE_DIR}")

if(TARGET castor_c)
  install(TARGETS castor_c EXPORT castor-c-targets)
  install(EXPORT castor-c-targets NAMESPACE castor:: DESTINATION "${CASTOR_PACKAGE_DIR}")
  # Paths are relative to the file itself: the prefix may be anywhere.
  set(pc_dir "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
  file(RELATIVE_PATH CASTOR_PC_TO_PREFIX "/${pc_dir}" "/")
  configure_file(host/c/castor_c.pc.in castor_c.pc @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/castor_c.pc" DESTINATION "${pc_dir}")
endif()
if(TARGET castor_cli)
  # A shared library is found from where the tool lies, wherever the prefix is.
  file(RELATIVE_PATH bin_to_lib "${CMAKE_INSTALL_FULL_BINDIR}" "${CMAKE_INSTALL_FULL_LIBDIR}")
  set_target_properties(castor_cli PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
  install(TARGETS castor_cli)
endif()
if(TARGET castor_mpi)
  install(TARGETS castor_mpi)
endif()
