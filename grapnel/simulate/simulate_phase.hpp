#pragma once

/// @file
/// Integrates one phase and provides samples. Thread safety: as PhaseDynamics.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

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

/// One step of a phase, for evaluation by its dense output.
struct PhaseStep {
  double begin, end;  // [s]; the end is where the phase stops, if inside
  bool fresh;         // efforts and accelerations may have jumped at `begin`
  /// The system at a time from `begin` to `end`, as at an output instant. Valid until the next call.
  const std::function<PhaseSample(double t)>& at;
  /// Only its state, without accelerations and efforts. Valid until the next call of either function.
  const std::function<const State&(double t)>& state_at;
};
/// Evaluates every step after its completion.
using StepProbe = std::function<void(const PhaseStep&)>;

/// Observes a phase between its steps. Except in `probe`, no instant is interpolated and no effort computed.
struct StepWatch {
  /// Called at the start, at the end, and after some steps between: the first that reaches each of `checks` - 1 evenly
  /// spaced times. The state as from PhaseDynamics::state(); both are valid during the call.
  std::function<void(double t, const State&, const PhaseIntegrals&)> check = {};
  int checks = 32;
  /// Called after every step, with the time reached: may end the phase by throwing, e.g. when its time limit is
  /// exceeded.
  std::function<void(double t)> each_step = {};
  /// Evaluates every step before its samples are observed. It changes neither steps nor samples.
  StepProbe probe = {};
  /// Receives every impact of hard contacts, after it.
  std::function<void(const HardImpact&)> impact = {};
};

/// A quantity whose first fall from positive to zero or below ends a phase.
using StopCondition = std::function<double(double t, const State&)>;

/// The same for a quantity that depends on accelerations, efforts or constraint forces.
using LoadCondition = std::function<double(const PhaseSample&)>;

/// Results of keeping loops closed.
struct LoopOutcome {
  int rows = 0;
  int rank = 0;               // at the start of the phase
  ClosureDefect unprojected;  // maximum after one step; without projection the maximum overall
  // In the norm of the step control, times the relative tolerance:
  double correction_total = 0;   // sum of the corrections
  double integration_error = 0;  // sum of the steps' error estimates and rounding errors
};

struct PhaseOutcome {
  bool finished = false;
  bool stopped = false;  // by the condition, at end_time; finished is then also true
  std::string failure;   // time and cause, if not finished
  double end_time = 0;   // reached
  State end_state;
  PhaseIntegrals integrals;
  long rhs_evaluations = 0;
  long steps = 0;
  long rejected = 0;
  long implicit_steps = 0;                            // of `steps`
  std::vector<std::array<double, 2>> implicit_spans;  // begins and ends of intervals of implicit steps [s]
  MomentumDefect momentum_corrected;                  // at the end
  LoopOutcome loops;
  double quaternion_defect = 0;  // largest | |q| - 1 | before renormalization
};

/// Data of a phase that was integrated elsewhere up to the time from which it continues.
struct PhaseResumption {
  double begin = 0;          // start of the phase: reference of output instants and checks [s]
  PhaseIntegrals integrals;  // since then
  double next_step = 0;      // trial step of an explicit method with error control [s]
};

/// Output instants of a phase besides its begin and end: origin + k interval, with integers k.
struct OutputGrid {
  double interval = 0;                // [s]; 0: none
  std::optional<double> origin = {};  // [s]; absent: the begin of the phase

  OutputGrid(double the_interval) : interval(the_interval) {}  // NOLINT(google-explicit-constructor)
  OutputGrid(double the_interval, double the_origin) : interval(the_interval), origin(the_origin) {}
};

/// What a phase integrates: from `start` at t0 to t1 [s], forwards or backwards.
struct PhaseInterval {
  const State& start;
  double t0, t1;           // [s]
  OutputGrid outputs = 0;  // instants of samples besides t0 and t1
};

/// What takes part in a phase besides its dynamics; each member may be absent.
struct PhaseObservers {
  std::function<void(const PhaseSample&)> observe = {};
  StepWatch watch = {};
  StopCondition stop = {};
  LoadCondition stop_on_load = {};
  std::optional<PhaseResumption> resumed = {};
};

/// Integrates over `interval`, and calls `observe` at t0, at every instant of the output grid after it, and at the end.
/// Steps end where trajectories and loads are not smooth (PhaseDynamics::breaks); a sample at such a time has the later
/// limits, the last sample the earlier ones.
///
/// Loops that setup.project_loops keeps closed are closed at the start, after every step and in every sample; a step
/// that cannot be projected fails the phase.
///
/// With `stop` or `stop_on_load` the phase ends at the first time at which one of them falls from positive to zero or
/// below: at t0 if it is not positive there. They are evaluated eight times a step, so a shorter dip may be missed, and
/// after every jump of the right-hand side. The last evaluation of `stop_on_load` in a stopped phase is that at the
/// stop.
///
/// With `resumed` the phase does not begin at t0 but continues there: steps and integrals are those of the whole phase
/// up to rounding, output instants those after t0; steps and evaluations are counted from t0 on. @throws
/// std::domain_error if `stop` becomes NaN; std::invalid_argument if `resumed` belongs to another phase.
PhaseOutcome simulate_phase(PhaseDynamics& dynamics, const PhaseInterval& interval,
                            const IntegrationSetup& integration = {}, const PhaseObservers& observers = {});

}  // namespace grapnel
