// The fields of summary.json that say whether a run can be trusted and flown: clearance, limits, feasibility, the
// ledger, costs, the orbit; and the document that all fields make.
#include <algorithm>
#include <array>
#include <cmath>

#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {

// ---- Clearance and limits ----

namespace {

using Bodies = std::array<std::string, 2>;

struct Clearances {
  const CaptureResult* result = nullptr;
};
struct Limits {
  const CaptureResult* result = nullptr;
};

}  // namespace

template <>
const Type& type_of<MinimumClearance>() {
  using C = MinimumClearance;
  static constexpr Field fields[] = {
      field<&C::phase>("phase", "in which bodies with shapes were watched"),
      field<&C::distance>("distance", "m", "negative: a depth of overlap; null: no pair was watched").or_null(),
      derived<[](const C& c) {
        return Bodies{c.body_a, c.body_b};
      }>("bodies", "", "that come nearest"),
      derived<[](const C& c) {
        return std::array{c.point_a, c.point_b};
      }>("points", "m", "of them that are nearest, in W"),
      field<&C::time>("time", "s", "when that is"),
  };
  static constexpr Type type = structure<C>(
      "MinimumClearance", "the minimum distance of any two bodies that are watched, in one phase.", fields);
  return type;
}

template <>
const Type& type_of<ClearanceEvent>() {
  using E = ClearanceEvent;
  static constexpr Field fields[] = {
      field<&E::phase>("phase", "of this time"),
      derived<[](const E& e) {
        return Bodies{e.least.body_a, e.least.body_b};
      }>("bodies", "", "that were too near"),
      field<&E::begin_time>("begin", "s", "of this time; if it was under way when its phase began, that instant"),
      field<&E::end_time>("end", "s", "likewise"),
      field<&E::required>("required", "m", "the distance that was asked for"),
      derived<[](const E& e) { return e.least.distance; }>("minimum_distance", "m", "negative: a depth of overlap"),
      derived<[](const E& e) { return e.least.time; }>("minimum_time", "s", "when that was"),
      field<&E::overlap_begin>("overlap_begin", "s",
                               "when the two begin to overlap, which may be later than `begin`; absent: they do not"),
  };
  static constexpr Type type =
      structure<E>("ClearanceEvent", "a time during which two bodies were nearer to each other than required.", fields);
  return type;
}

template <>
const Type& type_of<Clearances>() {
  using C = Clearances;
  static constexpr Field fields[] = {
      derived<[](const C& c) {
        std::vector<Bodies> pairs;
        for (const auto& [a, b] : c.result->clearance_unwatched) pairs.push_back({a, b});
        return pairs;
      }>("unwatched", "",
         "pairs of bodies that were not checked: the link that grasps and its target until the grasp closes or is "
         "missed, and while it holds (an end-effector that passes *through* its own target before is not reported), "
         "and pairs ignored by the scenario. From a miss, a rebound or a release on the pair is checked: until it has "
         "come to the required clearance, an overlap counts only where it is deeper than when the grasp opened. "
         "Neighbours along the tree are not checked"),
      derived < [](const C& c) -> auto& {return *std::min_element(
                                   c.result->clearance.begin(), c.result->clearance.end(),
                                   [](const auto& a, const auto& b) { return a.distance < b.distance; });
}
> ("minimum", "", "of all phases"), derived < [](const C& c) -> auto& { return c.result->clearance; }
> ("phases", "", "per phase"), derived < [](const C& c) -> auto& { return c.result->clearance_events; }
> ("events", "", "bodies too near"),
};  // namespace grapnel
static constexpr Type type = structure<C>("Clearances", "distances between bodies with shapes.", fields);
return type;
}

template <>
const Type& type_of<LimitKind>() {
  static constexpr Choice choices[] = {
      choice(LimitKind::position, "position"), choice(LimitKind::rate, "rate"), choice(LimitKind::effort, "effort"),
      choice(LimitKind::effort_saturated, "effort_saturated", "a motor ran at its limit, no violation.")};
  static constexpr Type type = enumeration<LimitKind>("LimitKind", choices);
  return type;
}

