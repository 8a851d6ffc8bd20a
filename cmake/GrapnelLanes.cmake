# The instruction sets for which lanes are compiled, and the flags of a set's own translation units:
# GRAPNEL_LANE_SETS, GRAPNEL_LANE_FLAGS_<set>, GRAPNEL_LANES_X86.
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
