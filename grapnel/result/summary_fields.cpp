// The fields of summary.json about validity and feasibility: clearance, limits, feasibility, the ledger, costs, the
// orbit; and the whole document.
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
      field<&C::phase>("phase", "phase in which bodies with shapes were monitored"),
      field<&C::distance>("distance", "m",
                          "minimum distance; negative: a depth of overlap; null: no pair was monitored")
          .or_null(),
      derived<[](const C& c) {
        return Bodies{c.body_a, c.body_b};
      }>("bodies", "", "closest pair"),
      derived<[](const C& c) {
        return std::array{c.point_a, c.point_b};
      }>("points", "m", "closest points of this pair, in W"),
      field<&C::time>("time", "s", "time of the minimum"),
  };
  static constexpr Type type =
      structure<C>("MinimumClearance", "the minimum distance of any two monitored bodies in one phase.", fields);
  return type;
}

template <>
const Type& type_of<ClearanceEvent>() {
  using E = ClearanceEvent;
  static constexpr Field fields[] = {
      field<&E::phase>("phase", "phase of the interval"),
      derived<[](const E& e) {
        return Bodies{e.minimum.body_a, e.minimum.body_b};
      }>("bodies", "", "pair of bodies"),
      field<&E::begin_time>("begin", "s", "start of the interval, at the earliest the start of its phase"),
      field<&E::end_time>("end", "s", "end of the interval, at the latest the end of its phase"),
      field<&E::required>("required", "m", "required distance"),
      derived<[](const E& e) { return e.minimum.distance; }>(
          "minimum_distance", "m", "minimum distance in the interval; negative: a depth of overlap"),
      derived<[](const E& e) { return e.minimum.time; }>("minimum_time", "s", "time of the minimum"),
      field<&E::overlap_begin>("overlap_begin", "s",
                               "start of the overlap, which may be later than `begin`; absent: no overlap"),
  };
  static constexpr Type type =
      structure<E>("ClearanceEvent", "an interval in which two bodies were closer than required.", fields);
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
         "pairs of bodies that are not checked: pairs that the scenario ignores, and the grasping link with its target "
         "until the grasp closes or is missed, and while it holds (an end-effector that passes *through* its own "
         "target before that is not reported). After a miss, a rebound or a release the pair is checked: until it "
         "reaches the required clearance, an overlap counts only if it is deeper than when the grasp opened. "
         "Neighbouring links are not checked"),
      derived<[](const C& c) {
        return *std::min_element(c.result->clearance.begin(), c.result->clearance.end(),
                                 [](const auto& a, const auto& b) { return a.distance < b.distance; });
      }>("minimum", "", "minimum over all phases"),
      part<&C::result, &CaptureResult::clearance>("phases", "", "minimum of each phase"),
      part<&C::result, &CaptureResult::clearance_events>("events", "", "intervals in which bodies were too close"),
  };
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
      field<&E::kind>("kind", "violated limit."),
      field<&E::joint>("joint", "name of the joint, or `base control x`, `y`, `z`"),
      field<&E::phase>("phase", "phase of the interval"),
      field<&E::begin_time>("begin", "s", "start of the interval"),
      field<&E::end_time>("end", "s", "end of the interval"),
      field<&E::limit>("limit", "as the joint's",
                       "limit with its sign: a rate of -0.3 against a limit of 0.2 has the limit -0.2"),
      field<&E::worst_value>("worst_value", "as the joint's", "largest excess value: rad or m, rad/s or m/s, N m or N"),
      field<&E::worst_time>("worst_time", "s", "time of that value"),
  };
  static constexpr Type type = structure<E>("LimitEvent",
                                            "an interval in which a joint exceeded a limit, or a motor was saturated. "
                                            "Efforts are evaluated in every step of the integrator, as loads are.",
                                            fields);
  return type;
}

