#pragma once

/// @file
/// Integrates one phase and hands out samples. Thread safety: as PhaseDynamics.

#include <functional>
#include <string>

#include "grapnel/simulate/integration_setup.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

/// The system at one output instant.
struct PhaseSample {
  double time;
  const State& state;
  const PhaseIntegrals& integrals;
  std::span<const double> motor;  // effort per joint [N m or N]
  std::span<const double> friction;
};

struct PhaseOutcome {
  bool finished = false;
  std::string failure;  // what happened when, if not finished
  double end_time = 0;  // reached
  State end_state;
  PhaseIntegrals integrals;
  long rhs_evaluations = 0;
  long steps = 0;
  long rejected = 0;
  MomentumDefect momentum_mended;  // at the end
  double quaternion_defect = 0;    // largest | |q| - 1 | before renormalization
};

/// Integrates from `start` at t0 (the dynamics' start time is the caller's) to t1, forwards or backwards, and calls
/// `observe` at t0, at every multiple of `interval` after it, and at t1 (interval 0: at t0 and t1 only).
PhaseOutcome simulate_phase(PhaseDynamics& dynamics, const State& start, double t0, double t1, double interval,
                            const IntegrationSetup& integration,
                            const std::function<void(const PhaseSample&)>& observe = {});

}  // namespace grapnel
