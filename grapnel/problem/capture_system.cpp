#include "grapnel/problem/capture_system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/impact/impact_law.hpp"
#include "grapnel/model/coupling.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {
namespace {

template <class Items>
auto find_named(const Items& items, const std::string& name) {
  return std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
}

void check_grasps(const CaptureProblem& problem, std::vector<std::string>& faults) {
  for (const GraspSetup& g : problem.grasps) {
    if (find_named(problem.robot.end_effectors, g.end_effector) == problem.robot.end_effectors.end()) {
      faults.push_back(fmt::format("grasp: unknown end-effector '{}'", g.end_effector));
    }
    const auto target = find_named(problem.targets, g.target);
    if (target == problem.targets.end()) {
      faults.push_back(fmt::format("grasp: unknown target '{}'", g.target));
    } else if (find_named(target->grasp_points, g.grasp_point) == target->grasp_points.end()) {
      faults.push_back(fmt::format("grasp: target '{}' has no grasp point '{}'", g.target, g.grasp_point));
    }
    if (g.orientation == GraspSetup::Orientation::axis && target != problem.targets.end()) {
      const auto point = find_named(target->grasp_points, g.grasp_point);
      const auto e = find_named(problem.robot.end_effectors, g.end_effector);
      if (point != target->grasp_points.end() && e != problem.robot.end_effectors.end() &&
          !(point->approach_direction && e->approach_axis))
        faults.push_back(fmt::format(
            "grasp of '{}': orientation by axis needs an approach axis and an approach direction", g.end_effector));
    }
    if (g.closes == GraspSetup::Closes::at_time && !(g.closes_at > 0))
      faults.push_back(fmt::format("grasp of '{}': closes at {} s, must be positive", g.end_effector, g.closes_at));
    if (g.model == GraspModel::hinge && !(std::abs(norm(g.hinge_axis) - 1) < 1e-9)) {
      faults.push_back(fmt::format("grasp of '{}': hinge axis must be a unit vector", g.end_effector));
    }
  }
}

bool finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

void check_waypoints(const CaptureProblem& problem, std::size_t joints, std::vector<std::string>& faults) {
  const ApproachSetup& approach = *problem.approach;
  for (const Waypoint& w : approach.waypoints) {
    if (!(w.time > 0)) faults.push_back(fmt::format("waypoint at t = {}: the time must be positive", w.time));
    if (w.joints.empty() == w.places.empty() && joints > 0) faults.push_back("waypoint: give joints or places");
    if (!w.joints.empty() && (w.joints.size() != joints || !finite(w.joints)))
      faults.push_back(fmt::format("waypoint: {} joint values for {} joints", w.joints.size(), joints));
    if (w.rates && (w.rates->size() != joints || !finite(*w.rates)))
      faults.push_back(fmt::format("waypoint: {} joint rates for {} joints", w.rates->size(), joints));
    for (const Waypoint::Place& place : w.places) {
      if (find_named(problem.robot.end_effectors, place.end_effector) == problem.robot.end_effectors.end())
        faults.push_back(fmt::format("waypoint: unknown end-effector '{}'", place.end_effector));
      if (!place.target.empty() && find_named(problem.targets, place.target) == problem.targets.end())
        faults.push_back(fmt::format("waypoint: unknown target '{}'", place.target));
    }
  }
}

void check_straight_in(const CaptureProblem& problem, std::vector<std::string>& faults) {
  const ApproachSetup& approach = *problem.approach;
  const StraightIn& in = *approach.straight_in;
  if (!approach.plan) faults.push_back("approach: straight_in needs plan");
  if (approach.final_rates || approach.match) faults.push_back("approach: with straight_in the final rates follow");
  if (!(in.stand_off > 0) || !(in.final_speed >= 0) || !std::isfinite(in.stand_off + in.final_speed))
    faults.push_back("approach: straight_in needs a positive stand-off and a final speed that is not negative");
  if (!(in.duration > 0)) faults.push_back("approach: straight_in: duration must be positive");
}

void check_samples(const SampledMotion& s, std::size_t joints, std::vector<std::string>& faults) {
  bool good = s.positions.size() == joints && (s.rates.empty() || s.rates.size() == joints) && s.times.size() >= 2;
  for (const auto& column : s.positions) good = good && column.size() == s.times.size() && finite(column);
  for (const auto& column : s.rates) good = good && column.size() == s.times.size() && finite(column);
  for (std::size_t k = 1; k < s.times.size(); ++k) good = good && s.times[k] > s.times[k - 1];
  if (!good)
    faults.push_back(
        "approach: a sampled motion needs increasing times, at least two, and for every joint a finite value at each");
}

void check_pieces(const ApproachSetup& approach, std::size_t joints, std::vector<std::string>& faults) {
  bool good = approach.pieces.back().until == approach.duration;
  double begin = 0;
  for (const MotionPiece& piece : approach.pieces) {
    good = good && piece.until > begin && piece.series.size() == joints;
    begin = piece.until;
    for (const std::vector<double>& series : piece.series) good = good && !series.empty() && finite(series);
  }
  if (!good)
    faults.push_back(
        "approach: pieces need increasing ends, the last the approach's, and for every joint finite coefficients");
}

// Checks that the joints' motion is stated in exactly one form.
void check_motion_form(const CaptureProblem& problem, std::size_t joints, std::vector<std::string>& faults) {
  const ApproachSetup& approach = *problem.approach;
  const int forms = (approach.plan ? 1 : 0) + (approach.sampled ? 1 : 0) + (approach.pieces.empty() ? 0 : 1);
  if (forms > 1 || (forms == 1 && !approach.final_position.empty()))
    faults.push_back("approach: give one of final positions, plan, samples and pieces");
  if (forms == 0 && approach.final_position.size() != joints) {
    faults.push_back(fmt::format("approach: final joint positions: {} values for {} joints",
                                 approach.final_position.size(), joints));
  } else if (!finite(approach.final_position)) {
    faults.push_back("approach: final joint positions: a value is not finite");
  }
  if (approach.plan) {
    if (approach.plan->starts < 1) faults.push_back("approach: plan: starts must be at least 1");
    const std::vector<double>& guess = approach.plan->guess;
    if (!guess.empty() && (guess.size() != joints || !finite(guess)))
      faults.push_back(fmt::format("approach: plan: guess: {} values for {} joints", guess.size(), joints));
  }
  if (const auto& window = approach.window) {
    if (!approach.plan) faults.push_back("approach: a window of capture times needs plan");
    if (!(window->earliest > 0 && window->latest > 0) || !std::isfinite(window->latest) || !(window->step >= 0) ||
        !std::isfinite(window->step))
      faults.push_back("approach: window: times must be positive, and the step must not be negative");
  }
  if (approach.sampled) check_samples(*approach.sampled, joints, faults);
  if (!approach.pieces.empty()) check_pieces(approach, joints, faults);
  if ((approach.sampled || !approach.pieces.empty()) &&
      (approach.match || approach.final_rates || !approach.waypoints.empty()))
    faults.push_back("approach: samples and pieces state the whole motion; leave out final rates and waypoints");
  check_waypoints(problem, joints, faults);
  if (approach.straight_in) check_straight_in(problem, faults);
}

// Checks obstacles, and names in rules of contact. `check_body`: checks that a body of the model exists.
template <class CheckBody>
void check_contacts(const CaptureProblem& problem, const CheckBody& check_body, std::vector<std::string>& faults) {
  for (std::size_t i = 0; i < problem.obstacles.size(); ++i) {
    const std::string& name = problem.obstacles[i].name;
    if (name.empty()) faults.push_back(fmt::format("obstacles: obstacle {} has no name", i));
    if (find_named(problem.obstacles, name) != problem.obstacles.begin() + static_cast<std::ptrdiff_t>(i))
      faults.push_back(fmt::format("obstacles: duplicate name '{}'", name));
  }
  for (std::size_t i = 0; i < problem.materials.size(); ++i) {
    if (find_named(problem.materials, problem.materials[i].name) !=
        problem.materials.begin() + static_cast<std::ptrdiff_t>(i))
      faults.push_back(fmt::format("materials: duplicate name '{}'", problem.materials[i].name));
  }
  const auto check = [&](const BodyName& body) {
    if (!body.obstacle)
      check_body("contacts", body);
    else if (*body.obstacle >= problem.obstacles.size())
      faults.push_back(fmt::format("contacts: there is no obstacle {}", *body.obstacle));
  };
  for (const ContactPairsSetup& rule : problem.contacts) {
    const int forms = (rule.pairs.empty() ? 0 : 1) + (rule.all ? 1 : 0) +
                      (rule.first_group.empty() && rule.second_group.empty() ? 0 : 1);
    if (forms != 1) faults.push_back("contacts: give one of pairs, two groups and all");
    if (rule.first_group.empty() != rule.second_group.empty()) faults.push_back("contacts: one of two groups is empty");
    for (const auto* pairs : {&rule.pairs, &rule.exclude}) {
      for (const auto& [a, b] : *pairs) check(a), check(b);
    }
    for (const auto* group : {&rule.first_group, &rule.second_group}) {
      for (const BodyName& body : *group) check(body);
    }
  }
}

// Checks external loads, the orbit, clearances and contacts.
void check_surroundings(const CaptureProblem& problem, const Model& model, std::vector<std::string>& faults) {
  const auto check_body = [&](const char* what, const BodyName& body) {
    if (body.target && *body.target >= problem.targets.size()) {
      faults.push_back(fmt::format("{}: there is no target {}", what, *body.target));
      return;
    }
    if (body.obstacle) {
      faults.push_back(fmt::format("{}: obstacle {} is not allowed", what, *body.obstacle));
      return;
    }
    const std::string name = name_in_model(problem, body);
    if (std::none_of(model.bodies().begin(), model.bodies().end(),
                     [&](const Body& b) { return b.description.name == name; }))
      faults.push_back(fmt::format("{}: unknown body '{}'", what, shown_name(problem, body)));
  };
  for (const LoadSetup& load : problem.loads) {
    check_body("load", load.body);
  }
  if (problem.orbit) {
    if (const std::string fault = fault_of(reference_orbit(*problem.orbit)); !fault.empty())
      faults.push_back("orbit: " + fault);
  }
  for (const auto& [a, b] : problem.clearance.ignore) {
    for (const BodyName& body : {a, b}) check_body("clearance", body);
  }
  check_contacts(problem, check_body, faults);
}

// Checks one phase after the approach. `check_size`: checks a list of values per joint.
template <class CheckSize>
void check_phase(const CaptureProblem& problem, std::size_t k, const CheckSize& check_size,
                 std::vector<std::string>& faults) {
  const PostImpactSetup& post = problem.post_impact[k];
  const std::string key = phases_key(problem);
  const std::string here = problem.post_impact.size() > 1 ? fmt::format("{}[{}]", key, k) : key;
  const auto add = [&](const std::string& fault) { faults.push_back(here + fault); };
  if (!(post.duration > 0) || !std::isfinite(post.duration)) add(": duration must be positive");
  if (has_gains(post.joints)) {
    check_size(post.kp, (here + ": kp").c_str());
    check_size(post.kd, (here + ": kd").c_str());
  }
  if (post.move) {
    check_size(post.move->joints, (here + ".move: joints").c_str());
    if (!(post.move->duration > 0) || !std::isfinite(post.move->duration) || !(post.move->after >= 0))
      add(".move: duration must be positive, after not negative");
  }
  if (post.joints == PostImpactSetup::Joints::detumble && !post.detumble)
    add(": joints: detumble requires the section 'detumble'");
  if (post.detumble && !(post.detumble->torque > 0 && std::isfinite(post.detumble->torque)))
    add(".detumble: torque must be positive");
  if (const auto& hold = post.keep_base_attitude) {
    if (!hold->posture.empty()) check_size(hold->posture, (here + ".keep_base_attitude: posture").c_str());
    if (!(hold->rate > 0 && std::isfinite(hold->rate)) ||
        !(hold->posture_rate > 0 && std::isfinite(hold->posture_rate)))
      add(".keep_base_attitude: rates must be positive");
  }
  for (const PostImpactSetup::Release& release : post.releases) {
    if (!(release.after > 0)) add(fmt::format(": release after {} s: the time must be positive", release.after));
    for (const std::string& name : release.end_effectors) {
      if (std::none_of(problem.grasps.begin(), problem.grasps.end(),
                       [&](const GraspSetup& g) { return g.end_effector == name; }))
        add(fmt::format(": release of '{}', which has no grasp", name));
    }
  }
}

void check_phases(const CaptureProblem& problem, std::size_t joints, std::vector<std::string>& faults) {
  const auto check_size = [&](const std::vector<double>& values, const char* what) {
    if (values.size() != joints)
      faults.push_back(fmt::format("{}: {} values for {} joints", what, values.size(), joints));
    for (double x : values) {
      if (!std::isfinite(x)) faults.push_back(fmt::format("{}: a value is not finite", what));
    }
  };
  check_size(problem.joint_position, "initial joint positions");
  if (!problem.joint_rate.empty()) check_size(problem.joint_rate, "initial joint rates");
  if (const auto& approach = problem.approach) {
    if (!(approach->duration > 0) || !std::isfinite(approach->duration))
      faults.push_back("approach: duration must be positive");
    check_motion_form(problem, joints, faults);
    if (approach->final_rates) check_size(*approach->final_rates, "approach: final joint rates");
    if (approach->match && problem.grasps.empty()) faults.push_back("approach: matching rates needs grasps");
    if (has_gains(approach->tracking.mode)) {
      check_size(approach->tracking.kp, "approach: kp");
      check_size(approach->tracking.kd, "approach: kd");
    }
  }
  if (problem.impact && problem.grasps.empty()) faults.push_back("impact: there are no grasps");
  if (problem.impact && !(problem.impact->duration > 0)) faults.push_back("impact: duration must be positive");
  for (std::size_t k = 0; k < problem.post_impact.size(); ++k) check_phase(problem, k, check_size, faults);
}

void check_initial(const CaptureProblem& problem, std::vector<std::string>& faults) {
  if (problem.V_WB && problem.momentum) faults.push_back("initial: give the base's twist or the momentum, not both");
  // With contacts a free target may touch others.
  const bool all_are_grasped = problem.impact && problem.contacts.empty();
  for (const TargetSetup& t : problem.targets) {
    if (all_are_grasped && std::none_of(problem.grasps.begin(), problem.grasps.end(),
                                        [&](const GraspSetup& g) { return g.target == t.name; })) {
      faults.push_back(fmt::format("no grasp names target '{}'", t.name));
    }
  }
}

void check_wheels(const CaptureProblem& problem, std::vector<std::string>& faults) {
  if (!problem.wheel_rate.empty() &&
      (problem.wheel_rate.size() != problem.robot.wheels.size() || !finite(problem.wheel_rate)))
    faults.push_back(
        fmt::format("wheels: {} initial rates for {} wheels", problem.wheel_rate.size(), problem.robot.wheels.size()));
  for (const std::vector<double>* of_gimbals : {&problem.gimbal_angle, &problem.gimbal_rate}) {
    if (!of_gimbals->empty() && (of_gimbals->size() != problem.robot.gyros.size() || !finite(*of_gimbals)))
      faults.push_back(
          fmt::format("gyros: {} initial values for {} gimbals", of_gimbals->size(), problem.robot.gyros.size()));
  }
}

// The body of a rotor: its moment of inertia about the axis, the minimum transverse inertia of a rigid body, and a
// negligible mass at the base's centre of mass. The base keeps the rest, so that both together equal the given base.
constexpr double kRotorMass = 1e-6;  // of the base's

// J_s a a^T + J_s/2 (1 - a a^T)
Symmetric3d least_inertia(const Vector3d& a, double J_s) {
  const double half = 0.5 * J_s;
  return {half + half * a[0] * a[0], half + half * a[1] * a[1], half + half * a[2] * a[2],
          half * a[0] * a[1],        half * a[0] * a[2],        half * a[1] * a[2]};
}

BodyDescription wheel_body(const WheelSetup& wheel, const BodyDescription& base) {
  BodyDescription body;
  body.name = wheel_body_name(wheel.name);
  body.parent = base.name;
  // z is along the spin axis, so that the inertia is exactly diagonal. Rounding errors beside the axis would turn with
  // the wheel, and act as a torque in steps that are long relative to a turn.
  body.X_PF = Posed{rotation_between({0, 0, 1}, wheel.axis), base.com};
  body.joint.name = body.name;
  body.joint.type = JointType::revolute;
  body.joint.axis = {0, 0, 1};
  body.joint.limits.effort = wheel.torque;
  body.joint.limits.rate = wheel.rate;
  body.joint.friction = wheel.friction;
  body.mass = kRotorMass * base.mass;
  body.inertia = Symmetric3d{0.5 * wheel.inertia, 0.5 * wheel.inertia, wheel.inertia, 0, 0, 0};
  return body;
}

// A gyro's gimbal without the rotor, and the rotor, which is at the gimbal's origin: (17.5).
std::array<BodyDescription, 2> gyro_bodies(const MomentGyroSetup& gyro, const BodyDescription& base) {
  std::array<BodyDescription, 2> bodies;
  auto& [gimbal, rotor] = bodies;
  gimbal.name = gimbal_body_name(gyro.name), rotor.name = gyro_rotor_body_name(gyro.name);
  gimbal.parent = base.name, rotor.parent = gimbal.name;
  gimbal.X_PF = Posed{Rotationd::identity(), base.com};
  for (BodyDescription& body : bodies) {
    body.joint.name = body.name;
    body.joint.type = JointType::revolute;
    body.mass = kRotorMass * base.mass;
  }
  gimbal.joint.axis = gyro.gimbal_axis;
  rotor.X_PF.R = rotation_between({0, 0, 1}, gyro.spin_axis), rotor.joint.axis = {0, 0, 1};  // as for a wheel
  gimbal.inertia = least_inertia(gyro.gimbal_axis, gyro.gimbal_inertia - 0.5 * gyro.inertia);
  rotor.inertia = Symmetric3d{0.5 * gyro.inertia, 0.5 * gyro.inertia, gyro.inertia, 0, 0, 0};
  return bodies;
}

// Subtracts wheels and gyros from the base.
void take_wheels_out(const RobotSetup& robot, BodyDescription& base) {
  const BodyDescription whole = base;
  const auto take_out = [&](const BodyDescription& rotor) {
    base.mass -= rotor.mass;
    const Symmetric3d I = rotate(rotor.X_PF.R, rotor.inertia);  // (17.1)
    base.inertia += Symmetric3d{-I.xx, -I.yy, -I.zz, -I.xy, -I.xz, -I.yz};
  };
  for (const WheelSetup& wheel : robot.wheels) take_out(wheel_body(wheel, whole));
  for (const MomentGyroSetup& gyro : robot.gyros) {
    for (const BodyDescription& body : gyro_bodies(gyro, whole)) take_out(body);
  }
}

ModelBuilder servicer_builder(const CaptureProblem& problem, const RobotSetup& robot, bool with_wheels) {
  ModelBuilder builder;
  for (BodyDescription body : robot.bodies) {
    if (body.name == problem.robot.base) {
      if (with_wheels) {
        for (const WheelSetup& wheel : problem.robot.wheels) builder.add(wheel_body(wheel, body));
        for (const MomentGyroSetup& gyro : problem.robot.gyros) {
          for (BodyDescription& part : gyro_bodies(gyro, body)) builder.add(std::move(part));
        }
        take_wheels_out(problem.robot, body);
      }
      const bool fixed = problem.robot.base_mode == RobotSetup::Base::fixed;
      body.parent.clear();
      body.joint = {};
      body.joint.name = body.name;
      body.joint.type = fixed ? JointType::fixed : JointType::free;
      body.X_PF = fixed ? problem.X_WB : Posed::identity();
    }
    builder.add(std::move(body));
  }
  for (const FrameDescription& frame : robot.end_effectors) builder.add(frame);
  return builder;
}

CaptureSystem index(const CaptureProblem& problem, const RobotSetup& robot, Model model, bool with_targets) {
  CaptureSystem system{std::move(model), 0, {}, {}, {}, {}, {}};
  system.addresses = body_addresses(problem, robot, system.model, with_targets);
  system.base = system.model.body_index(problem.robot.base);
  for (const FrameDescription& f : problem.robot.end_effectors)
    system.end_effectors.push_back(system.model.frame_index(f.name));
  if (with_targets) {
    for (const TargetSetup& t : problem.targets) {
      system.target_frames.push_back(system.model.frame_index(target_body_name(t.name)));
    }
  }
  for (std::size_t j = 0; j < system.model.joints().size(); ++j) {
    const BodyDescription& body = system.model.joint_body(j).description;
    if (yields(body.joint)) {
      system.elastic_joints.push_back(static_cast<int>(j));
    } else if (find_named(robot.bodies, body.name) != robot.bodies.end()) {
      system.robot_joints.push_back(static_cast<int>(j));
    }
  }
  // -1: the model has no such joint.
  const auto joint_of = [&](const std::string& name) {
    const auto is_it = [&](int body) { return system.model.bodies()[body].description.name == name; };
    const auto at = std::find_if(system.model.joints().begin(), system.model.joints().end(), is_it);
    return at == system.model.joints().end() ? -1 : static_cast<int>(at - system.model.joints().begin());
  };
  for (const WheelSetup& wheel : problem.robot.wheels) {
    if (const int joint = joint_of(wheel_body_name(wheel.name)); joint >= 0) system.wheels.push_back(joint);
  }
  for (const MomentGyroSetup& gyro : problem.robot.gyros) {
    const CaptureSystem::Gyro joints{joint_of(gimbal_body_name(gyro.name)), joint_of(gyro_rotor_body_name(gyro.name))};
    if (joints.gimbal >= 0) system.gyros.push_back(joints);
  }
  return system;
}

}  // namespace

