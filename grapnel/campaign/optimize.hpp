#pragma once

/// @file
/// The search for the best capture: a sample that fills the space of the variables, then local searches from its best
/// points.

#include <optional>
#include <stop_token>

#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/campaign/optimization.hpp"

namespace grapnel {

/// A point that was simulated.
struct Evaluation {
  std::vector<double> values;  // of the variables
  std::size_t search = 0;      // 0: the sample; k: the k-th local search
  CaseRow row;                 // index: position in OptimizationOutcome::evaluations
  Score score;
};

struct OptimizationOutcome {
  Evaluation before;                    // the unchanged scenario; without values
  std::vector<Evaluation> evaluations;  // the sample, then the local searches one after the other
  std::optional<std::size_t> best;      // of the acceptable ones
  std::optional<std::size_t> nearest;   // nearest to acceptable, if there is no best
  std::size_t count(CaseStatus status) const;
  std::size_t beyond_limits() const;  // reached but not acceptable
};

/// Runs a single case of an optimization: the unchanged scenario, or a file written by scenario_text.
Evaluation evaluate(const Optimization& optimization, const StudyCase& point, const std::stop_token& stop = {});

/// Thrown by evaluate() when a stop is requested; not a std::exception, so that cases do not report it as a failure.
struct EvaluationStopped {};

/// Searches. The sample is an additive recurrence with the generalized golden ratio (Roberts 2018), its first point the
/// variables' `start`. Local searches are Rowan's subplex method (NLopt's SBPLX), which only compares points, so that
/// limits and unreachable points need no smoothness; or, by `search.steps`, sequential quadratic programs (NLopt's
/// SLSQP) with central differences, which take two points per variable. The sample gets half of the evaluations. The
/// outcome is identical, bit for bit, for any number of threads. After a request of `options.stop` the outcome has the
/// evaluations completed until then; `before` may be without a row.
OptimizationOutcome optimize(const Optimization& optimization, const PoolOptions& options);

}  // namespace grapnel
