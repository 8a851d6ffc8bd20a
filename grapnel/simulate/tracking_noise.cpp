#include "grapnel/simulate/tracking_noise.hpp"

#include <Random123/philox.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "grapnel/spatial/scalar.hpp"

namespace grapnel {
namespace {

// A number in (0, 1] with 53 random bits.
double unit_interval(std::uint32_t high, std::uint32_t low) {
  const std::uint64_t bits = (std::uint64_t{high} << 32 | low) >> 11;
  return static_cast<double>(bits + 1) * 0x1p-53;
}

}  // namespace

// Noise settings and joint => amplitude, frequencies and phases of kTones cosines (docs/theory, section 6.4), drawn by
// Philox from seed and joint. Throws std::invalid_argument for a negative deviation or a bandwidth not positive.
NoiseSignal::NoiseSignal(const TrackingNoise& noise, std::uint32_t joint) {
  if (!(noise.position >= 0) || !std::isfinite(noise.position)) {
    throw std::invalid_argument("tracking noise: the standard deviation must be finite and not negative");
  }
  if (!(noise.bandwidth > 0) || !std::isfinite(noise.bandwidth)) {
    throw std::invalid_argument("tracking noise: the bandwidth must be finite and positive");
  }
  if (noise.position == 0) return;
  amplitude_ = noise.position * std::sqrt(2.0 / kTones);  // each tone's variance is half its amplitude squared
  const r123::Philox4x32::key_type key = {
      {static_cast<std::uint32_t>(noise.seed), static_cast<std::uint32_t>(noise.seed >> 32)}};
  for (std::uint32_t k = 0; k < kTones; ++k) {
    const r123::Philox4x32::ctr_type counter = {{joint, k, 0, 0}};
    const r123::Philox4x32::ctr_type random = r123::Philox4x32()(counter, key);
    const double frequency = noise.bandwidth * (k + unit_interval(random[0], random[1])) / kTones;
    tones_.push_back({2 * std::numbers::pi * frequency, 2 * std::numbers::pi * unit_interval(random[2], random[3])});
  }
}

double NoiseSignal::rate_change(double duration) const {
  double rate = 0, acceleration = 0;
  for (const Tone& tone : tones_)
    rate += tone.angular_frequency, acceleration += tone.angular_frequency * tone.angular_frequency;
  return amplitude_ * std::min(2 * rate, acceleration * duration);
}

JointPoint NoiseSignal::at(double t) const {
  JointPoint n;
  for (const Tone& tone : tones_) {
    const double w = tone.angular_frequency, angle = w * t + tone.phase;
    const auto [sine, cosine] = sine_cosine(angle);
    const double c = amplitude_ * cosine, s = amplitude_ * sine;
    n.position += c;
    n.rate -= w * s;
    n.acceleration -= w * w * c;
  }
  return n;
}

}  // namespace grapnel