std::string target_body_name(const std::string& target) { return "target:" + target; }

BodyDescription target_body(const TargetSetup& target) {
  BodyDescription body;
  body.name = target_body_name(target.name);
  body.joint.name = body.name;
  body.joint.type = JointType::free;
  body.mass = target.mass;
  body.com = target.com;
  body.inertia = target.inertia;
  return body;
}

std::string name_in_model(const CaptureProblem& problem, const BodyName& body) {
  if (!body.target) return body.name;
  const std::string target = target_body_name(problem.targets.at(*body.target).name);
  return body.name.empty() ? target : panel_body_name(target, body.name);
}

std::string shown_name(const CaptureProblem& problem, const BodyName& body) {
  if (body.obstacle) return problem.obstacles.at(*body.obstacle).name;
  const std::string name = name_in_model(problem, body);
  return body.target ? name.substr(target_body_name("").size()) : name;
}

std::string shown_name(const CaptureSystem& system, int body) {
  const std::string& name = system.model.bodies()[body].description.name;
  return belongs_to_targets(system, body) ? name.substr(target_body_name("").size()) : name;
}

Posed own_frame(const CaptureSystem& system, int body) {
  const BodyAddress& address = system.addresses[body];
  return address.is_target_itself() ? system.model.frames()[system.target_frames[address.target]].X_BE
                                    : Posed::identity();
}

