#pragma once

/// @file
/// Integrates one phase and hands out samples. Thread safety: as PhaseDynamics.

#include <functional>
#include <optional>
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
  const PhaseDynamics* dynamics = nullptr;  // as evaluated at this state; null outside an integration
};

/// One step of a phase, to be looked at as closely as its dense output allows.
struct PhaseStep {
  double begin, end;  // [s]; the end is where the phase stops, if that is inside
  bool fresh;         // efforts and accelerations may have jumped at `begin`: they go on from no step before
  /// The system at a time from `begin` to `end`, as in an output instant. Valid until the next call.
  const std::function<PhaseSample(double t)>& at;
  /// Only its state, without accelerations and efforts. Valid until the next call of either function.
  const std::function<const State&(double t)>& state_at;
};
/// Looks into every step, after it.
using StepProbe = std::function<void(const PhaseStep&)>;

/// Looks at a phase between its steps, where its conservation checks may be made without output in between: no instant
/// is interpolated and no effort worked out.
struct StepWatch {
  /// At the start, at the end, and after steps in between: the first that reaches each of `looks` - 1 evenly spaced
  /// times. The state as PhaseDynamics::state() has it; both are valid during the call.
  std::function<void(double t, const State&, const PhaseIntegrals&)> look;
  int looks = 32;
  /// After every step, with the time reached: ends the phase by throwing, when its time on the clock is up, say.
  std::function<void(double t)> each_step;
  StepProbe probe;
};

/// A quantity whose first fall from positive to zero or below ends a phase.
using StopCondition = std::function<double(double t, const State&)>;

/// How loops were kept closed.
struct LoopOutcome {
  int rows = 0;
  int rank = 0;               // as the phase began
  ClosureDefect unprojected;  // largest that one step left; without projection the largest there was
  // In the norm that judges steps, times the relative tolerance:
  double correction_total = 0;   // sum of the corrections
  double integration_error = 0;  // sum of the steps' error estimates, and of what rounding in them is worth
};

struct PhaseOutcome {
  bool finished = false;
  bool stopped = false;  // by the condition, at end_time; finished is then true as well
  std::string failure;   // what happened when, if not finished
  double end_time = 0;   // reached
  State end_state;
  PhaseIntegrals integrals;
  long rhs_evaluations = 0;
  long steps = 0;
  long rejected = 0;
  MomentumDefect momentum_mended;  // at the end
  LoopOutcome loops;
  double quaternion_defect = 0;  // largest | |q| - 1 | before renormalization
};

/// What there is of a phase that somebody else has integrated up to where it is to go on.
struct PhaseResumption {
  double begin = 0;          // when the phase began: output instants and looks are counted from there [s]
  PhaseIntegrals integrals;  // since then
  double next_step = 0;      // that adaptive_8 tries first [s]
};

/// Output instants of a phase beside its begin and end: origin + k interval, with whole numbers k.
struct OutputGrid {
  double interval = 0;                // [s]; 0: none
  std::optional<double> origin = {};  // [s]; absent: the begin of the phase

  OutputGrid(double the_interval) : interval(the_interval) {}  // NOLINT(google-explicit-constructor)
  OutputGrid(double the_interval, double the_origin) : interval(the_interval), origin(the_origin) {}
};

/// Integrates from `start` at t0 to t1, forwards or backwards, and calls `observe` at t0, at every instant of `outputs`
/// after it, and at the end. Steps end where trajectories and loads are
/// not smooth (PhaseDynamics::breaks); a sample at such a time shows what follows it, the last sample what led to it.
///
/// Loops that setup.project_loops keeps closed are closed in the start, after every step and in every sample; a step
/// that cannot be brought back fails the phase.
///
/// With `stop` the phase ends at the first time where it falls from positive to zero or below: at t0 if it is not
/// positive there. It is looked at eight times a step, so that a shorter dip may go unseen.
///
/// `probe` looks into every step before the samples in it are handed out. It changes neither steps nor samples.
/// `each_step` is called after every step, as StepWatch::each_step.
///
/// With `resumed` the phase does not begin at t0 but goes on there: steps and integrals are those of the whole phase up
/// to rounding, output instants those after t0; steps and evaluations are counted from t0 on.
/// @throws std::domain_error if `stop` becomes NaN; std::invalid_argument if `resumed` is of another phase.
PhaseOutcome simulate_phase(PhaseDynamics& dynamics, const State& start, double t0, double t1,
                            const OutputGrid& outputs, const IntegrationSetup& integration,
                            const std::function<void(const PhaseSample&)>& observe = {}, const StopCondition& stop = {},
                            const StepProbe& probe = {}, const std::function<void(double t)>& each_step = {},
                            const std::optional<PhaseResumption>& resumed = {});

/// The same with a watch instead of samples. The steps, and so the outcome, are those without.
PhaseOutcome simulate_phase(PhaseDynamics& dynamics, const State& start, double t0, double t1,
                            const IntegrationSetup& integration, const StepWatch& watch, const StopCondition& stop = {},
                            const std::optional<PhaseResumption>& resumed = {});

}  // namespace grapnel
