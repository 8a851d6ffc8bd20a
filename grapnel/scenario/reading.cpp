#include "grapnel/scenario/reading.hpp"

namespace grapnel {
namespace {

template <class Named>
const Named* find_named(const std::vector<Named>& list, const std::string& name) {
  for (const Named& one : list) {
    if (one.name == name) return &one;
  }
  return nullptr;
}

}  // namespace

const EndEffectorSetup* end_effector_named(const Reading& reading, const std::string& name) {
  return find_named(reading.robot.setup.end_effectors, name);
}

const GraspPoint* grasp_point_named(const Reading& reading, const std::string& target, const std::string& point) {
  const TargetSetup* owner = find_named(reading.problem.targets, target);
  return owner ? find_named(owner->grasp_points, point) : nullptr;
}

}  // namespace grapnel
