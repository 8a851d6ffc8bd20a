#include "grapnel/result/verdicts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>

#include "grapnel/result/described_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// "left", "left and right", "a, b and c".
std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 < names.size() ? ", " : " and ") + names[i];
  return text;
}

// ", by moving debris 106 mm and rocket 20 mm"
std::string moved_words(const CaptureResult& result) {
  std::vector<std::string> moves, targets;
  for (const GraspOutcome& g : result.grasps) {
    if (!g.captured || !(g.target_moved > 0) || std::count(targets.begin(), targets.end(), g.target) > 0) continue;
    targets.push_back(g.target);
    moves.push_back(fmt::format("{} {}", g.target, length_text(g.target_moved)));
  }
  return moves.empty() ? "" : ", by moving " + listed(moves);
}

// Bodies overlap before the capture.
bool is_beyond_validity(const CaptureResult& result) {
  return result.valid_until && *result.valid_until < result.capture_time;
}

// The row of contacts before the capture that the plan does not include.
constexpr std::string_view kUnplannedContact = "unplanned_contact";

// Severities: overlaps first.
int rank_of(const Violation& v) { return v.kind == "overlap" ? 0 : v.kind == "clearance" ? 1 : 2; }

double severity_of(const GradedViolation& v) {
  const int rank = rank_of(v);
  if (rank == 0) return v.value;
  if (rank == 1) return v.limit - v.value;
  return std::abs(v.value - v.limit) / (v.limit != 0 ? std::abs(v.limit) : 1);
}

void add_clearance(const ClearanceEvent& e, std::vector<GradedViolation>& all) {
  const std::string pair = e.minimum.body_a + " and " + e.minimum.body_b;
  GradedViolation v;
  v.phase = e.phase;
  v.worst_time = e.minimum.time;
  if (e.overlap_begin) {
    v.kind = "overlap", v.what = pair + " overlap", v.time = *e.overlap_begin;
    v.value = -e.minimum.distance;
    v.worst = fmt::format("{} overlap by {} m", pair, short_number(v.value));
    all.push_back(v);
    if (!(e.begin_time < *e.overlap_begin)) return;
    v.worst_time = *e.overlap_begin;  // from there on it is the overlap that counts
  }
  v.kind = "clearance", v.time = e.begin_time;
  v.what = fmt::format("{} are nearer than {} m", pair, short_number(e.required));
  v.value = std::max(0.0, e.minimum.distance), v.limit = e.required;
  v.worst = fmt::format("{} are {} m apart, of {} m required", pair, short_number(v.value), short_number(v.limit));
  all.push_back(v);
}

void add_limit(const LimitEvent& e, std::vector<GradedViolation>& all) {
  if (e.kind == LimitKind::effort_saturated) return;
  GradedViolation v;
  v.kind = name_of(e.kind), v.phase = e.phase, v.time = e.begin_time;
  v.what = fmt::format("{} of {} passes its limit {}", v.kind, e.joint, short_number(e.limit));
  v.value = e.worst_value, v.limit = e.limit, v.worst_time = e.worst_time;
  v.worst = fmt::format("{} of {} is {}, its limit {}", v.kind, e.joint, short_number(v.value), short_number(v.limit));
  all.push_back(v);
}

// "clearance", "joint positions"
std::string row_words(const std::string& name) {
  if (name == "clearance_violation") return "clearance";
  for (const char* what : {"position", "rate", "effort"}) {
    if (name == fmt::format("joint_{}_violation", what)) return fmt::format("joint {}s", what);
  }
  return name;
}

// "arm and debris touch at t = 11.76 s (2 more pairs), which the plan does not include"; empty: nothing disturbed it.
std::string unplanned_words(const CaptureResult& result) {
  if (!result.plan) return "";
  const std::vector<PlannedContact>& contacts = result.plan->contacts;
  const auto first = std::ranges::find_if(contacts, &PlannedContact::disturbs);
  if (first == contacts.end()) return "";
  const auto count = std::ranges::count_if(contacts, &PlannedContact::disturbs);
  return fmt::format("{} and {} touch at t = {} s{}, before the capture, which the plan does not include",
                     first->body_a, first->body_b, short_number(first->simulated.value_or(0)),
                     count > 1 ? fmt::format(" ({} more pairs later)", count - 1) : "");
}

