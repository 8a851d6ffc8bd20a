#pragma once

/// @file
/// Random planar robots and states for the oracle's tests.

#include "oracle/planar_dual_arm.hpp"
#include "support/random_robot.hpp"

namespace grapnel::oracle {

inline PlanarDualArm random_planar_robot(testing::Random& random) {
  PlanarDualArm r{};
  for (double* m : {&r.m0, &r.m1, &r.m2, &r.m3}) *m = random.uniform(1, 20);
  for (double* I : {&r.I0, &r.I1, &r.I2, &r.I3}) *I = random.uniform(0.1, 5);
  for (double* a : {&r.b1, &r.b2, &r.a1, &r.a2, &r.a3, &r.d1, &r.d2, &r.d3}) *a = random.uniform(-1.5, 1.5);
  return r;
}

inline PlanarState random_planar_state(testing::Random& random) {
  PlanarState s;
  for (int i = 0; i < 6; ++i) s.q[i] = random.uniform(-3, 3), s.rate[i] = random.uniform(-2, 2);
  return s;
}

}  // namespace grapnel::oracle
