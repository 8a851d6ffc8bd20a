#include "grapnel/compare/impulse_page.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "grapnel/describe/json.hpp"
#include "grapnel/report/base64.hpp"

namespace grapnel {
namespace {

nlohmann::ordered_json momentum_json(const MomentumCurve& curve) {
  nlohmann::ordered_json components = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < kMomentumComponents; ++c) {
    std::vector<double> value, deviation;
    bool any = false;
    for (std::size_t k = 0; k < curve.time.size(); ++k) {
      value.push_back(curve.value[k][c]), deviation.push_back(curve.deviation[k][c]);
      any = any || std::isfinite(curve.value[k][c]);
    }
    if (!any) continue;
    components.push_back({{"name", kMomentumNames[c]},
                          {"unit", kMomentumUnits[c]},
                          {"value", base64_of(std::span<const double>(value))},
                          {"deviation", base64_of(std::span<const double>(deviation))}});
  }
  return {{"body", curve.body}, {"time", base64_of(std::span<const double>(curve.time))}, {"components", components}};
}

}  // namespace

ReportData impulse_page_data(const MeasuredImpulses& impulses) {
  const ImpulseReport& report = impulses.report;
  nlohmann::ordered_json curves = nlohmann::ordered_json::array();
  for (const MomentumCurve& curve : impulses.momentum) {
    if (!curve.time.empty()) curves.push_back(momentum_json(curve));
  }
  return page_data("impulses", "Impulses of " + report.log + " (" + report.scenario + ")",
                   {{"report", json_of(report)}, {"momentum", std::move(curves)}}, report.version);
}

}  // namespace grapnel
