#pragma once

/// @file
/// Stability of sampled proportional-derivative control with zero-order hold.

#include <Eigen/Core>

#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// x'' = -B (K_p x + K_d x') about rest; B: accelerations per effort, symmetric and positive semidefinite.
struct SampledLoop {
  Eigen::MatrixXd response;  // B
  Eigen::VectorXd kp, kd;
  ControlTiming timing;
};

/// Asymptotic growth factor of errors per sample: the spectral radius of the loop, each effort held for a period, after
/// the delay. Above 1 the loop is unstable.
double growth_per_tick(const SampledLoop& loop);

/// The largest factor, at most 1, by which all gains may be multiplied for a stable loop; 0: none was found.
double largest_stable_share(const SampledLoop& loop);

}  // namespace grapnel
