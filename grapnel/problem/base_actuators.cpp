#include "grapnel/problem/base_actuators.hpp"

#include <stdexcept>

namespace grapnel {

const OtherActuatorKind& functions_of(BaseActuatorKind kind) {
  for (const OtherActuatorKind* other : kOtherActuators) {
    if (other->kind == kind) return *other;
  }
  throw std::logic_error("functions_of: the kind has its own members in RobotSetup");
}

}  // namespace grapnel
