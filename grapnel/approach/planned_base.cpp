#include "grapnel/approach/planned_base.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace grapnel {

bool keeps_attitude(const BaseControlSetup& control, const Symmetric3d& inertia, double duration) {
  const double w = 2 * std::numbers::pi / duration;
  const std::array<double, 3> J = {inertia.xx, inertia.yy, inertia.zz};
  for (int k = 0; k < 3; ++k) {
    const double stiffness = std::hypot(control.kp[k], control.kd[k] * w);
    // Feedforward compensates the joints' motion, but the gains must not be zero.
    if (control.feedforward ? stiffness == 0 : J[static_cast<std::size_t>(k)] * w * w > stiffness) return false;  // (2)
  }
  return true;
}

}  // namespace grapnel
