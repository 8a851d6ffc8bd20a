#include "grapnel/problem/problem_conflicts.hpp"

#include <map>

#include "grapnel/model/coupling.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/plan_objectives.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Limit of samples, to detect typos: 10 million of a seven-joint dual arm are some 10 GB.
constexpr double kMostSamples = 1e7;

// Whether the centre of mass is so far from the body's origin that the inertia about it is lost to rounding.
template <class Body>
bool loses_inertia(const Body& body) {
  constexpr double kLost = 1e-12;    // of mass |com|^2: four digits of the inertia remain
  constexpr double kFarthest = 1e4;  // [m]; a larger distance, or a body without inertia, is a different error
  const Symmetric3d& I = body.inertia;
  const bool is_given = I.xx != 0 || I.yy != 0 || I.zz != 0;
  return is_given && std::isfinite(body.mass) && norm(body.com) <= kFarthest &&
         std::min({I.xx, I.yy, I.zz}) < kLost * body.mass * dot(body.com, body.com);
}
template <class Body>
std::string lost_inertia_text(const Body& body, const std::string& path) {
  return fmt::format(
      "{}.com is {:.6g} m from the body's origin: compared with mass times its square, {:.6g} kg m^2, the inertia is "
      "lost to "
      "rounding; move the origin closer to the body",
      path, norm(body.com), body.mass * dot(body.com, body.com));
}

class Conflicts : ConflictFinder {
 public:
  // `before`: the maximum duration of the phases before the first of the problem [s].
  Conflicts(const CaptureProblem& problem, double before, std::vector<ProblemFault>& found)
      : ConflictFinder(problem, found), before_(before) {}

  void find() {
    if (problem_.robot.base_mode != RobotSetup::Base::free) check_base_at_rest();
    find_orbit_conflicts(problem_, found_);
    for (std::size_t i = 0; i < problem_.targets.size(); ++i) {
      if (!loses_inertia(problem_.targets[i])) continue;
      const std::string path = fmt::format("targets[{}]", i);
      found_.push_back({path + ".com", lost_inertia_text(problem_.targets[i], path)});
    }
    check_end_effectors();
    check_arrival();
    if (problem_.approach) check_approach(*problem_.approach);
    find_grasp_conflicts(problem_, found_);
    if (problem_.impact) check_impact(*problem_.impact);
    if (problem_.post_impact) check_releases(*problem_.post_impact);
    find_control_conflicts(problem_, found_);
    find_sensor_conflicts(problem_, found_);
    find_load_conflicts(problem_, found_);
    find_contact_conflicts(problem_, found_);
    find_stage_conflicts(problem_, found_);
    find_coupling_conflicts(problem_, found_);
    find_tendon_conflicts(problem_, found_);
    check_shapes();
    check_panels();
    check_lengths();
    if (!problem_.approach && !problem_.impact && !problem_.post_impact)
      add("", "nothing to simulate: state 'approach', 'impact' or both, or 'motion' without a capture");
  }

 private:
  // ---- Bodies ----

  // Conflicts of the robot alone are found by robot_conflicts().
  void check_shapes() {
    const std::size_t of_robot = problem_.robot.geometry.size();
    std::size_t all = of_robot;
    for (const TargetSetup& target : problem_.targets) all += target.geometry.size();
    for (const ObstacleSetup& obstacle : problem_.obstacles) all += obstacle.geometry.size();
    if (all <= kMostShapes || of_robot > kMostShapes) return;
    add("targets", "targets{} and robot have {} shapes in total, at most {} are allowed",
        problem_.obstacles.empty() ? "" : ", obstacles", all, kMostShapes);
  }

