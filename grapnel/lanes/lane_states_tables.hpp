#pragma once

/// @file
/// Data of states.hpp for lane translation units: plain data without Eigen.

#include <cstdint>

#include "grapnel/dynamics/derivatives_structure.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel::lanes {

struct StatesTables {
  const TreeLink<double>* links;
  int link_count;
  int coordinates;
  int velocities;
  DerivativesTables derivatives;
};

/// Rows of numbers, one per case; `stride`: distance of two rows' begins in numbers; 0: all cases share one row.
struct StateRows {
  const double* data = nullptr;  // null: zeros
  std::int64_t stride = 0;
};

/// Numbers of LinkMotion in StateCases::motion: X_WL's rotation by rows and position, V_WL [angular; linear].
constexpr int kMotionNumbers = 18;

/// A wrench on a link in all cases: constant components in W, at a point fixed in the link.
struct StateWrench {
  int link;
  double p_LP[3], F_W[6];  // [moment; force]
};

/// Derivatives in the conventions of dynamics_derivatives.hpp, velocities x velocities per case; null: not requested.
struct StateDerivatives {
  double* value = nullptr;  // velocities: accelerations of forward, forces of inverse dynamics
  double *dq = nullptr, *dv = nullptr;
  double* other = nullptr;    // of forward dynamics by the forces, of inverse dynamics by the accelerations
  double* dwrench = nullptr;  // of forward dynamics: velocities x 6 per wrench
};

/// The states of `count` cases and the requested results: row-major, case after case; null: not requested.
struct StateCases {
  std::int64_t count = 0;
  StateRows q;                    // coordinates, quaternions of unit norm; never null
  StateRows v;                    // velocities
  StateRows force;                // generalized, of forward dynamics
  StateRows acceleration;         // of inverse dynamics
  double gravity[3] = {0, 0, 0};  // uniform, in W [m/s^2]

  double* motion = nullptr;         // links x kMotionNumbers: poses and twists of the tree's links in W
  double* accelerations = nullptr;  // velocities: forward dynamics
  double* forces = nullptr;         // velocities: inverse dynamics
  double* mass_matrix = nullptr;    // velocities x velocities

  // Of the derivatives alone: external wrenches, and for forward dynamics velocities with given accelerations, which
  // `acceleration` has.
  const StateWrench* wrenches = nullptr;
  int wrench_count = 0;
  const std::uint8_t* prescribed = nullptr;  // per velocity; null: none
  StateDerivatives forward, inverse;
};

// The function of an instruction set, defined in lane_states_set.cpp.
template <class Set>
void run_lane_states_of(const StatesTables& tables, const StateCases& cases);

}  // namespace grapnel::lanes
