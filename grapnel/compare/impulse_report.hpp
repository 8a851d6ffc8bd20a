#pragma once

/// @file
/// Impulses and momentum of measured motion; docs/formats/impulses.md is the contract of impulses.json.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/compare/momentum_report.hpp"
#include "grapnel/describe/type.hpp"
#include "grapnel/result/ledger.hpp"

namespace grapnel {

struct ImpulseReport {
  using Component = MeasuredComponent;
  struct Grasp {
    std::string end_effector, target;
    std::vector<Component> components;
    std::vector<double> covariance;  // of the determined components, row by row
  };
  struct Rate {
    std::string quantity, component, unit;
    double before = 0, after = 0, change = 0, uncertainty = 0, curvature = 0, window = 0;
    std::size_t samples = 0, outliers = 0;
    double chi_square = 0;
    double residual = 0;  // of the balance, in standard uncertainties
  };
  struct Contact {
    double time = 0, end = 0;
    bool detected = false;
    std::optional<double> time_uncertainty, statistic, threshold;
    double simulated_time = 0;
    Verdict verdict = Verdict::not_checked;
    std::string reason;
    std::optional<double> chi_square, chi_square_bound;
    std::size_t unknowns = 0, rank = 0, rows = 0, freedom = 0;
    std::vector<Grasp> grasps;
    std::vector<Component> drives;
    std::vector<std::vector<double>> null_space;
    std::vector<Rate> rates;
    std::vector<std::string> assumed, zero_efforts;
  };
  using Momentum = MomentumReport;

  std::string version;
  Verdict verdict = Verdict::not_checked;
  std::string scenario, sha256, log, log_sha256;
  double offset = 0;
  std::optional<double> offset_uncertainty;
  double false_alarms = 0;
  std::optional<double> detection_window;
  std::vector<Contact> contacts;
  std::vector<Momentum> momentum;
  std::vector<std::string> unused, warnings;

  std::size_t count(Verdict of) const;
};
template <>
const Type& type_of<ImpulseReport>();

/// impulses.json
std::string impulse_report_json(const ImpulseReport& report);
/// impulses.csv: a line per component of the impulse at each grasp.
std::string impulse_report_csv(const ImpulseReport& report);
/// The tables of the terminal.
std::string impulse_report_text(const ImpulseReport& report);

}  // namespace grapnel