std::string wheel_body_name(const std::string& wheel) { return "wheel:" + wheel; }
std::string gimbal_body_name(const std::string& gyro) { return "gyro:" + gyro; }
std::string gyro_rotor_body_name(const std::string& gyro) { return "gyro-rotor:" + gyro; }

ControlledRobot controlled_parts(const CaptureProblem& problem) {
  ControlledRobot robot;
  const auto has_sensor = [&](const auto& sensors, const auto& named, const std::string& name) {
    return problem.sensors &&
           std::ranges::find(*problem.sensors.*sensors, name, named) != (*problem.sensors.*sensors).end();
  };
  for (const EndEffectorSetup& effector : problem.robot.end_effectors)
    robot.end_effectors.push_back(
        {effector.name, effector.name, has_sensor(&SensorSetup::wrists, &WristSensor::end_effector, effector.name)});
  for (const WheelSetup& wheel : problem.robot.wheels)
    robot.wheels.push_back({wheel.name, wheel_body_name(wheel.name)});
  for (const MomentGyroSetup& gyro : problem.robot.gyros)
    robot.gyros.push_back({gyro.name, gimbal_body_name(gyro.name)});
  for (const ThrusterSetup& thruster : problem.robot.thrusters) robot.thrusters.push_back(thruster.name);
  for (const TargetSetup& target : problem.targets)
    robot.targets.push_back({target.name, target_body_name(target.name),
                             has_sensor(&SensorSetup::relative_poses, &RelativePoseSensor::target, target.name)});
  robot.commands_base = problem.control && problem.control->base_torque;
  robot.commands_actuators = problem.control && problem.control->base_actuators;
  return robot;
}

