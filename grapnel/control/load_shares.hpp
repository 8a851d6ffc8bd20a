#pragma once

/// @file
/// Loads that depend affinely on one number, relative to their limits: efforts of joints, forces and moments of grasps.

#include <Eigen/Core>
#include <vector>

namespace grapnel {

/// |fixed + k varied| relative to a limit; one or three components.
struct LimitedLoad {
  Eigen::Vector3d fixed = Eigen::Vector3d::Zero(), varied = Eigen::Vector3d::Zero();
  double limit = 0;  // positive and finite
};

/// A choice of k, and the largest share of its limit that a load has there.
struct LoadShare {
  double k = 0;
  double share = 0;  // 0 without loads
  int load = -1;     // index of that load; -1 without loads
};

LoadShare share_at(const std::vector<LimitedLoad>& loads, double k);

/// The largest k from 0 to `most` for which no load exceeds its limit; if there is none, the k that minimizes the
/// largest share. Continuous in all numbers.
LoadShare largest_within(const std::vector<LimitedLoad>& loads, double most);

}  // namespace grapnel