template <>
const Type& type_of<LimitEvent>() {
  using E = LimitEvent;
  static constexpr Field fields[] = {
      field<&E::kind>("kind", "which limit."),
      field<&E::joint>("joint", "or `base control x`, `y`, `z`"),
      field<&E::phase>("phase", "of this time"),
      field<&E::begin_time>("begin", "s", "of this time"),
      field<&E::end_time>("end", "s", "likewise"),
      field<&E::limit>("limit", "as the joint's",
                       "with its sign: a rate of -0.3 against a limit of 0.2 has the limit -0.2"),
      field<&E::worst_value>("worst_value", "as the joint's", "rad or m, rad/s or m/s, N m or N"),
      field<&E::worst_time>("worst_time", "s", "when that was"),
  };
  static constexpr Type type = structure<E>("LimitEvent",
                                            "a time during which a joint was beyond one of its limits, or a motor at "
                                            "it. Efforts are looked at in every step of "
                                            "the integrator, as loads are.",
                                            fields);
  return type;
}

template <>
const Type& type_of<Limits>() {
  static constexpr Field fields[] = {derived < [](const Limits& l) -> auto& {return l.result->limit_events;
}
> ("events", "", "in the order of time")
}
;
static constexpr Type type = structure<Limits>("Limits", "limits of joints, drives and base control.", fields);
return type;
}

// ---- Feasibility ----

namespace {

struct Feasibility {
  Verdict verdict = Verdict::not_checked;
  std::string sentence;
  std::optional<Violation> first;
  std::optional<GradedViolation> worst;
  std::vector<GradedViolation> by_phase;
  std::vector<std::string> not_checked;
  std::optional<double> valid_until;
};

Feasibility feasibility_of(const CaptureResult& result) {
  Feasibility f;
  f.verdict = result.ledger.feasibility();
  f.sentence = feasibility_sentence(result);
  f.first = result.first_violation;
  f.by_phase = worst_by_phase(violations_of(result));
  if (!f.by_phase.empty()) f.worst = *std::min_element(f.by_phase.begin(), f.by_phase.end(), is_worse);
  f.not_checked = not_checked_texts(result.ledger);
  f.valid_until = result.valid_until;
  return f;
}

}  // namespace

template <>
const Type& type_of<Verdict>() {
  static constexpr Choice choices[] = {choice(Verdict::yes, "yes"), choice(Verdict::no, "no"),
                                       choice(Verdict::not_checked, "not checked")};
  static constexpr Type type = enumeration<Verdict>("Verdict", choices);
  return type;
}

template <>
const Type& type_of<Violation>() {
  static constexpr Field fields[] = {
      field<&Violation::kind>("kind",
                              "`overlap`; `clearance`: nearer than required; `position`, `rate`, `effort` of a joint"),
      field<&Violation::what>("what", "in words: which bodies, which joint"),
      field<&Violation::phase>("phase", "in which it begins"),
      field<&Violation::time>("time", "s", "when it begins"),
  };
  static constexpr Type type =
      structure<Violation>("Violation", "something that a real robot could not have done.", fields);
  return type;
}

template <>
const Type& type_of<GradedViolation>() {
  using V = GradedViolation;
  static constexpr Field fields[] = {
      field<&V::kind>("kind", "as in `Violation`"),
      field<&V::worst>("what", "in words, with how far it went"),
      field<&V::phase>("phase", "in which it is"),
      field<&V::worst_time>("time", "s", "of the worst instant"),
      field<&V::value>("value", "m, or as the joint's", "depth of the overlap, the distance, the joint's value"),
  };
  static constexpr Type type = structure<V>("GradedViolation",
                                            "a violation at its worst. Overlaps count more than distances, these more "
                                            "than limits; then depth, lacking distance, "
                                            "relative excess.",
                                            fields);
  return type;
}

template <>
const Type& type_of<Feasibility>() {
  using F = Feasibility;
  static constexpr Field fields[] = {
      field<&F::verdict>(
          "verdict",
          "`not checked`: clearance is switched off, bodies lack shapes, nothing moves, or the run failed "
          "before its end, and what was looked at was kept. A violation that was found is a `no` whatever "
          "else was not looked at. Joints without limits have nothing to check"),
      field<&F::sentence>("sentence", "as on the terminal"),
      field<&F::first>("first", "the first violation in time; absent if there is none"),
      field<&F::worst>("worst", "the worst of all; absent if there is none"),
      field<&F::by_phase>("by_phase", "the worst of each phase; absent if there is none")
          .when<[](const F& f) { return !f.by_phase.empty(); }>(),
      field<&F::not_checked>("not_checked", "what nobody looked at, and why"),
      field<&F::valid_until>("valid_until", "s",
                             "when bodies begin to overlap: from then on the motion is beyond what the model can say. "
                             "Absent: they do not, as far as that was checked"),
  };
  static constexpr Type type = structure<F>(
      "Feasibility", "whether a robot could do this. The motion feels none of it: bodies pass through each other.",
      fields);
  return type;
}