CaptureSystem make_servicer(const CaptureProblem& problem) {
  std::optional<RobotSetup> made;
  const RobotSetup& robot = modelled_robot(problem.robot, false, made);
  return index(problem, robot, servicer_builder(problem, robot, false).build(), false);
}

CaptureSystem make_moving_servicer(const CaptureProblem& problem) {
  std::optional<RobotSetup> made;
  const RobotSetup& robot = modelled_robot(problem.robot, true, made);
  return index(problem, robot, servicer_builder(problem, robot, true).build(), false);
}

State without_inner_motion(const CaptureSystem& with, const State& state, const CaptureSystem& without) {
  State result = zero_state(without.model);
  for (std::size_t j = 0; j < without.robot_joints.size(); ++j) {
    const Body& to = without.model.joint_body(without.robot_joints[j]);
    const Body& from = with.model.joint_body(with.robot_joints[j]);
    result.q[to.q] = state.q[from.q], result.v[to.v] = state.v[from.v];
  }
  if (!without.model.has_free_root(without.base)) return result;
  const Body &to = without.model.bodies()[without.base], &from = with.model.bodies()[with.base];
  std::copy_n(state.q.begin() + from.q, 7, result.q.begin() + to.q);
  std::copy_n(state.v.begin() + from.v, 6, result.v.begin() + to.v);
  return result;
}

