#include "capture/loop_case.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {
namespace {

BodyDescription base_body() {
  BodyDescription base;
  base.name = base.joint.name = "base";
  base.joint.type = JointType::free;
  base.mass = 300;
  base.com = {0.05, -0.03, 0.02};
  base.inertia = Symmetric3d::diagonal(60, 75, 50);
  return base;
}

void add_arm(CaptureProblem& p, int arm, int arms, int joints, Random& random) {
  const std::string n = std::to_string(arm);
  const double around = 2 * std::acos(-1.0) * arm / arms;
  std::string parent = "base";
  for (int j = 0; j < joints; ++j) {
    BodyDescription b;
    b.name = "arm" + n + "-link" + std::to_string(j);
    b.joint.name = "arm" + n + "-joint" + std::to_string(j);
    b.parent = parent;
    b.joint.type = JointType::revolute;
    b.joint.axis = random.direction();
    b.X_PF.p = j == 0 ? Vector3d{0.6 * std::cos(around), 0.6 * std::sin(around), 0.4} : Vector3d{0, 0, 0.45};
    b.mass = random.uniform(4, 15);
    b.com = Vector3d{0, 0, 0.22} + random.vector(0.05);
    b.inertia = random_inertia(b.mass, 0.5, random);
    p.robot.bodies.push_back(b);
    p.joint_position.push_back(random.uniform(-0.8, 0.8));
    p.joint_rate.push_back(random.uniform(-0.1, 0.1));
    parent = b.name;
  }
  p.robot.end_effectors.push_back({{"hand" + n, parent, {random.rotation(), {0, 0, 0.4}}}});
}

Vector3d end_effector_position(const CaptureProblem& p, std::size_t arm) {
  const CaptureSystem robot = make_servicer(p);
  const Kinematics k = forward_kinematics(robot.model, initial_servicer_state(p, robot));
  return frame_pose(robot.model, k, robot.end_effectors[arm]).p;
}

bool may_be_nan(const std::string& path) {
  return path.find("/reference_") != std::string::npos || path.find("/reaction_") != std::string::npos;
}

// Central difference of order 8.
template <class Value>
auto derivative(const Value& value, std::size_t s, double h) {
  constexpr std::array<double, 4> c{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  auto sum = (c[0] / h) * (value(s + 1) - value(s - 1));
  for (std::size_t k = 2; k <= 4; ++k) sum = sum + (c[k - 1] / h) * (value(s + k) - value(s - k));
  return sum;
}

bool holds(const CaptureResult& r, const GraspSetup& g, std::size_t s) {
  return value_at(r, "grasps/" + g.end_effector + "/holds", s) == 1;
}

// The robot's state without targets, as recorded.
State robot_state(const CaptureProblem& p, const CaptureSystem& robot, const CaptureResult& r, std::size_t s) {
  State state = zero_state(robot.model);
  const std::vector<double> q = joints_at(r, "joints/position", s), v = joints_at(r, "joints/velocity", s);
  for (std::size_t j = 0; j < robot.robot_joints.size(); ++j) {
    const Body& body = robot.model.bodies()[robot.model.joints()[robot.robot_joints[j]]];
    state.q[body.q] = q[j], state.v[body.v] = v[j];
  }
  if (p.robot.base_mode != RobotSetup::Base::fixed) {
    set_root_pose(robot.model, robot.base, pose_at(r, "base", s), state);
    set_root_twist(robot.model, robot.base, twist_at(r, "base", s), state);
  }
  return state;
}

}  // namespace

CaptureProblem random_loops(const LoopOptions& options, int index) {
  Random random(5000 + index);
  CaptureProblem p;
  p.name = "loops " + std::to_string(index);
  p.contact.largest_gap = std::numeric_limits<double>::infinity();  // grasps may close during the approach
  p.robot.name = "random";
  p.robot.base = "base";
  p.robot.bodies = {base_body()};
  const int arms = static_cast<int>(options.target_of_arm.size());
  for (int arm = 0; arm < arms; ++arm) add_arm(p, arm, arms, options.joints, random);
  p.X_WB = {random.rotation(), random.vector(3)};
  p.V_WB = Twistd{random.vector(0.1), random.vector(0.1)};
  const int targets = 1 + *std::max_element(options.target_of_arm.begin(), options.target_of_arm.end());
  for (int t = 0; t < targets; ++t) {
    TargetSetup target;
    target.name = "target" + std::to_string(t);
    target.mass = random.log_uniform(30, 300);
    target.com = random.vector(0.2);
    target.inertia = random_inertia(target.mass, 1.2, random);
    Vector3d mean = Vector3d::zero();
    double holders = 0;
    for (int arm = 0; arm < arms; ++arm) {
      if (options.target_of_arm[static_cast<std::size_t>(arm)] != t) continue;
      mean = mean + end_effector_position(p, static_cast<std::size_t>(arm)), holders += 1;
      const std::string n = std::to_string(arm);
      target.grasp_points.push_back({"point" + n, {random.rotation(), random.vector(0.4)}});
      const GraspModel model =
          options.models.empty() ? GraspModel::rigid : options.models[static_cast<std::size_t>(arm)];
      p.grasps.push_back({"hand" + n, target.name, "point" + n, model, random.direction()});
    }
    target.X_WT = {random.rotation(), (1 / holders) * mean + random.vector(0.2)};
    target.V_WT = {random.vector(options.spin), random.vector(0.1)};
    p.targets.push_back(target);
  }
  p.impact.emplace();
  p.post_impact.emplace();
  p.post_impact->duration = options.time;
  p.post_impact->kp.assign(p.joint_position.size(), 60);
  p.post_impact->kd.assign(p.joint_position.size(), 30);
  p.output_interval = 0.1;
  return p;
}

CaptureProblem scenario(const std::string& path) {
  return load_scenario(std::string(GRAPNEL_SOURCE_DIR) + "/scenarios/" + path);
}

Opening opening(const CaptureProblem& p, const CaptureResult& r, std::size_t grasp, std::size_t from, std::size_t to) {
  const GraspSetup& g = p.grasps.at(grasp);
  const auto end_effector = [&](std::size_t s) { return pose_at(r, "end_effectors/" + g.end_effector, s); };
  const auto target = [&](std::size_t s) { return pose_at(r, "targets/" + g.target, s); };
  const Vector3d point = inverse(target(from)) * end_effector(from).p;
  const Vector3d axis = transposed_times(target(from).R, end_effector(from).R * g.hinge_axis);
  const Rotationd relative = transpose(target(from).R) * end_effector(from).R;
  Opening worst;
  for (std::size_t s = from; s <= to; ++s) {
    const Posed E = end_effector(s), T = target(s);
    worst.position = std::max(worst.position, norm(E.p - T * point));
    worst.turned = std::max(worst.turned, rotation_angle(transpose(relative) * (transpose(T.R) * E.R)));
    if (g.model == GraspModel::hinge) worst.angle = std::max(worst.angle, norm(cross(E.R * g.hinge_axis, T.R * axis)));
    if (g.model == GraspModel::rigid) worst.angle = worst.turned;
  }
  return worst;
}

Opening opening(const CaptureProblem& p, const CaptureResult& r, const std::string& phase) {
  Opening worst;
  for (std::size_t g = 0; g < p.grasps.size(); ++g) {
    const Opening o = opening(p, r, g, first_sample(r, phase), last_sample(r, phase));
    worst.position = std::max(worst.position, o.position);
    worst.angle = std::max(worst.angle, o.angle);
    worst.turned = std::max(worst.turned, o.turned);
  }
  return worst;
}

void expect_finite(const CaptureResult& r) {
  for (const Series& s : r.series.series) {
    EXPECT_EQ(s.data.size(), r.series.time.size() * static_cast<std::size_t>(s.width())) << s.path;
    if (may_be_nan(s.path)) continue;
    EXPECT_TRUE(std::all_of(s.data.begin(), s.data.end(), [](double x) { return std::isfinite(x); })) << s.path;
  }
  for (const LedgerEntry& e : r.ledger.entries) EXPECT_TRUE(std::isfinite(e.value)) << e.name;
  for (const ImpactReport& i : r.impacts) {
    for (const GraspImpulse& g : i.grasps) EXPECT_TRUE(std::isfinite(norm(g.impulse) + norm(g.angular_impulse)));
    for (double x : i.joint_velocity_change) EXPECT_TRUE(std::isfinite(x));
    EXPECT_TRUE(std::isfinite(i.kinetic_energy_after));
  }
  for (const GraspLoad& g : r.grasp_loads) EXPECT_TRUE(std::isfinite(g.largest_force + g.largest_moment));
  for (const LoopReport& l : r.loops) {
    EXPECT_TRUE(std::isfinite(l.unprojected_position + l.unprojected_angle + l.correction_total + l.integration_error));
  }
}

WrenchErrors wrench_errors(const CaptureProblem& p, const CaptureResult& r, const std::string& phase) {
  const std::size_t first = first_sample(r, phase), last = last_sample(r, phase);
  const double h = r.series.time[first + 1] - r.series.time[first];
  const CaptureSystem robot = make_servicer(p);
  WrenchErrors worst;
  double force = 0, moment = 0;
  for (std::size_t s = first + 4; s + 5 <= last; s += 5) {
    Forces forces;
    forces.gravity = p.gravity;
    std::vector<Vector3d> F(p.targets.size(), Vector3d::zero()), M = F;
    for (std::size_t i = 0; i < p.grasps.size(); ++i) {
      const GraspSetup& g = p.grasps[i];
      if (!holds(r, g, s)) continue;
      const Wrenchd W{vector_at(r, "grasps/" + g.end_effector + "/moment", s),
                      vector_at(r, "grasps/" + g.end_effector + "/force", s)};
      const Vector3d at = vector_at(r, "end_effectors/" + g.end_effector + "/position", s);
      const Frame& end_effector = robot.model.frames()[robot.model.frame_index(g.end_effector)];
      forces.external.push_back({end_effector.body, at, W});
      for (std::size_t t = 0; t < p.targets.size(); ++t) {
        if (p.targets[t].name == g.target) F[t] = F[t] - W.linear, M[t] = M[t] - W.angular - cross(at, W.linear);
      }
      force = std::max(force, norm(W.linear)), moment = std::max(moment, norm(W.angular));
    }
    for (std::size_t t = 0; t < p.targets.size(); ++t) {
      const std::string group = "targets/" + p.targets[t].name;
      const auto linear = [&](std::size_t k) { return vector_at(r, group + "/linear_momentum", k); };
      const auto about_origin = [&](std::size_t k) {
        return vector_at(r, group + "/angular_momentum", k) +
               cross(vector_at(r, "system/center_of_mass", k), linear(k));
      };
      const Vector3d weight = p.targets[t].mass * p.gravity;
      const Vector3d com = pose_at(r, group, s) * p.targets[t].com;
      worst.linear = std::max(worst.linear, norm(derivative(linear, s, h) - F[t] - weight));
      worst.angular = std::max(worst.angular, norm(derivative(about_origin, s, h) - M[t] - cross(com, weight)));
    }
    const State now = robot_state(p, robot, r, s);
    std::vector<double> vdot(now.v.size());
    for (std::size_t i = 0; i < vdot.size(); ++i) {
      vdot[i] = derivative([&](std::size_t k) { return robot_state(p, robot, r, k).v[i]; }, s, h);
    }
    std::vector<double> tau = inverse_dynamics(robot.model, now, vdot, forces);
    const std::vector<double> effort = joints_at(r, "joints/effort", s), friction = joints_at(r, "joints/friction", s);
    for (std::size_t j = 0; j < effort.size(); ++j) {
      double& torque = tau[robot.model.bodies()[robot.model.joints()[robot.robot_joints[j]]].v];
      worst.joints = std::max(worst.joints, std::abs(torque - effort[j] - friction[j]));
      torque = 0;
    }
    for (double x : tau) worst.base = std::max(worst.base, std::abs(x));
  }
  const double size = std::max(force, moment);
  worst.linear /= size, worst.angular /= size, worst.base /= size, worst.joints /= size;
  worst.largest_force = force;
  return worst;
}

Twistd mobility(const TargetSetup& target, const Posed& X_WT, const Vector3d& p_W, const Vector3d& moment,
                const Vector3d& force) {
  const Vector3d arm = p_W - X_WT * target.com;
  const Symmetric3d I = rotate(X_WT.R, target.inertia);
  // Columns of I; Cramer's rule.
  const Vector3d x = I * Vector3d{1, 0, 0}, y = I * Vector3d{0, 1, 0}, z = I * Vector3d{0, 0, 1};
  const Vector3d L = moment + cross(arm, force);
  const double det = dot(x, cross(y, z));
  const Vector3d w{dot(L, cross(y, z)) / det, dot(x, cross(L, z)) / det, dot(x, cross(y, L)) / det};
  return {w, (1 / target.mass) * force + cross(w, arm)};
}

double jump(const CaptureResult& r, const std::string& before, const std::string& after, bool twists) {
  const std::size_t a = last_sample(r, before), b = first_sample(r, after);
  EXPECT_EQ(r.series.time[a], r.series.time[b]);
  double largest = 0;
  for (const Series& s : r.series.series) {
    const bool pose = s.path.ends_with("/position") || s.path.ends_with("/quaternion_wxyz");
    const bool twist = s.path.ends_with("velocity") || s.path.ends_with("momentum");
    if (!pose && !(twist && twists)) continue;
    if (s.path.find("reference") != std::string::npos) continue;
    for (int c = 0; c < s.width(); ++c)
      largest = std::max(largest, std::abs(value_at(r, s.path, a, c) - value_at(r, s.path, b, c)));
  }
  return largest;
}

}  // namespace grapnel::testing