template <>
const Type& type_of<Limits>() {
  static constexpr Field fields[] = {
      part<&Limits::result, &CaptureResult::limit_events>("events", "", "intervals, in the order of time")};
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
                              "`overlap`; `clearance`: closer than required; `position`, `rate`, `effort` of a joint"),
      field<&Violation::what>("what", "the bodies or the joint, as a sentence"),
      field<&Violation::phase>("phase", "phase in which it begins"),
      field<&Violation::time>("time", "s", "start of the violation"),
  };
  static constexpr Type type =
      structure<Violation>("Violation", "a violation that makes the motion infeasible for a real robot.", fields);
  return type;
}

template <>
const Type& type_of<GradedViolation>() {
  using V = GradedViolation;
  static constexpr Field fields[] = {
      field<&V::kind>("kind", "as in `Violation`"),
      field<&V::worst>("what", "the violation with its size, as a sentence"),
      field<&V::phase>("phase", "phase of the violation"),
      field<&V::worst_time>("time", "s", "time of the worst instant"),
      field<&V::value>("value", "m, or as the joint's", "depth of the overlap, the distance, or the joint's value"),
  };
  static constexpr Type type =
      structure<V>("GradedViolation",
                   "a violation at its worst instant. Overlaps rank before distances, distances before limits; within "
                   "a rank by depth, missing distance, or relative excess.",
                   fields);
  return type;
}

template <>
const Type& type_of<Feasibility>() {
  using F = Feasibility;
  static constexpr Field fields[] = {
      field<&F::verdict>("verdict",
                         "`not checked`: clearance is switched off, bodies lack shapes, nothing moves, or the run "
                         "failed before its end, and no violation was found. A detected violation gives `no`, even if "
                         "other checks were not evaluated. Joints without limits need no check"),
      field<&F::sentence>("sentence", "the verdict, as printed on the terminal"),
      field<&F::first>("first", "the first violation in time; absent if there is none"),
      field<&F::worst>("worst", "the worst violation; absent if there is none"),
      field<&F::by_phase>("by_phase", "the worst violation of each phase; absent if there is none")
          .when<[](const F& f) { return !f.by_phase.empty(); }>(),
      field<&F::not_checked>("not_checked", "checks that were not evaluated, with the reason"),
      field<&F::valid_until>("valid_until", "s",
                             "start of the first overlap: from then on the model is not valid. Absent: no overlap, as "
                             "far as it was checked"),
  };
  static constexpr Type type = structure<F>("Feasibility",
                                            "whether a real robot could perform this motion. Violations do not affect "
                                            "the simulated motion: bodies pass through each other.",
                                            fields);
  return type;
}

// ---- Verdicts ----

template <>
const Type& type_of<Tone>() {
  static constexpr Choice choices[] = {choice(Tone::good, "good"), choice(Tone::bad, "bad"), choice(Tone::warn, "warn"),
                                       choice(Tone::none, "none", "nothing was evaluated.")};
  static constexpr Type type = enumeration<Tone>("Tone", choices);
  return type;
}

template <>
const Type& type_of<Remark>() {
  static constexpr Field fields[] = {
      field<&Remark::tone>("tone", "kind of the remark."),
      field<&Remark::of>("of", "subject of the remark; may be empty"),
      field<&Remark::text>("text", "the remark"),
  };
  static constexpr Type type = structure<Remark>("Remark", "a line below a verdict.", fields);
  return type;
}

template <>
const Type& type_of<Answer>() {
  static constexpr Field fields[] = {
      field<&Answer::question>("question", "`Capture`, `Ledger`, `Feasibility` or `Loads and control`"),
      field<&Answer::tone>("tone", "kind of the answer."),
      field<&Answer::word>("word", "the answer in one to three words"),
      field<&Answer::sentence>("sentence", "the reason"),
      field<&Answer::remarks>("remarks", "grasps, failed checks, worst violations or further findings, one each"),
  };
  static constexpr Type type = structure<Answer>("Answer", "the answer of the result to one question.", fields);
  return type;
}

// ---- The ledger ----

template <>
const Type& type_of<LedgerEntry::Kind>() {
  using Kind = LedgerEntry::Kind;
  static constexpr Choice choices[] = {
      choice(Kind::conservation, "conservation", "a failure invalidates the computation."),
      choice(Kind::feasibility, "feasibility", "a failure means that the robot could not perform the motion.")};
  static constexpr Type type = enumeration<Kind>("LedgerKind", choices);
  return type;
}

