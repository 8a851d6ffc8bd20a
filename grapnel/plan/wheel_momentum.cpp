#include "grapnel/plan/wheel_momentum.hpp"

#include <cmath>

namespace grapnel {

double WheelMomentum::share(std::size_t wheel, double t, const Vector3d& u) const {
  const PlannedWheel& w = wheels[wheel];
  return dot(w.row, H - u) + w.wanted + w.fading * std::exp(-rate * (t - begin));
}

}  // namespace grapnel
