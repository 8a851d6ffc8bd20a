#pragma once

/// @file
/// Analytical derivatives of the dynamics with closed loops and coupled joints, LoopSolver::accelerations(): of the
/// accelerations and of the multipliers, by implicit differentiation of (2.9) and (2.10). Section 28 of docs/theory.

#include <memory>
#include <span>
#include <vector>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"

namespace grapnel {

struct LoopDynamicsDerivatives {
  ForwardDynamicsDerivatives motion;  // of vdot with closed loops
  /// Of the multipliers, per row as LoopSolver::multipliers().
  struct Multipliers {
    std::vector<double> value;
    RowMatrix dq, dv, dtau, dwrench;
  };
  Multipliers multipliers;
  /// The smallest change of velocities, in the metric of M, by which they satisfy the closures after a displacement:
  /// rows: velocities, columns as of dq.
  RowMatrix closing_dq;
  int rank = 0;  // independent rows, chosen as LoopSolver does; the multipliers of the others are zero
  /// The largest inconsistency of redundant rows relative to the accelerations of the closures' bodies
  /// (LoopSolver::contradiction), and that of their derivatives relative to those of the independent rows. If one is
  /// large, the accelerations are not differentiable here: a singular configuration, or open loops.
  double contradiction = 0, contradiction_of_derivatives = 0;
};

/// For one model with its couplings, and one set of closures. Thread safety: one thread at a time. The model must
/// outlive it.
class LoopDerivatives {
 public:
  /// @throws std::invalid_argument as LoopSolver.
  LoopDerivatives(const Model& model, std::span<const LoopClosure> closures);
  ~LoopDerivatives();
  LoopDerivatives(LoopDerivatives&&) noexcept;
  LoopDerivatives& operator=(LoopDerivatives&&) noexcept;

  int rows() const;

  /// Conventions as of forward_dynamics_derivatives(). Loops need not be closed: displacements are those of the tree.
  /// `feedback`: of LoopSolver::accelerations() [1/s]. Allocates.
  /// @throws std::invalid_argument if a size does not match the model.
  void evaluate(const State& state, const Forces& forces, const PrescribedMotion& given, double feedback,
                LoopDynamicsDerivatives& result);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace grapnel