// ---- The ledger ----

template <>
const Type& type_of<LedgerEntry::Kind>() {
  using Kind = LedgerEntry::Kind;
  static constexpr Choice choices[] = {
      choice(Kind::conservation, "conservation", "a failure means that the computation cannot be trusted."),
      choice(Kind::feasibility, "feasibility", "that the robot could not do this.")};
  static constexpr Type type = enumeration<Kind>("LedgerKind", choices);
  return type;
}

template <>
const Type& type_of<LedgerEntry>() {
  using E = LedgerEntry;
  static constexpr Field fields[] = {
      field<&E::value>("value", "see `unit`", "the largest deviation found; null: not a number").or_null(),
      field<&E::bound>("bound", "see `unit`", "what it must not exceed"),
      derived<[](const E& e) {
        const bool unseen = !e.not_checked.empty() && e.pass();
        return unseen ? std::nullopt : std::optional(e.pass());
      }>("pass", "", "`value` <= `bound`, or nothing to check; null where nobody looked")
          .or_null(),
      field<&E::unit>("unit", "`1`: relative to the scale that `note` names"),
      field<&E::note>("note",
                      "what is compared, over which phases; of momentum and energy also the group of bodies that is "
                      "worst, and its scale"),
      field<&E::applies>("applies", "false: there is nothing to check in this run; `value` is then 0"),
      field<&E::kind>("kind", "what a failure means."),
      field<&E::not_checked>("not_checked",
                             "why nobody looked, or not at all of it, although there is something to look at")
          .when<[](const E& e) { return !e.not_checked.empty(); }>(),
      field<&E::advice>("advice", "of a row of conservation that fails: what mends it, or why nothing does")
          .when<[](const E& e) { return !e.advice.empty(); }>(),
  };
  static constexpr Type type =
      structure<E>("LedgerEntry", "a quantity that is conserved or balanced, or a demand on the robot.", fields);
  return type;
}

template <>
const Type& type_of<LedgerScale>() {
  using S = LedgerScale;
  static constexpr Field fields[] = {
      field<&S::linear_momentum>("linear_momentum", "N s", "largest over time of the sum of all |m v|"),
      field<&S::angular_momentum>("angular_momentum", "N m s",
                                  "of all (|I w| + |r x m v|), r from the system's centre of mass"),
      field<&S::energy>("energy", "J", "largest kinetic energy"),
  };
  static constexpr Type type = structure<S>("LedgerScale",
                                            "the sizes of the whole system's momenta and energy. Rows are judged per "
                                            "group of bodies that touch, relative to the "
                                            "group's own.",
                                            fields);
  return type;
}

template <>
const Type& type_of<Ledger>() {
  static constexpr Field fields[] = {
      field<&Ledger::entries>("NAME", "each of the checks, under its name").keyed_by<&LedgerEntry::name>(),
      field<&Ledger::scale>("scale", "of the whole system"),
      derived<[](const Ledger& l) { return l.pass(); }>("pass", "",
                                                        "whether all rows of conservation pass. Where they do not, "
                                                        "this run is no result, although everything computed "
                                                        "is kept, and `grapnel run` ends with exit code 1"),
      derived<[](const Ledger& l) { return l.feasibility(); }>("feasible", "", "the verdict of `Feasibility`"),
  };
  static constexpr Type type = structure<Ledger>("Ledger", "the proof: every check with its bound.", fields);
  return type;
}

template <>
const Type& type_of<PhaseCost>() {
  using C = PhaseCost;
  static constexpr Field fields[] = {
      field<&C::phase>("phase", "that was integrated"),
      field<&C::rhs_evaluations>("rhs_evaluations", "1", "of the equations of motion"),
      field<&C::steps>("steps", "1", "that were taken"),
      field<&C::rejected>("rejected", "1", "steps that were repeated with a smaller size"),
  };
  static constexpr Type type = structure<C>("PhaseCost", "what an integration cost.", fields);
  return type;
}