template <>
const Type& type_of<LedgerEntry>() {
  using E = LedgerEntry;
  static constexpr Field fields[] = {
      field<&E::value>("value", "see `unit`", "largest deviation; null: not a number").or_null(),
      field<&E::bound>("bound", "see `unit`", "bound on the deviation"),
      derived<[](const E& e) {
        const bool unseen = !e.not_checked.empty() && e.pass();
        return unseen ? std::nullopt : std::optional(e.pass());
      }>("pass", "", "`value` <= `bound`, or nothing to check; null: not evaluated")
          .or_null(),
      field<&E::unit>("unit", "`1`: relative to the scale named in `note`"),
      field<&E::note>("note",
                      "compared quantities and phases; for momentum and energy also the group of bodies with the "
                      "largest deviation, and its scale"),
      field<&E::applies>("applies", "false: this run has nothing to check; `value` is then 0"),
      field<&E::kind>("kind", "meaning of a failure."),
      field<&E::not_checked>("not_checked", "reason for which the check was not evaluated, or only in part")
          .when<[](const E& e) { return !e.not_checked.empty(); }>(),
      field<&E::advice>("advice", "for a failed conservation row: how to correct it, or why no correction exists")
          .when<[](const E& e) { return !e.advice.empty(); }>(),
  };
  static constexpr Type type =
      structure<E>("LedgerEntry", "a conserved or balanced quantity, or a requirement on the robot.", fields);
  return type;
}

template <>
const Type& type_of<LedgerScale>() {
  using S = LedgerScale;
  static constexpr Field fields[] = {
      field<&S::linear_momentum>("linear_momentum", "N s", "maximum over time of the sum of all |m v|"),
      field<&S::angular_momentum>(
          "angular_momentum", "N m s",
          "maximum over time of the sum of all (|I w| + |r x m v|), r from the system's centre of mass"),
      field<&S::energy>("energy", "J", "maximum kinetic energy"),
  };
  static constexpr Type type = structure<S>("LedgerScale",
                                            "magnitudes of the whole system's momenta and energy. Rows are evaluated "
                                            "per group of bodies in contact, relative to the group's scale.",
                                            fields);
  return type;
}

template <>
const Type& type_of<Ledger>() {
  static constexpr Field fields[] = {
      field<&Ledger::entries>("NAME", "each of the checks, under its name").keyed_by<&LedgerEntry::name>(),
      field<&Ledger::scale>("scale", "scale of the whole system"),
      derived<[](const Ledger& l) { return l.pass(); }>("pass", "",
                                                        "whether all rows of conservation pass. Where they do not, "
                                                        "this run is no result, although everything computed "
                                                        "is kept, and `grapnel run` ends with exit code 1"),
      derived<[](const Ledger& l) { return l.feasibility(); }>("feasible", "", "verdict of `Feasibility`"),
  };
  static constexpr Type type = structure<Ledger>("Ledger", "all checks of the result, with their bounds.", fields);
  return type;
}

template <>
const Type& type_of<PhaseCost>() {
  using C = PhaseCost;
  static constexpr Field fields[] = {
      field<&C::phase>("phase", "integrated phase"),
      field<&C::rhs_evaluations>("rhs_evaluations", "1", "evaluations of the equations of motion"),
      field<&C::steps>("steps", "1", "accepted steps"),
      field<&C::rejected>("rejected", "1", "steps that were repeated with a smaller step size"),
      field<&C::implicit_steps>("implicit_steps", "1", "accepted steps of the implicit method"),
      field<&C::implicit_spans>("implicit_spans", "s",
                                "begins and ends of the intervals that the implicit method integrated"),
  };
  static constexpr Type type = structure<C>("PhaseCost", "cost of an integration.", fields);
  return type;
}

template <>
const Type& type_of<OrbitReport>() {
  using O = OrbitReport;
  static constexpr Field fields[] = {
      field<&O::body>("body", "central body; `own`: a gravitational parameter of the scenario"),
      field<&O::radius>("radius", "m", "distance from its centre to the reference point, W's origin, at t = 0"),
      field<&O::rate>("rate", "rad/s", "angular rate of the radial and along-track directions in W, at t = 0"),
      field<&O::period>("period", "s", "period of the orbit"),
  };
  static constexpr Type type = structure<O>("OrbitReport", "the orbit of the frame W.", fields);
  return type;
}

