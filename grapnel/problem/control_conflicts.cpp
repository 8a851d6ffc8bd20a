// Conflicts of the robot's control: laws of joints and base, the on-board computer, actuators of the base.
#include <map>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "grapnel/simulate/thruster_allocation.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

class ControlConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  void find() {
    check_base_controls();
    if (problem_.post_impact) check_joints_afterwards(*problem_.post_impact);
    check_impedance();
    check_control();
    check_wheels();
    if (problem_.approach) check_actuators_of(problem_.approach->base_control, "approach.base_control");
    if (problem_.post_impact) check_actuators_of(problem_.post_impact->base_control, "post_impact.base_control");
    check_gyros();
  }

 private:
  // ---- Attitude control ----

  void check_base_controls() {
    const RobotSetup::Base mode = problem_.robot.base_mode;
    if (problem_.approach && problem_.approach->base_control && mode != RobotSetup::Base::free)
      refuse_base_control("approach.base_control");
    // A held base is released at the impact.
    if (problem_.post_impact && problem_.post_impact->base_control && mode == RobotSetup::Base::fixed)
      refuse_base_control("post_impact.base_control");
  }

  void refuse_base_control(const char* path) {
    add_key(path, "{}: the robot's base is {}, so its attitude needs no control", path,
            name_of(problem_.robot.base_mode));
  }

  // ---- Reaction wheels ----

  void check_wheels() {
    const std::vector<WheelSetup>& wheels = problem_.robot.wheels;
    if (!problem_.wheel_rate.empty() && problem_.wheel_rate.size() != wheels.size())
      add("initial.wheel_rates", "initial.wheel_rates: {} values, the robot has {} wheels", problem_.wheel_rate.size(),
          wheels.size());
    for (std::size_t i = 0; i < std::min(wheels.size(), problem_.wheel_rate.size()); ++i) {
      if (std::abs(problem_.wheel_rate[i]) > wheels[i].rate)
        add("initial.wheel_rates", "initial.wheel_rates: {} rad/s of wheel {}, whose maximum rate is {} rad/s",
            problem_.wheel_rate[i], in_quotes(wheels[i].name), wheels[i].rate);
    }
    if (problem_.approach) check_wheels_of(problem_.approach->base_control, "approach.base_control");
    if (problem_.post_impact) check_wheels_of(problem_.post_impact->base_control, "post_impact.base_control");
  }

  // Checks that the wheels can give the torques that the gains require.
  void check_wheels_of(const std::optional<BaseControlSetup>& control, const std::string& path) {
    if (!control || !uses_wheels(*control, true)) return;
    const std::vector<WheelSetup>& wheels = problem_.robot.wheels;
    if (wheels.empty()) {
      if (control->actuators)
        add(path + ".actuators", "{}.actuators: wheels, but the robot has none (wheels: [...] in the robot file)",
            path);
      return;
    }
    std::vector<Vector3d> axes;
    for (const WheelSetup& wheel : wheels) axes.push_back(wheel.axis);
    for (int k = 0; k < 3; ++k) {
      if (control->kp[k] == 0 && control->kd[k] == 0) continue;
      if (lacking_torque(axes, axis_vector(k)) < 1e-6) continue;
      add(path,
          "{}: its gains require torque about {}, which the robot's wheels cannot give; state the gains per axis, "
          "with 0 for axes without control, or actuators: outside",
          path, "xyz"[k]);
    }
  }

  // ---- Control moment gyros ----

  void check_gyros() {
    if (!problem_.gimbal_angle.empty() && problem_.gimbal_angle.size() != problem_.robot.gyros.size())
      add("initial.gimbal_angles", "initial.gimbal_angles: {} values, the robot has {} gyros",
          problem_.gimbal_angle.size(), problem_.robot.gyros.size());
    if (problem_.approach) check_gyros_of(problem_.approach->base_control, "approach.base_control");
    if (problem_.post_impact) check_gyros_of(problem_.post_impact->base_control, "post_impact.base_control");
  }

  bool uses_gyros(const BaseControlSetup& control) const {
    if (control.actuators) return control.actuators == Actuators::gyros;
    return problem_.robot.wheels.empty() && !problem_.robot.gyros.empty();
  }

  void check_gyros_of(const std::optional<BaseControlSetup>& control, const std::string& path) {
    if (!control) return;
    if (!uses_gyros(*control)) {
      if (control->steering)
        add_key(path + ".steering", "{}.steering: no gyros are used; it requires actuators: gyros", path).relies_on =
            path + ".actuators";
      return;
    }
    if (problem_.robot.gyros.empty()) {
      add(path + ".actuators", "{}.actuators: gyros, but the robot has none (gyros: [...] in the robot file)", path);
      return;
    }
    check_gyro_torques(path);
  }

  // Checks that gyros can turn the base about every axis, for some gimbal angles.
  void check_gyro_torques(const std::string& path) {
    const std::vector<MomentGyroSetup>& gyros = problem_.robot.gyros;
    if (gyros.size() < 3) {
      add(path,
          "{}: the robot's {} gyro{} cannot give torque about all axes; use three or more, or actuators: "
          "outside",
          path, gyros.size(), gyros.size() == 1 ? "" : "s");
      return;
    }
    for (int k = 0; k < 3; ++k) {
      // A gyro's torque is perpendicular to its gimbal axis.
      if (std::any_of(gyros.begin(), gyros.end(),
                      [&](const MomentGyroSetup& g) { return norm(cross(g.gimbal_axis, axis_vector(k))) >= 1e-6; }))
        continue;
      add(path, "{}: all gimbals of the robot's gyros turn about {}, so they can give no torque about this axis", path,
          "xyz"[k]);
    }
  }

  // ---- Thrusters, and wheels and thrusters together ----

  using Actuators = BaseControlSetup::Actuators;

  // `requested`: also if the robot has no wheels.
  bool uses_wheels(const BaseControlSetup& control, bool requested = false) const {
    if (control.actuators && control.actuators != Actuators::wheels) return false;
    return requested || !problem_.robot.wheels.empty();
  }

  void check_actuators_of(const std::optional<BaseControlSetup>& control, const std::string& path) {
    if (!control) return;
    const bool drives = control->actuators == Actuators::thrusters;
    if (drives && problem_.robot.thrusters.empty())
      add(path + ".actuators", "{}.actuators: thrusters, but the robot has none (thrusters: [...] in the robot file)",
          path);
    if (control->modulation && !drives && !control->dumping)
      add_key(path + ".thrusters", "{}.thrusters: no thrusters are used; it requires actuators: thrusters, or dumping",
              path)
          .relies_on = path + ".actuators";
    if (control->dumping) check_dumping(*control, path);
    if (drives && !problem_.robot.thrusters.empty()) check_turning(*control, path);
    if (drives || control->dumping) check_modulation(*control, path);
    if (control->actuators && is_other(*control->actuators)) {
      if (const std::string fault = functions_of(*control->actuators).fault(problem_); !fault.empty())
        add(path + ".actuators", "{}.actuators: {}", path, fault);
    }
    check_wheel_speeds(*control, path);
  }

  // Checks that thrusters can give the torques that the gains require, in both directions.
  void check_turning(const BaseControlSetup& control, const std::string& path) {
    const ThrusterAllocation allocation = thruster_allocation();
    for (int k = 0; k < 3; ++k) {
      if (control.kp[k] == 0 && control.kd[k] == 0) continue;
      if (allocation.can_provide(axis_vector(k)) && allocation.can_provide(-axis_vector(k))) continue;
      add(path,
          "{}: its gains require torque about {}, which the robot's thrusters cannot give in both directions; state "
          "the gains "
          "per axis, with 0 for axes without control, or actuators: outside",
          path, "xyz"[k]);
    }
  }

  void check_dumping(const BaseControlSetup& control, const std::string& path) {
    const std::string here = path + ".dumping";
    if (!uses_wheels(control)) {
      add_key(here, "{}: momentum dumping requires reaction wheels, but base_control does not use any", here);
      return;
    }
    if (!(control.dumping->below < control.dumping->above))
      add(here + ".below", "{}.below is {} [N m s], must be less than above, {}", here, control.dumping->below,
          control.dumping->above);
    if (problem_.robot.thrusters.empty()) {
      add_key(here, "{}: the robot has no thrusters (thrusters: [...] in the robot file)", here);
      return;
    }
    std::vector<Vector3d> axes;
    for (const WheelSetup& wheel : problem_.robot.wheels) axes.push_back(wheel.axis);
    const ThrusterAllocation allocation = thruster_allocation();
    for (int k = 0; k < 3; ++k) {
      if (lacking_torque(axes, axis_vector(k)) >= 1e-6) continue;
      if (allocation.can_provide(axis_vector(k)) && allocation.can_provide(-axis_vector(k))) continue;
      add_key(here,
              "{}: wheels accumulate momentum about {}, about which the robot's thrusters cannot give torque in both "
              "directions",
              here, "xyz"[k]);
    }
    if (control.modulation && control.modulation->kind != ThrusterModulation::Kind::pulse_width)
      add(path + ".thrusters.modulation", "{}.thrusters.modulation: dumping needs pulse_width", path);
  }

  void check_modulation(const BaseControlSetup& control, const std::string& path) {
    const ThrusterModulation modulation = control.modulation.value_or(ThrusterModulation{});
    if (!(modulation.level_off < modulation.level_on))
      add(path + ".thrusters.level_off", "{}.thrusters.level_off is {}, must be less than level_on, {}", path,
          modulation.level_off, modulation.level_on);
    if (modulation.kind != ThrusterModulation::Kind::pulse_width) return;
    if (!problem_.control) {
      add(path, "{}: thrusters with pulse_width fire in the periods of the control clock: control: {{period: ...}}",
          path)
          .relies_on = "control";
      return;
    }
    for (std::size_t i = 0; i < problem_.robot.thrusters.size(); ++i) {
      const ThrusterSetup& thruster = problem_.robot.thrusters[i];
      if (thruster.min_on_time < problem_.control->timing.period) continue;
      add(path,
          "{}: thruster {} fires for {} s or more (min_on_time), which must be less than control.period, {} s, for "
          "pulse_width",
          path, in_quotes(thruster.name), thruster.min_on_time, problem_.control->timing.period)
          .relies_on = "control.period";
    }
  }

  void check_wheel_speeds(const BaseControlSetup& control, const std::string& path) {
    if (control.wheel_speed_rate == 0 && control.wheel_speeds.empty()) return;
    const std::vector<WheelSetup>& wheels = problem_.robot.wheels;
    const std::string rate = path + ".wheel_speed_rate", speeds = path + ".wheel_speeds";
    if (!uses_wheels(control)) {
      add(control.wheel_speeds.empty() ? rate : speeds,
          "{} requires reaction wheels, but base_control does not use any",
          control.wheel_speeds.empty() ? rate : speeds);
      return;
    }
    if (control.wheel_speed_rate == 0)
      add(speeds, "{}: without wheel_speed_rate the wheels do not reach these rates", speeds);
    if (!control.wheel_speeds.empty() && control.wheel_speeds.size() != wheels.size()) {
      add(speeds, "{}: {} values, the robot has {} wheels", speeds, control.wheel_speeds.size(), wheels.size());
      return;
    }
    for (std::size_t i = 0; i < control.wheel_speeds.size(); ++i) {
      if (std::abs(control.wheel_speeds[i]) > wheels[i].rate)
        add(speeds, "{}: {} rad/s of wheel {}, whose maximum rate is {} rad/s", speeds, control.wheel_speeds[i],
            in_quotes(wheels[i].name), wheels[i].rate);
    }
  }

  ThrusterAllocation thruster_allocation() const {
    const std::vector<ThrusterSetup>& thrusters = problem_.robot.thrusters;
    Vector3d com = Vector3d::zero();
    if (!problem_.robot.bodies.empty()) com = problem_.robot.bodies[0].com;
    return ThrusterAllocation(std::vector<Thruster>(thrusters.begin(), thrusters.end()), com);
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
    const bool any_phase = problem_.post_impact.any(
        [](const PostImpactSetup& phase) { return phase.joints == PostImpactSetup::Joints::controller; });
    const bool is_there = problem_.control && (problem_.control->has_controller() || problem_.control->source);
    const auto needs_plugin = [&](const char* path) {
      add(path,
          "{} is controller, which needs the plugin, the FMU or the log that drives them: control: {{period: ..., "
          "plugin: ...}}",
          path)
          .relies_on = "control";
    };
    if (in_approach && !is_there) needs_plugin("approach.tracking.mode");
    if (afterwards && !is_there) needs_plugin("post_impact.joints");
    if (!problem_.control) return;
    check_timing(problem_.control->timing);
    if (problem_.control->log) check_rows(*problem_.control);
    if (problem_.control->log) check_log(*problem_.control->log, in_approach, afterwards);
    if (is_there && !in_approach && !any_phase) {
      const char* const path = problem_.control->log            ? "control.torques"
                               : problem_.control->external     ? "control.external"
                               : !problem_.control->fmu.empty() ? "control.fmu"
                                                                : "control.plugin";
      add(path, "{} drives nothing: approach.tracking.mode or post_impact.joints must be controller", path);
    }
    check_external(*problem_.control);
    const auto both = [&](const char* path) {
      add_key(path, "{}: control.{} assigns the base's torque to the controller; leave out one of the two", path,
              problem_.control->base_torque ? "base_torque" : "base_actuators");
    };
    if (problem_.control->base_torque || problem_.control->base_actuators) {
      if (in_approach && problem_.approach->base_control) both("approach.base_control");
      if (afterwards && problem_.post_impact->base_control) both("post_impact.base_control");
    }
    if (problem_.control->base_actuators) check_base_actuators(*problem_.control);
    if (!problem_.control->base_torque) return;
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add("control.base_torque", "control.base_torque: the robot's base is fixed, so a torque has no effect");
    if (problem_.robot.wheels.empty() && !problem_.robot.gyros.empty()) check_gyro_torques("control.base_torque");
    std::vector<Vector3d> axes;
    for (const WheelSetup& wheel : problem_.robot.wheels) axes.push_back(wheel.axis);
    for (int k = 0; k < 3 && !axes.empty(); ++k) {
      if (lacking_torque(axes, axis_vector(k)) >= 1e-6)
        add("control.base_torque",
            "control.base_torque: the robot's wheels, which give it, cannot give torque about {}", "xyz"[k]);
    }
  }

  void check_base_actuators(const ControlSetup& control) {
    const RobotSetup& robot = problem_.robot;
    const char* const path = "control.base_actuators";
    if (control.log || !(control.has_controller() || control.source))
      add(path, "{} needs a controller: plugin, fmu or external", path).relies_on = "control";
    if (control.base_torque)
      add(path, "{} excludes base_torque, because the controller commands the actuators that produce this torque",
          path);
    if (robot.wheels.empty() && robot.gyros.empty() && robot.thrusters.empty())
      add(path, "{}: the robot has no wheels, gyros or thrusters", path);
    if (robot.base_mode == RobotSetup::Base::fixed)
      add(path, "{}: the robot's base is fixed, so its actuators have no effect", path);
  }

  // A log commands the actuators of the base, as attitude control would.
  void check_log(const EffortLog& log, bool in_approach, bool afterwards) {
    if (!log.commands_actuators()) return;
    const auto both = [&](const char* path) {
      add_key(path, "{}: control.torques commands each actuator of the base; leave out one of the two", path)
          .relies_on = "control.torques";
    };
    if (in_approach && problem_.approach->base_control) both("approach.base_control");
    if (afterwards && problem_.post_impact->base_control) both("post_impact.base_control");
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add("control.torques", "control.torques commands the base's actuators, but the base is fixed");
    const double period = problem_.control->timing.period;
    for (std::size_t i = 0; i < std::min(log.thruster.size(), problem_.robot.thrusters.size()); ++i) {
      const ThrusterSetup& thruster = problem_.robot.thrusters[i];
      for (std::size_t row = 0; row < log.thruster[i].size(); ++row) {
        const double time = log.thruster[i][row] * period;
        if (time == 0 || log.thruster[i][row] == 1 || time >= thruster.min_on_time) continue;
        add("control.torques",
            "control.torques opens thruster {} at {} [s] for {:.6g} s, but its valve is open for at least {} s "
            "(min_on_time)",
            in_quotes(thruster.name), log.times[row], time, thruster.min_on_time)
            .relies_on = "control.period";
        break;
      }
    }
  }

  void check_external(const ControlSetup& control) {
    if (control.source) return;  // a program's controller, whose name is in place of the plugin's
    if (control.external && (control.log || !control.plugin.empty() || !control.fmu.empty()))
      add("control.external", "control.external: the controller belongs to a program; leave out {}",
          control.log              ? "torques"
          : control.plugin.empty() ? "fmu"
                                   : "plugin")
          .relies_on = "control";
    if (control.external || !control.plugin.empty() || !control.fmu.empty()) return;
    if (control.parameters != "{}")
      add("control.parameters", "control.parameters needs a controller: plugin, fmu or external").relies_on = "control";
    if (control.base_torque && !control.log)
      add("control.base_torque", "control.base_torque needs a controller: plugin, fmu or external").relies_on =
          "control";
  }

  // A row between two samples would be read late or never.
  void check_rows(const ControlSetup& control) {
    const double period = control.timing.period;
    if (!(period > 0)) return;
    for (const double t : control.log->times) {
      if (std::abs(t / period - std::round(t / period)) <= 1e-6) continue;
      add("control.torques", "control.torques has a row at {} [s], which is not a multiple of control.period, {}", t,
          period)
          .relies_on = "control.period";
      return;
    }
  }

  // Sample times are breaks of the integration, which are listed in advance.
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
          "control.period is {} [s], must be less than {}, the duration of the run: sensors would be read once",
          timing.period, run);
    }
    if (run > 0 && timing.delay >= run)
      add("control.delay",
          "control.delay is {} [s], must be less than {}, the duration of the run: no command would act", timing.delay,
          run);
  }

  // ---- Joints after the impact ----

  void check_joints_afterwards(const PostImpactSetup& post) {
    using Joints = PostImpactSetup::Joints;
    if (post.move) {
      const double end = post.move->after + post.move->duration;
      if (post.joints == Joints::free || post.joints == Joints::braked)
        add_key("post_impact.move",
                "post_impact.move: joints that are {} follow no reference; use joints: pd or computed_torque",
                name_of(post.joints))
            .relies_on = "post_impact.joints";
      if (is_law(post.joints))
        add_key("post_impact.move",
                "post_impact.move: joints that {} follow no posture; use joints: pd or computed_torque",
                name_of(post.joints))
            .relies_on = "post_impact.joints";
      if (post.move->duration > 0 && post.duration > 0 && end > post.duration)
        add("post_impact.move.duration", "post_impact.move ends after {} [s], must end within post_impact's {}", end,
            post.duration);
    }
    check_laws(post);
    if (post.joints == Joints::computed_torque)
      refuse_loops("computed_torque, but", "joints of a closed loop cannot be accelerated independently; use pd");
    if (post.joints == Joints::keep_base_attitude)
      refuse_loops("keep_base_attitude, but", "this law does not support closed loops; use detumble or pd");
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

  // Conflicts of laws that move all joints together.
  void check_laws(const PostImpactSetup& post) {
    using Joints = PostImpactSetup::Joints;
    const auto refuse = [&](const char* key) {
      add_key(fmt::format("post_impact.{}", key), "post_impact.{} requires joints: {}; they are {}", key, key,
              name_of(post.joints))
          .relies_on = "post_impact.joints";
    };
    if (post.detumble && post.joints != Joints::detumble) refuse("detumble");
    if (post.keep_base_attitude && post.joints != Joints::keep_base_attitude) refuse("keep_base_attitude");
    if (post.grasp_force && post.joints != Joints::grasp_force) refuse("grasp_force");
    if (post.joints == Joints::grasp_force && post.grasp_force) check_grasp_force(*post.grasp_force, post.kd);
    if (post.joints == Joints::detumble && post.detumble) check_detumbling(post.detumble->target);
    if (post.joints == Joints::detumble && std::any_of(post.kd.begin(), post.kd.end(), [](double d) { return d <= 0; }))
      add("post_impact.kd",
          "post_impact.kd must be above 0 with joints: detumble, because kd weights the distribution of the efforts");
    if (post.joints != Joints::keep_base_attitude) return;
    if (problem_.robot.base_mode == RobotSetup::Base::fixed)
      add("post_impact.joints",
          "post_impact.joints is keep_base_attitude, but the robot's base is fixed and needs none");
    if (post.base_control)
      add_key("post_impact.base_control",
              "post_impact.base_control: the joints already control the base's attitude; use only one of them")
          .relies_on = "post_impact.joints";
  }

  // ---- Impedance ----

  void check_impedance() {
    const bool in_approach = problem_.approach && problem_.approach->tracking.mode == JointControl::impedance;
    const bool in_impact = problem_.impact && problem_.impact->joints == ImpactSetup::Joints::impedance;
    const bool afterwards = problem_.post_impact && problem_.post_impact->joints == PostImpactSetup::Joints::impedance;
    const auto needs_it = [&](const char* path) {
      add(path, "{} is impedance, which needs its section: impedance: {{mass: ..., damping: ..., stiffness: ...}}",
          path);
    };
    if (!problem_.impedance) {
      if (in_approach) needs_it("approach.tracking.mode");
      if (in_impact) needs_it("impact.joints");
      if (afterwards) needs_it("post_impact.joints");
      return;
    }
    const bool any_phase = problem_.post_impact.any(
        [](const PostImpactSetup& phase) { return phase.joints == PostImpactSetup::Joints::impedance; });
    if (!in_approach && !in_impact && !any_phase)
      add_key("impedance",
              "impedance: has no effect: approach.tracking.mode, impact.joints or post_impact.joints must be "
              "impedance");
    if (in_impact && !impact_law(*problem_.impact).in_time)
      add("impact.joints", "impact.joints is impedance, which needs law compliant: law {} is instantaneous",
          name_of(problem_.impact->law));
    if (afterwards)
      refuse_loops("impedance, but", "this law does not support closed loops; use grasp_force, detumble or pd");
    check_end_effectors(*problem_.impedance);
    if (problem_.impedance->match == ImpedanceSetup::Match::none) return;
    const std::string path = "impedance.match";
    if (!in_impact) add(path, "{}: target, which requires impact.joints: impedance", path);
    if (problem_.impedance->law == ImpedanceSetup::Law::transpose ||
        problem_.impedance->force == ImpedanceSetup::Force::not_sensed)
      add(path,
          "{}: target needs law operational_space and force sensed: otherwise the apparent mass is not controlled",
          path);
    const auto touches = [](const GraspSetup& g) { return g.contact; };
    if (std::none_of(problem_.grasps.begin(), problem_.grasps.end(), touches))
      add(path, "{}: target, but no grasp is a contact with a normal: grasps[...].model: contact", path);
  }

  void check_end_effectors(const ImpedanceSetup& impedance) {
    const std::string path = "impedance.end_effectors";
    std::vector<std::string> known, end_effectors = impedance.end_effectors;
    for (const EndEffectorSetup& e : problem_.robot.end_effectors) known.push_back(e.name);
    for (const std::string& name : end_effectors) {
      if (std::find(known.begin(), known.end(), name) == known.end())
        add(path, "{} names {}, which the robot does not have{}", path, in_quotes(name),
            suggestion(name, known, "end-effectors"));
    }
    for (const GraspSetup& grasp : problem_.grasps) {
      const bool fresh =
          std::find(end_effectors.begin(), end_effectors.end(), grasp.end_effector) == end_effectors.end();
      if (impedance.end_effectors.empty() && fresh) end_effectors.push_back(grasp.end_effector);
    }
    if (end_effectors.empty())
      add_key("impedance", "impedance: no grasps name end-effectors; list them: {}: [...]", path);
    const int needed = impedance.motion == ImpedanceSetup::Motion::pose ? 6 : 3;
    for (const std::string& name : end_effectors) {
      const EndEffectorSetup* effector = end_effector(name);
      if (!effector) continue;
      const int joints = moving_joints_to(effector->body);
      if (joints >= needed) continue;
      add("impedance.motion", "impedance.motion is {}, which needs at least {} moving joints; the arm of {} has {}",
          name_of(impedance.motion), needed, in_quotes(name), joints);
    }
  }

  // ---- Grasp forces ----

  void check_grasp_force(const GraspForceSetup& setup, const std::vector<double>& kd) {
    std::vector<std::string> targets;
    for (const GraspSetup& grasp : problem_.grasps) {
      const bool fresh = std::find(targets.begin(), targets.end(), grasp.target) == targets.end();
      if (!grasp.contact && fresh && find_named(problem_.targets, grasp.target)) targets.push_back(grasp.target);
    }
    if (targets.empty()) return;  // no grasps, or invalid ones
    const std::string path = "post_impact.grasp_force.target";
    if (setup.target.empty() && targets.size() > 1) {
      add("post_impact.grasp_force",
          "post_impact.grasp_force: the grasps hold {} targets; name one with 'target', {} or {}", targets.size(),
          in_quotes(targets[0]), in_quotes(targets[1]));
      return;
    }
    if (!setup.target.empty() && std::find(targets.begin(), targets.end(), setup.target) == targets.end()) {
      add(path, "{} is {}, which no grasp holds{}", path, in_quotes(setup.target),
          suggestion(setup.target, targets, "targets"));
      return;
    }
    const std::string& target = setup.target.empty() ? targets[0] : setup.target;
    std::vector<std::string> end_effectors;
    for (const GraspSetup& grasp : problem_.grasps) {
      if (!grasp.contact && grasp.target == target) end_effectors.push_back(grasp.end_effector);
    }
    if (end_effectors.size() < 2)
      add("post_impact.joints",
          "post_impact.joints is grasp_force, which needs two grasps or more of one target; {} is held by one: use "
          "detumble or impedance",
          in_quotes(target));
    if (std::any_of(kd.begin(), kd.end(), [](double d) { return d <= 0; }))
      add("post_impact.kd",
          "post_impact.kd must be above 0 with joints: grasp_force, because kd weights the distribution of the "
          "efforts");
    for (std::size_t p = 0; p < setup.pairs.size(); ++p) {
      const std::string place = fmt::format("post_impact.grasp_force.pairs[{}].between", p);
      const std::vector<std::string>& between = setup.pairs[p].between;
      for (const std::string& name : between) {
        if (std::find(end_effectors.begin(), end_effectors.end(), name) == end_effectors.end())
          add(place, "{} names {}, which does not hold {}{}", place, in_quotes(name), in_quotes(target),
              suggestion(name, end_effectors, "grasps"));
      }
      if (between.size() != 2 || between[0] == between[1])
        add(place, "{} must name two different end-effectors", place);
    }
  }

  // Checks the target to be brought to rest, and the arms that hold it.
  void check_detumbling(const std::string& named) {
    std::vector<std::string> held;
    for (const GraspSetup& grasp : problem_.grasps) {
      const bool fresh = std::find(held.begin(), held.end(), grasp.target) == held.end();
      if (!grasp.contact && fresh && find_named(problem_.targets, grasp.target)) held.push_back(grasp.target);
    }
    if (held.empty()) return;  // no grasps, or invalid ones
    const std::string path = "post_impact.detumble.target";
    if (named.empty() && held.size() > 1) {
      add("post_impact.detumble", "post_impact.detumble: the grasps hold {} targets; name one with 'target', {} or {}",
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
      const EndEffectorSetup* effector = end_effector(grasp.end_effector);
      if (grasp.contact || grasp.target != target || !effector) continue;
      any_rigid = any_rigid || grasp.model == GraspModel::rigid;
      const int joints = moving_joints_to(effector->body), turns = 6 - row_count(grasp.model);
      if (joints + turns >= 6) continue;
      add("post_impact.joints",
          "post_impact.joints is detumble, but the arm of grasps[{}] has {} moving joint{}; the six motions of {} need "
          "at least "
          "6",
          i, joints, joints == 1 ? "" : "s", in_quotes(target));
    }
    if (!any_rigid)
      add("post_impact.joints",
          "post_impact.joints is detumble, but no grasp of {} is rigid: hinges and points transmit no torque about "
          "their "
          "own axes",
          in_quotes(target));
  }

  // Number of moving joints between the base and a link.
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
};

}  // namespace

void find_control_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  ControlConflicts(problem, found).find();
}

}  // namespace grapnel
