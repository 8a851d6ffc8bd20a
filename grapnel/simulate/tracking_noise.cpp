#include "grapnel/simulate/tracking_noise.hpp"

#include <Random123/philox.h>

#include <algorithm>
#include <array>
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

// Sines and cosines of angles of at most this magnitude, by the functions for one angle.
void sine_cosine(const std::array<double, NoiseSignal::kTones>& angles, double largest,
                 std::array<double, NoiseSignal::kTones>& sines, std::array<double, NoiseSignal::kTones>& cosines) {
  constexpr int kCount = NoiseSignal::kTones;
  if (!(largest <= sine_cosine_detail::kLimit)) {
    for (int k = 0; k < kCount; ++k) {
      const auto [sine, cosine] = grapnel::sine_cosine(angles[k]);
      sines[k] = sine, cosines[k] = cosine;
    }
    return;
  }
  for (int k = 0; k < kCount; ++k) {  // without a branch
    const auto [sine, cosine] = sine_cosine_detail::reduced(angles[k]);
    sines[k] = sine, cosines[k] = cosine;
  }
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

// t => n, n', n''. The sines and cosines of all tones are evaluated in SIMD registers, and summed in the tones' order.
JointPoint NoiseSignal::at(double t) const {
  JointPoint n;
  if (tones_.empty()) return n;
  std::array<double, kTones> angles, sines, cosines;
  double largest = 0;
  for (int k = 0; k < kTones; ++k) angles[k] = tones_[k].angular_frequency * t + tones_[k].phase;
  for (const double angle : angles) largest = std::max(largest, std::abs(angle));
  sine_cosine(angles, largest, sines, cosines);
  for (int k = 0; k < kTones; ++k) {
    const double w = tones_[k].angular_frequency, c = amplitude_ * cosines[k], s = amplitude_ * sines[k];
    n.position += c;
    n.rate -= w * s;
    n.acceleration -= w * w * c;
  }
  return n;
}

}  // namespace grapnel
