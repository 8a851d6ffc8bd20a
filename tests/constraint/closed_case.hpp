#pragma once

/// @file
/// Random servicers whose arms hold targets in loops, with a state on the closures, loads, and dense reference
/// matrices.

#include <Eigen/Core>

#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/dynamics/workspace.hpp"
#include "oracle/maximal_system.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

/// Cases 0 to kClosed - 1; every third is planar (all axes of a loop parallel: rows of its closures are redundant).
inline constexpr int kClosed = 150;

struct ClosedCase {
  Model model;
  State state;  // on the closures in position and velocity
  std::vector<LoopClosure> closures;
  oracle::MaximalLoads loads;  // torques, wrenches, gravity; nothing prescribed
};

/// A free or fixed base with two to four arms of three to seven joints, some prismatic, some with rotors, and some
/// rigidly attached bodies. Arm 0 carries a target by a fixed, revolute or spherical joint. Each other arm holds that
/// target, or a second one carried by arm 1, by a closure of any kind. This includes dual and triple arms on one
/// target, two pairs on two targets, and arms with separate targets.
ClosedCase random_closed(int index);

/// The system with one or two coupled joints, of any arms, the dependent ones anywhere between base and hand.
ClosedCase coupled_case(int index);

/// A branched robot with a free or fixed root, and one to three targets. Each target is held once or twice by closures
/// that are closed in position at random angles; sometimes two bodies of the robot are connected too. Cases with a
/// target held by the base alone, held twice by one link, or near a singular configuration are drawn again.
ClosedCase random_trees(int index);

/// Prescribed joints, or a prescribed base, drawn such that the closures remain feasible. None for some cases.
oracle::MaximalLoads with_prescribed(const ClosedCase& c, int index);

/// Dense matrices of the velocities that are not prescribed, at `state`.
struct DenseLoops {
  Eigen::MatrixXd M, J;  // all velocities
  Eigen::MatrixXd M_free, J_free;
  std::vector<Eigen::Index> free;  // velocities that are not prescribed
  int rank = 0;                    // of J_free, rows scaled to length one in the metric of M
  double least = 1;                // singular value of those that count; small near a singular configuration
  bool clear = true;               // no singular value between dependent and independent

  DenseLoops(const Model& model, const State& state, std::span<const LoopClosure> closures,
             const std::vector<std::uint8_t>& prescribed = {});
  /// The velocity on the closures closest to v in the metric of M with unchanged prescribed velocities; by singular
  /// value decomposition.
  Eigen::VectorXd closed(const Eigen::VectorXd& v) const;
  /// J_f M_f^-1 J_f^T.
  Eigen::MatrixXd contact_inertia() const;
};

/// Loads in the kernel's format. Spans refer to `loads`, `state` and `workspace`, which must outlive the result.
DynamicsInput<double> dynamics_input(const Model& model, const State& state, const oracle::MaximalLoads& loads,
                                     Workspace& workspace);

/// State after motion with velocity `v` for time `step`; quaternions remain normalized.
State moved(const Model& model, const State& state, const Eigen::VectorXd& v, double step);
/// The displacement from `from` to a nearby state, as a velocity over unit time; exact to second order.
Eigen::VectorXd displacement(const Model& model, const State& from, const State& to);

}  // namespace grapnel::testing