// The checks that passed, and the checks for which the model has nothing to evaluate.
std::string satisfied_words(const CaptureResult& result) {
  std::vector<std::string> satisfied, limits;
  bool clearance = false, any_limit_row = false;
  for (const LedgerEntry& e : result.ledger.entries) {
    if (e.kind != LedgerEntry::Kind::feasibility || e.name == kUnplannedContact) continue;
    const bool is_clearance = e.name == "clearance_violation";
    any_limit_row = any_limit_row || !is_clearance;
    if (!e.applies) continue;
    clearance = clearance || is_clearance;
    (is_clearance ? satisfied : limits).push_back(row_words(e.name));
  }
  if (limits.size() == 3) limits = {"joint limits"};
  satisfied.insert(satisfied.end(), limits.begin(), limits.end());
  std::string text = listed(satisfied) + (satisfied.size() == 1 && clearance ? " is kept" : " are kept");
  const bool all_may = !result.contacts.empty();
  if (!clearance) text += all_may ? "; all pairs of bodies may touch" : "; no two bodies can touch";
  if (any_limit_row && limits.empty()) text += "; no joint limits are stated";
  return text;
}

// "valid until 35.46 s: base and debris overlap from then on (post_impact)"
std::string violation_words(const CaptureResult& result) {
  std::string text = result.valid_until ? fmt::format("valid until {} s", short_number(*result.valid_until)) : "";
  const Violation& first = *result.first_violation;
  if (first.kind == "overlap")
    return text + fmt::format("{}{} from then on ({})", text.empty() ? "" : ": ", first.what, first.phase);
  return text + fmt::format("{}first {} at t = {} s ({})", text.empty() ? "" : ", where bodies overlap; ", first.what,
                            short_number(first.time), first.phase);
}

// The first violation, and contacts that the plan does not include.
std::string infeasible_reason(const CaptureResult& result) {
  const auto unplanned = std::ranges::find(result.ledger.entries, kUnplannedContact, &LedgerEntry::name);
  const bool failed = unplanned != result.ledger.entries.end() && !unplanned->pass();
  const std::string contact = failed ? unplanned_words(result) : "";
  const std::string violation = result.first_violation ? violation_words(result) : "";
  return violation + (violation.empty() || contact.empty() ? "" : "; ") + contact;
}

// What the verdict rests on.
std::string feasibility_reason(const CaptureResult& result) {
  const Verdict verdict = result.ledger.feasibility();
  if (verdict == Verdict::no) return infeasible_reason(result);
  std::string unplanned = unplanned_words(result);
  if (!unplanned.empty())
    unplanned = "; " + unplanned + (result.captured() ? "; the targets are captured all the same" : "");
  if (verdict == Verdict::yes) return satisfied_words(result) + unplanned;
  const std::vector<std::string> texts = not_checked_texts(result.ledger);
  return (texts.empty() ? "there is nothing to check" : fmt::format("{}", fmt::join(texts, "; "))) + unplanned;
}

// "; left lost at t = 31.2 s, closed again at t = 40 s", for each end-effector that lost its target.
std::string loss_words(const CaptureResult& result) {
  std::string text;
  for (const GraspOutcome& g : result.grasps) {
    std::string times;
    for (const LossReport& loss : result.losses) {
      if (loss.end_effector == g.end_effector)
        times += fmt::format("{}t = {} s", times.empty() ? "" : " and ", short_number(loss.time));
    }
    if (times.empty()) continue;
    text += fmt::format("; {} lost at {}", g.end_effector, times);
    if (g.captured) text += fmt::format(", closed again at t = {} s", short_number(g.time));
  }
  return text;
}

