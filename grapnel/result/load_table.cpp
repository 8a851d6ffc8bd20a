#include "grapnel/result/load_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "grapnel/result/text_table.hpp"

namespace grapnel {
namespace {

// The worst first; NaN before all others.
bool is_heavier(const PeakLoad& a, const PeakLoad& b) {
  if (std::isnan(a.margin()) || std::isnan(b.margin())) return std::isnan(a.margin()) && !std::isnan(b.margin());
  return a.margin() < b.margin();
}

bool is_rated(const PeakLoad& load) { return std::isfinite(load.rating); }

// A drive that is saturated at its effort limit has no margin, and does not exceed a rating.
bool is_saturated(const PeakLoad& load) {
  return load.quantity.starts_with("driving") && std::abs(load.margin()) <= 1e-9;
}

std::string percent(const PeakLoad& load) {
  if (is_saturated(load)) return "saturated";
  return fmt::format("{:.1f} %{}", 100 * load.margin(), load.peak > load.rating ? "  EXCEEDED" : "");
}

// "force of left 485 of 400 N at t = 31.2 s (post_impact)"
std::string words(const CaptureResult& result, const PeakLoad& load) {
  std::string text = fmt::format("{} of {}, {} of {} at t = {} s ({})", load.quantity, load.of, short_number(load.peak),
                                 short_number(load.rating), short_number(load.time), load.phase);
  if (load.assumed_duration)
    text += fmt::format(", a mean over an assumed {} ms", short_number(1e3 * assumed_duration(result, load)));
  return text;
}

}  // namespace

const PeakLoad* worst_margin(const CaptureResult& result, bool without_assumed) {
  const PeakLoad* worst = nullptr;
  for (const PeakLoad& load : result.peak_loads) {
    if (!is_rated(load) || (without_assumed && load.assumed_duration)) continue;
    if (!worst || is_heavier(load, *worst)) worst = &load;
  }
  return worst;
}

double assumed_duration(const CaptureResult& result, const PeakLoad& peak) {
  if (!peak.assumed_duration || !(peak.peak > 0)) return 0;
  const std::string whole = peak.quantity == "force"    ? "impulse"
                            : peak.quantity == "moment" ? "angular_impulse"
                                                        : "driving_impulse";
  for (const PeakLoad& load : result.peak_loads) {
    if (load.of == peak.of && load.phase == peak.phase && load.quantity == whole) return load.peak / peak.peak;
  }
  return 0;
}

bool rests_on_duration(const ImpactReport& impact, const LoadMargin& margin) {
  return !impact.compliant && !margin.quantity.ends_with("impulse");
}

std::string worst_margin_line(const CaptureResult& result) {
  const PeakLoad* worst = worst_margin(result);
  if (!worst) return "";
  std::string out = paragraph(fmt::format("worst margin: {}; {}", percent(*worst), words(result, *worst)), "");
  if (!worst->assumed_duration) return out;
  const PeakLoad* sure = worst_margin(result, true);
  if (!sure) return out + "  every margin depends on that assumption\n";
  return out + paragraph(fmt::format("without assumed durations: {}; {}", percent(*sure), words(result, *sure)), "  ");
}

std::string margins_table(const CaptureResult& result) {
  constexpr std::size_t kShown = 12;
  std::vector<const PeakLoad*> worst;  // one per rated joint or gripper
  for (const PeakLoad& load : result.peak_loads) {
    if (!is_rated(load)) continue;
    const auto at = std::find_if(worst.begin(), worst.end(), [&](const PeakLoad* w) { return w->of == load.of; });
    if (at == worst.end()) {
      worst.push_back(&load);
    } else if (is_heavier(load, **at)) {
      *at = &load;
    }
  }
  if (worst.empty()) return "";
  std::stable_sort(worst.begin(), worst.end(), [](const PeakLoad* a, const PeakLoad* b) { return is_heavier(*a, *b); });
  TextTable table;
  table.row({"worst load, all phases", "", "peak", "rating", "at", "phase", "margin"});
  bool assumed = false;
  for (std::size_t i = 0; i < std::min(kShown, worst.size()); ++i) {
    const PeakLoad& load = *worst[i];
    assumed = assumed || load.assumed_duration;
    table.row({load.of, load.quantity, short_number(load.peak), short_number(load.rating), short_number(load.time),
               load.phase, percent(load) + (load.assumed_duration ? " *" : "")});
  }
  std::string out = "\n" + table.text();
  if (worst.size() > kShown) out += fmt::format("  and {} more, see loads in summary.json\n", worst.size() - kShown);
  if (assumed) {
    double duration = 0;
    for (const PeakLoad* load : worst) duration = std::max(duration, assumed_duration(result, *load));
    out += paragraph(fmt::format("* a mean over an assumed {} ms (impact.duration); the impact itself takes no time",
                                 short_number(1e3 * duration)),
                     "  ");
  }
  return out;
}

}  // namespace grapnel