  void check_panels() {
    for (std::size_t i = 0; i < problem_.targets.size(); ++i) {
      const TargetSetup& target = problem_.targets[i];
      if (target.panels.empty()) continue;
      const std::string path = fmt::format("targets[{}].panels", i);
      if (const std::string fault = panel_fault(target); !fault.empty()) add_key(path, "{}: {}", path, fault);
      const MotionPhases& post = problem_.post_impact;
      if (post && post->grasp_force)
        add_key(path, "{}: the law grasp_force of post_impact supports only rigid held targets", path);
      if (post && (post->assumed || post->identify))
        add_key(path, "{}: post_impact.assumed and identify support only rigid held targets", path);
    }
  }

  // ---- The beginning ----

  void check_base_at_rest() {
    const auto refuse = [&](const char* key) {
      add_key(fmt::format("initial.base.{}", key),
              "initial.base.{}: the robot's base is {}, so its motion cannot be stated", key,
              name_of(problem_.robot.base_mode));
    };
    if (problem_.V_WB && !is_zero(problem_.V_WB->angular)) refuse("angular_velocity");
    if (problem_.V_WB && !is_zero(problem_.V_WB->linear)) refuse("velocity");
    if (problem_.momentum) refuse("momentum");
  }

  void check_end_effectors() {
    std::map<std::string_view, std::size_t> grasp_of;
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const std::string& name = problem_.grasps[i].end_effector;
      const auto [first, fresh] = grasp_of.emplace(name, i);
      if (fresh || name.empty()) continue;
      add(fmt::format("grasps[{}].end_effector", i), "end-effector {} in grasps[{}] is used twice; first in grasps[{}]",
          in_quotes(name), i, first->second);
    }
  }

  // ---- The approach ----

  // Checks relative velocities of grasps against the condition for the joints' final rates.
  void check_arrival() {
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (!is_zero(grasp.relative_velocity)) check_arrival(fmt::format("grasps[{}].relative_velocity", i), false);
      if (!is_zero(grasp.relative_angular_velocity))
        check_arrival(fmt::format("grasps[{}].relative_angular_velocity", i), true);
    }
  }
  void check_arrival(const std::string& path, bool angular) {
    const auto fault = [&](const char* why) { add_key(path, "{}: {}", path, why); };
    const auto& approach = problem_.approach;
    if (!approach) {
      fault("there is no approach; without one, relative motion follows from the initial state and the target's");
    } else if (approach->straight_in) {
      fault("approach.straight_in determines the velocity at arrival; use its final_speed");
    } else if (approach->sampled || !approach->pieces.empty() ||
               (!approach->match && (approach->final_rates || !approach->plan))) {
      fault(
          "relative velocities require matched final rates, but the final rates are given; use approach.final_rates: "
          "{match: ...}");
    } else if (angular && approach->match && *approach->match != RateMatch::twist) {
      fault("the angular velocity is not matched; use approach.final_rates: {match: twist}");
    }
  }

  void check_approach(const ApproachSetup& approach) {
    if (approach.plan && problem_.grasps.empty())
      add_key("approach.plan", "approach.plan needs 'grasps': there is no point to reach").relies_on = "grasps";
    if (approach.capture_at == ApproachSetup::CaptureAt::envelope) check_envelopes();
    if (approach.straight_in) check_directions();
    if (approach.plan) {
      check_plan(*approach.plan, approach.straight_in.has_value());
      check_wheel_budget(*approach.plan, approach.base_control);
    }
    if (approach.window) check_window(approach, *approach.window);
    const double straight = approach.straight_in ? approach.straight_in->duration : 0;
    const double duration = shortest(problem_.approach).value_or(0);
    if (approach.straight_in && duration > 0 && straight >= duration) {
      add("approach.straight_in.duration", "approach.straight_in.duration is {} [s], must be less than {} {}", straight,
          approach.window ? "approach.window.earliest," : "the approach's", duration);
    }
    const double end = duration - straight;
    double before = 0;
    for (std::size_t i = 0; i < approach.waypoints.size(); ++i) {
      const double time = approach.waypoints[i].time;
      const std::string path = fmt::format("approach.waypoints[{}].time", i);
      if (time > 0 && time <= before) {
        add(path, "{} is {} [s], must be greater than {} of the waypoint before", path, time, before);
      } else if (time > 0 && end > 0 && time >= end) {
        add(path, "{} is {} [s], must be less than {}, {}", path, time, end,
            straight > 0      ? "where straight_in begins"
            : approach.window ? "approach.window.earliest"
                              : "the approach's duration");
      }
      before = std::max(before, time);
    }
    for (std::size_t i = 1; i < approach.pieces.size(); ++i) {
      const double begin = approach.pieces[i - 1].until, until = approach.pieces[i].until;
      const std::string path = fmt::format("approach.pieces[{}].until", i);
      if (until > 0 && until <= begin)
        add(path, "{} is {} [s], must be greater than {} of the piece before", path, until, begin);
    }
    if (!approach.sampled && approach.pieces.empty()) check_start(approach);
  }

  // Checks a plan's objectives and constraints.
  void check_plan(const PlanSetup& plan, bool straight_in) {
    using Objective = PlanSetup::Objective;
    const auto minimizes = [&](Objective objective) { return weight_in(plan, objective) > 0; };
    if (plan.weights && std::none_of(std::begin(kPlanObjectives), std::end(kPlanObjectives),
                                     [&](const PlanObjective& one) { return weight_in(plan, one) != 0; })) {
      add("approach.plan.weights",
          "approach.plan.weights: all weights are zero; state a weight, or objective: as_found, which minimizes "
          "nothing");
    }
    const std::string objective = plan.weights ? "approach.plan.weights." : "approach.plan.objective: ";
    const std::string path = plan.weights ? "approach.plan.weights" : "approach.plan.objective";
    if (!problem_.clearance.enabled) {
      if (plan.clearance)
        add("approach.plan.clearance",
            "approach.plan.clearance: 'clearance' is switched off, so no distances are evaluated");
      if (minimizes(Objective::clearance))
        add(path, "{}clearance: 'clearance' is switched off, so no distances are evaluated", objective);
    }
    if (plan.weights && minimizes(Objective::nearest) && plan.guess.empty())
      add("approach.plan.weights.nearest", "approach.plan.weights.nearest needs approach.plan.guess");
    if (!straight_in) return;
    if (minimizes(Objective::impulse) || minimizes(Objective::impulse_index)) {
      add(path,
          "{}{}: the plan ends at the stand-off of straight_in, where no grasp closes; leave "
          "out one of them",
          objective, minimizes(Objective::impulse) ? "impulse" : "impulse_index");
    }
  }

  // Checks the constraint of the wheels' momenta against the actuators of the base.
  void check_wheel_budget(const PlanSetup& plan, const std::optional<BaseControlSetup>& control) {
    const bool wanted = weight_in(plan, PlanSetup::Objective::wheel_momentum) > 0;
    if (!plan.wheel_momentum && !wanted) return;
    const std::string path = plan.wheel_momentum ? "approach.plan.wheel_momentum"
                             : plan.weights      ? "approach.plan.weights.wheel_momentum"
                                                 : "approach.plan.objective";
    const std::string what = plan.wheel_momentum || plan.weights ? path : path + ": wheel_momentum";
    using Actuators = BaseControlSetup::Actuators;
    const bool by_wheels = control && !problem_.robot.wheels.empty() &&
                           control->actuators.value_or(Actuators::wheels) == Actuators::wheels;
    if (!by_wheels) {
      add(path,
          "{} needs wheels that control the base's attitude: wheels: [...] in the robot file, and "
          "approach.base_control "
          "that uses them",
          what);
      return;
    }
    for (const WheelSetup& wheel : problem_.robot.wheels) {
      if (!std::isfinite(wheel.rate))
        add(path, "{}: wheel '{}' has no maximum rate ('rate' in the robot file), so its momentum is unlimited", what,
            wheel.name);
    }
    if (control->dumping) {
      add(path, "{}: a plan cannot include thrusters that dump the wheels' momentum (approach.base_control.dumping)",
          what);
    }
  }

  // Limit of capture times, to detect typos: a plan takes some 10 ms.
  static constexpr double kMostTimes = 10'000;

  void check_window(const ApproachSetup& approach, const CaptureWindow& window) {
    const double length = window.latest - window.earliest;
    if (window.earliest > 0 && window.latest > 0 && !(length > 0)) {
      add("approach.window.latest", "approach.window.latest is {} [s], must be greater than {}, earliest",
          window.latest, window.earliest);
    } else if (window.step > 0 && length / window.step > kMostTimes) {
      add("approach.window.step",
          "approach.window.step is {} [s], which makes {:.3g} times; at most {:.0f} are allowed", window.step,
          length / window.step, kMostTimes);
    }
    if (!approach.plan || window.choose != CaptureWindow::Choose::objective) return;
    if (approach.plan->objective != PlanSetup::Objective::as_found || approach.plan->weights) return;
    add("approach.window.choose",
        "approach.window.choose: objective needs an objective, but approach.plan.objective is as_found; choose "
        "soonest or slowest, or another objective");
  }

  // Checks that capture_at: envelope has envelopes.
  void check_envelopes() {
    const char* const path = "approach.capture_at";
    if (problem_.grasps.empty())
      add(path, "{}: envelope needs 'grasps': there is no point to close on", path).relies_on = "grasps";
    const auto waits = [](const GraspSetup& grasp) { return grasp.closes == GraspSetup::Closes::together; };
    if (!problem_.grasps.empty() && std::none_of(problem_.grasps.begin(), problem_.grasps.end(), waits)) {
      add(path, "{}: envelope has no effect: every grasp has closes_at or closes_on_arrival; leave out capture_at",
          path);
    }
    for (const GraspSetup& grasp : problem_.grasps) {
      const EndEffectorSetup* effector = end_effector(grasp.end_effector);
      if (!waits(grasp) || !effector || effector->envelope) continue;
      add(path, "{}: envelope needs an 'envelope' at end-effector {}", path, in_quotes(effector->name));
    }
  }

  void check_directions() {
    for (const GraspSetup& grasp : problem_.grasps) {
      const GraspPoint* point = grasp_point(grasp);
      if (!point || point->approach_direction) continue;
      add_key("approach.straight_in",
              "approach.straight_in needs an 'approach_direction' at grasp point {} of target {}",
              in_quotes(point->name), in_quotes(grasp.target));
    }
  }

  // The thesis's profile has no initial rate, so neither joints that follow it exactly nor its later pieces can have
  // one.
  void check_start(const ApproachSetup& approach) {
    if (approach.profile != JointProfile::quartic) return;
    const auto at_rest = [](const std::vector<double>& rates) {
      return std::all_of(rates.begin(), rates.end(), [](double r) { return r == 0; });
    };
    if (approach.tracking.mode == JointControl::prescribed && !at_rest(problem_.joint_rate)) {
      add("approach.profile",
          "approach.profile: the quartic profile starts from rest; with initial.joint_rates use quintic or cycloidal");
    }
    for (std::size_t i = 0; i < approach.waypoints.size(); ++i) {
      const Waypoint& waypoint = approach.waypoints[i];
      if (waypoint.places.empty() && at_rest(waypoint.rates.value_or(std::vector<double>{}))) continue;
      add("approach.profile",
          "approach.profile: the quartic profile starts from rest, and so cannot leave approach.waypoints[{}], which "
          "is passed with rates; use quintic or cycloidal",
          i);
      return;
    }
  }

  // ---- Grasps that are released ----

  void check_releases(const PostImpactSetup& post) {
    double before = 0;
    std::map<std::string_view, std::size_t> release_of;  // by end-effector
    for (std::size_t i = 0; i < post.releases.size(); ++i) {
      const PostImpactSetup::Release& release = post.releases[i];
      const double after = release.after;
      const std::string path = fmt::format("post_impact.release[{}]", i);
      if (after > 0 && after <= before) {
        add(path + ".after", "{}.after is {} [s], must be greater than {} of the release before", path, after, before);
      } else if (after > 0 && post.duration > 0 && after >= post.duration) {
        add(path + ".after", "{}.after is {} [s], must be less than {}, post_impact's duration", path, after,
            post.duration);
      }
      before = std::max(before, after);
      for (std::size_t k = 0; k < release.end_effectors.size(); ++k) {
        const std::string& name = release.end_effectors[k];
        const auto [first, fresh] = release_of.emplace(name, i);
        if (fresh)
          check_release_after_closing(name, after, path + ".end_effectors", k);
        else if (end_effector(name))
          add_second_release(name, path + ".end_effectors", k, first->second == i, first->second);
      }
    }
  }

  void add_second_release(const std::string& name, const std::string& path, std::size_t k, bool is_same,
                          std::size_t first) {
    const std::string place = fmt::format("{}[{}]", path, k);
    if (is_same)
      add(place, "{} names {} twice", path, in_quotes(name));
    else
      add(place, "end-effector {} in {} is already released in post_impact.release[{}]", in_quotes(name), path, first);
  }

  // With capture_at: envelope, post_impact may begin earlier, and so may the release.
  void check_release_after_closing(const std::string& name, double after, const std::string& path, std::size_t k) {
    const auto grasp = std::find_if(problem_.grasps.begin(), problem_.grasps.end(),
                                    [&](const GraspSetup& g) { return g.end_effector == name; });
    const auto approach = duration_of(problem_.approach);
    if (grasp == problem_.grasps.end() || grasp->closes != GraspSetup::Closes::at_time) return;
    if (!approach || !(after > 0) || grasp->closes_at < *approach + before_ + after) return;
    add(fmt::format("{}[{}]", path, k), "end-effector {} in {} closes at {} [s], must close before it releases at {}",
        in_quotes(name), path, grasp->closes_at, *approach + before_ + after);
  }

  // ---- The impact ----

  void check_impact(const ImpactSetup& impact) {
    const bool bends =
        is_flexible(problem_.robot) || std::any_of(problem_.targets.begin(), problem_.targets.end(),
                                                   [](const TargetSetup& t) { return !t.panels.empty(); });
    const ImpactLaw& law = impact_law(impact);
    if (law.published && bends)
      add_key("impact.law", "impact.law: as_published: the thesis's formulas support only rigid robots and targets");
    if (impact.modes != ImpactSetup::Modes::all && law.in_time)
      add_key("impact.modes",
              "impact.modes: with law compliant all modes respond; none and slow are for impacts without "
              "duration");
    const std::size_t before = found_.size();
    if (law.published) check_published();
    check_law(impact, law);
    for (std::size_t i = before; i < found_.size(); ++i) {
      if (found_[i].relies_on.empty()) found_[i].relies_on = "impact.law";
    }
  }

  // The thesis's formulas are for rigid grasps of a floating robot that close simultaneously.
  void check_published() {
    const auto undefined = [&](const std::string& why) {
      add("impact.law", "impact.law: as_published is not defined {}; use plastic", why);
    };
    if (problem_.robot.base_mode == RobotSetup::Base::fixed) undefined("for a robot whose base is fixed");
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (grasp.contact) continue;  // reported by check_contact()
      if (grasp.model != GraspModel::rigid) undefined(fmt::format("for grasps[{}], which is not rigid", i));
      if (grasp.closes != GraspSetup::Closes::together || closes_again(grasp))
        undefined(fmt::format("for grasps[{}], which does not close with the others", i));
    }
  }

  // Checks the law's requirements for the grasps.
  void check_law(const ImpactSetup& impact, const ImpactLaw& law) {
    bool any_contact = false, any_grasp = false, any_turning = false;
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      (grasp.contact ? any_contact : any_grasp) = true;
      any_turning = any_turning || (!grasp.contact && grasp.model != GraspModel::point);
      if (grasp.contact) check_contact(grasp, fmt::format("grasps[{}].model", i), law);
    }
    if (!law.of_grasps && !any_contact && any_grasp) {
      add("impact.law",
          "impact.law: {} is for contacts, but every grasp holds; state model: contact for a grasp, or use law "
          "bilateral_restitution or plastic",
          law.name);
    }
    if (!law.in_time) return;
    if (any_contact && impact.contact.stiffness == 0)
      add("impact.law", "impact.law: compliant needs impact.contact with the stiffness of the contacts").relies_on =
          "impact.contact";
    if (any_grasp && impact.grasp.linear_stiffness == 0)
      add("impact.law", "impact.law: compliant needs impact.grasp with the stiffness of the grasps").relies_on =
          "impact.grasp";
    if (any_turning && impact.grasp.angular_stiffness == 0)
      add_key("impact.grasp",
              "missing key 'angular_stiffness' in impact.grasp: rigid grasps and hinges hold rotations too")
          .relies_on = "impact.grasp.angular_stiffness";
  }

  // A contact needs a law with rebound, and a surface.
  void check_contact(const GraspSetup& grasp, const std::string& path, const ImpactLaw& law) {
    if (!law.of_contacts) {
      add(path,
          "{}: contact is not supported by impact.law {}; use restitution, friction or compliant, or a grasp that "
          "holds "
          "(rigid, hinge, point)",
          path, law.name);
    }
    const GraspPoint* point = grasp_point(grasp);
    if (!point || contact_normal(*find_named(problem_.targets, grasp.target), *point)) return;
    add(path,
        "{}: contact needs the surface's normal: state for grasp point {} of target {} a normal, or an "
        "approach_direction "
        "(the normal is opposite to it)",
        path, in_quotes(point->name), in_quotes(grasp.target));
  }

  // ---- Numbers of samples ----

  // Sample and step counts beyond any plausible use.
  void check_lengths() {
    const double approach = longest(problem_.approach).value_or(0);
    const double post = duration_of(problem_.post_impact).value_or(0);
    const double samples = (approach + post) / problem_.output_interval;
    if (problem_.output_interval > 0 && samples > kMostSamples) {
      add("output.interval",
          "output.interval is {} [s], which gives {:.3g} samples over {:.6g} s; at most {:.0f} are allowed",
          problem_.output_interval, samples, approach + post, kMostSamples);
    }
    const IntegrationSetup& integration = problem_.integration;
    const bool fixed_step = integration.method == IntegrationSetup::Method::rk4 && integration.step > 0;
    const double steps = fixed_step ? std::max(approach, post) / integration.step : 0;
    if (steps > static_cast<double>(integration.max_steps)) {
      add("integration.step", "integration.step is {} [s], which gives {:.3g} steps; integration.max_steps allows {}",
          integration.step, steps, integration.max_steps);
    }
  }

  const double before_;
};

