#pragma once

/// @file
/// Integration of a CompliantSystem, one step of the Radau method at a time, with events; and its recorder.

#include "grapnel/impact/compliant_system.hpp"
#include "grapnel/integrate/radau_iia.hpp"

namespace grapnel {

class StiffIntegrator {
 public:
  enum class Result { stepped, event, end, failed };

  /// Integrates from y = 0 at t = 0 to `end`. `sizes` of changes and `tolerances` of steps: as for RadauIIA.
  /// `first_step`: initially and after every restart [s]. `system` must outlive the integrator.
  StiffIntegrator(CompliantSystem& system, std::span<const double> sizes, std::span<const double> tolerances,
                  double first_step, double end);
  StiffIntegrator(const StiffIntegrator&) = delete;
  StiffIntegrator& operator=(const StiffIntegrator&) = delete;

  /// Makes one step, up to the first event in it: then the step is repeated such that it ends at the event.
  Result step();
  double time() const { return radau_.time(); }
  std::span<const double> y() const { return radau_.y(); }
  /// Event functions that crossed zero at the last Result::event: nonzero entries.
  std::span<const int> crossed() const { return crossed_; }
  /// The solution at a time within the last step.
  std::span<const double> at(double t);
  /// The last step's beginning, and its stages: instants in it, the last at its end; loads of interfaces there.
  double step_begin() const { return radau_.begin(); }
  static constexpr int stages() { return RadauIIA::kStages; }
  double time_of_stage(int stage) const { return radau_.time_of_stage(stage); }
  std::span<const InterfaceLoad> loads_at_stage(int stage) const;
  std::span<const InterfaceLoad> loads_at_end() const { return loads_at_stage(stages() - 1); }
  /// Restarts at the current time: phases have changed.
  void restart();
  /// Continues at the current time with these numbers, after a change of the system's layout; restart() must follow.
  /// `sizes`, `tolerances`: as for the constructor.
  void replace(std::span<const double> y, std::span<const double> sizes, std::span<const double> tolerances);
  /// Whether the last Result::event is one of the system's shapes.
  bool shapes_changed() const { return system_.has_shapes() && crossed_.back() != 0; }
  /// A drive's efforts jump here.
  void jump() { radau_.jump(); }
  /// The next Result::end occurs at this time, if it is before the end.
  void stop_at(double t) { stop_ = std::min(t, end_); }
  /// Maximum length of a step; 0: no limit. [s]
  void limit_step(double longest) { radau_.limit_step(longest); }

  long evaluations() const { return evaluations_before_ + radau_.evaluations(); }
  /// Cause and time of a failure.
  std::string message() const;

 private:
  bool crosses(std::size_t index, double before, double now) const;
  double crossing(std::size_t index, double a, double b, double at_a, double at_b);
  void values(double t, std::span<const double> y, std::vector<double>& g);
  double value_at(std::size_t index, double t);
  bool land(double t, std::size_t index);
  void check_at_begin();
  void values_at_stage(int stage, bool clear, std::vector<double>& g);
  bool shapes_stay_clear();

  StiffSystem stiff_system();

  CompliantSystem& system_;
  std::vector<InterfaceLoad> stage_loads_;  // of RadauIIA's last derivatives at its stages
  RadauIIA radau_;
  double first_step_, end_, stop_;
  std::vector<double> at_;
  std::vector<int> crossed_, directions_;
  long evaluations_before_ = 0;  // before replace()
  std::vector<double> begin_, before_, now_,
      there_;  // event functions: at the step's beginning, and during the search in it
};

// Records histories and peaks of a compliant impact, from the solution between steps, too.

/// Samples lie on a time grid that becomes coarser during the impact, so that their number stays between `samples` and
/// twice that for any duration; and at every event, before and after.
class CompliantRecorder {
 public:
  /// `spacing`: initial spacing of the grid [s].
  CompliantRecorder(CompliantSystem& system, int samples, double spacing);

  /// Adds a sample, and the values from which the next step's peaks are searched; call it also before phases or a
  /// drive's piece change.
  void mark(double t, std::span<const double> y);
  /// Adds peaks and samples of the integrator's last step; phases must still be those of the step.
  void step(StiffIntegrator& integrator);
  /// Writes times, states and histories; the caller writes the histories' impulses and losses.
  void finish(ImpactSolution& outcome);

 private:
  enum Measure { force, moment, deformation, measures };
  struct Peak {
    double value = 0, time = 0;
  };
  struct Sample {
    double t;
    long grid;  // index on the grid; negative: an event
  };
  static double measure(std::span<const InterfaceLoad> loads, std::size_t index);
  static void measure_all(std::span<const InterfaceLoad> loads, std::vector<double>& values);
  void take(double t, long grid, std::span<const double> y);
  void evaluate();
  void thin();
  void refine(StiffIntegrator& integrator, double from, double to, std::size_t index);

  CompliantSystem& system_;
  int samples_;
  double spacing_;
  long next_ = 1;
  long on_grid_ = 0;
  std::vector<Sample> taken_;  // evaluated ones first
  std::vector<double> y_;      // of the others, row by row
  // Per evaluated sample:
  std::vector<State> states_;
  std::vector<std::vector<double>> accelerations_;
  std::vector<InterfaceLoad> loads_;              // of all interfaces
  std::vector<ShapeSample> shapes_;               // with shapes
  std::vector<std::vector<double>> multipliers_;  // with loops
  CompliantSystem::Sampled sampled_;
  std::vector<double> times_;
  static constexpr int kStagePoints = StiffIntegrator::stages() + 1;
  std::array<std::vector<double>, kStagePoints>
      stage_values_;  // per interface and measure: at the step's beginning and stages
  std::vector<Peak> peaks_;
  std::vector<double> touching_;
};

}  // namespace grapnel
