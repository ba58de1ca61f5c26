# Read by ctest: the order in which tests begin. Neighbours of one file need the same kernels; begun side by side in a
# fresh build they would each compile them. A step of about 0.382 times their number, as of leaves around a stem, parts
# the tests of every file evenly.
set(tests ${castor_tests_TESTS} ${castor_failure_tests_TESTS} ${castor_c_tests_TESTS})
list(LENGTH tests count)
math(EXPR step "${count} * 382 / 1000 + 1")
set(cost 0)
foreach(test IN LISTS tests)
  math(EXPR place "${cost} % ${count}")
  math(EXPR place "${count} - ${place}")  # tests of higher cost begin first
  set_tests_properties("${test}" PROPERTIES COST ${place})
  math(EXPR cost "${cost} + ${step}")
endforeach()
