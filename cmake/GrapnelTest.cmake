include(GoogleTest)

# What nearly every test includes, read once: half of a test's compile time otherwise. Tests include what they use all the
# same: a build of the tests by clang without sanitizers has no such header, and shows what is missing. It is there a
# second time, for what is compiled without optimization.
set(GRAPNEL_LIGHT_TEST_OPTIONS $<$<CONFIG:Release>:-O0>)
if(GRAPNEL_SANITIZE)
  set(GRAPNEL_LIGHT_TEST_OPTIONS -O0)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" OR GRAPNEL_SANITIZE)
  set(GRAPNEL_TEST_HEADERS ON)
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp CONTENT "")
  foreach(target grapnel_test_headers grapnel_light_test_headers)
    add_library(${target} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/test_headers.cpp)
    target_link_libraries(${target} PRIVATE grapnel::options GTest::gmock)  # with the macros that tests have
    target_include_directories(${target} SYSTEM PRIVATE ${EIGEN3_INCLUDE_DIRS})
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
    if(target STREQUAL grapnel_light_test_headers)
      target_compile_options(${target} PRIVATE ${GRAPNEL_LIGHT_TEST_OPTIONS})
    endif()
    target_precompile_headers(${target} PRIVATE
      <gmock/gmock.h> <gtest/gtest.h> <Eigen/Core>
      <algorithm> <cmath> <filesystem> <fstream> <functional> <map> <memory> <optional> <random> <span> <sstream> <string>
      <vector>)
  endforeach()
endif()

# The default linker takes 1.5 seconds of CPU time for each of about seventy test programs, gold 0.6 seconds.
set(GRAPNEL_TEST_LINKER)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT APPLE)
  find_program(GRAPNEL_GOLD ld.gold DOC "Linker of the tests: gold, of the package binutils")
  mark_as_advanced(GRAPNEL_GOLD)
  if(GRAPNEL_GOLD)
    set(GRAPNEL_TEST_LINKER -fuse-ld=gold)
  endif()
endif()