// "; left slipped at t = 2.5 s by 12 mm and 0.1 rad, holds since t = 3.1 s", for each end-effector that slipped.
std::string slip_words(const CaptureResult& result) {
  std::string text;
  for (const GraspOutcome& g : result.grasps) {
    const auto first = std::ranges::find(result.slips, g.end_effector, &SlipReport::end_effector);
    if (first == result.slips.end()) continue;
    const auto last =
        std::ranges::find(result.slips.rbegin(), result.slips.rend(), g.end_effector, &SlipReport::end_effector);
    text += fmt::format("; {} slipped at t = {} s", g.end_effector, short_number(first->time));
    if (g.slipped) text += fmt::format(", by {} and {} rad", length_text(g.slip_distance), short_number(g.slip_angle));
    if (!g.captured || !g.slipped) continue;
    text += g.slips ? ", and slips at the end" : fmt::format(", holds since t = {} s", short_number(last->until));
  }
  return text;
}

// Parts of the verdict on the capture.
struct CaptureWords {
  std::string moved;   // ", by moving debris 106 mm"
  std::string facts;   // "1 of 1 grasps, t = 20 s, gap 106 mm"
  std::string doubts;  // ": no capture envelope is given for left"
};

CaptureWords capture_words(const CaptureResult& result) {
  const bool captured = result.captured();
  std::size_t closed = 0;
  double gap = 0;
  std::vector<std::string> unjudged;
  for (const GraspOutcome& g : result.grasps) {
    closed += g.captured;
    // Of the decisive grasps: all that closed, or those that did not.
    if (g.captured == captured && !(g.distance <= gap)) gap = g.distance;
    if (g.captured && !g.judged) unjudged.push_back(g.end_effector);
  }
  CaptureWords words;
  if (captured) words.moved = moved_words(result);
  words.facts =
      fmt::format("{} of {} grasps, t = {} s, {} {}", closed, result.grasps.size(), short_number(result.capture_time),
                  result.grasps.size() == 1 ? "gap" : "largest gap", length_text(gap));
  if (!unjudged.empty()) words.doubts = fmt::format(": no capture envelope is given for {}", listed(unjudged));
  words.doubts += slip_words(result) + loss_words(result);
  if (is_beyond_validity(result))
    words.doubts +=
        fmt::format("; beyond validity, bodies overlap from t = {} s on", short_number(*result.valid_until));
  return words;
}

}  // namespace

std::string length_text(double metres) {
  return metres >= 1e-6 && metres < 1 ? fmt::format("{:.3g} mm", 1e3 * metres) : fmt::format("{:.3g} m", metres);
}

std::string grasp_name(const std::string& end_effector, const std::string& target, const std::string& grasp_point) {
  if (target.empty()) return end_effector;
  return end_effector + " -> " + target + (grasp_point.empty() ? "" : "/" + grasp_point);
}

std::string capture_sentence(const CaptureResult& result) {
  if (result.grasps.empty()) return "";
  const CaptureWords words = capture_words(result);
  return fmt::format("captured: {}{} ({}){}", result.captured() ? name_of(result.capture_verdict()) : "NO", words.moved,
                     words.facts, words.doubts);
}

std::vector<GradedViolation> violations_of(const CaptureResult& result) {
  std::vector<GradedViolation> all;
  for (const ClearanceEvent& e : result.clearance_events) add_clearance(e, all);
  for (const LimitEvent& e : result.limit_events) add_limit(e, all);
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::pair(a.time, rank_of(a)) < std::pair(b.time, rank_of(b));
  });
  return all;
}

bool is_worse(const GradedViolation& one, const GradedViolation& other) {
  const int a = rank_of(one), b = rank_of(other);
  return a != b ? a < b : severity_of(one) > severity_of(other);
}

std::vector<GradedViolation> worst_by_phase(const std::vector<GradedViolation>& violations) {
  std::vector<GradedViolation> worst;
  for (const GradedViolation& v : violations) {
    const auto known =
        std::find_if(worst.begin(), worst.end(), [&](const GradedViolation& w) { return w.phase == v.phase; });
    if (known == worst.end()) {
      worst.push_back(v);
    } else if (is_worse(v, *known)) {
      *known = v;
    }
  }
  return worst;
}

