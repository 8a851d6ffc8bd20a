# Compiler options that every Grapnel target shares.
add_library(grapnel_options INTERFACE)
add_library(grapnel::options ALIAS grapnel_options)

target_compile_options(grapnel_options INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast -Wundef
  # errno of math functions is never read; without this sqrt is a call.
  -fno-math-errno)
if(GRAPNEL_WERROR)
  target_compile_options(grapnel_options INTERFACE -Werror)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 reports false positives for these inside the standard library and Eigen at -O3.
  target_compile_options(grapnel_options INTERFACE
    -Wno-maybe-uninitialized -Wno-uninitialized -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict)
endif()
if(GRAPNEL_NATIVE)
  # PUBLIC through the modules: Eigen's alignment must be the same in every object that shares its types.
  target_compile_options(grapnel_options INTERFACE -march=native)
endif()
if(GRAPNEL_SANITIZE)
  target_compile_options(grapnel_options INTERFACE -fsanitize=${GRAPNEL_SANITIZE} -fno-omit-frame-pointer
                                                   -fno-sanitize-recover=all)
  target_link_options(grapnel_options INTERFACE -fsanitize=${GRAPNEL_SANITIZE})
endif()
if(GRAPNEL_COVERAGE)
  target_compile_options(grapnel_options INTERFACE --coverage)
  target_link_options(grapnel_options INTERFACE --coverage)
endif()