template <>
const Type& type_of<OrbitReport>() {
  using O = OrbitReport;
  static constexpr Field fields[] = {
      field<&O::body>("body", "the central one; `own` with a gravitational parameter of the scenario's"),
      field<&O::radius>("radius", "m", "from its centre to the reference point, W's origin, at t = 0"),
      field<&O::rate>("rate", "rad/s", "at which radial and along-track turn in W, at t = 0"),
      field<&O::period>("period", "s", "of the orbit"),
  };
  static constexpr Type type = structure<O>("OrbitReport", "the orbit with which W falls.", fields);
  return type;
}

template <>
const Type& type_of<ElasticModeReport>() {
  using E = ElasticModeReport;
  static constexpr Field fields[] = {
      field<&E::held>("held", "Hz", "frequency with the base held and the joints braked; null: there are no more modes")
          .or_null(),
      field<&E::braked>("braked", "Hz", "with the base free and the joints braked").or_null(),
      field<&E::free>("free", "Hz", "with base and joints free").or_null(),
      field<&E::damping_ratio>("damping_ratio", "1", "of `held`"),
      field<&E::effective_mass>("effective_mass", "kg",
                                "of `held`, in the directions of the base's axes; zero for a base that is fixed"),
      field<&E::effective_inertia>("effective_inertia", "kg m^2", "of `held`, about the base's axes; likewise"),
  };
  static constexpr Type type =
      structure<E>("ElasticMode", "a mode of vibration, by its place from the slowest on.", fields);
  return type;
}

template <>
const Type& type_of<ElasticReport>() {
  using E = ElasticReport;
  static constexpr Field fields[] = {
      field<&E::at>("at", "`start`, or `captured`: with the targets that grasps hold"),
      field<&E::time>("time", "s", "when the posture was this"),
      field<&E::springs>("springs", "1", "that stand for what bends"),
      field<&E::fastest>("fastest", "Hz", "frequency of the fastest mode, base and joints free: it limits the steps"),
      field<&E::modes>("modes", "the slowest, up to 20"),
  };
  static constexpr Type type =
      structure<E>("Elastic", "small vibrations about the posture at an instant; loops count nothing.", fields);
  return type;
}

// ---- The document ----

namespace {

enum class SummaryFormat { second };

struct ScenarioNamed {
  const CaptureResult* result = nullptr;
};
struct Approach {
  const CaptureResult* result = nullptr;
};
struct Capture {
  const CaptureResult* result = nullptr;
};
struct PostImpact {
  const CaptureResult* result = nullptr;
};

bool has_approach(const CaptureResult& r) { return r.approach_start || r.approach_end || r.plan; }
bool has_phases(const CaptureResult& r) {
  return r.post_impact_end || !r.phases.empty() || !r.loops.empty() || !r.grasp_loads.empty();
}

}  // namespace

template <>
const Type& type_of<SummaryFormat>() {
  static constexpr Choice choices[] = {choice(SummaryFormat::second, "grapnel-summary/2")};
  static constexpr Type type = enumeration<SummaryFormat>("SummaryFormat", choices);
  return type;
}

template <>
const Type& type_of<CaptureStatus>() {
  static constexpr Choice choices[] = {choice(CaptureStatus::not_run, "not_run"),
                                       choice(CaptureStatus::completed, "completed"),
                                       choice(CaptureStatus::failed, "failed")};
  static constexpr Type type = enumeration<CaptureStatus>("CaptureStatus", choices);
  return type;
}

template <>
const Type& type_of<ScenarioNamed>() {
  using S = ScenarioNamed;
  static constexpr Field fields[] = {derived < [](const S& s) -> auto& {return s.result->scenario_name;
}
> ("name", "", "the scenario's name"), derived < [](const S& s) -> auto& { return s.result->scenario_sha256; }
> ("sha256", "", "of the bytes of the scenario, all files it includes, and overrides"),
}
;
static constexpr Type type = structure<S>("ScenarioNamed", "what was simulated.", fields);
return type;
}

