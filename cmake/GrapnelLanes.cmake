# The instruction sets for which lanes are compiled: GRAPNEL_LANES_X86, and grapnel_lane_sources().
#
# The last flags on a command line win: these undo -march=native, and every configuration's lack of optimization, without
# which inline functions of the standard library would be emitted for the set.
set(GRAPNEL_LANE_SETS one_lane)
set(common -O3 -ffp-contract=off -fno-math-errno -fno-tree-vectorize -fno-tree-slp-vectorize
  -DGRAPNEL_UNROLL_COMPONENTS)
if(GRAPNEL_LANES AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(GRAPNEL_LANES_X86 ON)
  list(APPEND GRAPNEL_LANE_SETS sse2 avx2 avx512)
  list(APPEND common -march=x86-64)
  if(GRAPNEL_NATIVE)
    list(APPEND common -mtune=native)
  endif()
endif()
# Every operation of a pack is an inlined function with references: checked one by one, a kernel takes many minutes to
# compile. So only one lane is checked, and only its accesses to memory; the other sets are the same templates.
set(one_lane ${common})
if(GRAPNEL_SANITIZE)
  list(APPEND common -fno-sanitize=all)
  list(APPEND one_lane -fno-sanitize=all)
  if(GRAPNEL_SANITIZE MATCHES "address")
    list(APPEND one_lane -O1 -fsanitize=address)
  endif()
endif()
set(GRAPNEL_LANE_FLAGS_one_lane ${one_lane})
set(GRAPNEL_LANE_FLAGS_sse2 ${common} -msse2)
set(GRAPNEL_LANE_FLAGS_avx2 ${common} -mavx2 -mfma)
set(GRAPNEL_LANE_FLAGS_avx512 ${common} -mavx2 -mfma -mavx512f -mavx512dq -mavx512vl)
set(GRAPNEL_LANE_TAG_one_lane OneLane)
set(GRAPNEL_LANE_TAG_sse2 Sse2)
set(GRAPNEL_LANE_TAG_avx2 Avx2)
set(GRAPNEL_LANE_TAG_avx512 Avx512)

# grapnel_lane_sources(<list> NAME...): compiles NAME_set.cpp of the current folder once per instruction set, with the
# set's flags and GRAPNEL_LANE_SET as its tag in pack.hpp. Appends the sources, NAME_<set>.cpp in the build folder, to
# the list. Such a file may include templates on the set and plain data, but no Eigen. It must not make the compiler
# emit a function without the set in its name, because portable code could be linked to it (tests/lanes/symbols_test).
function(grapnel_lane_sources list)
  foreach(name ${ARGN})
    foreach(set ${GRAPNEL_LANE_SETS})
      set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}_${set}.cpp)
      file(CONFIGURE OUTPUT ${source} CONTENT
        "#define GRAPNEL_LANE_SET ${GRAPNEL_LANE_TAG_${set}}\n#include \"${CMAKE_CURRENT_SOURCE_DIR}/${name}_set.cpp\"\n")
      set_source_files_properties(${source} PROPERTIES COMPILE_OPTIONS "${GRAPNEL_LANE_FLAGS_${set}}")
      list(APPEND ${list} ${source})
    endforeach()
  endforeach()
  set(${list} ${${list}} PARENT_SCOPE)
endfunction()