std::vector<std::string> not_checked_texts(const Ledger& ledger) {
  std::vector<std::pair<std::string, std::vector<std::string>>> reasons;  // with the rows
  for (const LedgerEntry& e : ledger.entries) {
    if (e.kind != LedgerEntry::Kind::feasibility || e.not_checked.empty()) continue;
    const auto known =
        std::find_if(reasons.begin(), reasons.end(), [&](const auto& r) { return r.first == e.not_checked; });
    if (known == reasons.end()) {
      reasons.push_back({e.not_checked, {row_words(e.name)}});
    } else {
      known->second.push_back(row_words(e.name));
    }
  }
  std::vector<std::string> texts;
  for (const auto& [reason, rows] : reasons) texts.push_back(listed(rows) + ": " + reason);
  return texts;
}

// ---- Actuators and control ----

namespace {

// "wheel a at its largest rate 418.9 rad/s"
std::string saturated_words(const SaturationReport& s) {
  using Actuator = SaturationReport::Actuator;
  const bool is_rate = s.quantity == SaturationReport::Quantity::rate;
  const std::string limit = is_rate ? fmt::format("largest rate {} rad/s", short_number(s.limit))
                                    : fmt::format("largest torque {} N m", short_number(s.limit));
  switch (s.actuator) {
    case Actuator::wheel:
      return (is_rate ? "wheel " : "motor of wheel ") + s.name + " at its " + limit;
    case Actuator::gyro:
      return "gimbal of gyro " + s.name + " at its " + limit;
    case Actuator::gyros:
      return fmt::format("gyros near a singularity (measure below {})", short_number(s.limit));
    case Actuator::thruster:
      return "thruster " + s.name + " on continuously, delivers less than commanded";
    case Actuator::joint:
      return fmt::format("drive of {} at its effort limit {}", s.name, short_number(s.limit));
    case Actuator::base_control:
      break;
  }
  return fmt::format("base control about {} at its limit {} N m", s.name, short_number(s.limit));
}

// A wheel at its largest rate and a thruster that is always on have no reserve; torques that saturate briefly, as slews
// begin, are usual.
bool exceeds_warning_threshold(const SaturationReport& s) {
  constexpr double kShare = 0.01, kShareOfTorques = 0.1, kLongOfTorques = 60;  // [1], [1], [s]
  const bool has_no_reserve =
      s.quantity == SaturationReport::Quantity::rate || s.quantity == SaturationReport::Quantity::duty;
  return s.at_end || (has_no_reserve ? s.share >= kShare : s.share >= kShareOfTorques || s.duration >= kLongOfTorques);
}

std::string more_words(std::size_t more) { return more > 0 ? fmt::format("; {} more, see saturation", more) : ""; }

}  // namespace

std::string saturation_text(const SaturationReport& s) {
  return fmt::format("{} for {} s ({:.3g} % of the motion), first at t = {} s{}", saturated_words(s),
                     short_number(s.duration), 100 * s.share, short_number(s.first_time),
                     s.at_end ? ", and at the end" : "");
}

std::string saturation_sentence(const CaptureResult& result) {
  if (result.saturation.empty()) return "";
  return "saturated: " + saturation_text(result.saturation.front()) + more_words(result.saturation.size() - 1);
}

std::vector<std::string> saturation_warnings(const CaptureResult& result) {
  constexpr std::size_t kMaxTexts = 4;
  std::vector<std::string> texts;
  std::size_t more = 0;
  for (const SaturationReport& s : result.saturation) {
    if (s.actuator == SaturationReport::Actuator::gyros || !exceeds_warning_threshold(s)) continue;
    if (texts.size() < kMaxTexts) {
      texts.push_back("saturated: " + saturation_text(s));
    } else {
      ++more;
    }
  }
  if (more > 0) texts.push_back(fmt::format("saturated: {} more actuators, see saturation in summary.json", more));
  return texts;
}

