#pragma once

/// @file
/// Results of an optimization as text and files; docs/formats/optimization.md is their contract.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/study/optimize.hpp"

namespace grapnel {

/// evaluations.csv: one line per point.
std::string evaluations_csv(const Optimization& optimization, const OptimizationOutcome& outcome);

/// comparison.json: settings, counts, and all stored numbers before and after.
struct OptimizationReport {
  struct Settings {
    std::string name, sha256;
    StudyMode simulate = StudyMode::run;
  };
  struct Feasible {
    Verdict before = Verdict::not_checked;
    std::optional<Verdict> after;
  };
  struct Variable {
    std::string name, unit;
    double from = 0, to = 0;
    std::optional<double> best;
  };
  struct Change {
    std::string name, unit;
    double before = 0, after = 0;
    bool has_after = false;
  };
  std::string version;  // the program's
  Settings settings;
  std::size_t evaluations = 0;
  std::array<std::size_t, 3> status{};  // per CaseStatus
  std::size_t beyond_limits = 0;
  std::optional<std::size_t> best;
  std::optional<std::string> why;  // reason without a best point
  bool before_acceptable = false;
  std::optional<std::string> before_reason;
  Feasible feasibility;
  std::vector<Variable> variables;
  Change objective;
  std::vector<Change> limits, columns;
  std::string text;  // of the optimization file
};
template <>
const Type& type_of<OptimizationReport>();

/// Its text. `after`: the row of the best point, or null if there is none.
std::string comparison_json(const Optimization& optimization, const OptimizationOutcome& outcome,
                            const Evaluation* after, const std::string& version);

/// Counts, the best values of the variables, and the main numbers before and after.
std::string comparison_text(const Optimization& optimization, const OptimizationOutcome& outcome,
                            const Evaluation* after);

/// Why no point was selected: the limit with the smallest violation and its size; or the most frequent reason if no
/// point has a result.
std::string why_nothing_is_best(const Optimization& optimization, const OptimizationOutcome& outcome);

/// The objective as text: "minimize grasps/tip-1/impulse_magnitude".
std::string objective_text(const Optimization& optimization);

}  // namespace grapnel
