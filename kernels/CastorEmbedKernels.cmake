# castor_embed_kernels(TARGET TABLE FILE...)
#
# Embeds OpenCL sources into TARGET as a table name -> text that host/opencl/kernel_source.h declares:
# castor::kernels::TABLE. Names are relative to include/, kernels/ or tests/kernels/, so that an #include line is the
# same in C++ and in OpenCL C. The table is made again whenever a listed file changes.

set(CASTOR_EMBED_SCRIPT "${CMAKE_CURRENT_LIST_DIR}/embed_kernels.cmake")

function(castor_embed_kernels target table)
  set(output "${CMAKE_CURRENT_BINARY_DIR}/${table}.cpp")
  set(files ${ARGN})
  list(TRANSFORM files PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  string(JOIN "," joined ${files})
  add_custom_command(OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" "-DTABLE=${table}" "-DOUTPUT=${output}" "-DFILES=${joined}"
            "-DROOT=${PROJECT_SOURCE_DIR}" -P "${CASTOR_EMBED_SCRIPT}"
    DEPENDS ${files} "${CASTOR_EMBED_SCRIPT}"
    COMMENT "Embedding ${table}" VERBATIM)
  target_sources(${target} PRIVATE "${output}")
endfunction()