template <>
const Type& type_of<Approach>() {
  using A = Approach;
  static constexpr Field fields[] = {derived < [](const A& a) -> auto& {return a.result->approach_start;
}
> ("start", "", "at the phase's first instant"), derived < [](const A& a) -> auto& { return a.result->approach_end; }
> ("end", "", "at its last instant"), derived < [](const A& a) -> auto& { return a.result->plan->final_rates; }
> ("planned_final_rates", "rad/s or m/s",
   "joint rates the approach aimed at, in the order of `joints.names`; absent without a plan")
        .when<[](const A& a) { return a.result->plan.has_value(); }>(),
    derived < [](const A& a) -> auto& {
  return a.result->plan;
}
> ("plan", "", "of the joints' motion"), derived < [](const A& a) -> auto& { return a.result->navigation; }
> ("navigation", "", "plans and the estimates they rest on; absent where targets are known and planned for once")
        .when<[](const A& a) { return !a.result->navigation.empty(); }>(),
    derived < [](const A& a) -> auto& {
  return a.result->approach_impedance;
}
> ("impedance", "", "absent without it"),
}
;
static constexpr Type type = structure<A>("Approach", "the motion up to the capture.", fields);
return type;
}

template <>
const Type& type_of<Capture>() {
  using C = Capture;
  static constexpr Field fields[] = {
      derived<[](const C& c) { return c.result->capture_verdict(); }>(
          "captured", "", "of all grasps; `assumed`, if that is so of at least one and all closed."),
      derived<[](const C& c) { return capture_sentence(*c.result); }>(
          "verdict", "", "the sentence on the terminal, with the gap and by how much targets were moved"),
      derived<[](const C& c) { return c.result->capture_time; }>("time", "s",
                                                                 "when those were to close that close together"),
      derived < [](const C& c) -> auto& {return c.result->grasps;
}
> ("grasps", "", "per grasp of the scenario"),
}
;
static constexpr Type type = structure<C>("Capture", "whether the grasps closed.", fields);
return type;
}

template <>
const Type& type_of<PostImpact>() {
  using P = PostImpact;
  static constexpr Field fields[] = {derived < [](const P& p) -> auto& {return p.result->post_impact_end;
}
> ("end", "", "at the end of the motion"), derived < [](const P& p) -> auto& { return p.result->phases; }
> ("phases", "", "that have ended, in the order of time"), derived < [](const P& p) -> auto& { return p.result->loops; }
> ("loops", "", "absent where no loop was closed").when<[](const P& p) { return !p.result->loops.empty(); }>(),
    derived < [](const P& p) -> auto& {
  return p.result->grasp_loads;
}
> ("grasp_loads", "", "per phase and grasp; absent where nothing was held")
        .when<[](const P& p) { return !p.result->grasp_loads.empty(); }>(),
    derived < [](const P& p) -> auto& {
  return p.result->detumbling;
}
> ("detumbling", "", "absent without it"), derived < [](const P& p) -> auto& { return p.result->base_keeping; }
> ("base_keeping", "", "absent without it"), derived < [](const P& p) -> auto& { return p.result->identification; }
> ("identification", "", "absent without it"), derived < [](const P& p) -> auto& { return p.result->impedance; }
> ("impedance", "", "absent without it"), derived < [](const P& p) -> auto& { return p.result->grasp_force; }
> ("grasp_force", "", "absent without it"), derived < [](const P& p) -> auto& { return p.result->rest; }
> ("at_rest", "", "absent where the scenario states no rates"),
}
;
static constexpr Type type =
    structure<P>("PostImpact", "the motion after the impact, or of a run without one.", fields);
return type;
}

