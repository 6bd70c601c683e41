# CTest includes this when it starts, once for each program of GoogleTest: one test for each of its suites. One process for
# each single test would load the program's 190 shared libraries each time, which takes as long as most tests. Long tests
# are tests of CTest by themselves, so that all processors have work until the end.
#   program  label  alone  cameras  left_out  long_tests   as for lumigraft_module_tests

function(add_one name filter)
  add_test("${label}.${name}" "${program}" "--gtest_filter=${filter}")
  set_tests_properties("${label}.${name}" PROPERTIES LABELS "${label}" TIMEOUT 1200 ${ARGN})
endfunction()

# Adds the suites that a filter of whole suites matches; the other arguments are their properties.
function(add_suites filter)
  execute_process(COMMAND "${program}" --gtest_list_tests "--gtest_filter=${filter}"
                  OUTPUT_VARIABLE listed RESULT_VARIABLE failed)
  if(failed)
    add_test("${label}_tests" "${program}" --gtest_list_tests)  # fails in the same way, where it is counted
    return()
  endif()
  string(REGEX MATCHALL "[^\n]+" lines "${listed}")
  foreach(line ${lines})
    string(REGEX REPLACE " *#.*" "" line "${line}")  # the value of a parameter
    if(line MATCHES "^([A-Za-z0-9_/]+)[.]$")
      set(suite "${CMAKE_MATCH_1}")
      if(NOT long_tests)
        add_one("${suite}" "${suite}.*-${left_out}" ${ARGN})
      endif()
    elseif(long_tests AND line MATCHES "^  (.+)$")
      add_one("${suite}.${CMAKE_MATCH_1}" "${suite}.${CMAKE_MATCH_1}" SKIP_REGULAR_EXPRESSION "  SKIPPED " ${ARGN})
    endif()
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
add_suites("-${alone}:${cameras}:${left_out}")
