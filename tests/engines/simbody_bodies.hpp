#pragma once

/// @file
/// Bodies and states of the bridge in Simbody's types, for the sources of the bridge (C++17).

#include <Simbody.h>

#include "engines/simbody_bridge.hpp"

namespace grapnel::testing {

inline SimTK::Vec3 vec3(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
inline SimTK::Vec3 vec3(const std::vector<double>& values, int first) {
  return {values[first], values[first + 1], values[first + 2]};
}

/// Used without normalization: a constructor that normalizes would change it.
inline SimTK::Rotation rotation(const std::array<double, 9>& r) {
  return SimTK::Rotation(SimTK::Mat33(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]), true);
}
inline SimTK::Rotation rotation_at(const std::vector<double>& q, int first) {
  return SimTK::Rotation(SimTK::Quaternion(q[first], q[first + 1], q[first + 2], q[first + 3]));
}

/// Adds the bodies and their joints; returns Simbody's index of each.
std::vector<SimTK::MobilizedBodyIndex> add_bodies(const std::vector<SimbodyBody>& given,
                                                  SimTK::SimbodyMatterSubsystem& matter);

/// Sets coordinates and velocities of the bodies, given as Grapnel's.
void place_bodies(const std::vector<SimbodyBody>& given, const std::vector<SimTK::MobilizedBodyIndex>& bodies,
                  const SimTK::SimbodyMatterSubsystem& matter, const std::vector<double>& q,
                  const std::vector<double>& v, SimTK::State& state);

}  // namespace grapnel::testing
