#pragma once

/// @file
/// Dynamics of trees with loop closures (2.9)-(2.12): accelerations and multipliers by the range-space method on top
/// of the O(n) recursion, impulses that close loops in velocity, and projection onto the closures in the mass metric. A
/// closure joins two bodies of one tree or of two: an end-effector and a target that still has its own root.

#include <memory>
#include <string>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

/// What a projection did.
struct ProjectionResult {
  ClosureDefect before;  // largest over the closures
  ClosureDefect after;
  bool converged = false;
  bool changed = false;  // whether anything was moved
};

/// Solves for one model and one set of closures. Nothing allocates after construction.
class LoopSolver {
 public:
  /// @throws std::invalid_argument if a closure names no two bodies, or two that no joint parts, or if a frame is not
  /// finite or no rotation.
  LoopSolver(const Model& model, std::span<const LoopClosure> closures);
  ~LoopSolver();
  LoopSolver(LoopSolver&&) noexcept;
  LoopSolver& operator=(LoopSolver&&) noexcept;

  const std::vector<LoopClosure>& closures() const;
  int rows() const;

  /// Accelerations and forces as of articulated_body(), with the closures' multipliers acting. `feedback`: rate 1/T of
  /// Baumgarte's stabilization, u' + 2 u / T + e / T^2 = 0 [1/s]; 0: none.
  void accelerations(const DynamicsInput<double>& in, double feedback, Workspace& workspace, std::span<double> vdot,
                     std::span<double> force);

  /// Velocity that fits the closures, v - M^-1 J^T W^+ J v: the plastic impact that closes all loops. Velocities that
  /// are `prescribed` (may be empty) do not change.
  void close_velocities(std::span<const double> q, std::span<const std::uint8_t> prescribed, Workspace& workspace,
                        std::span<double> v);

  /// Brings coordinates, then velocities onto the closures in the mass metric. Defects that are all up to `negligible`
  /// [m, rad, and these per second] are left as they are.
  ProjectionResult project(std::span<const std::uint8_t> prescribed, Workspace& workspace, std::span<double> q,
                           std::span<double> v, double negligible = 0);

  /// Multipliers of the last accelerations() or impulses of the last close_velocities(), per row, in C's axes, on body
  /// a at C (body b gets the opposite there); where rows are redundant one of many.
  std::span<const double> multipliers() const;
  /// Independent rows in the last solution.
  int rank() const;
  /// Of the last solution: the largest part of a redundant row that the others do not explain, over the size of what
  /// was to be solved (for accelerations, of the accelerations of both bodies, if larger). Not small: the closures, or
  /// closures and prescribed joints, contradict each other.
  double contradiction() const;
  /// Of the last solution: the least pivot that counted, scaled so that a free body b alone has 1; 0 with no rows.
  double least_pivot() const;
  /// The row of the last solution with the largest contradiction, in words: closure and direction.
  std::string contradicting_row() const;

  /// Multipliers that change nothing in the last solution, a basis of them: rows x (rows - rank()).
  Eigen::MatrixXd self_stresses() const;

  /// What each self-stress adds to the efforts along joint axes that prescribed joints take, per velocity, and the size
  /// of the self-stress, its largest moment or force at any joint. `workspace`: as the last solution left it.
  struct JointEfforts {
    Eigen::MatrixXd effort, terms;  // velocities x (rows - rank())
  };
  JointEfforts self_stress_efforts(const Workspace& workspace) const;

  /// Contact-space inertia W = J M^-1 J^T of the last solution, rows x rows (of the joints that are not prescribed).
  Eigen::MatrixXd contact_inertia() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace grapnel
