#include "grapnel/compare/comparison_page.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "grapnel/describe/json.hpp"
#include "grapnel/report/base64.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMostShown = 4000;  // samples per component

// The indices of the samples that the page shows: every n-th, the outliers, and the largest residual.
std::vector<std::size_t> shown_samples(const ComparedCurve& curve) {
  const std::size_t count = curve.time.size(), every = (count + kMostShown - 1) / kMostShown;
  std::size_t peak = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (std::abs(curve.residual[i]) > std::abs(curve.residual[peak])) peak = i;
  }
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % every == 0 || i == peak || curve.is_outlier[i] != 0) shown.push_back(i);
  }
  return shown;
}

std::string packed(const std::vector<double>& values, const std::vector<std::size_t>& which) {
  std::vector<double> chosen;
  for (const std::size_t i : which) {
    if (i < values.size()) chosen.push_back(values[i]);
  }
  return base64_of(std::span<const double>(chosen));
}

nlohmann::ordered_json curve_json(const ComparedCurve& curve) {
  const std::vector<std::size_t> shown = shown_samples(curve);
  std::vector<std::size_t> breaks;  // shown samples that follow a gap
  auto gap = curve.after_gaps.begin();
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const auto next = std::upper_bound(gap, curve.after_gaps.end(), shown[k]);
    if (next != gap && k > 0) breaks.push_back(k);
    gap = next;
  }
  std::vector<double> outliers;
  for (const std::size_t i : shown) {
    if (curve.is_outlier[i] != 0) outliers.push_back(curve.time[i]);
  }
  return {{"quantity", curve.quantity},
          {"component", curve.component},
          {"samples", shown.size()},
          {"of", curve.time.size()},
          {"time", packed(curve.time, shown)},
          {"measured", packed(curve.measured, shown)},
          {"simulated", packed(curve.simulated, shown)},
          {"residual", packed(curve.residual, shown)},
          {"outliers", outliers},
          {"breaks", breaks}};
}

}  // namespace

ReportData comparison_page_data(const LogComparison& comparison) {
  const ComparisonReport& report = comparison.report;
  nlohmann::ordered_json curves = nlohmann::ordered_json::array();
  for (const ComparedCurve& curve : comparison.curves) curves.push_back(curve_json(curve));
  return page_data("log", report.run.scenario + " and " + report.log.file,
                   {{"comparison", json_of(report)}, {"curves", std::move(curves)}}, report.version);
}

}  // namespace grapnel
