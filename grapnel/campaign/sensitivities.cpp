#include "grapnel/campaign/sensitivities.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "grapnel/campaign/run_events.hpp"
#include "grapnel/campaign/uncertain_value.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
namespace {

// Tolerances of the runs, at most: differences of runs must not be differences of step sizes.
constexpr double kRelativeTolerance = 1e-12, kAbsoluteTolerance = 1e-13;
constexpr double kAccuracy = 1e-12;     // of the outcomes of runs, relative
constexpr double kStep = 0.01;          // first step, relative to the size of the value
constexpr double kOfDeviation = 0.5;    // and at most this part of a standard deviation
constexpr double kLeastStep = 1e-4;     // relative to the size, however small the deviation
constexpr double kSmallOutcome = 1e-6;  // scale of outcomes that are zero as all of their vector [SI]

// The capture at values, with its events.
FunctionValue evaluated(const SensitivityTask& task, const std::vector<double>& at, const std::stop_token& stop) {
  FunctionValue value;
  StudyCase point;
  try {
    point = task.problem(at);
  } catch (const InputError& error) {
    value.failure = error.faults().empty() ? "invalid values" : error.faults().front().message;
    value.is_outside = true;
    return value;
  } catch (const std::exception& error) {
    value.failure = error_text(error);
    return value;
  }
  IntegrationSetup& integration = point.problem.integration;
  integration.relative_tolerance = std::min(integration.relative_tolerance, kRelativeTolerance);
  integration.absolute_tolerance = std::min(integration.absolute_tolerance, kAbsoluteTolerance);
  const CaptureProgress watch = [&stop](const std::string&, double, double) {
    if (stop.stop_requested()) throw SensitivitiesStopped();
  };
  try {
    const CaptureDetail detail = detail_of(task.columns);
    const CaptureResult result = task.mode == StudyMode::impact ? simulate_impact_only(point.problem, detail, watch)
                                                                : simulate_capture(point.problem, watch, detail);
    const CaseRow row = case_row(point, result, task.columns);
    if (row.status == CaseStatus::ok)
      value.values = row.values, value.events = run_events(result);
    else
      value.failure = row.reason.empty() ? "the capture fails" : row.reason;
  } catch (const std::exception& error) {
    value.failure = error_text(error);
  }
  return value;
}

// Runs captures in parallel, and counts them.
class Runs {
 public:
  Runs(const SensitivityTask& task, const SensitivityOptions& options) : task_(task), options_(options) {}

  std::vector<FunctionValue> at(const std::vector<std::vector<double>>& points) {
    std::vector<FunctionValue> values(points.size());
    PoolOptions pool{.threads = options_.threads, .stop = options_.stop};
    pool.progress = [this](const CaseProgress& now) {
      done_ = now;
      if (options_.progress) options_.progress(now);
    };
    CaseProgress progress = done_;
    progress.total = done_.done + points.size();
    run_jobs(points.size(), pool, progress, [&](std::size_t job, const RowSink& submit, const std::stop_token& stop) {
      values[job] = evaluated(task_, points[job], stop);
      CaseRow row;
      row.status = values[job].values.empty() ? CaseStatus::failed : CaseStatus::ok;
      submit({row});
    });
    if (options_.stop.stop_requested()) throw SensitivitiesStopped();
    return values;
  }
  std::size_t count() const { return done_.done; }

 private:
  const SensitivityTask& task_;
  const SensitivityOptions& options_;
  CaseProgress done_;
};

// The name without the component of a vector.
std::string group_of(const std::string& name) {
  for (const char* end : {"/x", "/y", "/z"}) {
    if (name.ends_with(end)) return name.substr(0, name.size() - 2);
  }
  return name;
}

// Per outcome its magnitude, at least that of the largest component of its vector.
std::vector<double> scales_of(const std::vector<Column>& columns, const std::vector<double>& values) {
  std::map<std::string, double> largest;
  for (std::size_t j = 0; j < columns.size(); ++j) {
    double& scale = largest[group_of(columns[j].name)];
    if (std::isfinite(values[j])) scale = std::max(scale, std::abs(values[j]));
  }
  std::vector<double> scales;
  for (const Column& column : columns) scales.push_back(std::max(largest[group_of(column.name)], kSmallOutcome));
  return scales;
}

DifferenceVariable variable_of(const SensitivityValue& value) {
  DifferenceVariable variable{value.value, value.size, kStep * value.size, value.least, value.most};
  if (value.deviation && *value.deviation > 0) {
    variable.size = std::max(std::min(value.size, *value.deviation), kLeastStep * value.size);
    variable.step = std::clamp(kOfDeviation * *value.deviation, kLeastStep * value.size, kStep * value.size);
  }
  return variable;
}

std::optional<double> finite(double value) { return std::isfinite(value) ? std::optional(value) : std::nullopt; }

SensitivityReport::Derivative derivative_of(const DerivativeEntry& entry, const SensitivityValue& value, double outcome,
                                            double scale) {
  SensitivityReport::Derivative one{
      value.name, entry.verdict, finite(entry.derivative), finite(entry.error), {},          {},
      entry.left, entry.right,   entry.is_one_sided,       entry.step,          entry.reason};
  if (entry.verdict == Differentiable::yes && std::abs(outcome) > kNegligibleChange * scale)
    one.elasticity = finite(value.value / outcome * entry.derivative + 0.0);  // no -0
  return one;
}

// ---- First-order propagation ----

bool is_determined(const SensitivityReport::Outcome& outcome) {
  return std::all_of(outcome.by.begin(), outcome.by.end(),
                     [](const auto& one) { return one.verdict == Differentiable::yes; });
}

std::string why_no_deviation(const SensitivityReport::Outcome& outcome) {
  std::string names;
  for (const auto& one : outcome.by) {
    if (one.verdict != Differentiable::yes) names += (names.empty() ? "" : ", ") + one.by;
  }
  return "no determined derivative by " + names;
}

double derivative_at(const SensitivityReport::Outcome& outcome, std::size_t k) {
  return outcome.by[k].derivative.value_or(NAN);
}

// J S J^T, (29.7), and the shares of values, (29.8).
void propagate(const SensitivityTask& task, SensitivityReport& report) {
  const std::size_t n = task.values.size();
  const auto covariance = [&](const SensitivityReport::Outcome& a, const SensitivityReport::Outcome& b) {
    double sum = 0;
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t l = 0; l < n; ++l) sum += derivative_at(a, k) * task.covariance[k * n + l] * derivative_at(b, l);
    }
    return sum;
  };
  std::vector<const SensitivityReport::Outcome*> determined;
  for (SensitivityReport::Outcome& outcome : report.outcomes) {
    if (!is_determined(outcome)) {
      outcome.deviation_absent = why_no_deviation(outcome);
      continue;
    }
    const double variance = std::max(covariance(outcome, outcome), 0.0);
    outcome.deviation = std::sqrt(variance);
    determined.push_back(&outcome);
    for (std::size_t k = 0; k < n && variance > 0; ++k) {
      double sum = 0;
      for (std::size_t l = 0; l < n; ++l) sum += task.covariance[k * n + l] * derivative_at(outcome, l);
      outcome.by[k].share = derivative_at(outcome, k) * sum / variance;
    }
  }
  for (const SensitivityReport::Outcome* a : determined) {
    report.covariance_of.push_back(a->name);
    std::vector<double>& row = report.covariance.emplace_back();
    for (const SensitivityReport::Outcome* b : determined) row.push_back(covariance(*a, *b));
  }
}

