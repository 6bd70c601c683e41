# CTest includes this when it starts, once for each program of GoogleTest: one test for each of its suites. One process for
# each single test would load the program's 270 shared libraries each time, which takes as long as most tests.
#   program  label  alone  cameras   as for lumigraft_module_tests

# Adds the suites that a filter of whole suites matches; the other arguments are their properties.
function(add_suites filter)
  execute_process(COMMAND "${program}" --gtest_list_tests "--gtest_filter=${filter}"
                  OUTPUT_VARIABLE listed RESULT_VARIABLE failed)
  if(failed)
    add_test("${label}_tests" "${program}" --gtest_list_tests)  # fails in the same way, where it is counted
    return()
  endif()
  string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+[.]" suites "${listed}")
  foreach(suite ${suites})
    string(REGEX REPLACE "[\n.]" "" suite "${suite}")
    add_test("${label}.${suite}" "${program}" "--gtest_filter=${suite}.*")
    set_tests_properties("${label}.${suite}" PROPERTIES LABELS "${label}" TIMEOUT 1200 ${ARGN})
  endforeach()
endfunction()

if(NOT EXISTS "${program}")
  add_test("${label}_tests_NOT_BUILT" "${label}_tests_NOT_BUILT")
  return()
endif()
if(alone)
  add_suites("${alone}" RUN_SERIAL TRUE)
endif()
if(cameras)
  add_suites("${cameras}" RESOURCE_LOCK loopback_camera)
endif()
add_suites("-${alone}:${cameras}")
