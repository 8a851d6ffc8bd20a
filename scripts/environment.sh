# shellcheck shell=bash
# Sourced by the scripts beside it: the repository root as working directory, one number of jobs, ccache where there is one.
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit

# Processors this process may use (nproc knows affinity); ninja and ctest would otherwise disagree.
jobs=$(nproc 2>/dev/null || echo 2)
export CMAKE_BUILD_PARALLEL_LEVEL="${CMAKE_BUILD_PARALLEL_LEVEL:-$jobs}"
export CTEST_PARALLEL_LEVEL="${CTEST_PARALLEL_LEVEL:-$jobs}"

if command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER-ccache}"
  # Without these ccache keeps nothing that is compiled with a precompiled header.
  export CCACHE_SLOPPINESS="${CCACHE_SLOPPINESS:-pch_defines,time_macros}"
fi