# How the tests' own code is compiled: executables and the libraries that they share.
function(grapnel_test_code target light computes own_headers)
  if(GRAPNEL_SANITIZE AND NOT computes)
    set(light ON)
  endif()
  get_target_property(sources ${target} SOURCES)
  # Nearly as modules are: sixteen files compile as one. Every file has a namespace of its name for what is its own.
  if(NOT own_headers)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ${GRAPNEL_UNITY} UNITY_BUILD_BATCH_SIZE 16)
  endif()
  if(GRAPNEL_TEST_HEADERS AND NOT own_headers)
    if(light)
      target_precompile_headers(${target} REUSE_FROM grapnel_light_test_headers)
    else()
      target_precompile_headers(${target} REUSE_FROM grapnel_test_headers)
    endif()
    foreach(source ${sources})
      get_source_file_property(own_options ${source} COMPILE_OPTIONS)
      if(own_options)
        set_source_files_properties(${source} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
      endif()
    endforeach()
  endif()
  # What a test checks is the library, which is compiled at -O3 wherever the test's own code is not; at -O1 that code
  # compiles in 0.7 of the time.
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(light)
    target_compile_options(${target} PRIVATE ${GRAPNEL_LIGHT_TEST_OPTIONS})
  endif()
  target_compile_definitions(${target} PRIVATE GRAPNEL_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
endfunction()

# grapnel_test_library(<name> SOURCES <file>... [LIBRARIES <target>...] [OWN_HEADERS] [LIGHT] [COMPUTES])
#
# Defines what several tests share: static, with the include folder tests/; LIBRARIES are those of its headers.
function(grapnel_test_library name)
  cmake_parse_arguments(ARG "OWN_HEADERS;LIGHT;COMPUTES" "" "SOURCES;LIBRARIES" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR}/tests)
  # GTest: what is included for all tests (above) is compiled with its definitions.
  target_link_libraries(${name} PUBLIC ${ARG_LIBRARIES} grapnel::options PRIVATE GTest::gmock)
  grapnel_test_code(${name} "${ARG_LIGHT}" "${ARG_COMPUTES}" "${ARG_OWN_HEADERS}")
endfunction()

# grapnel_test(<name> SOURCES <file>... [LIBRARIES <target>...] [LABELS <label>...] [TIMEOUT <seconds>] [PROGRAM]
#              [SHARDS <n>] [OWN_HEADERS] [LIGHT] [COMPUTES] [UNSANITIZED])
#
# Defines the test executable <name> on GoogleTest and GoogleMock (their main included) and registers each of its cases
# with ctest as <name>.<Suite>.<Case>; under sanitizers, where a process takes long to start, all of them as <name>, or as
# <n> parts <name>.1 and so on, so that no core waits long for another at the end. Labels select: "slow" stays out of
# sanitizer builds, "engine" compares with another engine. PROGRAM: the test runs the grapnel program, which is then built first.
# LIGHT: the test's own code computes little, and is compiled without optimization in optimized builds as well, in two thirds of
# the time. Under sanitizers all tests are, in two fifths of the time, but those that
# COMPUTES marks: their own code computes so much that they would take longer to run by more than it saves.
# COST: seconds that its longest cases take, where these are many: what takes long begins first.
# UNSANITIZED: stays out of sanitizer builds, as what is slow does: they would see nothing of the library there.
# OWN_HEADERS: the sources define macros before they include Eigen, so nothing is included for them.
#
# In the sources: GRAPNEL_SOURCE_DIR is the repository root and GRAPNEL_PROGRAM the program's path, both as strings.
# Headers below tests/ are found from there: #include "oracle/free_body.hpp".
function(grapnel_test name)
  cmake_parse_arguments(ARG "PROGRAM;OWN_HEADERS;LIGHT;COMPUTES;UNSANITIZED" "TIMEOUT;SHARDS;COST" "SOURCES;LIBRARIES;LABELS" ${ARGN})
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "grapnel_test(${name}): unknown arguments: ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT ARG_SOURCES)
    message(FATAL_ERROR "grapnel_test(${name}): no SOURCES")
  endif()
  if(NOT ARG_TIMEOUT)
    # For one case, or all of them under sanitizers: it stops what hangs, and times nothing.
    set(ARG_TIMEOUT 300)
    if(GRAPNEL_SANITIZE)
      set(ARG_TIMEOUT 900)
    endif()
    if("slow" IN_LIST ARG_LABELS)
      set(ARG_TIMEOUT 1200)
    endif()
  endif()

  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} GTest::gtest GTest::gmock GTest::gtest_main grapnel::options)
  target_link_options(${name} PRIVATE ${GRAPNEL_TEST_LINKER})
  set_property(GLOBAL APPEND PROPERTY GRAPNEL_TESTS ${name})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  grapnel_test_code(${name} "${ARG_LIGHT}" "${ARG_COMPUTES}" "${ARG_OWN_HEADERS}")
  target_compile_definitions(${name} PRIVATE
    $<$<TARGET_EXISTS:grapnel>:GRAPNEL_PROGRAM="$<TARGET_FILE:grapnel>">)
  if(ARG_PROGRAM)
    add_dependencies(${name} grapnel)
  endif()

  if(GRAPNEL_SANITIZE AND (ARG_UNSANITIZED OR "slow" IN_LIST ARG_LABELS))
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL TRUE)  # built where it is asked for by name
    return()
  endif()
  if(GRAPNEL_SANITIZE)
    if(NOT ARG_SHARDS)
      add_test(NAME ${name} COMMAND ${name})
      set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
      if(ARG_COST)
        set_tests_properties(${name} PROPERTIES COST ${ARG_COST})
      endif()
      return()
    endif()
    math(EXPR last "${ARG_SHARDS} - 1")
    foreach(shard RANGE ${last})
      math(EXPR number "${shard} + 1")
      add_test(NAME ${name}.${number} COMMAND ${name})
      set_tests_properties(${name}.${number} PROPERTIES TIMEOUT ${ARG_TIMEOUT} COST 10
        ENVIRONMENT "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${shard}")
    endforeach()
    return()
  endif()

  # What is slow begins first, so that no core waits long for another at the end.
  set(cost 0)
  if("slow" IN_LIST ARG_LABELS)
    set(cost 10)
  endif()
  if(ARG_COST)
    set(cost ${ARG_COST})
  endif()
  gtest_discover_tests(${name}
    TEST_PREFIX ${name}.
    DISCOVERY_MODE PRE_TEST
    DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${ARG_TIMEOUT} COST ${cost})
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
