#pragma once

/// @file
/// Sensor errors of joints, from a seed: smooth noise of limited bandwidth.

#include <cstdint>
#include <vector>

#include "grapnel/simulate/control_setup.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

/// n(t) of one joint.
class NoiseSignal {
 public:
  static constexpr int kTones = 24;
  NoiseSignal() = default;  // no noise
  /// Random numbers are counter-based (Philox 4x32-10, Salmon et al. 2011): a function of seed, joint and tone alone.
  /// The frequency of tone k of N is in the k-th of N equal parts of the band, which avoids slow beats. @throws
  /// std::invalid_argument if `position` is negative or not finite, or the bandwidth not positive and finite.
  NoiseSignal(const TrackingNoise& noise, std::uint32_t joint);
  /// n, n', n''.
  JointPoint at(double t) const;

  /// A bound of the change of n' within a duration [s].
  double rate_change(double duration) const;

  struct Tone {
    double angular_frequency, phase;
  };
  /// n(t) = amplitude() sum cos(w_k t + phase_k); empty without noise.
  double amplitude() const { return amplitude_; }
  const std::vector<Tone>& tones() const { return tones_; }

 private:
  double amplitude_ = 0;
  std::vector<Tone> tones_;
};

}  // namespace grapnel
