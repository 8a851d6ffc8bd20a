#include "grapnel/compare/momentum_report.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/compare/comparison_report.hpp"
#include "grapnel/compare/measured_momentum.hpp"
#include "grapnel/result/described_table.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

std::vector<MeasuredComponent> momentum_components(const MomentumCurve& curve, std::size_t sample) {
  std::vector<MeasuredComponent> components;
  for (std::size_t c = 0; c < kMomentumComponents; ++c) {
    MeasuredComponent one;
    one.name = kMomentumNames[c], one.unit = kMomentumUnits[c];
    one.determined = std::isfinite(curve.value[sample][c]);
    if (one.determined) one.value = curve.value[sample][c], one.uncertainty = curve.deviation[sample][c];
    components.push_back(std::move(one));
  }
  return components;
}

}  // namespace

std::vector<MomentumReport> momentum_report(std::span<const MomentumCurve> curves) {
  std::vector<MomentumReport> report;
  for (const MomentumCurve& curve : curves) {
    MomentumReport& one = report.emplace_back();
    one.body = curve.body, one.missing = curve.missing, one.samples = curve.time.size();
    if (curve.time.empty()) continue;
    one.first = momentum_components(curve, 0), one.last = momentum_components(curve, curve.time.size() - 1);
  }
  return report;
}

std::string momentum_report_text(std::span<const MomentumReport> report) {
  TextTable table;
  table.row({"momentum and energy", "unit", "first", "uncertainty", "last", "uncertainty"});
  bool any = false;
  for (const MomentumReport& m : report) {
    for (std::size_t c = 0; c < m.first.size() && c < m.last.size(); ++c) {
      if (!m.first[c].determined && !m.last[c].determined) continue;
      any = true;
      table.row({printable_line(m.body) + ", " + m.first[c].name, m.first[c].unit, optional_number(m.first[c].value),
                 optional_number(m.first[c].uncertainty), optional_number(m.last[c].value),
                 optional_number(m.last[c].uncertainty)});
    }
  }
  std::string text = any ? table.text() + "\n" : "";
  for (const MomentumReport& m : report) {
    if (!m.missing.empty())
      text += paragraph(fmt::format("{}: more would follow from {}", printable_line(m.body), some_of(m.missing)), "");
  }
  return text;
}

}  // namespace grapnel