constexpr std::string_view kPhasesKey = "post_impact";

void replace_all(std::string& text, std::string_view what, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
}

// The checks call the current phase post_impact; this inserts its place in the file: that of the sequence, and its
// index in a list.
void put_in_place(const CaptureProblem& problem, std::size_t phase, ProblemFault& fault) {
  const std::string key = phases_key(problem);
  const std::string place = problem.post_impact.size() > 1 ? fmt::format("{}[{}]", key, phase) : key;
  const std::string& here = fault.path.starts_with(kPhasesKey) ? place : key;
  for (std::string* text : {&fault.path, &fault.message}) replace_all(*text, kPhasesKey, here);
  if (fault.relies_on.starts_with(kPhasesKey)) replace_all(fault.relies_on, kPhasesKey, here);
}

// Checks each later phase as the first one of a problem, without repeating conflicts of other parts.
void find_in_later_phases(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  CaptureProblem rotated = problem;
  double before = 0;
  for (std::size_t phase = 1; phase < problem.post_impact.size(); ++phase) {
    before += problem.post_impact[phase - 1].duration;
    std::rotate(rotated.post_impact.begin(), rotated.post_impact.begin() + 1, rotated.post_impact.end());
    std::vector<ProblemFault> of_phase;
    Conflicts(rotated, before, of_phase).find();
    for (ProblemFault& fault : of_phase) {
      if (!fault.path.starts_with(kPhasesKey)) continue;
      put_in_place(problem, phase, fault);
      found.push_back(std::move(fault));
    }
  }
}

}  // namespace

