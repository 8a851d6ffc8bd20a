#include "grapnel/problem/problem_conflicts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// More samples than this are a slip of the pen: 10 million of a seven-joint dual arm are some 10 GB.
constexpr double kMostSamples = 1e7;
// Of an orbit's radius: up to there the linear field is within 1.5 %.
constexpr double kNear = 0.01;

template <class Named>
const Named* find_named(const std::vector<Named>& list, const std::string& name) {
  const auto found = std::find_if(list.begin(), list.end(), [&](const Named& one) { return one.name == name; });
  return found == list.end() ? nullptr : &*found;
}

bool is_zero(const Vector3d& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

// Whether the centre of mass is so far from the body's origin that rounding takes the inertia about it.
template <class Body>
bool loses_inertia(const Body& body) {
  constexpr double kLost = 1e-12;    // of mass |com|^2: four digits are left of the inertia
  constexpr double kFarthest = 1e4;  // [m]; beyond, and without an inertia, there is another fault
  const Symmetric3d& I = body.inertia;
  const bool is_given = I.xx != 0 || I.yy != 0 || I.zz != 0;
  return is_given && std::isfinite(body.mass) && norm(body.com) <= kFarthest &&
         std::min({I.xx, I.yy, I.zz}) < kLost * body.mass * dot(body.com, body.com);
}
template <class Body>
std::string lost_inertia_text(const Body& body, const std::string& path) {
  return fmt::format(
      "{}.com is {:.6g} m from the body's origin: beside mass times its square, {:.6g} kg m^2, the inertia is lost to "
      "rounding; put the origin nearer to the body",
      path, norm(body.com), body.mass * dot(body.com, body.com));
}

class Conflicts {
 public:
  explicit Conflicts(const CaptureProblem& problem) : problem_(problem) {}

  std::vector<ProblemFault> find() {
    const bool is_free = problem_.robot.base_mode == RobotSetup::Base::free;
    if (!is_free) check_base_at_rest();
    if (problem_.orbit) check_orbit(*problem_.orbit);
    for (std::size_t i = 0; i < problem_.targets.size(); ++i) {
      if (!loses_inertia(problem_.targets[i])) continue;
      const std::string path = fmt::format("targets[{}]", i);
      found_.push_back({path + ".com", lost_inertia_text(problem_.targets[i], path)});
    }
    check_end_effectors();
    check_arrival();
    if (problem_.approach) {
      check_approach(*problem_.approach);
      if (problem_.approach->base_control && !is_free) refuse_base_control("approach.base_control");
    }
    check_closing();
    if (problem_.impact) check_impact(*problem_.impact);
    if (problem_.post_impact) {
      check_releases(*problem_.post_impact);
      check_joints_afterwards(*problem_.post_impact);
      // A held base is released at the impact.
      if (problem_.post_impact->base_control && problem_.robot.base_mode == RobotSetup::Base::fixed)
        refuse_base_control("post_impact.base_control");
    }
    check_control();
    check_wheels();
    for (std::size_t i = 0; i < problem_.loads.size(); ++i) check_load(problem_.loads[i], i);
    check_shapes();
    check_lengths();
    if (!problem_.approach && !problem_.impact && !problem_.post_impact)
      add("", "nothing to simulate: give 'approach', 'impact' or both");
    return std::move(found_);
  }

 private:
  template <class... Arguments>
  ProblemFault& add(std::string path, fmt::format_string<Arguments...> form, Arguments&&... arguments) {
    return found_.emplace_back(ProblemFault{std::move(path), fmt::format(form, std::forward<Arguments>(arguments)...)});
  }
  // That a key is there.
  template <class... Arguments>
  ProblemFault& add_key(std::string path, fmt::format_string<Arguments...> form, Arguments&&... arguments) {
    ProblemFault& fault = add(std::move(path), form, std::forward<Arguments>(arguments)...);
    fault.of_key = true;
    return fault;
  }

  const EndEffectorSetup* end_effector(const std::string& name) const {
    return find_named(problem_.robot.end_effectors, name);
  }
  const GraspPoint* grasp_point(const GraspSetup& grasp) const {
    const TargetSetup* target = find_named(problem_.targets, grasp.target);
    return target ? find_named(target->grasp_points, grasp.grasp_point) : nullptr;
  }

  // ---- Bodies ----

  // Those of the robot alone are its own conflict.
  void check_shapes() {
    const std::size_t of_robot = problem_.robot.geometry.size();
    std::size_t all = of_robot;
    for (const TargetSetup& target : problem_.targets) all += target.geometry.size();
    if (all <= kMostShapes || of_robot > kMostShapes) return;
    add("targets", "targets and robot have {} shapes in all, at most {} are allowed", all, kMostShapes);
  }

  // ---- The beginning ----

  void check_base_at_rest() {
    const auto refuse = [&](const char* key) {
      add_key(fmt::format("initial.base.{}", key),
              "initial.base.{}: the robot's base is {}, so its motion cannot be given", key,
              name_of(problem_.robot.base_mode));
    };
    if (problem_.V_WB && !is_zero(problem_.V_WB->angular)) refuse("angular_velocity");
    if (problem_.V_WB && !is_zero(problem_.V_WB->linear)) refuse("velocity");
    if (problem_.momentum) refuse("momentum");
  }

  // ---- The orbit ----

  void check_orbit(const OrbitSetup& setup) {
    if (!is_zero(problem_.gravity))
      add_key("gravity", "gravity: it is for test beds on the ground; a frame that falls with an 'orbit' feels none");
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add_key("orbit",
              "orbit: the robot's base is fixed to a ground, which does not fall with an orbit; use base mode "
              "free or held");
    if (std::abs(dot(setup.radial, setup.along_track)) > 1e-9) {
      add("orbit.along_track",
          "orbit.along_track must be perpendicular to orbit.radial; their product is {:.3g}, the angle between them "
          "{:.4g} degrees",
          dot(setup.radial, setup.along_track),
          std::acos(std::clamp(dot(setup.radial, setup.along_track), -1.0, 1.0)) * 180 / std::numbers::pi)
          .relies_on = "orbit.radial";
    }
    const ReferenceOrbit orbit = reference_orbit(setup);
    if (!fault_of(orbit).empty()) return;  // said elsewhere
    const double lowest = orbit.semi_major_axis * (1 - orbit.eccentricity), radius = central_body(setup.body).radius;
    if (!setup.mu && lowest < radius) {
      add(setup.altitude ? "orbit.altitude" : "orbit.semi_major_axis",
          "orbit: its lowest point is {:.6g} m from the centre of the body {}, below its surface at {:.6g}; lengths "
          "are "
          "in m, or carry their unit (7000 km)",
          lowest, name_of(setup.body), radius);
      return;
    }
    check_nearness(lowest);
  }

  // Whether the linear field holds where things are, and come to be.
  void check_nearness(double lowest) {
    const double duration = duration_of(problem_.approach).value_or(0) + duration_of(problem_.post_impact).value_or(0);
    const auto check = [&](const std::string& path, const Vector3d& position, const Vector3d& velocity) {
      const double off = norm(position), way = norm(velocity) * duration, most = kNear * lowest;
      if (!(off + way > most) || !std::isfinite(off + way)) return;
      if (off >= way) {
        add(path + ".position",
            "{}.position: {:.6g} m from the orbit's reference point, which is W's origin; the field near an orbit is "
            "linear and holds within {:.6g} m",
            path, off, most);
      } else {
        add(path + ".velocity",
            "{}.velocity: it leads {:.6g} m away from the orbit's reference point within the run; velocities are "
            "relative to the orbit, and its field is linear and holds within {:.6g} m",
            path, way, most);
      }
    };
    check("initial.base", problem_.X_WB.p, problem_.V_WB ? problem_.V_WB->linear : Vector3d::zero());
    for (std::size_t i = 0; i < problem_.targets.size(); ++i)
      check(fmt::format("targets[{}].state", i), problem_.targets[i].X_WT.p, problem_.targets[i].V_WT.linear);
  }

  // ---- Reaction wheels ----

  void check_wheels() {
    const std::vector<WheelSetup>& wheels = problem_.robot.wheels;
    if (!problem_.wheel_rate.empty() && problem_.wheel_rate.size() != wheels.size())
      add("initial.wheel_rates", "initial.wheel_rates: {} values, the robot has {} wheels", problem_.wheel_rate.size(),
          wheels.size());
    for (std::size_t i = 0; i < std::min(wheels.size(), problem_.wheel_rate.size()); ++i) {
      if (std::abs(problem_.wheel_rate[i]) > wheels[i].rate)
        add("initial.wheel_rates", "initial.wheel_rates: {} rad/s of wheel {}, whose largest rate is {} rad/s",
            problem_.wheel_rate[i], in_quotes(wheels[i].name), wheels[i].rate);
    }
    if (problem_.approach) check_wheels_of(problem_.approach->base_control, "approach.base_control");
    if (problem_.post_impact) check_wheels_of(problem_.post_impact->base_control, "post_impact.base_control");
  }

  // That they can turn the base as they are asked to.
  void check_wheels_of(const std::optional<BaseControlSetup>& control, const std::string& path) {
    if (!control || control->actuators == BaseControlSetup::Actuators::outside) return;
    const std::vector<WheelSetup>& wheels = problem_.robot.wheels;
    if (wheels.empty()) {
      if (control->actuators)
        add(path + ".actuators", "{}.actuators: wheels, and the robot has none (wheels: [...] in the robot file)",
            path);
      return;
    }
    std::vector<Vector3d> axes;
    for (const WheelSetup& wheel : wheels) axes.push_back(wheel.axis);
    for (int k = 0; k < 3; ++k) {
      if (control->kp[k] == 0 && control->kd[k] == 0) continue;
      if (lacking_torque(axes, axis_vector(k)) < 1e-6) continue;
      add(path,
          "{}: its gains ask for torque about {}, which the robot's wheels cannot give; give the gains of each axis, "
          "with 0 for those that are not controlled, or actuators: outside",
          path, "xyz"[k]);
    }
  }

  static Vector3d axis_vector(int k) {
    Vector3d axis = Vector3d::zero();
    axis[k] = 1;
    return axis;
  }

  // ---- The on-board computer ----

  void check_control() {
    const bool in_approach = problem_.approach && problem_.approach->tracking.mode == JointControl::controller;
    const bool afterwards = problem_.post_impact && problem_.post_impact->joints == PostImpactSetup::Joints::controller;
    const bool is_there = problem_.control && problem_.control->has_controller();
    const auto needs_plugin = [&](const char* path) {
      add(path,
          "{} is controller, which needs the plugin or the log that drives them: control: {{period: ..., plugin: ...}}",
          path)
          .relies_on = "control";
    };
    if (in_approach && !is_there) needs_plugin("approach.tracking.mode");
    if (afterwards && !is_there) needs_plugin("post_impact.joints");
    if (!problem_.control) return;
    check_timing(problem_.control->timing);
    if (problem_.control->log) check_rows(*problem_.control);
    if (is_there && !in_approach && !afterwards) {
      const char* const path = problem_.control->log ? "control.torques" : "control.plugin";
      add(path, "{} drives nothing: approach.tracking.mode or post_impact.joints must be controller", path);
    }
    if (!problem_.control->base_torque) return;
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add("control.base_torque", "control.base_torque: the robot's base is fixed, so no torque turns it");
    std::vector<Vector3d> axes;
    for (const WheelSetup& wheel : problem_.robot.wheels) axes.push_back(wheel.axis);
    for (int k = 0; k < 3 && !axes.empty(); ++k) {
      if (lacking_torque(axes, axis_vector(k)) >= 1e-6)
        add("control.base_torque", "control.base_torque: the robot's wheels, which give it, can give none about {}",
            "xyz"[k]);
    }
    const auto both = [&](const char* path) {
      add_key(path, "{}: control.base_torque leaves the base's torque to the plugin; leave out one of the two", path);
    };
    if (in_approach && problem_.approach->base_control) both("approach.base_control");
    if (afterwards && problem_.post_impact->base_control) both("post_impact.base_control");
  }

  // A row between two samples would never be read, or late.
  void check_rows(const ControlSetup& control) {
    const double period = control.timing.period;
    if (!(period > 0)) return;
    for (const double t : control.log->times) {
      if (std::abs(t / period - std::round(t / period)) <= 1e-6) continue;
      add("control.torques", "control.torques has a row at {} [s], which is no multiple of control.period, {}", t,
          period)
          .relies_on = "control.period";
      return;
    }
  }

  // Ticks are breaks of the integration, which are listed before it.
  void check_timing(const ControlTiming& timing) {
    const auto approach = duration_of(problem_.approach), after = duration_of(problem_.post_impact);
    if (!approach || !after || !(timing.period > 0) || !(timing.delay >= 0)) return;
    const double run = *approach + *after, ticks = run / timing.period;
    constexpr double kMostTicks = 1e7;
    if (ticks > kMostTicks) {
      add("control.period", "control.period is {} [s], which makes {:.3g} samples in the run's {} s; at most {:.0f}",
          timing.period, ticks, run, kMostTicks);
    } else if (run > 0 && timing.period >= run) {
      add("control.period",
          "control.period is {} [s], must be less than {}, the length of the run: sensors would be read once",
          timing.period, run);
    }
    if (run > 0 && timing.delay >= run)
      add("control.delay", "control.delay is {} [s], must be less than {}, the length of the run: no command would act",
          timing.delay, run);
  }

  void refuse_base_control(const char* path) {
    add_key(path, "{}: the robot's base is {}, so its attitude needs no control", path,
            name_of(problem_.robot.base_mode));
  }

  void check_end_effectors() {
    std::map<std::string_view, std::size_t> grasp_of;
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const std::string& name = problem_.grasps[i].end_effector;
      const auto [first, fresh] = grasp_of.emplace(name, i);
      if (fresh || name.empty()) continue;
      add(fmt::format("grasps[{}].end_effector", i),
          "end-effector {} in grasps[{}] is used twice; it already holds in grasps[{}]", in_quotes(name), i,
          first->second);
    }
  }

  // ---- The approach ----

  // Relative velocities of grasps, against what says how the joints arrive.
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
      fault("approach.straight_in says how it arrives; use its final_speed");
    } else if (approach->sampled || !approach->pieces.empty() ||
               (!approach->match && (approach->final_rates || !approach->plan))) {
      fault("the final rates are given, so that there is nothing to match; use approach.final_rates: {match: ...}");
    } else if (angular && approach->match && *approach->match != RateMatch::twist) {
      fault("the turning is not matched; use approach.final_rates: {match: twist}");
    }
  }

  // A phase's duration; 0 without the phase. Empty where it is in doubt.
  template <class Phase>
  static std::optional<double> duration_of(const std::optional<Phase>& phase) {
    if (!phase) return 0.0;
    if (!(phase->duration > 0) || !std::isfinite(phase->duration)) return {};
    return phase->duration;
  }

  void check_approach(const ApproachSetup& approach) {
    if (approach.plan && problem_.grasps.empty())
      add_key("approach.plan", "approach.plan needs 'grasps': there is nothing to reach").relies_on = "grasps";
    if (approach.capture_at == ApproachSetup::CaptureAt::envelope) check_envelopes();
    if (approach.straight_in) check_directions();
    const double straight = approach.straight_in ? approach.straight_in->duration : 0;
    if (approach.straight_in && approach.duration > 0 && straight >= approach.duration) {
      add("approach.straight_in.duration",
          "approach.straight_in.duration is {} [s], must be less than the approach's {}", straight, approach.duration);
    }
    const double end = approach.duration - straight;
    double before = 0;
    for (std::size_t i = 0; i < approach.waypoints.size(); ++i) {
      const double time = approach.waypoints[i].time;
      const std::string path = fmt::format("approach.waypoints[{}].time", i);
      if (time > 0 && time <= before) {
        add(path, "{} is {} [s], must be greater than {} of the waypoint before", path, time, before);
      } else if (time > 0 && end > 0 && time >= end) {
        add(path, "{} is {} [s], must be less than {}, {}", path, time, end,
            straight > 0 ? "where straight_in begins" : "the approach's duration");
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

  // What capture_at: envelope waits for.
  void check_envelopes() {
    const char* const path = "approach.capture_at";
    if (problem_.grasps.empty())
      add(path, "{}: envelope needs 'grasps': there is nothing to close on", path).relies_on = "grasps";
    const auto waits = [](const GraspSetup& grasp) { return grasp.closes == GraspSetup::Closes::together; };
    if (!problem_.grasps.empty() && std::none_of(problem_.grasps.begin(), problem_.grasps.end(), waits)) {
      add(path,
          "{}: envelope has nothing to wait for: every grasp has closes_at or closes_on_arrival; leave out capture_at",
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

  // The thesis's profile has no initial rate in it, so neither joints that follow it exactly nor its later pieces can
  // have one.
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

  // ---- Grasps that close, and release ----

  void check_closing() {
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (grasp.closes == GraspSetup::Closes::together) continue;
      const bool at_time = grasp.closes == GraspSetup::Closes::at_time;
      const std::string path = fmt::format("grasps[{}].{}", i, at_time ? "closes_at" : "closes_on_arrival");
      const EndEffectorSetup* effector = end_effector(grasp.end_effector);
      if (!at_time && effector && !effector->envelope)
        add(path, "{} needs an 'envelope' at end-effector {}", path, in_quotes(effector->name));
      if (!problem_.impact) {
        add(path, "{} needs 'impact' in the scenario: without it nothing closes", path);
      } else if (at_time) {
        check_closing_time(grasp.closes_at, path);
      }
    }
  }

  void check_closing_time(double time, const std::string& path) {
    const auto approach = duration_of(problem_.approach), after = duration_of(problem_.post_impact);
    if (!(time > 0) || !approach) return;
    if (time > *approach && !problem_.post_impact) {
      const std::string end = *approach > 0 ? fmt::format("after the approach's end at {}", *approach)
                                            : "but without an approach all is at 0";
      add(path, "{} is {} [s], {}; what closes later needs 'post_impact'", path, time, end);
    } else if (after && time > *approach + *after) {
      add(path, "{} is {} [s], must be at most {}, the end of post_impact", path, time, *approach + *after);
    }
  }

  void check_joints_afterwards(const PostImpactSetup& post) {
    using Joints = PostImpactSetup::Joints;
    if (post.move) {
      const double end = post.move->after + post.move->duration;
      if (post.joints == Joints::free || post.joints == Joints::braked)
        add_key("post_impact.move",
                "post_impact.move: joints that are {} follow nothing; use joints: pd or computed_torque",
                name_of(post.joints))
            .relies_on = "post_impact.joints";
      if (is_law(post.joints))
        add_key("post_impact.move",
                "post_impact.move: joints that {} go where that takes them; use joints: pd or computed_torque",
                name_of(post.joints))
            .relies_on = "post_impact.joints";
      if (post.move->duration > 0 && post.duration > 0 && end > post.duration)
        add("post_impact.move.duration", "post_impact.move ends after {} [s], must end within post_impact's {}", end,
            post.duration);
    }
    check_laws(post);
    if (post.joints == Joints::computed_torque)
      refuse_loops("computed_torque, but", "joints of a closed loop cannot be accelerated one by one; use pd");
    if (post.joints == Joints::keep_base_attitude)
      refuse_loops("keep_base_attitude, but", "this law is not there for closed loops; use detumble or pd");
  }

  void refuse_loops(std::string_view what, std::string_view why) {
    std::map<std::string_view, std::size_t> holds;  // by target
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (grasp.contact || grasp.target.empty()) continue;
      const auto [first, fresh] = holds.emplace(grasp.target, i);
      if (fresh) continue;
      add("post_impact.joints", "post_impact.joints is {} grasps[{}] and grasps[{}] hold one target, and {}", what,
          first->second, i, why);
      return;
    }
  }

  // Laws that move all joints together.
  void check_laws(const PostImpactSetup& post) {
    using Joints = PostImpactSetup::Joints;
    const auto refuse = [&](const char* key) {
      add_key(fmt::format("post_impact.{}", key), "post_impact.{} belongs to joints: {}; they are {}", key, key,
              name_of(post.joints))
          .relies_on = "post_impact.joints";
    };
    if (post.detumble && post.joints != Joints::detumble) refuse("detumble");
    if (post.keep_base_attitude && post.joints != Joints::keep_base_attitude) refuse("keep_base_attitude");
    if (post.joints == Joints::detumble && post.detumble) check_detumbling(post.detumble->target);
    if (post.joints == Joints::detumble && std::any_of(post.kd.begin(), post.kd.end(), [](double d) { return d <= 0; }))
      add("post_impact.kd", "post_impact.kd must be above 0 with joints: detumble, which share the efforts by it");
    if (post.joints != Joints::keep_base_attitude) return;
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add("post_impact.joints",
          "post_impact.joints is keep_base_attitude, but the robot's base is fixed and needs none");
    if (post.base_control)
      add_key("post_impact.base_control",
              "post_impact.base_control: the joints keep the base's attitude already; use one of both")
          .relies_on = "post_impact.joints";
  }

  // What is brought to rest, and whether those that hold it can.
  void check_detumbling(const std::string& named) {
    std::vector<std::string> held;
    for (const GraspSetup& grasp : problem_.grasps) {
      const bool fresh = std::find(held.begin(), held.end(), grasp.target) == held.end();
      if (!grasp.contact && fresh && find_named(problem_.targets, grasp.target)) held.push_back(grasp.target);
    }
    if (held.empty()) return;  // there are no grasps, or faulty ones
    const std::string path = "post_impact.detumble.target";
    if (named.empty() && held.size() > 1) {
      add("post_impact.detumble", "post_impact.detumble: the grasps hold {} targets; say which by 'target', {} or {}",
          held.size(), in_quotes(held[0]), in_quotes(held[1]));
      return;
    }
    if (!named.empty() && std::find(held.begin(), held.end(), named) == held.end()) {
      add(path, "{} is {}, which no grasp holds{}", path, in_quotes(named), suggestion(named, held, "targets"));
      return;
    }
    const std::string& target = named.empty() ? held[0] : named;
    bool any_rigid = false;
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      const EndEffectorSetup* hand = end_effector(grasp.end_effector);
      if (grasp.contact || grasp.target != target || !hand) continue;
      any_rigid = any_rigid || grasp.model == GraspModel::rigid;
      const int joints = moving_joints_to(hand->body), turns = 6 - row_count(grasp.model);
      if (joints + turns >= 6) continue;
      add("post_impact.joints",
          "post_impact.joints is detumble, but the arm of grasps[{}] has {} moving joint{}; the six motions of {} take "
          "6 "
          "or more",
          i, joints, joints == 1 ? "" : "s", in_quotes(target));
    }
    if (!any_rigid)
      add("post_impact.joints",
          "post_impact.joints is detumble, but no grasp of {} is rigid: hinges and points pass on no torque about "
          "their "
          "own axes",
          in_quotes(target));
  }

  // Between the base and a link.
  int moving_joints_to(const std::string& link) const {
    int joints = 0;
    const BodyDescription* body = nullptr;
    for (std::string name = link; !name.empty(); name = body->parent) {
      const auto is_it = [&](const BodyDescription& b) { return b.name == name; };
      const auto found = std::find_if(problem_.robot.bodies.begin(), problem_.robot.bodies.end(), is_it);
      if (found == problem_.robot.bodies.end() || found->parent.empty()) break;
      body = &*found;
      joints += velocity_count(body->joint.type);
    }
    return joints;
  }

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
      add(place, "end-effector {} in {} has released before, in post_impact.release[{}]", in_quotes(name), path, first);
  }

  // With capture_at: envelope post_impact may begin, and the grasp be released, still earlier than this.
  void check_release_after_closing(const std::string& name, double after, const std::string& path, std::size_t k) {
    const auto grasp = std::find_if(problem_.grasps.begin(), problem_.grasps.end(),
                                    [&](const GraspSetup& g) { return g.end_effector == name; });
    const auto approach = duration_of(problem_.approach);
    if (grasp == problem_.grasps.end() || grasp->closes != GraspSetup::Closes::at_time) return;
    if (!approach || !(after > 0) || grasp->closes_at < *approach + after) return;
    add(fmt::format("{}[{}]", path, k), "end-effector {} in {} closes at {} [s], must close before it releases at {}",
        in_quotes(name), path, grasp->closes_at, *approach + after);
  }

  // ---- The impact ----

  using Law = ImpactSetup::Law;

  void check_impact(const ImpactSetup& impact) {
    const std::size_t before = found_.size();
    if (impact.law == Law::as_published) check_published();
    check_law(impact);
    for (std::size_t i = before; i < found_.size(); ++i) {
      if (found_[i].relies_on.empty()) found_[i].relies_on = "impact.law";
    }
  }

  // The thesis's formulas are for rigid grasps of a floating robot that close all at once.
  void check_published() {
    const auto undefined = [&](const std::string& why) {
      add("impact.law", "impact.law: as_published is not defined {}; use plastic", why);
    };
    if (problem_.robot.base_mode == RobotSetup::Base::fixed) undefined("for a robot whose base is fixed");
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (grasp.contact) continue;  // said by check_contact()
      if (grasp.model != GraspModel::rigid) undefined(fmt::format("for grasps[{}], which is not rigid", i));
      if (grasp.closes != GraspSetup::Closes::together)
        undefined(fmt::format("for grasps[{}], which does not close with the others", i));
    }
  }

  // What the law needs of the grasps.
  void check_law(const ImpactSetup& impact) {
    bool any_contact = false, any_grasp = false, any_turning = false;
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      (grasp.contact ? any_contact : any_grasp) = true;
      any_turning = any_turning || (!grasp.contact && grasp.model != GraspModel::point);
      if (grasp.contact) check_contact(grasp, fmt::format("grasps[{}].model", i), impact.law);
    }
    if (is_of_contacts(impact.law) && impact.law != Law::compliant && !any_contact && any_grasp) {
      add("impact.law",
          "impact.law: {} is for contacts, and every grasp here holds; give a grasp model: contact, or use law "
          "bilateral_restitution or plastic",
          name_of(impact.law));
    }
    if (impact.law != Law::compliant) return;
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

  // A contact needs a law that lets it rebound, and a surface.
  void check_contact(const GraspSetup& grasp, const std::string& path, Law law) {
    if (!is_of_contacts(law)) {
      add(path,
          "{}: contact has no meaning with impact.law {}; use restitution, friction or compliant, or let it hold "
          "(rigid, hinge, point)",
          path, name_of(law));
    }
    const GraspPoint* point = grasp_point(grasp);
    if (!point || contact_normal(*find_named(problem_.targets, grasp.target), *point)) return;
    add(path,
        "{}: contact needs the surface's normal: give grasp point {} of target {} a normal, or an approach_direction "
        "(the normal is against it)",
        path, in_quotes(point->name), in_quotes(grasp.target));
  }

  static bool is_of_contacts(Law law) {
    return law == Law::restitution || law == Law::friction || law == Law::compliant;
  }

  // ---- Loads, numbers of samples ----

  void check_load(const LoadSetup& load, std::size_t i) {
    const std::string path = fmt::format("external_wrenches[{}]", i);
    check_profile(load.profile, path + ".time");
    if (load.frame == LoadFrame::orbit && !problem_.orbit)
      add(path + ".frame", "{}.frame: orbit needs 'orbit' in the scenario", path).relies_on = "orbit";
    if (!load.stream) return;
    if (load.frame == LoadFrame::body) {
      add(path + ".frame",
          "{}.frame: body has no meaning with a stream, which does not turn with the body; use world "
          "or orbit",
          path);
    }
    if (const double shares = load.stream->specular + load.stream->diffuse; shares > 1) {
      add(path + ".stream", "{}.stream: specular and diffuse are shares of one stream and make {:.6g}, at most 1", path,
          shares);
    }
  }

  void check_profile(const LoadProfile& profile, const std::string& path) {
    const bool ends = profile.shape != LoadProfile::Shape::table && std::isfinite(profile.end);
    if (ends && !(profile.end > profile.start))
      add(path + ".end", "{} ends at {} [s], must end after its start at {}", path, profile.end, profile.start);
    double before = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < profile.times.size(); ++i) {
      const double time = profile.times[i];
      if (!std::isfinite(time)) continue;  // another fault
      const std::string row = fmt::format("{}.values[{}]", path, i);
      if (!(time > before))
        add(row + "[0]", "{}: time {} must be greater than {} of the row before", row, time, before);
      before = time;
    }
  }

  // Sample and step counts that cannot be meant.
  void check_lengths() {
    const double approach = duration_of(problem_.approach).value_or(0);
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

  const CaptureProblem& problem_;
  std::vector<ProblemFault> found_;
};

}  // namespace