template <>
const Type& type_of<ElasticModeReport>() {
  using E = ElasticModeReport;
  static constexpr Field fields[] = {
      field<&E::held>("held", "Hz", "frequency with the base fixed and the joints braked; null: no further modes")
          .or_null(),
      field<&E::braked>("braked", "Hz", "frequency with the base free and the joints braked").or_null(),
      field<&E::free>("free", "Hz", "frequency with base and joints free").or_null(),
      field<&E::damping_ratio>("damping_ratio", "1", "damping ratio of `held`"),
      field<&E::effective_mass>(
          "effective_mass", "kg",
          "effective mass of `held`, in the directions of the base's axes; zero for a fixed base"),
      field<&E::effective_inertia>("effective_inertia", "kg m^2",
                                   "effective inertia of `held`, about the base's axes; zero for a fixed base"),
  };
  static constexpr Type type =
      structure<E>("ElasticMode", "one mode of vibration; the modes are sorted from the slowest.", fields);
  return type;
}

template <>
const Type& type_of<ElasticReport>() {
  using E = ElasticReport;
  static constexpr Field fields[] = {
      field<&E::at>("at", "`start`, or `captured`: with the grasped targets"),
      field<&E::time>("time", "s", "time of the posture"),
      field<&E::springs>("springs", "1", "number of springs that represent flexible bodies and joints"),
      field<&E::fastest>("fastest", "Hz",
                         "frequency of the fastest mode, base and joints free: it limits the step size"),
      field<&E::modes>("modes", "the slowest modes, at most 20"),
  };
  static constexpr Type type = structure<E>(
      "Elastic", "small vibrations about the posture at one instant; closed loops are not included.", fields);
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
// The report of a law; empty: it did not act.
std::optional<LawReport> report_of(const CaptureResult& result, LawReport::Law law, bool in_approach = false) {
  const LawReport* report = result.law(law, in_approach);
  return report ? std::optional(*report) : std::nullopt;
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
  static constexpr Field fields[] = {
      part<&S::result, &CaptureResult::scenario_name>("name", "", "name of the scenario"),
      part<&S::result, &CaptureResult::scenario_sha256>(
          "sha256", "", "SHA-256 of the bytes of the scenario, all included files, and overrides"),
  };
  static constexpr Type type = structure<S>("ScenarioNamed", "the simulated scenario.", fields);
  return type;
}

template <>
const Type& type_of<Approach>() {
  using A = Approach;
  static constexpr Field fields[] = {
      part<&A::result, &CaptureResult::approach_start>("start", "", "state at the start of the phase"),
      part<&A::result, &CaptureResult::approach_end>("end", "", "state at the end of the phase"),
      derived<[](const A& a) { return a.result->plan->final_rates; }>(
          "planned_final_rates", "rad/s or m/s",
          "planned joint rates at the end of the approach, in the order of `joints.names`; absent without a plan")
          .when<[](const A& a) { return a.result->plan.has_value(); }>(),
      part<&A::result, &CaptureResult::plan>("plan", "", "plan of the joint motion"),
      list_part<&A::result, &CaptureResult::navigation>(
          "navigation", "",
          "plans and the estimates that they use; absent if targets are known exactly and planned for once"),
      derived<[](const A& a) { return report_of(*a.result, LawReport::Law::impedance, true); }>(
          "impedance", "", "impedance control; absent without it"),
  };
  static constexpr Type type = structure<A>("Approach", "the motion up to the capture.", fields);
  return type;
}

template <>
const Type& type_of<Capture>() {
  using C = Capture;
  static constexpr Field fields[] = {
      derived<[](const C& c) { return c.result->capture_verdict(); }>(
          "captured", "", "verdict over all grasps; `assumed` if all closed and at least one of them is `assumed`"),
      derived<[](const C& c) { return capture_sentence(*c.result); }>(
          "verdict", "", "sentence as printed on the terminal, with the gap and the displacement of moved targets"),
      derived<[](const C& c) { return c.result->capture_time; }>("time", "s",
                                                                 "instant of the grasps that close simultaneously"),
      part<&C::result, &CaptureResult::grasps>("grasps", "", "one entry per grasp of the scenario"),
  };
  static constexpr Type type = structure<C>("Capture", "whether the grasps closed.", fields);
  return type;
}

template <>
const Type& type_of<PostImpact>() {
  using P = PostImpact;
  static constexpr Field fields[] = {
      part<&P::result, &CaptureResult::post_impact_end>("end", "", "state at the end of the motion"),
      part<&P::result, &CaptureResult::phases>("phases", "", "completed phases, in the order of time"),
      list_part<&P::result, &CaptureResult::loops>("loops", "", "closed loops; absent without closed loops"),
      list_part<&P::result, &CaptureResult::grasp_loads>("grasp_loads", "",
                                                         "loads per phase and grasp; absent without grasps"),
      derived<[](const P& p) { return report_of(*p.result, LawReport::Law::detumbling); }>(
          "detumbling", "", "detumbling law; absent without it"),
      derived<[](const P& p) { return report_of(*p.result, LawReport::Law::base_keeping); }>(
          "base_keeping", "", "base attitude control by the joints; absent without it"),
      part<&P::result, &CaptureResult::identification>("identification", "",
                                                       "identification of a held target; absent without it"),
      derived<[](const P& p) { return report_of(*p.result, LawReport::Law::impedance); }>(
          "impedance", "", "impedance control; absent without it"),
      derived<[](const P& p) { return report_of(*p.result, LawReport::Law::grasp_force); }>(
          "grasp_force", "", "grasp force control; absent without it"),
      part<&P::result, &CaptureResult::rest>("at_rest", "", "final rates; absent if the scenario states no limits"),
  };
  static constexpr Type type =
      structure<P>("PostImpact", "the motion after the impact, or the motion of a run without impact.", fields);
  return type;
}

template <>
const Type& type_of<Summary>() {
  using S = Summary;
  static constexpr Field fields[] = {
      derived<[](const S&) { return SummaryFormat::second; }>("schema", "", "format of this file"),
      field<&S::version>("version", "version of Grapnel"),
      derived<[](const S& s) { return ScenarioNamed{s.result}; }>("scenario", "", "the simulated scenario"),
      derived<[](const S& s) { return s.result->status; }>("status", "", "how the run ended"),
      part<&S::result, &CaptureResult::failure>("failure", "", "body, time and condition of a failure; else empty"),
      part<&S::result, &CaptureResult::warnings>("warnings", "", "warnings about the result"),
      derived<[](const S& s) { return answers_of(*s.result); }>("verdicts", "",
                                                                "answers of the result, as reports show them"),
      part<&S::result, &CaptureResult::orbit>("orbit", "", "orbit of the frame W; absent without one"),
      list_part<&S::result, &CaptureResult::elastic>("elastic", "",
                                                     "flexible modes; absent without flexible bodies and joints"),
      part<&S::result, &CaptureResult::control>("control", "", "sampled control; absent if control is continuous"),
      list_part<&S::result, &CaptureResult::sensors>(
          "sensors", "", "sensor readings compared with true values; absent without sensors"),
      derived<[](const S& s) { return Approach{s.result}; }>("approach", "",
                                                             "motion up to the capture; absent without an approach")
          .when<[](const S& s) { return has_approach(*s.result); }>(),
      derived<[](const S& s) { return Capture{s.result}; }>("capture", "",
                                                            "whether the grasps closed; absent without grasps")
          .when<[](const S& s) { return !s.result->grasps.empty(); }>(),
      derived<[](const S& s) { return *s.result->impact(); }>("impact", "", "first impact; absent without an impact")
          .when<[](const S& s) { return s.result->impact() != nullptr; }>(),
      derived<[](const S& s) { return s.result->later_impacts(); }>(
          "later_impacts", "", "impacts of grasps that closed later, in the order of time; absent if there are none")
          .when<[](const S& s) { return s.result->later_impacts().size() != 0; }>(),
      list_part<&S::result, &CaptureResult::releases>(
          "releases", "", "releases of grasps, in the order of time; absent if there are none"),
      list_part<&S::result, &CaptureResult::losses>("losses", "",
                                                    "grasps that opened because their load exceeded their limits "
                                                    "(`holds`) or that slipped too far, in the order of time; absent "
                                                    "if there are none"),
      list_part<&S::result, &CaptureResult::slips>(
          "slips", "", "slips of grasps beyond their limits, in the order of time; absent if there are none"),
      derived<[](const S& s) { return PostImpact{s.result}; }>("post_impact", "",
                                                               "motion after the impact; absent without such motion")
          .when<[](const S& s) { return has_phases(*s.result) && !s.result->without_impact; }>(),
      derived<[](const S& s) { return PostImpact{s.result}; }>("motion", "",
                                                               "motion of a scenario without a capture; else absent")
          .when<[](const S& s) { return has_phases(*s.result) && s.result->without_impact; }>(),
      list_part<&S::result, &CaptureResult::peak_loads>("loads", "",
                                                        "largest loads of every phase; absent without loads"),
      list_part<&S::result, &CaptureResult::wheels>("wheels", "", "reaction wheels; absent if there are none"),
      part<&S::result, &CaptureResult::gyros>("gyros", "", "control moment gyros; absent if there are none"),
      list_part<&S::result, &CaptureResult::actuators>(
          "actuators", "", "actuators of the base of other kinds; absent if there are none"),
      list_part<&S::result, &CaptureResult::tendons>("tendons", "", "tendons with commands; absent if there are none"),
      list_part<&S::result, &CaptureResult::joints>(
          "joints", "",
          "joints with sticking friction, stops or electrically modelled motors, per phase; absent if there are none"),
      list_part<&S::result, &CaptureResult::stop_impacts>(
          "stop_impacts", "", "first hundred impacts of joints on their stops; absent if there are none"),
      derived<[](const S& s) { return s.result->stop_impact_count; }>("stop_impact_count", "1",
                                                                      "number of all impacts on stops")
          .when<[](const S& s) { return !s.result->stop_impacts.empty(); }>(),
      part<&S::result, &CaptureResult::thrusters>("thrusters", "", "thrusters; absent if there are none"),
      list_part<&S::result, &CaptureResult::saturation>(
          "saturation", "", "saturated actuators, the longest saturation first; absent if there are none"),
      list_part<&S::result, &CaptureResult::stability>(
          "stability", "", "stability of control loops, per phase of motion; absent if it was not evaluated"),
      list_part<&S::result, &CaptureResult::control_loops>(
          "control_loops", "", "linear models of the control loops, in the order of time; absent without `--margins`"),
      derived<[](const S& s) { return *worst_margin(*s.result); }>(
          "worst_margin", "", "entry of `loads` with the smallest margin over all phases; absent without ratings")
          .when<[](const S& s) { return worst_margin(*s.result) != nullptr; }>(),
      list_part<&S::result, &CaptureResult::contacts>(
          "contacts", "",
          "contacts between shapes, one entry per pair of bodies that may touch, in the order of the scenario; absent "
          "if there are none"),
      list_part<&S::result, &CaptureResult::stages>(
          "stages", "", "stages of captures by contacts, in the order of the scenario; absent if none are stated"),
      derived<[](const S& s) { return Clearances{s.result}; }>(
          "clearance", "", "distances between bodies with shapes; absent if fewer than two bodies have shapes")
          .when<[](const S& s) { return !s.result->clearance.empty(); }>(),
      derived<[](const S& s) { return Limits{s.result}; }>("limits", "", "limits of joints and drives"),
      derived<[](const S& s) { return feasibility_of(*s.result); }>("feasibility", "",
                                                                    "whether a real robot could perform this motion"),
      part<&S::result, &CaptureResult::ledger>("ledger", "", "conservation checks"),
      part<&S::result, &CaptureResult::cost>("cost", "", "cost of each phase"),
  };
  static constexpr Type type = structure<S>("Summary", "summary of one capture, in SI units and radians.", fields);
  return type;
}

}  // namespace grapnel
