#pragma once

/// @file
/// Sensor errors of joints, from a seed: smooth noise of limited bandwidth.

#include <cstdint>
#include <vector>

#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

/// The sensor of a joint reads theta + n(t), and its rate theta_dot + n'(t). n is a sum of kTones cosines of equal
/// amplitude with random frequencies in (0, bandwidth] and random phases: nearly Gaussian, stationary, with standard
/// deviation `position`. It is smooth, so that an integrator keeps its order, and reproducible to the bit.
struct TrackingNoise {
  double position = 0;     // standard deviation [rad or m]; 0: no noise
  double bandwidth = 5;    // [Hz]
  std::uint64_t seed = 0;  // determines n(t), together with the joint's number
};

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
