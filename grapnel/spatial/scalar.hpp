#pragma once

/// @file
/// Requirements on a scalar type of Grapnel's kernels, and helpers for scalar-dependent operations.
///
/// The kernels are templates on the scalar S: `double`, packs of SIMD lanes, and dual numbers. A scalar has the four
/// operations and, found by argument-dependent lookup or in std, `sqrt`, `sin`, `cos`.

#include <cmath>

#include "grapnel/spatial/sine_cosine.hpp"

// g++ does not inline small functions in large kernels by default, which costs a factor of two (measured on forward
// dynamics).
#define GRAPNEL_INLINE __attribute__((always_inline)) inline
// The same for a lambda, behind its parameters.
#define GRAPNEL_INLINE_LAMBDA __attribute__((always_inline))

// Placed before a loop over components. g++ unrolls such a loop only after register allocation of structures, and keeps
// a structure indexed by a loop in memory. Used only where packs are compiled (cmake/GrapnelLanes.cmake): doubles gain
// nothing, and different products and sums would be fused.
#ifdef GRAPNEL_UNROLL_COMPONENTS
#define GRAPNEL_UNROLL _Pragma("GCC unroll 3")
#else
#define GRAPNEL_UNROLL
#endif

namespace grapnel {

/// Sine and cosine of one angle [rad]; for double see sine_cosine.hpp.
template <class S>
GRAPNEL_INLINE SineCosine<S> sine_cosine(const S& angle) {
  using std::cos;
  using std::sin;
  return {sin(angle), cos(angle)};
}

}  // namespace grapnel
