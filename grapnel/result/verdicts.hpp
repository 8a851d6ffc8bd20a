#pragma once

/// @file
/// The verdicts of a result as sentences: whether the capture succeeded, and whether a real robot could perform it. The
/// terminal, summary.json and reports show the same sentences.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

template <>
const Type& type_of<Captured>();
template <>
const Type& type_of<LimitKind>();

/// good, bad; warn: neither; none: nothing was evaluated.
enum class Tone { good, bad, warn, none };

/// A line below an answer: "left -> debris/handle: outside the envelope".
struct Remark {
  Tone tone = Tone::none;
  std::string of;  // may be empty
  std::string text;
};

/// The answer of a result to one question.
struct Answer {
  std::string question;  // "Feasibility"
  Tone tone = Tone::none;
  std::string word;      // "Not feasible"
  std::string sentence;  // the reason
  std::vector<Remark> remarks;
};
template <>
const Type& type_of<Answer>();

/// Whether the targets were captured, momentum and energy conserved, the motion feasible, loads and control in order,
/// and, if the scenario states the rates of rest, whether the goal of rest was reached.
std::vector<Answer> answers_of(const CaptureResult& result);

/// "106 mm", "38.2 m".
std::string length_text(double metres);

/// "left -> debris/handle"
std::string grasp_name(const std::string& end_effector, const std::string& target, const std::string& grasp_point);

/// The first sentence of a verdict: "captured: assumed, by moving debris 106 mm (1 of 1 grasps, t = 20 s, gap 106 mm):
/// no capture envelope is given for left". Empty without grasps.
std::string capture_sentence(const CaptureResult& result);

/// A violation that makes the motion infeasible for a real robot, with its size. `what` and `time` describe its start.
struct GradedViolation : Violation {
  double value = 0;       // worst: depth of an overlap [m], distance that is too small [m], value of the joint
  double limit = 0;       // the violated limit: 0 for an overlap
  double worst_time = 0;  // [s]
  std::string worst;      // as a sentence: "base and debris overlap by 0.05 m"
};
/// All violations in the order of time. A pair of bodies that comes too close and then overlaps has two entries.
std::vector<GradedViolation> violations_of(const CaptureResult& result);
/// Whether `one` is worse than `other`: overlaps by depth, then distances by the missing distance, then limits by
/// relative excess.
bool is_worse(const GradedViolation& one, const GradedViolation& other);
/// The worst violation of each phase, in the order of phases.
std::vector<GradedViolation> worst_by_phase(const std::vector<GradedViolation>& violations);

/// The worst violation of each phase with the number of further ones, and the checks that were not evaluated.
std::vector<Remark> violation_remarks(const CaptureResult& result);

/// Feasibility checks that were not evaluated: "clearance: switched off". Rows with the same reason share a sentence.
std::vector<std::string> not_checked_texts(const Ledger& ledger);

/// "saturated: wheel a at its largest rate 418.9 rad/s for 52 s (44 % of the motion), first at t = 10 s, and at the
/// end; 3 more". The longest saturation; empty: none.
std::string saturation_sentence(const CaptureResult& result);
/// One sentence for each saturation that exists at the end or lasts a hundredth of the motion (torques and efforts: a
/// tenth, or a minute), the longest first; beyond four texts, the number of the others. Singularities of gyros have a
/// separate warning.
std::vector<std::string> saturation_warnings(const CaptureResult& result);
/// "wheel a at its largest rate 418.9 rad/s for 52 s (44 % of the motion), first at t = 10 s, and at the end"
std::string saturation_text(const SaturationReport& report);

/// "stability: UNSTABLE in post_impact, base x: ...", else the verdict of the last phase with feedback; empty: no such
/// phase.
std::string stability_sentence(const CaptureResult& result);
/// "control is unstable in post_impact: base x oscillates with a period of 0.4 s, ..."
std::string instability_text(const StabilityReport& report);
/// The worst verdict of all phases; not_evaluated without phases.
Stability stability_of(const CaptureResult& result);
/// "linear model of post_impact at t = 60 s: stable; smallest margins of 9 channels: gain at most 1.78 times
/// (joints/effort/wrist-yaw), phase 53 deg (base/torque/y), delay 0.0979 s (joints/effort/wrist-yaw)"
std::string control_loop_text(const ControlLoopReport& report);

/// "at rest: yes, from t = 31 s on (...)", "at rest: NO, ..." with the rates at the end; empty if it is not requested.
std::string rest_sentence(const CaptureResult& result);

/// "capture at t = 90 s, selected from 7 times between 30 and 150 s; 4 reachable". Empty without evaluated times.
std::string window_sentence(const WindowReport& window);

/// "ratings: EXCEEDED, 2 of 14; worst ..." Empty: nothing is rated or nothing is exceeded.
std::string ratings_sentence(const CaptureResult& result);

/// "contacts: 2 of 5 pairs touched; largest force 12.3 N between base and debris at t = 3 s". Empty: no pair may touch.
std::string contact_sentence(const CaptureResult& result);
/// "contact too deep for the model: palm and debris from t = 2.5 s on (...)". Empty: no overlap was too deep.
std::string contact_warning(const CaptureResult& result);
/// "stages: cubesat latched at t = 5.62 s", or "stages: stage reached contact, then pushed away at t = 8 s". Empty:
/// none are stated.
std::string stage_sentence(const CaptureResult& result);

/// "ledger: every conserved quantity is within its bound".
std::string ledger_sentence(const Ledger& ledger);

/// "feasible: yes, clearance and joint limits are kept"; "feasible: NO, valid until 35.46 s: base and debris overlap
/// from then on (post_impact)"; "feasible: not checked; clearance: switched off". Without a line break.
std::string feasibility_sentence(const CaptureResult& result);

}  // namespace grapnel
