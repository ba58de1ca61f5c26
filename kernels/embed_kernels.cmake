# Run by castor_embed_kernels: writes OUTPUT, a C++ file that defines castor::kernels::TABLE from FILES (comma
# separated).

string(REPLACE "," ";" files "${FILES}")
set(text "// Made from the kernels' sources. Do not edit.\n#include \"opencl/kernel_source.h\"\n\n")
string(APPEND text "namespace castor::kernels {\nextern const SourceTable ${TABLE};\nconst SourceTable ${TABLE} = {\n")
foreach(file IN LISTS files)
  file(READ "${file}" source)
  file(RELATIVE_PATH name "${ROOT}" "${file}")
  string(REGEX REPLACE "^(include/|kernels/|tests/kernels/)" "" name "${name}")
  string(APPEND text "{\"${name}\", R\"CASTOR(${source})CASTOR\"},\n")
endforeach()
string(APPEND text "};\n}  // namespace castor::kernels\n")
file(WRITE "${OUTPUT}" "${text}")
