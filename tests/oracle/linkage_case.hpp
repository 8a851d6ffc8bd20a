#pragma once

/// @file
/// The linkages that the tests of this folder and of constraint/ move.

#include "oracle/linkage_model.hpp"

namespace grapnel::oracle {

/// A crank with full rotation: 0.3 + 1.0 < 0.9 + 0.8.
inline FourBar crank_rocker() {
  return {0.9,
          {0, 4, 0.6, 0.45, -0.1},
          {0.3, 1.1, 0.02, 0.12, 0.03},
          {1.0, 2.3, 0.2, 0.55, -0.08},
          {0.8, 1.7, 0.15, 0.3, 0.05},
          1};
}
inline FiveBar five_bar() {
  return {0.5,
          {{{0.4, 1.2, 0.03, 0.17, 0.02}, {0.45, 1.5, 0.04, 0.25, -0.03}}},
          {{{0.8, 2.1, 0.11, 0.43, 0.05}, {0.7, 1.9, 0.09, 0.3, -0.04}}},
          1,
          {0.3, -1.4}};
}
/// A pose in a plane that is not a coordinate plane.
inline Posed tilted() { return {rotation_from_rpy(0.4, -0.7, 1.1), {0.3, -0.5, 0.8}}; }

}  // namespace grapnel::oracle
