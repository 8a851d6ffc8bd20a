#include "examples/written_kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "capture/capture_case.hpp"

namespace grapnel::testing {
namespace {

// v turned by an angle about a unit axis (Rodrigues).
Vector3d turned(const Vector3d& v, const Vector3d& axis, double angle) {
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + (1 - std::cos(angle)) * dot(axis, v) * axis;
}

// R after a rotation by an angle about a unit axis in its frame.
Rotationd turned_frame(const Rotationd& R, const Vector3d& axis, double angle) {
  const Vector3d columns[] = {R * turned({1, 0, 0}, axis, angle), R * turned({0, 1, 0}, axis, angle),
                              R * turned({0, 0, 1}, axis, angle)};
  Rotationd product;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) product(i, j) = columns[j][i];
  }
  return product;
}

double joint_value(const CaptureResult& result, const std::string& joint, std::size_t sample) {
  const Series& values = series(result, "joints/position");
  const auto at = std::find(values.components.begin(), values.components.end(), joint);
  if (at == values.components.end()) throw std::out_of_range("no joint " + joint);
  return value_at(result, values.path, sample, static_cast<int>(at - values.components.begin()));
}

}  // namespace

std::map<std::string, Posed> written_poses(const RobotSetup& robot, const CaptureResult& result, std::size_t sample) {
  std::map<std::string, Posed> poses;
  for (const BodyDescription& body : robot.bodies) {
    if (body.name == robot.base) {
      poses[body.name] = pose_at(result, "base", sample);
      continue;
    }
    Posed X = poses.at(body.parent) * body.X_PF;
    if (body.joint.type == JointType::revolute) {
      X.R = turned_frame(X.R, body.joint.axis, joint_value(result, body.joint.name, sample));
    } else if (body.joint.type != JointType::fixed) {
      throw std::invalid_argument("joint type of " + body.joint.name);
    }
    poses[body.name] = X;
  }
  return poses;
}

Posed written_end_effector(const RobotSetup& robot, const std::map<std::string, Posed>& poses,
                           const std::string& end_effector) {
  for (const EndEffectorSetup& e : robot.end_effectors) {
    if (e.name == end_effector) return poses.at(e.body) * e.X_BE;
  }
  throw std::out_of_range("no end-effector " + end_effector);
}

Vector3d written_com(const RobotSetup& robot, const std::map<std::string, Posed>& poses) {
  Vector3d moment = Vector3d::zero();
  for (const BodyDescription& body : robot.bodies) moment += body.mass * (poses.at(body.name) * body.com);
  return (1 / written_mass(robot)) * moment;
}

double written_mass(const RobotSetup& robot) {
  double mass = 0;
  for (const BodyDescription& body : robot.bodies) mass += body.mass;
  return mass;
}

}  // namespace grapnel::testing
