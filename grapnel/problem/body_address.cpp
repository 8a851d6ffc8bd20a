#include "grapnel/problem/body_address.hpp"

#include <map>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel {

std::vector<BodyAddress> body_addresses(const CaptureProblem& problem, const RobotSetup& robot, const Model& model,
                                        bool with_targets) {
  using Owner = BodyAddress::Owner;
  // Names are unique within one model, and this model has been built from these parts.
  std::map<std::string, BodyAddress, std::less<>> known;
  std::size_t inside = 0;
  for (const WheelSetup& wheel : problem.robot.wheels)
    known[wheel_body_name(wheel.name)] = {Owner::inside_base, 0, inside++};
  for (const MomentGyroSetup& gyro : problem.robot.gyros) {
    known[gimbal_body_name(gyro.name)] = {Owner::inside_base, 0, inside++};
    known[gyro_rotor_body_name(gyro.name)] = {Owner::inside_base, 0, inside++};
  }
  for (std::size_t t = 0; with_targets && t < problem.targets.size(); ++t) {
    const std::vector<BodyDescription> bodies = target_bodies(problem.targets[t]).bodies;
    for (std::size_t i = 0; i < bodies.size(); ++i) known[bodies[i].name] = {Owner::target, t, i};
  }
  for (std::size_t i = 0; i < robot.bodies.size(); ++i) known[robot.bodies[i].name] = {Owner::robot, 0, i};
  std::vector<BodyAddress> addresses;
  for (const Body& body : model.bodies()) addresses.push_back(known.at(body.description.name));
  return addresses;
}

int body_named(const CaptureSystem& system, const BodyName& body) {
  if (body.obstacle) return -1;
  if (body.target && body.name.empty()) return body_at(system, {BodyAddress::Owner::target, *body.target, 0});
  for (std::size_t i = 0; i < system.addresses.size(); ++i) {
    const std::string& name = system.model.bodies()[i].description.name;
    const BodyAddress& address = system.addresses[i];
    const bool is_it = !body.target ? address.owner != BodyAddress::Owner::target && name == body.name
                                    : belongs_to_target(system, static_cast<int>(i), *body.target) &&
                                          address.part > 0 && name.ends_with(panel_body_name("", body.name));
    if (is_it) return static_cast<int>(i);
  }
  return -1;
}

int body_at(const CaptureSystem& system, const BodyAddress& address) {
  for (std::size_t i = 0; i < system.addresses.size(); ++i) {
    if (system.addresses[i] == address) return static_cast<int>(i);
  }
  return -1;
}

int target_body_index(const CaptureSystem& system, std::size_t target) {
  return system.model.frames()[system.target_frames.at(target)].body;
}

std::vector<int> bodies_of_target(const CaptureSystem& system, std::size_t target) {
  std::vector<int> bodies;
  for (std::size_t i = 0; i < system.addresses.size(); ++i) {
    if (belongs_to_target(system, static_cast<int>(i), target)) bodies.push_back(static_cast<int>(i));
  }
  return bodies;
}

bool belongs_to_target(const CaptureSystem& system, int body, std::size_t target) {
  const BodyAddress& address = system.addresses[body];
  return address.owner == BodyAddress::Owner::target && address.target == target;
}

bool belongs_to_targets(const CaptureSystem& system, int body) {
  return system.addresses[body].owner == BodyAddress::Owner::target;
}

bool is_inside_base(const CaptureSystem& system, int body) {
  return system.addresses[body].owner == BodyAddress::Owner::inside_base;
}

std::vector<PlacedShape> shapes_in_model(const CaptureProblem& problem, const CaptureSystem& system) {
  std::vector<PlacedShape> shapes;
  std::optional<RobotSetup> made;
  const RobotSetup& robot = modelled_robot(problem.robot, !system.elastic_joints.empty(), made);
  const auto add = [&](int body, Geometry geometry) {
    if (geometry.shape != Geometry::Shape::none) shapes.push_back({body, std::move(geometry)});
  };
  for (const auto& [body, geometry] : robot.geometry) add(system.model.body_index(body), geometry);
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const int body = target_body_index(system, t);
    for (Geometry geometry : problem.targets[t].geometry) {
      geometry.X_BG = own_frame(system, body) * geometry.X_BG;
      add(body, std::move(geometry));
    }
  }
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const TargetBodies target = target_bodies(problem.targets[t]);
    for (const auto& [name, geometry] : target.geometry) add(system.model.body_index(name), geometry);
  }
  return shapes;
}

}  // namespace grapnel