std::string wheel_fault(const RobotSetup& robot) {
  if (robot.bodies.empty() || (robot.wheels.empty() && robot.gyros.empty())) return {};
  // While a file is being read, the base, which comes first, may have no name yet.
  const auto base = find_named(robot.bodies, robot.base);
  BodyDescription rest = base == robot.bodies.end() ? robot.bodies.front() : *base;
  take_wheels_out(robot, rest);
  if (!(rest.mass > 0)) return "the wheels and gyros have more mass than the base, which includes them";
  const std::string fault = inertia_fault(rest.inertia);
  if (fault.empty()) return {};
  return fmt::format("the base's inertia without its {}, which it includes, is not that of a rigid body: {}",
                     robot.gyros.empty()    ? "wheels"
                     : robot.wheels.empty() ? "gyros"
                                            : "wheels and gyros",
                     fault);
}

CaptureSystem make_capture_system(const CaptureProblem& problem) {
  std::optional<RobotSetup> made;
  const RobotSetup& robot = modelled_robot(problem.robot, true, made);
  ModelBuilder builder = servicer_builder(problem, robot, true);
  for (const TargetSetup& t : problem.targets) {
    for (BodyDescription& body : target_bodies(t).bodies) builder.add(std::move(body));
    builder.add(FrameDescription{target_body_name(t.name), target_body_name(t.name), Posed::identity()});
  }
  CaptureSystem system = index(problem, robot, std::move(builder).build(), true);
  std::vector<std::string> faults;
  if (const auto& integration = problem.integration;
      integration.loops == IntegrationSetup::Loops::baumgarte && !(integration.baumgarte_time > 0))
    faults.push_back("integration: baumgarte_time must be positive");
  check_grasps(problem, faults);
  check_phases(problem, system.robot_joints.size(), faults);
  check_initial(problem, faults);
  check_wheels(problem, faults);
  check_surroundings(problem, system.model, faults);
  if (!faults.empty()) throw CaptureProblemError(fmt::format("{}", fmt::join(faults, "\n")));
  return system;
}

