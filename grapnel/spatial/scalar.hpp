#pragma once

/// @file
/// What a scalar type must offer to run in Grapnel's kernels, and the helpers that hide the differences.
///
/// The kernels are templates on the scalar S: `double` today, packs of SIMD lanes and dual numbers later. A scalar has
/// the four operations and, found by argument-dependent lookup or in std, `sqrt`, `sin`, `cos`.

#include <cmath>

#include "grapnel/spatial/sine_cosine.hpp"

// g++ leaves small functions as calls in large kernels, which costs a factor of two there (measured on forward
// dynamics).
#define GRAPNEL_INLINE __attribute__((always_inline)) inline
// The same for a lambda, behind its parameters.
#define GRAPNEL_INLINE_LAMBDA __attribute__((always_inline))

// In front of a loop over components. g++ unrolls such a loop only after it has decided which structures live in
// registers, and one that a loop indexes does not: every change of it is then stored. Only where packs are compiled
// (cmake/GrapnelLanes.cmake): doubles gain nothing by it, and other products and sums of theirs would be fused.
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