Stability stability_of(const CaptureResult& result) {
  if (result.stability.empty()) return Stability::not_evaluated;
  return std::ranges::min_element(result.stability, {}, &StabilityReport::verdict)->verdict;
}

std::string instability_text(const StabilityReport& s) {
  const std::string rate = s.of.starts_with("base ") ? "the angular velocity of the base about " + s.of.substr(5)
                                                     : "the rate error of joint " + s.of;
  const std::string since = std::isnan(s.since) ? "" : fmt::format(" since t = {} s", short_number(s.since));
  if (!(s.period > 0))
    return fmt::format(
        "control is unstable in {}: {} grows without oscillation, from {} in the first third to {} in the "
        "last; {}{}",
        s.phase, rate, short_number(s.amplitude_before), short_number(s.amplitude_after), s.reason, since);
  return fmt::format(
      "control is unstable in {}: {} oscillates with a period of {} s, at most {} in the first third and {} in the "
      "last; {}{}{}",
      s.phase, rate, short_number(s.period), short_number(s.amplitude_before), short_number(s.amplitude_after),
      s.reason, since,
      s.saturated_share > 0 ? fmt::format(" ({:.0f} % of the last third)", 100 * s.saturated_share) : "");
}

namespace {

// "phase 53 deg (base/torque/y)": the smallest value of all margins.
class Smallest {
 public:
  void consider(const std::optional<double>& value, double size, const std::string& channel) {
    if (!value || size >= size_) return;
    size_ = size, value_ = *value, channel_ = channel;
  }
  void write(const char* format, double factor, std::vector<std::string>& texts) const {
    if (channel_.empty()) return;
    texts.push_back(fmt::format(fmt::runtime(format), small_number(factor * value_)) + " (" + channel_ + ")");
  }

 private:
  double size_ = std::numeric_limits<double>::infinity(), value_ = 0;
  std::string channel_;
};

}  // namespace

std::string control_loop_text(const ControlLoopReport& report) {
  Smallest above, below, phase, delay;
  for (const LoopMargin& m : report.margins) {
    above.consider(m.gain_maximum, m.gain_maximum.value_or(0), m.channel);
    below.consider(m.gain_minimum, -m.gain_minimum.value_or(0), m.channel);
    phase.consider(m.phase, std::abs(m.phase.value_or(0)), m.channel);
    delay.consider(m.delay, m.delay.value_or(0), m.channel);
  }
  std::vector<std::string> texts;
  above.write("gain at most {} times", 1, texts);
  below.write("gain at least {} times", 1, texts);
  phase.write("phase {} deg", 180 / std::numbers::pi, texts);
  delay.write("delay {} s", 1, texts);
  std::string text = fmt::format("linear model of {} at t = {} s: {}", report.phase, short_number(report.time),
                                 name_of(report.verdict));
  if (report.verdict != LinearStability::stable) text += ", " + report.reason;
  if (!texts.empty())
    text +=
        fmt::format("; smallest margins of {}: {}", counted(report.margins.size(), "channel"), fmt::join(texts, ", "));
  return text;
}

std::string stability_sentence(const CaptureResult& result) {
  if (result.stability.empty()) return "";
  const StabilityReport& worst = *std::ranges::min_element(result.stability, {}, &StabilityReport::verdict);
  if (worst.verdict == Stability::unstable) return "stability: UNSTABLE; " + instability_text(worst);
  const StabilityReport& last = result.stability.back();
  if (last.verdict == Stability::stable)
    return fmt::format("stability: stable in {}, controlled rates decay", last.phase);
  return fmt::format(
      "stability: not evaluated in {}, {}: {} (at most {} in the first third of the phase, {} in the "
      "last)",
      last.phase, last.of, last.reason, short_number(last.amplitude_before), short_number(last.amplitude_after));
}

