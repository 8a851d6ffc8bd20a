#pragma once

/// @file
/// SUNDIALS CVODE (BDF, dense Newton) for a CompliantSystem: one internal step at a time, with events.

#include <memory>

#include "grapnel/impact/compliant_system.hpp"

namespace grapnel {

class StiffIntegrator {
 public:
  enum class Result { stepped, event, end, failed };

  /// From y = 0 at t = 0 until `end`. Errors per step stay within `tolerances`. `system` must outlive the integrator.
  StiffIntegrator(CompliantSystem& system, std::span<const double> tolerances, double end);
  ~StiffIntegrator();
  StiffIntegrator(const StiffIntegrator&) = delete;
  StiffIntegrator& operator=(const StiffIntegrator&) = delete;

  /// One step, or as far as the first event in it.
  Result step();
  double time() const;
  std::span<const double> y() const;
  /// Event functions that crossed zero at the last Result::event: not zero.
  std::span<const int> crossed() const;
  /// The solution at a time within the last step.
  std::span<const double> at(double t);
  /// Begins anew where it is: the right-hand side has changed.
  void restart();
  /// The next Result::end is at this time, if that is before the end.
  void stop_at(double t);
  /// No step is longer; 0: no limit. [s]
  void limit_step(double longest);

  long evaluations() const;
  /// What went wrong, with the solver's own words.
  std::string message() const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

// Histories and peaks of a compliant impact, taken from the solution between steps as well.

/// Samples lie on a grid in time that is made coarser as the impact goes on, so that their number stays between
/// `samples` and twice that, whatever the duration; and at every event, before and after.
class CompliantRecorder {
 public:
  /// `spacing`: of the grid at first [s].
  CompliantRecorder(CompliantSystem& system, int samples, double spacing);

  /// A sample of its own, and the values from which the next step's peaks are sought.
  void mark(double t, std::span<const double> y);
  /// Peaks and samples of the step that the integrator has just made from `from` to `to`; phases still those of the
  /// step.
  void step(StiffIntegrator& integrator, double from, double to);
  /// Writes times, states and histories; the histories' impulses and losses are the caller's.
  void finish(CompliantOutcome& outcome);

 private:
  enum Measure { force, moment, deformation, measures };
  struct Peak {
    double value = 0, time = 0;
  };
  struct Sample {
    double t;
    long grid;  // index on the grid; negative: an event
    State state;
    std::vector<double> vdot;
    std::vector<Vector3d> point, force, moment;
    std::vector<double> deformation;
  };
  double measure(std::size_t index) const;
  void measure_all(std::vector<double>& values) const;
  void take(double t, long grid);
  void thin();
  void refine(StiffIntegrator& integrator, double from, double to, std::size_t index);

  CompliantSystem& system_;
  int samples_;
  double spacing_;
  long next_ = 1;
  long on_grid_ = 0;
  std::vector<Sample> taken_;
  std::vector<double> begin_, middle_, end_;  // per interface and measure
  std::vector<Peak> peaks_;
  std::vector<double> touching_;
};

}  // namespace grapnel
