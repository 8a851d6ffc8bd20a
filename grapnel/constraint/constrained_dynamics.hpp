#pragma once

/// @file
/// Dynamics of trees with loop closures (2.9)-(2.12): accelerations and multipliers by the range-space method on top of
/// the O(n) recursion, impulses that close loops in velocity, and projection onto the closures in the mass metric. A
/// closure joins two bodies of one tree or of two trees, such as an end-effector and a target with its own root. The
/// model's couplings of joints (Model::couplings()) are further rows, after those of the closures.

#include <memory>
#include <string>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/workspace.hpp"

namespace grapnel {

/// Result of a projection.
struct ProjectionResult {
  ClosureDefect before;  // maximum over closures and couplings; of a coupling by the unit of its dependent joint
  ClosureDefect after;
  bool converged = false;
  bool changed = false;  // whether the state was changed
};

/// Solver for one model with its couplings, and one set of closures. No allocation after construction.
class LoopSolver {
 public:
  /// @throws std::invalid_argument if a closure does not name two bodies, if no joint separates its bodies, or if a
  /// frame is not finite or not a rotation.
  LoopSolver(const Model& model, std::span<const LoopClosure> closures);
  ~LoopSolver();
  LoopSolver(LoopSolver&&) noexcept;
  LoopSolver& operator=(LoopSolver&&) noexcept;

  const std::vector<LoopClosure>& closures() const;
  int rows() const;

  /// Accelerations and forces as of articulated_body(), with the closures' multipliers. `feedback`: rate 1/T of
  /// Baumgarte stabilization, u' + 2 u / T + e / T^2 = 0 [1/s]; 0: none.
  void accelerations(const DynamicsInput<double>& in, double feedback, Workspace& workspace, std::span<double> vdot,
                     std::span<double> force);

  /// Velocity consistent with the closures, v - M^-1 J^T W^+ J v: the plastic impact that closes all loops. Velocities
  /// that are `prescribed` (may be empty) do not change.
  void close_velocities(std::span<const double> q, std::span<const std::uint8_t> prescribed, Workspace& workspace,
                        std::span<double> v);

  /// Projects coordinates, then velocities onto the closures in the mass metric. The state is unchanged if all defects
  /// are at most `negligible` [m, rad, and these per second].
  ProjectionResult project(std::span<const std::uint8_t> prescribed, Workspace& workspace, std::span<double> q,
                           std::span<double> v, double negligible = 0);

  /// Multipliers of the last accelerations() or impulses of the last close_velocities(), per row, in C's axes, on body
  /// a at C (the opposite acts on body b); for a coupling the effort on its dependent joint. Not unique if rows are
  /// redundant.
  std::span<const double> multipliers() const;
  /// Those of the couplings alone, in the order of Model::couplings().
  std::span<const double> coupling_multipliers() const;
  /// Number of independent rows in the last solution.
  int rank() const;
  /// Of the last solution: the largest inconsistency of a redundant row, relative to the magnitude of the right-hand
  /// side (for accelerations, of the accelerations of both bodies, if larger). A large value means that the closures
  /// contradict each other or the prescribed joints.
  double contradiction() const;
  /// Of the last solution: the smallest accepted pivot, scaled such that a free body b alone has 1; 0 without rows.
  double min_pivot() const;
  /// Name of the row of the last solution with the largest contradiction: closure and direction, or coupling.
  std::string contradicting_row() const;

  /// Basis of the self-stresses of the last solution, multipliers without effect on the motion: rows x (rows - rank()).
  Eigen::MatrixXd self_stresses() const;

  /// Contribution of each self-stress to the efforts of prescribed joints, per velocity, and the magnitude of the
  /// self-stress: its largest moment or force at any joint. `workspace`: as left by the last solution.
  struct JointEfforts {
    Eigen::MatrixXd effort, terms;  // velocities x (rows - rank())
  };
  JointEfforts self_stress_efforts(const Workspace& workspace) const;

  /// Contact-space inertia W = J M^-1 J^T of the last solution, rows x rows (for the joints that are not prescribed).
  Eigen::MatrixXd contact_inertia() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace grapnel
