include(GoogleTest)

# What nearly every test includes, read once: half of a test's compile time otherwise. Tests include what they use all the
# same: a build of the tests by clang has no such header, and shows what is missing.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp CONTENT "")
  add_library(grapnel_test_headers OBJECT ${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp)
  target_link_libraries(grapnel_test_headers PRIVATE grapnel::options GTest::gmock)  # with the macros that tests have
  target_include_directories(grapnel_test_headers SYSTEM PRIVATE ${EIGEN3_INCLUDE_DIRS})
  target_compile_options(grapnel_test_headers PRIVATE $<$<CONFIG:Release>:-O1>)
  target_precompile_headers(grapnel_test_headers PRIVATE
    <gmock/gmock.h> <gtest/gtest.h> <Eigen/Core>
    <algorithm> <cmath> <filesystem> <fstream> <functional> <map> <memory> <optional> <random> <span> <sstream> <string>
    <vector>)
endif()

# grapnel_test(<name> SOURCES <file>... [LIBRARIES <target>...] [LABELS <label>...] [TIMEOUT <seconds>] [PROGRAM]
#              [OWN_HEADERS] [LIGHT])
#
# Defines the test executable <name> on GoogleTest and GoogleMock (their main included) and registers each of its cases
# with ctest as <name>.<Suite>.<Case>. Labels select: "slow" stays out of sanitizer builds, "engine" compares with
# another engine. PROGRAM: the test runs the grapnel program, which is then built first.
# LIGHT: the test's own code computes little. Under sanitizers it is compiled without optimization, in two fifths of the
# time.
# OWN_HEADERS: the sources define macros before they include Eigen, so nothing is included for them.
#
# In the sources: GRAPNEL_SOURCE_DIR is the repository root and GRAPNEL_PROGRAM the program's path, both as strings.
# Headers below tests/ are found from there: #include "oracle/free_body.hpp".
function(grapnel_test name)
  cmake_parse_arguments(ARG "PROGRAM;OWN_HEADERS;LIGHT" "TIMEOUT" "SOURCES;LIBRARIES;LABELS" ${ARGN})
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "grapnel_test(${name}): unknown arguments: ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT ARG_SOURCES)
    message(FATAL_ERROR "grapnel_test(${name}): no SOURCES")
  endif()
  if(NOT ARG_TIMEOUT)
    # For one case, sanitizers included: it stops what hangs, and times nothing.
    set(ARG_TIMEOUT 300)
    if(GRAPNEL_SANITIZE)
      set(ARG_TIMEOUT 900)  # they take some ten times as long
    endif()
    if("slow" IN_LIST ARG_LABELS)
      set(ARG_TIMEOUT 1200)
    endif()
  endif()

  add_executable(${name} ${ARG_SOURCES})
  # Nearly as modules are: sixteen files compile as one. Every test has a namespace of its file's name for what is its own.
  if(NOT ARG_OWN_HEADERS)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ${GRAPNEL_UNITY} UNITY_BUILD_BATCH_SIZE 16)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT ARG_OWN_HEADERS)
    target_precompile_headers(${name} REUSE_FROM grapnel_test_headers)
    foreach(source ${ARG_SOURCES})
      get_source_file_property(own_options ${source} COMPILE_OPTIONS)
      if(own_options)
        set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
      endif()
    endforeach()
  endif()
  target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} GTest::gtest GTest::gmock GTest::gtest_main grapnel::options)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  # What a test checks is the library, which is compiled at -O3 wherever the test's own code is not; at -O1 that code
  # compiles in 0.7 of the time.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(GRAPNEL_SANITIZE AND ARG_LIGHT)
    target_compile_options(${name} PRIVATE -O0)
  endif()
  target_compile_definitions(${name} PRIVATE
    GRAPNEL_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
    $<$<TARGET_EXISTS:grapnel>:GRAPNEL_PROGRAM="$<TARGET_FILE:grapnel>">)
  if(ARG_PROGRAM)
    add_dependencies(${name} grapnel)
  endif()

  if(GRAPNEL_SANITIZE AND "slow" IN_LIST ARG_LABELS)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL TRUE)  # built where it is asked for by name
    return()
  endif()

  gtest_discover_tests(${name}
    TEST_PREFIX ${name}.
    DISCOVERY_MODE PRE_TEST
    DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  if(ARG_LABELS)
    # gtest_discover_tests takes a list of labels apart, so a script that ctest reads after its own sets them.
    set(script ${CMAKE_CURRENT_BINARY_DIR}/${name}_labels.cmake)
    file(CONFIGURE OUTPUT ${script} @ONLY CONTENT [[
if(@name@_TESTS)
  set_tests_properties(${@name@_TESTS} PROPERTIES LABELS "@ARG_LABELS@")
endif()
]])
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${script})
  endif()
endfunction()