template <>
const Type& type_of<Summary>() {
  using S = Summary;
  static constexpr Field fields[] = {
      derived<[](const S&) { return SummaryFormat::second; }>("schema", "", "the format of this file"),
      field<&S::version>("version", "of Grapnel"),
      derived<[](const S& s) { return ScenarioNamed{&s.result}; }>("scenario", "", "what was simulated"),
      derived<[](const S& s) { return s.result.status; }>("status", "", "how the run ended"),
      derived < [](const S& s) -> auto& {return s.result.failure;
}
> ("failure", "", "body, time and condition, if it failed; else empty"), derived < [](const S& s) -> auto& {
  return s.result.warnings;
}
> ("warnings", "", "for who reads the result"), derived < [](const S& s) -> auto& { return s.result.orbit; }
> ("orbit", "", "absent without one"), derived < [](const S& s) -> auto& { return s.result.elastic; }
> ("elastic", "", "frequencies; absent where nothing bends")
        .when<[](const S& s) { return !s.result.elastic.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.control;
}
> ("control", "", "absent where control is continuous"), derived < [](const S& s) -> auto& { return s.result.sensors; }
> ("sensors", "", "readings against the truth; absent without sensors")
        .when<[](const S& s) { return !s.result.sensors.empty(); }>(),
    derived<[](const S& s) { return Approach{&s.result}; }>("approach", "", "absent without an approach")
        .when<[](const S& s) { return has_approach(s.result); }>(),
    derived<[](const S& s) { return Capture{&s.result}; }>("capture", "",
                                                           "whether the grasps closed; absent without grasps")
        .when<[](const S& s) { return !s.result.grasps.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.impact;
}
> ("impact", "", "the first; absent without an impact"), derived < [](const S& s) -> auto& {
  return s.result.later_impacts;
}
> ("later_impacts", "", "of grasps that closed later, in the order of time; absent if there are none")
        .when<[](const S& s) { return !s.result.later_impacts.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.releases;
}
> ("releases", "", "grasps that are released, in the order of time; absent if there are none")
        .when<[](const S& s) { return !s.result.releases.empty(); }>(),
    derived<[](const S& s) { return PostImpact{&s.result}; }>("post_impact", "", "absent without such motion")
        .when<[](const S& s) { return has_phases(s.result) && !s.result.without_impact; }>(),
    derived<[](const S& s) { return PostImpact{&s.result}; }>("motion", "",
                                                              "of a scenario in which nothing is captured; else absent")
        .when<[](const S& s) { return has_phases(s.result) && s.result.without_impact; }>(),
    derived < [](const S& s) -> auto& {
  return s.result.peak_loads;
}
> ("loads", "",
   "the largest loads of every phase; absent if "
   "nothing was loaded")
        .when<[](const S& s) { return !s.result.peak_loads.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.wheels;
}
> ("wheels", "", "reaction wheels; absent if there are none")
        .when<[](const S& s) { return !s.result.wheels.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.gyros;
}
> ("gyros", "", "control moment gyros; absent if there are none"), derived < [](const S& s) -> auto& {
  return s.result.joints;
}
> ("joints", "", "per phase, of joints with sticking friction, stops or known motors; absent if there are none")
        .when<[](const S& s) { return !s.result.joints.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.stop_impacts;
}
> ("stop_impacts", "", "joints that met their stops, the first hundred; absent if none did")
        .when<[](const S& s) { return !s.result.stop_impacts.empty(); }>(),
    derived<[](const S& s) { return s.result.stop_impact_count; }>("stop_impact_count", "1", "all of them")
        .when<[](const S& s) { return !s.result.stop_impacts.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.thrusters;
}
> ("thrusters", "", "absent if there are none"), derived < [](const S& s) -> auto& { return s.result.saturation; }
> ("saturation", "", "actuators that were at their limits, the longest first; absent if none was")
        .when<[](const S& s) { return !s.result.saturation.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return s.result.stability;
}
> ("stability", "", "of control loops, per phase of motion; absent where it was not observed")
        .when<[](const S& s) { return !s.result.stability.empty(); }>(),
    derived < [](const S& s) -> auto& {
  return *worst_margin(s.result);
}
> ("worst_margin", "", "the one of `loads` with the least margin over all phases; absent where nothing is rated")
        .when<[](const S& s) { return worst_margin(s.result) != nullptr; }>(),
    derived<[](const S& s) { return Clearances{&s.result}; }>("clearance", "", "absent where no two bodies have shapes")
        .when<[](const S& s) { return !s.result.clearance.empty(); }>(),
    derived<[](const S& s) { return Limits{&s.result}; }>("limits", "", "of joints and drives"),
    derived<[](const S& s) { return feasibility_of(s.result); }>("feasibility", "", "whether a robot could do this"),
    derived < [](const S& s) -> auto& {
  return s.result.ledger;
}
> ("ledger", "", "whether physics was kept"), derived < [](const S& s) -> auto& { return s.result.cost; }
> ("cost", "", "per phase"),
}
;
static constexpr Type type = structure<S>("Summary", "what happened in one capture, in SI units and radians.", fields);
return type;
}

}  // namespace grapnel
