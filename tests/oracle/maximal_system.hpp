#pragma once

/// @file
/// Closed loops in maximal coordinates, an independent reference: every body free with six velocities in W at its own
/// centre of mass, and all joints, grasps and prescribed motions as constraint rows of one dense system,
///   M Vdot + h = f + s^T tau + C^T l,   C Vdot + c = 0,   M = diag(I_c, m 1) + sum a s^T s, (1)
/// where the rows s give the joints' rates from the bodies' velocities and a is what a rotor reflects. With M = L L^T
/// and A = C L^-T, every row scaled to length one, the solution nearest to the free one is
///   L^T Vdot = y = y_f + A^+ (-c - A y_f),   y_f = L^-1 (f + s^T tau - h), (2)
/// by a complete orthogonal decomposition, so that redundant rows do no harm: accelerations are unique and of the
/// multipliers those with the least norm (of scaled rows) are given. Plastic impulses: the same with c = 0 and y_f =
/// L^T V.
///
/// Of Grapnel only the descriptions of bodies and the meaning of q and v are used: kinematics, masses, constraints and
/// integration are this file's own.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel::oracle {

using Wrench6 = Eigen::Matrix<double, 6, 1>;  // [moment; force], or the same of an impulse

/// Poses and velocities of all bodies, in the order of Model::bodies().
struct MaximalState {
  std::vector<Eigen::Vector3d> com;   // in W [m]
  std::vector<Eigen::Quaterniond> R;  // R_WB
  Eigen::VectorXd V;                  // per body [angular velocity; velocity of the centre of mass] in W

  /// Position of the body's own frame in W.
  Eigen::Vector3d origin(const Model& model, int body) const;
};

/// Poses and twists by a separate recursion over the joints' descriptions.
MaximalState maximal_state(const Model& model, const State& state);

/// Loads. Empty vectors mean zero, or nothing prescribed.
struct MaximalLoads {
  std::vector<double> tau;  // per velocity of the model, as Forces::generalized; not read where prescribed
  std::vector<ExternalWrench> external;
  Vector3d gravity = Vector3d::zero();
  std::vector<std::uint8_t> prescribed;  // per velocity of the model
  std::vector<double> acceleration;      // read where prescribed
};

/// Accelerations and forces, or velocities after an impact and impulses.
struct MaximalSolution {
  Eigen::VectorXd bodies;         // per body, as MaximalState::V
  std::vector<double> joints;     // what follows for the model's own velocities: vdot, or v after the impact
  std::vector<double> force;      // per velocity: as given, or what a prescribed one takes
  std::vector<Wrench6> closures;  // on body a, at C, in C's axes; body b gets the opposite there
  double residual = 0;            // of the constraint rows, relative: not small where they contradict each other
  int rank = 0;                   // of all rows, joints included
};

class MaximalSystem {
 public:
  MaximalSystem(const Model& model, std::span<const LoopClosure> closures);

  MaximalSolution accelerations(const MaximalState& state, const MaximalLoads& loads = {}) const;
  /// Plastic impact that closes all closures in velocity; velocities that are prescribed do not change.
  MaximalSolution close_velocities(const MaximalState& state, const std::vector<std::uint8_t>& prescribed = {}) const;
  /// Classical Runge-Kutta with `steps` equal steps under constant loads, constraints at acceleration level only: their
  /// drift is part of the method's error, O(h^4). Not for loops near a singular configuration: rows that are nearly
  /// redundant (1e-4) count as redundant.
  MaximalState integrate(MaximalState state, const MaximalLoads& loads, double duration, int steps) const;

 private:
  MaximalSolution accelerations(const MaximalState& state, const MaximalLoads& loads, double threshold) const;

  Model model_;
  std::vector<LoopClosure> closures_;
};

}  // namespace grapnel::oracle
