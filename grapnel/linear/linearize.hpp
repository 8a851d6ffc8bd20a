#pragma once

/// @file
/// The linear model of a scenario at a time, and the stability of its controllers (docs/theory, section 27).

#include <optional>
#include <stdexcept>

#include "grapnel/linear/linear_model.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/result/capture_result.hpp"

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

/// Linear models of the scenario's controllers at the start and shortly before the end of every phase in which they
/// act, with warnings of unstable ones; of a failed run, at the starts of the phases that began. The scenario is
/// simulated again, without observers: nothing else of the result changes. Growth whose time constant exceeds the phase
/// is "not decided". None for plugins, FMUs and controllers of the program, whose state is not accessible.
/// @throws LinearizeError if the second simulation ends differently, and exceptions of progress; the loops until then
/// remain in the result.
void add_control_loops(const CaptureProblem& problem, CaptureResult& result, const CaptureProgress& progress = {});

}  // namespace grapnel
