// Conflicts of coupled joints: joint values that violate a coupling, and features without couplings.
#include <map>
#include <set>
#include <stdexcept>

#include "grapnel/model/coupling.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Largest defect of stated values: of numbers with six decimals [rad or m, and these per second]. Dependent joints
// start exactly on their couplings.
constexpr double kCouplingDefect = 1e-6;

class CouplingConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  void find() {
    for (const BodyDescription& body : problem_.robot.bodies) {
      if (!body.joint.mimic.empty() && example_.empty())
        example_ = fmt::format("joint {} follows {}", in_quotes(body.joint.name), in_quotes(body.joint.mimic[0].joint));
    }
    if (example_.empty() || !coupling_faults(problem_.robot.bodies).empty()) return;
    if (problem_.impact) check_impact(*problem_.impact);
    check_laws();
    if (problem_.approach) check_plan(*problem_.approach);
    check_stated_values();
  }

 private:
  // ---- Features without couplings ----

  void check_impact(const ImpactSetup& impact) {
    using Law = ImpactSetup::Law;
    if (impact.law == Law::compliant || impact.law == Law::as_published)
      add("impact.law", "impact.law: {} does not support coupled joints ({}); use plastic, or a law of contacts",
          impact_law(impact).name, example_);
    if (impact.modes == ImpactSetup::Modes::slow)
      add("impact.modes", "impact.modes: slow does not support coupled joints ({}); use all or none", example_);
  }

  void check_laws() {
    if (problem_.approach && problem_.approach->tracking.mode == JointControl::impedance)
      refuse_law("approach.tracking.mode", "impedance");
    // The first phase, as post_impact; its place is inserted later.
    if (problem_.post_impact && is_law(problem_.post_impact->joints))
      refuse_law("post_impact.joints", name_of(problem_.post_impact->joints));
  }
  void refuse_law(const std::string& path, std::string_view law) {
    add(path, "{}: {} moves all joints together and does not support coupled joints ({}); use pd or computed_torque",
        path, law, example_);
  }

  // Plans hold coupled joints, so these must not carry the end-effector of a grasp.
  void check_plan(const ApproachSetup& approach) {
    const auto has_places = [](const Waypoint& w) { return !w.places.empty(); };
    const bool reaches =
        approach.plan || approach.match || approach.straight_in || std::ranges::any_of(approach.waypoints, has_places);
    if (!reaches) return;
    std::set<std::string_view> coupled;
    for (const BodyDescription& body : problem_.robot.bodies) {
      for (const CouplingTerm& term : body.joint.mimic) coupled.insert(body.joint.name), coupled.insert(term.joint);
    }
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const EndEffectorSetup* effector = end_effector(problem_.grasps[i].end_effector);
      const BodyDescription* body = effector ? find_named(problem_.robot.bodies, effector->body) : nullptr;
      while (body && !coupled.contains(body->joint.name)) body = find_named(problem_.robot.bodies, body->parent);
      if (!body) continue;
      add(approach.plan ? "approach.plan" : "approach",
          "approach: joint {}, which carries {} of grasps[{}], is coupled ({}); plans keep coupled joints at their "
          "initial values: grasp with an end-effector on a link before them, or state the motion with final_joints, "
          "trajectory or pieces",
          in_quotes(body->joint.name), in_quotes(effector->name), i, example_);
    }
  }

  // ---- Values ----

  void check_stated_values() {
    Model model;
    try {
      const CaptureSystem servicer = make_servicer(problem_);
      model = servicer.model;
      for (const int j : servicer.robot_joints) place_of_[model.joints()[j]] = places_++;
    } catch (const std::exception&) {
      return;  // other faults, which have been reported
    }
    for (const JointCoupling& coupling : model.couplings()) check_coupling(model, coupling);
  }

  struct Coupled {
    const Model& model;
    const JointCoupling& coupling;
  };

  void check_coupling(const Model& model, const JointCoupling& coupling) {
    const Coupled one{model, coupling};
    check(one, "initial.joints", problem_.joint_position, coupling.offset);
    check(one, "initial.joint_rates", problem_.joint_rate, 0);
    if (problem_.approach) check_approach(one, *problem_.approach);
    if (problem_.post_impact && problem_.post_impact->move)
      check(one, "post_impact.move.joints", problem_.post_impact->move->joints, coupling.offset);
  }

  void check_approach(const Coupled& one, const ApproachSetup& approach) {
    const double offset = one.coupling.offset;
    check(one, "approach.final_joints", approach.final_position, offset);
    if (approach.final_rates) check(one, "approach.final_rates", *approach.final_rates, 0);
    for (std::size_t i = 0; i < approach.waypoints.size(); ++i) {
      const std::string path = fmt::format("approach.waypoints[{}]", i);
      check(one, path + ".joints", approach.waypoints[i].joints, offset);
      if (const auto& rates = approach.waypoints[i].rates) check(one, path + ".rates", *rates, 0);
    }
    if (approach.sampled) check_samples(one, *approach.sampled);
    for (std::size_t i = 0; i < approach.pieces.size(); ++i)
      check_piece(one, fmt::format("approach.pieces[{}].series", i), approach.pieces[i]);
  }

  // The first sample that violates the coupling.
  void check_samples(const Coupled& one, const SampledMotion& motion) {
    if (motion.positions.size() != places_) return;
    for (std::size_t k = 0; k < motion.times.size(); ++k) {
      std::vector<double> values, rates;
      for (const auto& joint : motion.positions) values.push_back(k < joint.size() ? joint[k] : 0);
      for (const auto& joint : motion.rates) rates.push_back(k < joint.size() ? joint[k] : 0);
      const std::string when = fmt::format(" at t = {:.9g} s", motion.times[k]);
      if (!check(one, "approach.trajectory", values, one.coupling.offset, when) ||
          !check(one, "approach.trajectory", rates, 0, when))
        return;
    }
  }

  // A series of Chebyshev polynomials satisfies the coupling if its coefficients do.
  void check_piece(const Coupled& one, const std::string& path, const MotionPiece& piece) {
    if (piece.series.size() != places_) return;
    std::size_t terms = 0;
    for (const auto& series : piece.series) terms = std::max(terms, series.size());
    for (std::size_t m = 0; m < terms; ++m) {
      std::vector<double> values;
      for (const auto& series : piece.series) values.push_back(m < series.size() ? series[m] : 0);
      if (!check(one, path, values, m == 0 ? one.coupling.offset : 0, fmt::format(" in coefficient {}", m))) return;
    }
  }

  // Whether values per joint satisfy the coupling with this offset; otherwise adds the conflict.
  bool check(const Coupled& one, const std::string& path, const std::vector<double>& values, double offset,
             const std::string& when = {}) {
    if (values.size() != places_) return true;
    const auto name = [&](int body) { return in_quotes(one.model.bodies()[body].description.joint.name); };
    double needed = offset;
    std::vector<std::string> others;
    for (const auto& [body, factor] : one.coupling.joints) {
      if (body == dependent_body(one.coupling)) continue;
      needed -= factor * values[place_of_.at(body)];
      others.push_back(name(body));
    }
    const int dependent = dependent_body(one.coupling);
    const double value = values[place_of_.at(dependent)];
    if (!(std::abs(value - needed) > kCouplingDefect)) return true;
    add(path, "{}: joint {} is {:.9g}{}, but its coupling with {} makes it {:.9g} (violated by {:.3g}); state {:.9g}",
        path, name(dependent), value, when, fmt::format("{}", fmt::join(others, " and ")), needed, value - needed,
        needed)
        .relies_on = path;
    return false;
  }

  std::string example_;                  // of a coupling, as text
  std::map<int, std::size_t> place_of_;  // by body of the servicer: index in values per joint
  std::size_t places_ = 0;
};

}  // namespace

void find_coupling_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  CouplingConflicts(problem, found).find();
}

}  // namespace grapnel
