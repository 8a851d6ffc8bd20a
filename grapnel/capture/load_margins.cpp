#include "grapnel/capture/load_margins.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

struct Load {
  double force, moment, impulse, angular_impulse, driving, driving_impulse;
};

void compare(const std::string& of, const Load& load, const LoadRating& rating, std::vector<LoadMargin>& margins) {
  const auto add = [&](const char* quantity, double value, double limit) {
    if (std::isfinite(limit)) margins.push_back({of, quantity, value, limit});
  };
  add("force", load.force, rating.force);
  add("moment", load.moment, rating.moment);
  add("impulse", load.impulse, rating.impulse);
  add("angular_impulse", load.angular_impulse, rating.angular_impulse);
  add("driving", load.driving, rating.driving);
  add("driving_impulse", load.driving_impulse, rating.driving_impulse);
}

// Names of the joints between an end-effector and the base.
std::vector<std::string> arm_joints(const RobotSetup& robot, const std::string& end_effector) {
  std::vector<std::string> joints;
  std::string body;
  for (const EndEffectorSetup& e : robot.end_effectors) {
    if (e.name == end_effector) body = e.body;
  }
  for (std::size_t guard = 0; guard < robot.bodies.size() && body != robot.base; ++guard) {
    for (const BodyDescription& b : robot.bodies) {
      if (b.name != body) continue;
      joints.push_back(b.joint.name);
      body = b.parent;
      break;
    }
  }
  return joints;
}

}  // namespace

void add_margins(const CaptureProblem& problem, ImpactReport& report) {
  const bool in_time = report.compliant.has_value();
  const double duration = report.duration;
  for (const auto& [name, rating] : problem.robot.ratings) {
    for (const JointImpulse& j : report.joints) {
      if (j.joint != name) continue;
      const double impulse = norm(j.impulse), angular = norm(j.angular_impulse), driving = std::abs(j.along_axis);
      Load load{impulse / duration, angular / duration, impulse, angular, driving / duration, driving};
      if (in_time) load.force = j.peak_force, load.moment = j.peak_moment, load.driving = j.peak_driving;
      compare(name, load, rating, report.margins);
    }
  }
  for (const GraspImpulse& g : report.grasps) {
    for (const EndEffectorSetup& e : problem.robot.end_effectors) {
      if (e.name != g.end_effector) continue;
      const double impulse = norm(g.impulse), angular = norm(g.angular_impulse);
      Load load{impulse / duration, angular / duration, impulse, angular, 0, 0};
      if (g.profile) load.force = g.profile->peak_force, load.moment = g.profile->peak_moment;
      compare(e.name, load, e.rating, report.margins);
    }
  }
  // Brakes that stop the arms' own motion load them however slowly they meet the target.
  if (report.joints_during == "braked") return;
  for (const GraspImpulse& g : report.grasps) {
    const std::vector<std::string> joints = arm_joints(problem.robot, g.end_effector);
    SpeedLimit limit{g.end_effector, std::numeric_limits<double>::infinity(), 0, {}, {}};
    bool rated = false;
    for (const LoadMargin& m : report.margins) {
      if (m.of != g.end_effector && std::find(joints.begin(), joints.end(), m.of) == joints.end()) continue;
      rated = true;
      const double factor = m.rating / m.load;
      if (factor < limit.factor) limit.factor = factor, limit.of = m.of, limit.quantity = m.quantity;
    }
    if (!rated) continue;
    const double speed = norm(g.relative_velocity_before);
    limit.largest_speed = speed > 0 ? limit.factor * speed : 0;
    report.speed_limits.push_back(std::move(limit));
  }
}

}  // namespace grapnel
