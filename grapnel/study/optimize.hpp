#pragma once

/// @file
/// The search for the best capture: a sample that fills the space of the variables, then local searches from its best
/// points.

#include <optional>
#include <stop_token>

#include "grapnel/study/case_pool.hpp"
#include "grapnel/study/optimization.hpp"

namespace grapnel {

/// A point that was simulated.
struct Evaluation {
  std::vector<double> values;  // of the variables
  std::size_t search = 0;      // 0: the sample; k: the k-th local search
  CaseRow row;                 // index: position in OptimizationOutcome::evaluations
  Score score;
};

struct OptimizationOutcome {
  Evaluation before;                    // the scenario as it is; without values
  std::vector<Evaluation> evaluations;  // the sample, then the local searches one after the other
  std::optional<std::size_t> best;      // of the acceptable ones
  std::optional<std::size_t> nearest;   // to being acceptable, if there is no best
  std::size_t count(CaseStatus status) const;
  std::size_t beyond_limits() const;  // reached, and not acceptable
};

/// Runs the case of an optimization that stands on its own: the scenario before, or a file written by scenario_text.
Evaluation evaluate(const Optimization& optimization, const StudyCase& point, const std::stop_token& stop = {});

/// Thrown by evaluate() when a stop is requested; no std::exception, so that no case takes it for its own failure.
struct EvaluationStopped {};

/// Searches. The sample is an additive recurrence with the generalized golden ratio (Roberts 2018), its first point the
/// variables' `start`; local searches are Rowan's subplex method (NLopt's SBPLX), which only compares points, so that
/// limits and points that cannot be reached need no smoothness. Half of the evaluations are for each. The outcome is
/// the same, bit for bit, for any number of threads. Where `options.stop` is requested, the outcome has the evaluations
/// that were complete by then; `before` may be without a row.
OptimizationOutcome optimize(const Optimization& optimization, const PoolOptions& options);

}  // namespace grapnel