std::vector<ProblemFault> problem_conflicts(const CaptureProblem& problem) { return Conflicts(problem).find(); }

std::vector<ProblemFault> robot_conflicts(const RobotSetup& robot, const std::string& path) {
  std::vector<ProblemFault> found;
  for (std::size_t i = 0; i < robot.bodies.size(); ++i) {
    const BodyDescription& body = robot.bodies[i];
    const JointLimits& limits = body.joint.limits;
    const bool is_lost = loses_inertia(body), is_in_order = limits.lower <= limits.upper;
    if (!is_lost && is_in_order) continue;
    const std::string here = i == 0 ? "base" : fmt::format("links[{}]", i - 1);
    const std::string shown = path.empty() ? here : path + "." + here;
    if (is_lost) found.push_back({here + ".com", lost_inertia_text(body, shown)});
    if (!is_in_order) {
      found.push_back(
          {here + ".joint.limits.lower",
           fmt::format("{}.joint.limits: lower limit {} is above upper limit {}", shown, limits.lower, limits.upper)});
    }
  }
  if (const std::string fault = wheel_fault(robot); !fault.empty())
    found.push_back({"wheels", fmt::format("{}wheels: {}", path.empty() ? "" : path + ".", fault)});
  if (robot.geometry.size() > kMostShapes) {
    found.push_back({"links", fmt::format("the robot's bodies have {} shapes in all, at most {} are allowed",
                                          robot.geometry.size(), kMostShapes)});
  }
  return found;
}

}  // namespace grapnel
