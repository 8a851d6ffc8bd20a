#pragma once

/// @file
/// What an optimization has found, as text and files; docs/formats/optimization.md is their contract.

#include <string>

#include "grapnel/study/optimize.hpp"

namespace grapnel {

/// evaluations.csv: one line per point.
std::string evaluations_csv(const Optimization& optimization, const OptimizationOutcome& outcome);

/// comparison.json: settings, counts, and before and after of everything that was kept. `after`: of the best, or null
/// if there is none.
std::string comparison_json(const Optimization& optimization, const OptimizationOutcome& outcome,
                            const Evaluation* after, const std::string& version);

/// Counts, the best values of the variables, and before and after of what people look for first.
std::string comparison_text(const Optimization& optimization, const OptimizationOutcome& outcome,
                            const Evaluation* after);

/// Why nothing was chosen: which limit is passed least, and by how much; or that no point could be reached, and the
/// most frequent reason.
std::string why_nothing_is_best(const Optimization& optimization, const OptimizationOutcome& outcome);

/// The objective as a person reads it: "minimize grasps/tip-1/impulse_magnitude".
std::string objective_text(const Optimization& optimization);

}  // namespace grapnel
