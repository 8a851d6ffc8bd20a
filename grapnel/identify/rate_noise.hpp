#pragma once

/// @file
/// Seeded noise of rate sensors.

#include <cstdint>

#include "grapnel/identify/identify_target.hpp"

namespace grapnel {

/// Standard deviations of the velocities of the tree rooted at `root`, per velocity of the model; zero for the others.
std::vector<double> rate_deviations(const Model& model, int root, const RateNoise& noise);

/// A state with Gaussian noise added to its velocities. Counter-based (Philox 4x32-10, Salmon et al. 2011) and
/// Box-Muller: depends on seed, sample and velocity alone.
State with_rate_noise(const State& state, const std::vector<double>& deviations, std::uint64_t seed,
                      std::uint32_t sample);

}  // namespace grapnel
