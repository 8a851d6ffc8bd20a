#pragma once

/// @file
/// Results of a comparison of a run with a log; docs/formats/comparison.md is the contract of comparison.json.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/compare/momentum_report.hpp"
#include "grapnel/describe/type.hpp"
#include "grapnel/result/ledger.hpp"

namespace grapnel {

struct ComparisonReport {
  struct Component {
    std::string name;
    double rms = 0, bias = 0, peak = 0, peak_time = 0;
    std::optional<double> chi_square;
  };
  struct Quantity {
    std::string name, run, unit;
    std::vector<std::string> columns;
    Verdict verdict = Verdict::not_checked;
    std::string reason;
    std::size_t samples = 0, compared = 0, missing = 0, outside = 0, outliers = 0;
    std::optional<double> outlier_time;
    std::size_t gaps = 0;
    std::optional<double> longest_gap, longest_gap_time;
    std::optional<double> rms, peak, peak_time;  // empty: no sample is compared
    std::string peak_component;
    std::optional<double> lag, lag_uncertainty;
    std::optional<double> uncertainty, bias_uncertainty, chi_square, chi_square_bound;
    std::optional<double> interpolation_error;
    double autocorrelation = 0;
    std::vector<Component> components;
  };
  struct Run {
    std::string scenario, sha256;
  };
  struct Log {
    std::string file, sha256, format;
  };
  struct Clock {
    double offset = 0;
    bool found = false;
    std::optional<double> uncertainty, other;
    double drift = 0;      // [1]
    double reference = 0;  // [s]
    bool drift_found = false;
    std::optional<double> drift_uncertainty;
  };

  std::string version;
  Verdict verdict = Verdict::not_checked;
  Run run;
  Log log;
  Clock clock;
  std::vector<Quantity> quantities;
  std::vector<MomentumReport> momentum;
  std::string momentum_reason = "not computed";  // why `momentum` is empty
  std::vector<std::string> warnings;

  std::size_t count(Verdict of) const;
};
template <>
const Type& type_of<ComparisonReport>();

/// comparison.json
std::string comparison_report_json(const ComparisonReport& report);
/// The tables of the terminal: clocks, quantities, reasons, warnings.
std::string comparison_report_text(const ComparisonReport& report);

/// In tables of the terminal: "yes", "NO" or "not checked"; the number, or "-".
std::string verdict_word(Verdict verdict);
std::string optional_number(const std::optional<double>& value);

}  // namespace grapnel
