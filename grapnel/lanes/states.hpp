#pragma once

/// @file
/// Kinematics and dynamics of many states of one model, one per SIMD lane. Uses the kernels of dynamics/.
///
/// The result of a case depends on this case alone, bit for bit: not on other cases and their number, nor on the
/// instruction set among those with fused products. It equals that of dynamics/ up to rounding error, since there the
/// compiler chooses which products to fuse.

#include "grapnel/lanes/lane_states_tables.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel::lanes {

/// Thread safety: immutable; several threads may call run() concurrently.
class States {
 public:
  /// The model must outlive it. The set must be supported. @throws std::runtime_error if GRAPNEL_LANES names an
  /// instruction set that this processor lacks.
  explicit States(const Model& model, InstructionSet set = best_instruction_set().value_or(InstructionSet::one_lane));
  States(const States&) = delete;
  States& operator=(const States&) = delete;

  /// Computes on the calling thread. @throws std::invalid_argument if accelerations, mass matrices or derivatives are
  /// requested for a model with modal joints (ModalJoint).
  void run(const StateCases& cases) const;

 private:
  DerivativesStructure structure_;
  StatesTables tables_;
  void (*run_)(const StatesTables&, const StateCases&);
  void (*run_few_)(const StatesTables&, const StateCases&);  // for few cases; the same bits
  bool has_chains_;
};

}  // namespace grapnel::lanes
