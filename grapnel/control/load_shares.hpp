#pragma once

/// @file
/// Loads that are affine in one number, against their limits: efforts of joints, forces and moments of grasps.

#include <Eigen/Core>
#include <vector>

namespace grapnel {

/// |fixed + k varied| against a limit; of one or three components.
struct LimitedLoad {
  Eigen::Vector3d fixed = Eigen::Vector3d::Zero(), varied = Eigen::Vector3d::Zero();
  double limit = 0;  // above 0 and finite
};

/// A choice of k, and the largest share of its limit that a load takes there.
struct LoadShare {
  double k = 0;
  double share = 0;  // 0 without loads
  int load = -1;     // whose; -1 without loads
};

LoadShare share_at(const std::vector<LimitedLoad>& loads, double k);

/// The largest k from 0 to `most` at which no load exceeds its limit; where there is none, the k at which the largest
/// share is least. Continuous in all numbers.
LoadShare largest_within(const std::vector<LimitedLoad>& loads, double most);

}  // namespace grapnel
