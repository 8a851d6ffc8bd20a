#pragma once

/// @file
/// Private to this module: a loop from sample to sample.

#include <vector>

#include "grapnel/linear/stability.hpp"

namespace grapnel {

/// X[k+1] = F X[k] + G v[k]; the commands of the channels are v[k] = H X[k].
struct SampledSystem {
  Eigen::MatrixXd F, G, H;
};
/// `delays`: per channel [s].
SampledSystem sampled_system(const LinearLoop& loop, const std::vector<LoopChannel>& channels,
                             const std::vector<double>& delays);

/// Whether no eigenvalue of the closed loop grows.
bool is_free_of_growth(const LinearLoop& loop);
bool is_free_of_growth(const LinearLoop& loop, const SampledSystem& system);

}  // namespace grapnel