std::string rest_sentence(const CaptureResult& result) {
  if (!result.rest) return "";
  const RestReport& rest = *result.rest;
  std::string rates = fmt::format("base at {} of {} rad/s", short_number(rest.angular_velocity),
                                  short_number(rest.angular_velocity_limit));
  if (!rest.joint.empty())
    rates += fmt::format(", joint {} at {} of {}", rest.joint, short_number(rest.joint_rate),
                         short_number(rest.joint_rate_limit));
  return rest.at_rest ? fmt::format("at rest: yes, from t = {} s on; at the end {}", short_number(rest.time), rates)
                      : fmt::format("at rest: NO; at the end {}", rates);
}

std::string window_sentence(const WindowReport& window) {
  if (window.points.empty()) return "";
  const std::string times =
      fmt::format("{} times between {} and {} s", window.points.size(), short_number(window.points.front().time),
                  short_number(window.points.back().time));
  std::string text = std::isnan(window.time)
                         ? fmt::format("none of {} is reachable", times)
                         : fmt::format("capture at t = {} s, selected from {}; {} reachable", short_number(window.time),
                                       times, std::ranges::count(window.points, true, &WindowPoint::reachable));
  if (window.not_before)
    text += fmt::format("; by distance alone, none before t = {} s", short_number(*window.not_before));
  return text;
}

