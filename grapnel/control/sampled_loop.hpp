#pragma once

/// @file
/// Stability of proportional-derivative control that speaks at the ticks of a clock and is held between them.

#include <Eigen/Core>

#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// x'' = -B (K_p x + K_d x') about rest, B the accelerations by the efforts, symmetric and not negative.
struct SampledLoop {
  Eigen::MatrixXd response;  // B
  Eigen::VectorXd kp, kd;
  ControlTiming timing;
};

/// The factor by which errors grow from tick to tick in the long run: the spectral radius of the loop, each effort held
/// for a period, after the delay. Above 1 it is unstable.
double growth_per_tick(const SampledLoop& loop);

/// The largest factor up to 1 by which all gains may be multiplied for a loop that does not grow; 0: none was found.
double largest_stable_share(const SampledLoop& loop);

}  // namespace grapnel
