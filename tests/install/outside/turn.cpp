#include <cmath>
#include <cstdio>

#include "grapnel/spatial/pose.hpp"

// Three rotations by 120 deg are the identity.
int main() {
  const grapnel::Rotationd third = grapnel::rotation_about({0, 0, 1}, 2 * std::acos(-1.0) / 3);
  const grapnel::Vector3d p = third * (third * (third * grapnel::Vector3d{1, 2, 3}));
  std::printf("%.3f %.3f %.3f\n", p[0], p[1], p[2]);
  return std::abs(p[0] - 1) + std::abs(p[1] - 2) < 1e-12 ? 0 : 1;
}