std::string ratings_sentence(const CaptureResult& result) {
  std::vector<std::string> rated, exceeded;  // loads with ratings
  const auto note = [](std::vector<std::string>& names, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  for (const PeakLoad& load : result.peak_loads) {
    if (!std::isfinite(load.rating)) continue;
    const std::string name = load.of + " (" + load.quantity + ")";
    note(rated, name);
    if (load.margin() < -1e-9 || std::isnan(load.margin())) note(exceeded, name);
  }
  if (exceeded.empty()) return "";
  constexpr std::size_t kNamed = 4;
  const std::size_t named = std::min(kNamed, exceeded.size());
  std::string text =
      fmt::format("ratings: EXCEEDED, {} of {}: {}", exceeded.size(), rated.size(),
                  fmt::join(exceeded.begin(), exceeded.begin() + static_cast<std::ptrdiff_t>(named), ", "));
  if (named < exceeded.size()) text += fmt::format(" and {} more", exceeded.size() - named);
  return text;
}

std::string ledger_sentence(const Ledger& ledger) {
  std::size_t checked = 0, failing = 0;
  for (const LedgerEntry& e : ledger.entries) {
    if (e.kind == LedgerEntry::Kind::feasibility || !e.applies) continue;
    ++checked;
    failing += !e.pass();
  }
  if (checked == 0) return "ledger: empty";
  if (failing == 0) return "ledger: every conserved quantity is within its bound";
  return fmt::format("ledger: FAILS, {} of {} conserved quantities outside their bounds: the result is not valid",
                     failing, checked);
}

std::string feasibility_sentence(const CaptureResult& result) {
  const std::string reason = feasibility_reason(result);
  const Verdict verdict = result.ledger.feasibility();
  if (verdict == Verdict::yes) return "feasible: yes, " + reason;
  if (verdict == Verdict::not_checked) return "feasible: not checked; " + reason;
  return "feasible: NO" + (reason.empty() ? "" : (result.valid_until ? ", " : ": ") + reason);
}

// ---- Answers ----

namespace {

// A text as a sentence of a page.
std::string as_sentence(std::string text) {
  if (!text.empty() && text.front() >= 'a' && text.front() <= 'z') text.front() = char(text.front() - 'a' + 'A');
  return text.empty() || text.ends_with('.') ? text : text + ".";
}

// Contacts are not meant to hold.
bool is_contact(const CaptureResult& result, const GraspOutcome& grasp) {
  return result.impact() && std::ranges::any_of(result.impact()->grasps, [&](const GraspImpulse& met) {
           return met.end_effector == grasp.end_effector && met.model == "contact";
         });
}

Remark remark_on(const CaptureResult& result, const GraspOutcome& grasp) {
  const Tone tone = grasp.captured              ? grasp.judged ? Tone::good : Tone::warn
                    : is_contact(result, grasp) ? Tone::none
                                                : Tone::bad;
  const std::string released =
      grasp.released ? fmt::format("; release at t = {} s", short_number(*grasp.released)) : "";
  return {tone, grasp_name(grasp.end_effector, grasp.target, grasp.grasp_point), grasp.reason + released};
}

Answer capture_answer(const CaptureResult& result) {
  Answer answer{"Capture", Tone::none, "Nothing to grasp", "This run has no grasps.", {}};
  for (const GraspOutcome& grasp : result.grasps) answer.remarks.push_back(remark_on(result, grasp));
  for (const StagesReport& report : result.stages) {
    const bool failed = report.failure != StagesReport::Failure::none;
    answer.remarks.push_back(
        {failed ? Tone::bad : Tone::good, "stages of " + report.target, as_sentence(stage_text(report))});
  }
  const auto set_answer = [&](Tone tone, const char* word, const std::string& text) {
    answer.tone = tone, answer.word = word, answer.sentence = as_sentence(text);
  };
  if (!result.grasps.empty()) {
    const CaptureWords words = capture_words(result);
    const std::string text = words.facts + words.moved + words.doubts;
    const auto& met = result.impact() ? result.impact()->grasps : std::vector<GraspImpulse>{};
    const bool only_contacts =
        !met.empty() && std::ranges::all_of(met, [](const GraspImpulse& one) { return one.model == "contact"; });
    switch (result.capture_verdict()) {
      case Captured::yes:
        set_answer(is_beyond_validity(result) ? Tone::warn : Tone::good, "Captured", text);
        break;
      case Captured::assumed:
        set_answer(Tone::warn, "Assumed, no envelope", text);
        break;
      case Captured::no:
        only_contacts ? set_answer(Tone::none, "Contact, no grasp", text) : set_answer(Tone::bad, "Not captured", text);
        break;
    }
  }
  if (result.status == CaptureStatus::failed) set_answer(Tone::bad, "Run failed", result.failure);
  if (result.status == CaptureStatus::not_run) set_answer(Tone::warn, "Not run", "the scenario was not simulated");
  return answer;
}

Answer ledger_answer(const Ledger& ledger) {
  Answer answer{"Ledger", Tone::good, "Passes", "", {}};
  const LedgerEntry* closest = nullptr;
  const auto share = [](const LedgerEntry& e) { return e.value / e.bound; };
  bool is_empty = true;
  for (const LedgerEntry& e : ledger.entries) {
    if (e.kind == LedgerEntry::Kind::feasibility || !e.applies) continue;
    is_empty = false;
    if (!e.pass())
      answer.remarks.push_back({Tone::bad, "", failure_text(e) + (e.advice.empty() ? "" : "; " + e.advice)});
    if (e.bound > 0 && (!closest || share(e) > share(*closest))) closest = &e;
  }
  answer.sentence = as_sentence(ledger_sentence(ledger).substr(std::string_view("ledger: ").size()));
  if (is_empty) return {answer.question, Tone::warn, "No ledger", "The result has no conservation checks.", {}};
  if (!answer.remarks.empty()) {
    answer.tone = Tone::bad, answer.word = "Fails";
  } else if (closest) {
    const std::string unit = closest->unit == "1" ? "" : " " + closest->unit;
    answer.remarks.push_back(
        {Tone::none, "closest to its bound",
         fmt::format("{}, {:.3g} of {:.3g}{}", closest->name, closest->value, closest->bound, unit)});
  }
  return answer;
}

Answer feasibility_answer(const CaptureResult& result) {
  const std::string reason = as_sentence(feasibility_reason(result));
  const Verdict verdict = result.ledger.feasibility();
  if (verdict == Verdict::yes) return {"Feasibility", Tone::good, "Feasible", reason, {}};
  if (verdict == Verdict::no) return {"Feasibility", Tone::bad, "Not feasible", reason, violation_remarks(result)};
  const bool any = std::ranges::any_of(result.ledger.entries, [](const LedgerEntry& e) {
    return e.kind == LedgerEntry::Kind::feasibility && e.applies;
  });
  return {"Feasibility", any ? Tone::warn : Tone::none, "Not checked", reason, {}};
}

// The worst finding on loads and control gives the answer; the others follow.
Answer control_answer(const CaptureResult& result) {
  struct Finding {
    Tone tone;
    const char* word;
    std::string text;
  };
  std::vector<Finding> findings;
  const auto add = [&](Tone tone, const char* word, const std::string& text) {
    if (!text.empty()) findings.push_back({tone, word, as_sentence(text)});
  };
  for (const StabilityReport& report : result.stability) {
    if (report.verdict == Stability::unstable) add(Tone::bad, "Unstable", instability_text(report));
  }
  for (const ControlLoopReport& report : result.control_loops) {
    if (report.verdict == LinearStability::unstable) add(Tone::bad, "Unstable", control_loop_text(report));
  }
  const bool stable = findings.empty();
  const std::string ratings = ratings_sentence(result);
  add(Tone::bad, "Ratings exceeded", ratings);
  const std::string contacts = contact_sentence(result);
  const bool too_deep = std::ranges::any_of(result.contacts, &ContactPairReport::beyond_model);
  if (too_deep) add(Tone::warn, "Contact too deep", contacts);
  add(Tone::warn, "Saturated", saturation_sentence(result));
  const bool unclear = !result.stability.empty() && result.stability.back().verdict != Stability::stable;
  if (stable && !unclear) add(Tone::good, "Stable", stability_sentence(result));
  const bool rated = std::ranges::any_of(result.peak_loads, [](const PeakLoad& l) { return std::isfinite(l.rating); });
  if (rated && ratings.empty()) add(unclear ? Tone::none : Tone::good, "Ratings kept", "ratings: none is exceeded");
  if (stable && unclear) add(Tone::none, "Not evaluated", stability_sentence(result));
  // A failed run states only that it did not get there, whatever the scenario has.
  const bool complete = result.status == CaptureStatus::completed;
  if (findings.empty())
    add(Tone::none, "Not evaluated",
        complete ? "no ratings and no feedback control" : "the run ended before loads and control were evaluated");
  if (!too_deep) add(Tone::none, "Contacts", contacts);
  Answer answer{"Loads and control", findings.front().tone, findings.front().word, findings.front().text, {}};
  for (std::size_t i = 1; i < findings.size(); ++i) answer.remarks.push_back({findings[i].tone, "", findings[i].text});
  return answer;
}

}  // namespace

std::vector<Remark> violation_remarks(const CaptureResult& result) {
  std::vector<Remark> remarks;
  const std::vector<GradedViolation> all = violations_of(result);
  for (const GradedViolation& v : worst_by_phase(all)) {
    std::set<std::string> whats;
    for (const GradedViolation& other : all) {
      if (other.phase == v.phase && other.what != v.what) whats.insert(other.what);
    }
    std::string text = fmt::format("{} at t = {} s", v.worst, short_number(v.worst_time));
    if (!whats.empty()) text += fmt::format("; {} more, see summary.json", whats.size());
    remarks.push_back({Tone::bad, "worst in " + v.phase, text});
  }
  for (const std::string& text : not_checked_texts(result.ledger)) remarks.push_back({Tone::warn, "not checked", text});
  return remarks;
}

std::vector<Answer> answers_of(const CaptureResult& result) {
  std::vector<Answer> answers{capture_answer(result), ledger_answer(result.ledger), feasibility_answer(result),
                              control_answer(result)};
  if (result.rest) {
    const bool at_rest = result.rest->at_rest;
    answers.push_back({"Goal",
                       at_rest ? Tone::good : Tone::bad,
                       at_rest ? "At rest" : "Not at rest",
                       as_sentence(rest_sentence(result)),
                       {}});
  }
  return answers;
}

}  // namespace grapnel
