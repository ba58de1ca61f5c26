# Saved scenes and checkpoints in which values are changed under right checksums; scripts/test_forged runs more of them.
# A program of its own: small enough to be built with sanitizers alone.
add_executable(forged_files forge/forged_files.cpp forge/forge.cpp)
target_include_directories(forged_files PRIVATE .)
target_compile_options(forged_files PRIVATE $<$<CONFIG:Release>:-O1>)
target_precompile_headers(forged_files REUSE_FROM castor_tests)
target_link_libraries(forged_files PRIVATE castor_shared_programs castor_objects)
add_test(NAME "forge: files that lie give a message or a picture" COMMAND forged_files --count 100)
