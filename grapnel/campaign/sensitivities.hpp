#pragma once

/// @file
/// Sensitivities of a capture: derivatives of its outcomes by values of its scenario, and the first-order propagation
/// of uncertain values to outcomes (docs/theory, section 29). Thread safety: plain values; `problem` may be called from
/// any thread.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/campaign/column.hpp"
#include "grapnel/campaign/criterion.hpp"
#include "grapnel/campaign/differences.hpp"
#include "grapnel/text/faults.hpp"
#include "grapnel/text/override.hpp"

namespace grapnel {

/// A number of the scenario that is varied.
struct SensitivityValue {
  std::string name, unit, description;
  double value = 0;
  std::optional<double> deviation = {};  // standard deviation
  double size = 1;                       // magnitude; of a zero that of its vector, else a stated one
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
};

/// The captures whose outcomes are differentiated.
struct SensitivityTask {
  std::string name;
  std::string file;    // path given by the user
  std::string sha256;  // of the scenario, or of the campaign
  bool is_campaign = false;
  StudyMode mode = StudyMode::run;
  CampaignPlan plan = CampaignPlan::per_case;
  std::vector<SensitivityValue> values;
  std::vector<double> covariance;     // of the values, row by row; empty: not stated
  std::vector<Column> columns;        // the outcomes
  bool drops_absent = false;          // outcomes that do not exist are left out: columns were not selected by name
  std::vector<Criterion> criteria;    // of a campaign, on the columns
  std::vector<std::string> unjudged;  // texts of criteria that are not limits of outcomes
  std::vector<std::string> notes;     // about values that are held
  /// The capture at values. @throws InputError if they are invalid.
  std::function<StudyCase(std::span<const double>)> problem;
};

/// What a task differentiates.
struct SensitivityChoice {
  std::vector<std::string> by;  // paths of values; empty: default values of the scenario
  std::vector<std::string> of;  // patterns of columns; empty: default columns
  StudyMode mode = StudyMode::run;
  CampaignPlan plan = CampaignPlan::per_case;  // of a scenario; a campaign states its own
  std::vector<Override> overrides = {};        // of a scenario
  std::optional<std::string> text = {};        // of the scenario, instead of the bytes of the file
};

/// The task of a scenario file, or of a campaign file by its key `schema`. @throws InputError with all errors of the
/// file, of paths and of columns.
SensitivityTask load_sensitivities(const std::filesystem::path& file, const SensitivityChoice& choice,
                                   std::vector<Fault>* warnings = nullptr);

/// The outcomes, their derivatives, and their first-order uncertainty.
struct SensitivityReport {
  struct Settings {
    std::string name, file, sha256;
    StudyMode simulate = StudyMode::run;
    CampaignPlan plan = CampaignPlan::per_case;
  };
  struct Value {
    std::string name, unit, description;
    double value = 0;
    std::optional<double> deviation;
    double size = 0;
  };
  struct Derivative {
    std::string by;  // name of the value
    Differentiable verdict = Differentiable::not_decided;
    std::optional<double> derivative, error;
    std::optional<double> elasticity;  // value / outcome times the derivative
    std::optional<double> share;       // of the variance of the outcome
    std::optional<double> left, right;
    bool one_sided = false;
    double step = 0;
    std::string reason;
  };
  struct Outcome {
    std::string name, unit, description;
    double value = 0;                 // NaN: it does not exist
    std::optional<double> deviation;  // to first order
    std::string deviation_absent;     // why there is none
    std::vector<Derivative> by;       // per value, in their order
  };
  struct Limit {
    std::string criterion, outcome;
    double bound = 0;
    bool at_most = true, magnitude = false;
    bool holds = false;                 // at the values of the scenario
    std::optional<double> probability;  // to first order, for a normal distribution
  };
  std::string version;  // the program's
  Settings settings;
  std::size_t runs = 0;
  std::vector<Value> values;
  std::vector<Outcome> outcomes;
  std::vector<std::vector<double>> covariance;  // of the outcomes with a deviation; in the order of covariance_of
  std::vector<std::string> covariance_of;       // their names
  std::vector<Limit> limits;
  std::vector<std::string> unjudged;
  std::vector<std::string> notes;
};
template <>
const Type& type_of<SensitivityReport>();

struct SensitivityOptions {
  int threads = 1;
  std::function<void(const CaseProgress&)> progress = {};  // from the calling thread
  std::stop_token stop = {};
};

/// Thrown after a stop request.
struct SensitivitiesStopped {};
/// The capture at the values of the scenario fails.
struct SensitivitiesFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Runs the captures and differentiates. @throws SensitivitiesStopped, SensitivitiesFailed
SensitivityReport sensitivities(const SensitivityTask& task, const SensitivityOptions& options = {});

/// sensitivities.json, and sensitivities.csv with one line per outcome and value.
std::string sensitivities_json(const SensitivityReport& report);
std::string sensitivities_csv(const SensitivityReport& report);
/// Tables of the terminal: per outcome the values with the largest effects.
std::string sensitivities_text(const SensitivityReport& report);

}  // namespace grapnel
