# Precompiled headers that nearly every file includes, one set for the product and one for its tests, and unity builds,
# which compile up to six files of a folder at once. Together they halve the CPU time of a build. ccache works with
# neither, and saves time only when its cache holds an earlier build; clang-tidy checks each file by itself.
#   lumigraft_precompiled(name header ...)   defines precompiled headers
#   lumigraft_precompile(target name)        uses them for a target and compiles its files in groups
function(lumigraft_precompiled name)
  if(NOT LUMIGRAFT_CCACHE)
    file(CONFIGURE OUTPUT ${name}.cpp CONTENT "")
    add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
    target_link_libraries(${name} PRIVATE lumigraft_options Eigen3::Eigen)
    target_precompile_headers(${name} PRIVATE <algorithm> <filesystem> <functional> <map> <memory> <optional> <string>
                              <vector> <Eigen/Core> <Eigen/Geometry> ${ARGN})
  endif()
endfunction()

function(lumigraft_precompile target name)
  if(NOT LUMIGRAFT_CCACHE)
    if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
      # Deferred: folders add their files to the target later.
      cmake_language(EVAL CODE "cmake_language(DEFER DIRECTORY ${CMAKE_SOURCE_DIR} CALL lumigraft_unite ${target})")
    endif()
    target_precompile_headers(${target} REUSE_FROM ${name})
    # With precompiled headers GCC 12 warns about std::string + text in the standard library (GCC bug 105651).
    target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread)
  endif()
endfunction()

function(lumigraft_unite target)
  get_target_property(files ${target} SOURCES)
  get_target_property(target_folder ${target} SOURCE_DIR)
  foreach(file ${files})
    cmake_path(ABSOLUTE_PATH file BASE_DIRECTORY ${target_folder} NORMALIZE)
    cmake_path(IS_PREFIX CMAKE_BINARY_DIR ${file} is_generated)
    if(file MATCHES "[.]cpp$" AND NOT is_generated)
      cmake_path(GET file PARENT_PATH folder)
      cmake_path(RELATIVE_PATH folder BASE_DIRECTORY ${CMAKE_SOURCE_DIR} OUTPUT_VARIABLE key)
      string(MAKE_C_IDENTIFIER "${key}" key)
      list(LENGTH files_${key} count)
      list(APPEND files_${key} ${file})
      math(EXPR group "${count} / 6")
      set_source_files_properties(${file} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP ${key}_${group})
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  # GCC takes an unnamed namespace of an included file for one of a header.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()
