#pragma once

/// @file
/// Private to this module: a scenario at a time, and the functions whose derivatives are the linear model.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/linear/linearize.hpp"
#include "grapnel/linear/minimal_coordinates.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

/// Simulates the scenario up to the time; the motion segment that begins there, valid until the next call of
/// steps.next(). @throws LinearizeError if none does.
const MotionTask& task_at(CaptureSteps& steps, double time);

/// Whether two times are the same except for rounding.
bool is_same_time(double a, double b);

/// The name of the phase of a motion segment, which may have the number of the segment behind it.
std::string phase_of(const CaptureProblem& problem, const std::string& segment);

/// The motion segment that begins at the time, with its model and controllers.
struct OperatingPoint {
  /// `problem`: the scenario with rigid pieces on springs. Both outlive this.
  OperatingPoint(const CaptureProblem& problem, const MotionTask& task);

  const CaptureProblem& problem;
  const MotionTask* task;
  double time, interval_end;  // of the smooth interval that begins at the time [s]
  State state;
  int base = -1;                        // body
  std::vector<std::uint8_t> elsewhere;  // per velocity: of trees that nothing connects with the base

  const Model& model() const { return *task->model; }
  const PhaseSetup& setup() const { return *task->setup; }
  bool has_free_base() const { return model().has_free_root(base); }
  std::string phase() const { return phase_of(problem, task->phase); }
  int base_velocity() const { return model().bodies()[base].v; }
};

/// Whether shapes touch: contacts have no linear model.
bool shapes_touch(const OperatingPoint& point);

/// The laws of the segment as the linear model takes them.
struct LawsOfPoint {
  std::vector<std::string> names;
  std::string obstacle;            // why they cannot be linearized; empty: they can, or there are none
  std::vector<std::string> notes;  // what is not contained
};
LawsOfPoint laws_of(const OperatingPoint& point);

/// A phase evaluated at states near the operating point, all with the modes of that point.
class EvaluatedPhase {
 public:
  EvaluatedPhase(const OperatingPoint& point, PhaseSetup setup);
  Eigen::VectorXd accelerations(const State& state);
  /// Efforts of the motors, per Model::joints(), then the external torque of laws on the base, in its axes.
  Eigen::VectorXd commands(const State& state);
  /// The torque that attitude control commands, in the base's axes.
  Eigen::Vector3d commanded_torque(const State& state);
  /// Per velocity, whether drives, friction or actuators hold or prescribe it.
  std::vector<std::uint8_t> prescribed() const;

 private:
  std::span<const double> numbers(const State& state);

  double time_;
  PhaseDynamics dynamics_;
  std::vector<double> y_, dydt_;
};

/// The segment without laws: motors give no effort. `prescribed`: joints that move as prescribed continue to.
PhaseSetup setup_of_plant(const OperatingPoint& point, bool prescribed);
/// The segment with its laws, acting continuously on true values.
PhaseSetup setup_of_laws(const OperatingPoint& point);
/// Efforts and torque of the operating point, as of EvaluatedPhase::commands(): under the held commands of a sampled
/// controller.
Eigen::VectorXd commands_at(const OperatingPoint& point);

/// The value of a function and its derivative by the entries of x, with an estimate of the error of each entry, by
/// central differences with Richardson extrapolation over several steps. `f` maps a state to [f...]; loops: its
/// deviations are measured, since closing them changes the step. The one place that differentiates: analytical
/// derivatives can replace it.
struct Derivative {
  Eigen::MatrixXd value, error;
};
Derivative derivative_of(MinimalCoordinates& coordinates, const std::function<Eigen::VectorXd(const State&)>& f);

}  // namespace grapnel
