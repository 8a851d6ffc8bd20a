#pragma once

/// @file
/// What a result says first, in words: whether it is a capture, and whether a robot could do it. The same sentences
/// stand on the terminal, in summary.json and in reports.

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

/// "106 mm", "38.2 m".
std::string length_text(double metres);

/// The first sentence of a verdict: "captured: assumed, by moving debris 106 mm (1 of 1 grasps, t = 20 s, gap 106 mm):
/// no envelope says what left can close on". Empty without grasps.
std::string capture_sentence(const CaptureResult& result);

/// Something that a real robot could not have done, with how far it went. `what` and `time` are those of its beginning.
struct GradedViolation : Violation {
  double value = 0;       // worst: depth of an overlap [m], distance that is too small [m], value of the joint
  double limit = 0;       // that is passed: 0 of an overlap
  double worst_time = 0;  // [s]
  std::string worst;      // in words: "base and debris overlap by 0.05 m"
};
/// All of them in the order of time. A pair of bodies that comes too near and then overlaps is there twice.
std::vector<GradedViolation> violations_of(const CaptureResult& result);
/// Whether the first is the worse one: overlaps by their depth, then distances by what they lack, then limits by their
/// relative excess.
bool is_worse(const GradedViolation& one, const GradedViolation& other);
/// The worst of each phase, in the order of phases.
std::vector<GradedViolation> worst_by_phase(const std::vector<GradedViolation>& violations);

/// What of feasibility nobody looked at: "clearance: switched off". Of several rows with one reason, one text.
std::vector<std::string> not_checked_texts(const Ledger& ledger);

/// "saturated: wheel a at its largest rate 418.9 rad/s for 52 s (44 % of the motion), first at t = 10 s, and at the
/// end; 3 more". The longest saturation; empty: none.
std::string saturation_sentence(const CaptureResult& result);
/// Of every saturation that is there at the end, or lasts a hundredth of the motion (of torques and efforts a tenth, or
/// a minute), one text each, the longest first; of more than four, how many more. Singularities of gyros have a warning
/// of their own.
std::vector<std::string> saturation_warnings(const CaptureResult& result);
/// "wheel a at its largest rate 418.9 rad/s for 52 s (44 % of the motion), first at t = 10 s, and at the end"
std::string saturation_text(const SaturationReport& report);

/// "stability: UNSTABLE in post_impact, base x: ...", else of the last phase with feedback; empty: there is none.
std::string stability_sentence(const CaptureResult& result);
/// "control is unstable in post_impact: base x oscillates with a period of 0.4 s, ..."
std::string instability_text(const StabilityReport& report);
/// The worst of all phases; not_evaluated: of none.
Stability stability_of(const CaptureResult& result);

/// "at rest: yes, from t = 31 s on (...)", "at rest: NO, ..." with the rates at the end; empty where it is not asked
/// for.
std::string rest_sentence(const CaptureResult& result);

/// "ratings: EXCEEDED, 2 of 14; worst ..." Empty: nothing is rated or nothing is exceeded.
std::string ratings_sentence(const CaptureResult& result);

/// "feasible: yes, clearance and joint limits are kept"; "feasible: NO, valid until 35.46 s: base and debris overlap
/// from then on (post_impact)"; "feasible: not checked; clearance: switched off". Without a line break.
std::string feasibility_sentence(const CaptureResult& result);

}  // namespace grapnel
