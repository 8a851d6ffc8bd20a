#include "grapnel/identify/rate_noise.hpp"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

#include "grapnel/dynamics/free_floating.hpp"
#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

std::vector<double> rate_deviations(const Model& model, int root, const RateNoise& noise) {
  std::vector<double> deviations(model.velocities(), 0.0);
  const int first = model.bodies()[root].v;
  for (int i = 0; i < 3; ++i) {
    deviations[first + i] = noise.angular_velocity;
    deviations[first + 3 + i] = noise.velocity;
  }
  for (int i : joint_velocities(model, root)) deviations[i] = noise.joint_rate;
  return deviations;
}

State with_rate_noise(const State& state, const std::vector<double>& deviations, std::uint64_t seed,
                      std::uint32_t sample) {
  // In (0, 1], with 53 random bits.
  const auto unit = [](std::uint32_t high, std::uint32_t low) {
    return static_cast<double>(((std::uint64_t{high} << 32 | low) >> 11) + 1) * 0x1p-53;
  };
  const r123::Philox4x32::key_type key = {{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  State noisy = state;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    if (deviations[i] == 0) continue;
    // The last word separates these numbers from those of NoiseSignal with the same seed.
    const r123::Philox4x32::ctr_type counter = {{sample, static_cast<std::uint32_t>(i), 0, 1}};
    const r123::Philox4x32::ctr_type random = r123::Philox4x32()(counter, key);
    const double radius = std::sqrt(-2 * std::log(unit(random[0], random[1])));
    noisy.v[i] += deviations[i] * radius * sine_cosine(2 * std::numbers::pi * unit(random[2], random[3])).cosine;
  }
  return noisy;
}

}  // namespace grapnel