State initial_servicer_state(const CaptureProblem& problem, const CaptureSystem& system) {
  State state = zero_state(system.model);
  for (std::size_t j = 0; j < system.robot_joints.size(); ++j) {
    const Body& body = system.model.joint_body(system.robot_joints[j]);
    state.q[body.q] = problem.joint_position[j];
    if (!problem.joint_rate.empty()) state.v[body.v] = problem.joint_rate[j];
    // Joints that follow a stated motion exactly start at its beginning.
    if (!problem.approach || problem.approach->tracking.mode != JointControl::prescribed) continue;
    const ApproachSetup& approach = *problem.approach;
    if (approach.sampled) {
      const SampledMotion& s = *approach.sampled;
      const auto rates = s.rates.empty() ? std::span<const double>{} : std::span<const double>(s.rates[j]);
      const JointPoint first = evaluate(interpolate_samples(s.times, s.positions[j], rates), s.times.front());
      state.q[body.q] = first.position, state.v[body.v] = first.rate;
    } else if (!approach.pieces.empty()) {
      const JointPoint first = evaluate(trajectory_of({approach.pieces.data(), 1}, j), 0);
      state.q[body.q] = first.position, state.v[body.v] = first.rate;
    }
  }
  follow_couplings(system.model, state.q, state.v);
  for (const int body : system.model.springs()) {
    const Body& b = system.model.bodies()[body];
    state.q[b.q] = b.description.joint.spring->rest;
  }
  for (std::size_t w = 0; w < system.wheels.size() && !problem.wheel_rate.empty(); ++w)
    state.v[system.model.joint_body(system.wheels[w]).v] = problem.wheel_rate[w];
  for (std::size_t g = 0; g < system.gyros.size(); ++g) {
    const Body& gimbal = system.model.joint_body(system.gyros[g].gimbal);
    if (!problem.gimbal_angle.empty()) state.q[gimbal.q] = problem.gimbal_angle[g];
    if (!problem.gimbal_rate.empty()) state.v[gimbal.v] = problem.gimbal_rate[g];
    state.v[system.model.joint_body(system.gyros[g].rotor).v] = problem.robot.gyros[g].spin_rate;
  }
  if (!system.model.has_free_root(system.base)) return state;
  set_root_pose(system.model, system.base, problem.X_WB, state);
  if (problem.momentum) {
    set_root_twist(system.model, system.base,
                   base_twist_from_momentum(system.model, state, system.base, *problem.momentum), state);
  } else {
    set_root_twist(system.model, system.base, problem.V_WB.value_or(Twistd::zero()), state);
  }
  return state;
}

}  // namespace grapnel
