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
  /// No step is longer; 0: no limit. [s]
  void limit_step(double longest);

  long evaluations() const;
  /// What went wrong, with the solver's own words.
  std::string message() const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace grapnel
