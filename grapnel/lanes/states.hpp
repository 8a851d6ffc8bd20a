#pragma once

/// @file
/// Kinematics and dynamics of many states of one model at once, a state in every SIMD lane. What dynamics/ computes of
/// one state, by the same kernels.
///
/// A case's numbers depend on the case alone, bit for bit: not on the cases beside it and their number, nor on the
/// instruction set among those with fused products. They are those of dynamics/ up to rounding, since there the
/// compiler chooses which products are fused.

#include "grapnel/lanes/lane_states_tables.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/pack/dispatch.hpp"

namespace grapnel::lanes {

/// Thread safety: immutable; run() may be called by several threads at once.
class States {
 public:
  /// The model must outlive it. The set has to be one that is supported. @throws std::runtime_error if GRAPNEL_LANES
  /// names an instruction set that does not run here.
  explicit States(const Model& model, InstructionSet set = best_instruction_set().value_or(InstructionSet::one_lane));
  States(const States&) = delete;
  States& operator=(const States&) = delete;

  /// On the calling thread. @throws std::invalid_argument if accelerations or mass matrices are wanted of a model some
  /// of whose joints move by modes (ModalJoint).
  void run(const StateCases& cases) const;

 private:
  StatesTables tables_;
  void (*run_)(const StatesTables&, const StateCases&);
  void (*run_few_)(const StatesTables&, const StateCases&);  // the same bits
  bool has_chains_;
};

}  // namespace grapnel::lanes
