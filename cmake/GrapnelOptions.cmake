# Compiler options of Grapnel's sources, for this directory and those below; users of the library do not inherit them.
add_compile_options(
  -Wall -Wextra -Wpedantic -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast -Wundef
  # errno of math functions is never read; without this sqrt is a call.
  -fno-math-errno
  # A product and a sum are rounded one by one. Fused, a result would depend on where its numbers lie in memory: loops
  # over vectors treat the numbers before the first aligned one by other instructions than the rest.
  -ffp-contract=off
  # Clang takes a local name for a shadow of what another file of the same unity build has in its anonymous namespace.
  "$<$<NOT:$<CXX_COMPILER_ID:Clang>>:-Wshadow>")
if(GRAPNEL_WERROR)
  add_compile_options(-Werror)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 reports false positives for these inside the standard library and Eigen at -O3.
  add_compile_options(
    -Wno-maybe-uninitialized -Wno-uninitialized -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict)
  # The compiler's garbage collection begins at 1 GB of memory, not at 128 MB: a tenth less time for the same code.
  add_compile_options(--param=ggc-min-heapsize=1000000)
endif()

# What everything that includes a header of Grapnel must agree on.
add_library(grapnel_options INTERFACE)
add_library(grapnel::options ALIAS grapnel_options)
add_library(Grapnel::options ALIAS grapnel_options)
grapnel_install_library(grapnel_options options)
target_compile_features(grapnel_options INTERFACE cxx_std_20)
if(GRAPNEL_NATIVE)
  # Eigen's alignment must be the same in every object that shares its types.
  target_compile_options(grapnel_options INTERFACE -march=native)
endif()
if(GRAPNEL_SANITIZE)
  target_compile_options(grapnel_options INTERFACE -fsanitize=${GRAPNEL_SANITIZE} -fno-omit-frame-pointer
                                                   -fno-sanitize-recover=all)
  if(GRAPNEL_SANITIZE MATCHES "undefined")
    # Checks of every pointer before every use and of every sum of a pointer and a number took half of the compile time.
    # What is read or written out of bounds or by a null pointer ends a test under the address sanitizer as well, and
    # Eigen asserts its own alignment; an unread reference to null, an unread pointer past its array, and
    # misaligned numbers elsewhere are not found.
    target_compile_options(grapnel_options INTERFACE -fno-sanitize=null,alignment,pointer-overflow,object-size)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
      # Clang 14 cannot write this check's data for the parts of a coroutine.
      target_compile_options(grapnel_options INTERFACE -fno-sanitize=function)
    endif()
  endif()
  target_link_options(grapnel_options INTERFACE -fsanitize=${GRAPNEL_SANITIZE})
endif()
if(GRAPNEL_COVERAGE)
  target_compile_options(grapnel_options INTERFACE --coverage)
  target_link_options(grapnel_options INTERFACE --coverage)
endif()
