#pragma once

/// @file
/// The linear model of a scenario at a time, and the stability of its controllers (docs/theory, section 27).

#include <optional>
#include <stdexcept>

#include "grapnel/linear/linear_model.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// The scenario has no linear model at that time; what() states why.
class LinearizeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct LinearizeOptions {
  double time = 0;  // [s]
  std::optional<double> sample_time =
      {};            // of the sampled model [s]; absent: that of the scenario's controllers, if any
  double delay = 0;  // with it [s]
};

/// Simulates the scenario up to the time and linearizes the system that moves from there on. @throws LinearizeError,
/// CaptureProblemError.
LinearModel linearize(const CaptureProblem& problem, const LinearizeOptions& options);

}  // namespace grapnel