// P(y <= bound) and its like for a normal outcome, (29.9); without deviation 0 or 1.
double probability_of(const CriterionLimit& limit, double mean, double deviation) {
  const auto below = [&](double bound) {
    return deviation > 0 ? normal_probability((bound - mean) / deviation) : static_cast<double>(mean <= bound);
  };
  const double at_most = limit.magnitude ? std::max(below(limit.bound) - below(-limit.bound), 0.0) : below(limit.bound);
  return limit.at_most ? at_most : 1 - at_most;
}

void add_limits(const SensitivityTask& task, SensitivityReport& report) {
  for (const Criterion& criterion : task.criteria) {
    for (const CriterionLimit& limit : criterion.limits()) {
      const std::string& name = task.columns[limit.number].name;
      const auto outcome = std::find_if(report.outcomes.begin(), report.outcomes.end(),
                                        [&](const auto& one) { return one.name == name; });
      if (outcome == report.outcomes.end()) continue;
      const double value = limit.magnitude ? std::abs(outcome->value) : outcome->value;
      SensitivityReport::Limit one{criterion.name(),
                                   name,
                                   limit.bound,
                                   limit.at_most,
                                   limit.magnitude,
                                   limit.at_most ? value <= limit.bound : value >= limit.bound,
                                   {}};
      if (outcome->deviation) one.probability = probability_of(limit, outcome->value, *outcome->deviation);
      report.limits.push_back(std::move(one));
    }
  }
}

void add_notes(const SensitivityTask& task, SensitivityReport& report) {
  report.notes = task.notes;
  if (task.plan == CampaignPlan::nominal)
    report.notes.push_back("plan: nominal: the approach is planned once, and every run follows that plan");
  for (const SensitivityReport::Outcome& outcome : report.outcomes) {
    if (!std::isfinite(outcome.value)) report.notes.push_back(outcome.name + " does not exist in this capture");
  }
}

}  // namespace

SensitivityReport sensitivities(const SensitivityTask& task, const SensitivityOptions& options) {
  SensitivityReport report;
  report.version = GRAPNEL_VERSION;
  report.settings = {task.name, task.file, task.sha256, task.mode, task.plan};
  std::vector<double> at;
  std::vector<DifferenceVariable> variables;
  for (const SensitivityValue& value : task.values) {
    at.push_back(value.value);
    variables.push_back(variable_of(value));
    report.values.push_back({value.name, value.unit, value.description, value.value, value.deviation, value.size});
  }
  Runs runs(task, options);
  const FunctionValue center = runs.at({at}).front();
  if (center.values.empty()) throw SensitivitiesFailed(center.failure);
  const bool exists = std::ranges::any_of(center.values, [](double one) { return std::isfinite(one); });
  if (task.drops_absent && !exists)
    throw SensitivitiesFailed("no default column has a value; name others by --of COLUMNS");
  const std::vector<double> scales = scales_of(task.columns, center.values);
  const auto entries =
      differentiate([&](const auto& points) { return runs.at(points); }, center, variables, scales, kAccuracy);
  for (std::size_t j = 0; j < task.columns.size(); ++j) {
    const Column& column = task.columns[j];
    if (task.drops_absent && !std::isfinite(center.values[j])) continue;
    SensitivityReport::Outcome outcome{column.name, column.unit, column.description, center.values[j], {}, {}, {}};
    for (std::size_t k = 0; k < task.values.size(); ++k)
      outcome.by.push_back(derivative_of(entries[k][j], task.values[k], center.values[j], scales[j]));
    report.outcomes.push_back(std::move(outcome));
  }
  if (!task.covariance.empty()) propagate(task, report);
  add_limits(task, report);
  report.unjudged = task.unjudged;
  report.runs = runs.count();
  add_notes(task, report);
  return report;
}

}  // namespace grapnel