std::vector<ProblemFault> problem_conflicts(const CaptureProblem& problem) {
  std::vector<ProblemFault> found;
  Conflicts(problem, 0, found).find();
  for (ProblemFault& fault : found) put_in_place(problem, 0, fault);
  if (problem.post_impact.size() > 1) find_in_later_phases(problem, found);
  find_phase_conflicts(problem, found);
  return found;
}

namespace {

// Conflicts within a body's description. Places and sentences omit the body's own place.
std::vector<ProblemFault> body_conflicts(const RobotSetup& robot, const BodyDescription& body) {
  std::vector<ProblemFault> found;
  const auto add = [&](const char* place, const std::string& sentence) { found.push_back({place, sentence}); };
  const JointDescription& joint = body.joint;
  const JointFriction& friction = joint.friction;
  const JointLimits& limits = joint.limits;
  if (friction.static_effort && *friction.static_effort < friction.coulomb) {
    add(".joint.friction.static",
        fmt::format(".joint.friction.static: {} is less than coulomb, {}", *friction.static_effort, friction.coulomb));
  }
  if (limits.stop && !std::isfinite(limits.lower) && !std::isfinite(limits.upper))
    add(".joint.limits.stop", ".joint.limits.stop: there is neither a lower nor an upper limit");
  if (joint.elasticity) {
    if (const std::string fault = gear_fault(joint); !fault.empty())
      add(".joint.elasticity", ".joint.elasticity: " + fault);
  }
  if (joint.spring && (limits.stop || friction.model == JointFriction::Model::sticking))
    add(".joint.spring", ".joint.spring: a joint with a spring cannot have stops or static friction");
  if (joint.motor && std::isfinite(joint.motor->no_load_rate) && !std::isfinite(limits.effort))
    add(".joint.motor.no_load_rate", ".joint.motor.no_load_rate: needs limits.effort, the effort at rest");
  if (joint.motor && joint.motor->torque_constant > 0 && joint.gear_ratio == 0)
    add(".joint.motor.torque_constant", ".joint.motor.torque_constant: a gear_ratio of 0 transmits no effort");
  const bool is_lost = loses_inertia(body);
  if (!body.modes.empty() && !is_lost) {
    if (const std::string fault = modes_fault(body); !fault.empty()) add(".modes", ".modes: " + fault);
  }
  if (body.beam && !is_lost) {
    if (const std::string fault = beam_fault(body); !fault.empty()) {
      add(".beam", ".beam: " + fault);
    } else if (const std::string of_modes = beam_modes_fault(robot, body); !of_modes.empty()) {
      add(".beam.modes", ".beam.modes: " + of_modes);
    }
  }
  if (is_lost) add(".com", lost_inertia_text(body, ""));
  if (!(limits.lower <= limits.upper)) {
    add(".joint.limits.lower",
        fmt::format(".joint.limits: lower limit {} is above upper limit {}", limits.lower, limits.upper));
  }
  return found;
}

// Faults of coupled joints, with suggestions for unknown ones; `before`: prefix of paths in messages.
void add_coupling_faults(const RobotSetup& robot, const std::string& before, std::vector<ProblemFault>& found) {
  std::vector<std::string> names;
  for (const BodyDescription& body : robot.bodies) {
    if (has_one_axis(body.joint.type)) names.push_back(body.joint.name);
  }
  for (const CouplingFault& fault : coupling_faults(robot.bodies)) {
    const std::vector<CouplingTerm>& terms = robot.bodies[fault.body].joint.mimic;
    if (fault.term >= 0 && terms[fault.term].joint.empty()) continue;  // the reader has reported the missing key
    const std::string joint =
        fault.body == 0 ? std::string("base.joint") : fmt::format("links[{}].joint", fault.body - 1);
    std::string path = joint + ".mimic";
    if (fault.term >= 0 && terms.size() > 1) path += fmt::format("[{}]", fault.term);
    if (!fault.key.empty()) path += "." + fault.key;
    found.push_back({path, fmt::format("{}{}: {}{}", before, joint, fault.text,
                                       fault.unknown ? suggestion(terms[fault.term].joint, names, "joints") : "")});
  }
}

}  // namespace

