#include "grapnel/simulate/sensor_reader.hpp"

#include <Random123/philox.h>

#include <cmath>
#include <numbers>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

// Seed, sensor, channel and reading number => n_k of (20.1), standard normal, by Philox and Box-Muller; no state.
double normal_number(std::uint64_t seed, std::uint32_t sensor, std::uint32_t channel, std::uint64_t reading) {
  // In (0, 1], with 53 random bits.
  const auto unit = [](std::uint32_t high, std::uint32_t low) {
    return static_cast<double>(((std::uint64_t{high} << 32 | low) >> 11) + 1) * 0x1p-53;
  };
  const r123::Philox4x32::key_type key = {{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  // The last word separates these numbers from those of NoiseSignal (0) and with_rate_noise() (1) with the same seed.
  const r123::Philox4x32::ctr_type counter = {
      {static_cast<std::uint32_t>(reading), channel, sensor ^ static_cast<std::uint32_t>(reading >> 32) << 8, 2}};
  const r123::Philox4x32::ctr_type random = r123::Philox4x32()(counter, key);
  const double radius = std::sqrt(-2 * std::log(unit(random[0], random[1])));
  return radius * sine_cosine(2 * std::numbers::pi * unit(random[2], random[3])).cosine;
}

double quantized(double x, double quantum) { return quantum > 0 ? quantum * std::round(x / quantum) : x; }

Rotationd rotation_by(const Vector3d& vector) {
  const double angle = norm(vector);
  return angle > 0 ? rotation_about((1 / angle) * vector, angle) : Rotationd::identity();
}

}  // namespace grapnel