std::vector<ProblemFault> robot_conflicts(const RobotSetup& robot, const std::string& path) {
  std::vector<ProblemFault> found;
  for (std::size_t i = 0; i < robot.bodies.size(); ++i) {
    for (ProblemFault& fault : body_conflicts(robot, robot.bodies[i])) {
      const std::string here = i == 0 ? "base" : fmt::format("links[{}]", i - 1);
      fault.path = here + fault.path;
      fault.message = (path.empty() ? here : path + "." + here) + fault.message;
      found.push_back(std::move(fault));
    }
  }
  for (std::size_t w = 0; w < robot.wheels.size(); ++w) {
    if (robot.wheels[w].friction.model == JointFriction::Model::smooth) continue;
    const std::string here = fmt::format("wheels[{}].friction.model", w);
    found.push_back({here, fmt::format("{}{}: the bearing of a reaction wheel supports only the friction model smooth",
                                       path.empty() ? "" : path + ".", here)});
  }
  const std::string before = path.empty() ? "" : path + ".";
  add_coupling_faults(robot, before, found);
  add_tendon_faults(robot, before, found);
  bool sound = true;
  for (std::size_t g = 0; g < robot.gyros.size(); ++g) {
    const MomentGyroSetup& gyro = robot.gyros[g];
    const std::string here = fmt::format("gyros[{}]", g);
    if (!(std::abs(dot(gyro.gimbal_axis, gyro.spin_axis)) < 1e-6)) {
      found.push_back(
          {here + ".spin_axis", fmt::format("{}{}.spin_axis must be perpendicular to gimbal_axis; their dot "
                                            "product is {:.3g}",
                                            before, here, dot(gyro.gimbal_axis, gyro.spin_axis))});
    }
    if (!(gyro.gimbal_inertia > 0.5 * gyro.inertia)) {
      sound = false;
      found.push_back(
          {here + ".gimbal_inertia",
           fmt::format("{}{}.gimbal_inertia is {} [kg m^2], must be more than half of inertia, {}, which the "
                       "rotor has across its axis",
                       before, here, gyro.gimbal_inertia, 0.5 * gyro.inertia)});
    }
  }
  if (const std::string fault = sound ? wheel_fault(robot) : ""; !fault.empty()) {
    const char* const key = robot.wheels.empty() ? "gyros" : "wheels";
    found.push_back({key, fmt::format("{}{}: {}", before, key, fault)});
  }
  if (robot.geometry.size() > kMostShapes) {
    found.push_back({"links", fmt::format("the robot's bodies have {} shapes in total, at most {} are allowed",
                                          robot.geometry.size(), kMostShapes)});
  }
  return found;
}

const CaptureProblem& without_conflicts(const CaptureProblem& problem) {
  std::vector<ProblemFault> found = problem_conflicts(problem);
  for (ProblemFault& fault : robot_conflicts(problem.robot, "robot")) found.push_back(std::move(fault));
  if (found.empty()) return problem;
  std::vector<std::string> messages;
  for (const ProblemFault& fault : found) messages.push_back(fault.message);
  throw CaptureProblemError(fmt::format("{}", fmt::join(messages, "\n")));
}

}  // namespace grapnel
