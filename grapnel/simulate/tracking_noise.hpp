#pragma once

/// @file
/// What the joints' sensors misread, from a seed: smooth noise of limited bandwidth.

#include <cstdint>
#include <vector>

#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

/// The sensor of a joint reads theta + n(t), and its rate theta_dot + n'(t). n is a sum of kTones cosines of equal
/// amplitude with random frequencies in (0, bandwidth] and random phases: nearly Gaussian, stationary, of standard
/// deviation `position`, and smooth, so that an integrator keeps its order and a run its bits.
struct TrackingNoise {
  double position = 0;     // standard deviation [rad or m]; 0: no noise
  double bandwidth = 5;    // [Hz]
  std::uint64_t seed = 0;  // with the joint's number it determines n(t)
};

/// n(t) of one joint.
class NoiseSignal {
 public:
  static constexpr int kTones = 24;
  NoiseSignal() = default;  // silent
  /// Random numbers are counter-based (Philox 4x32-10, Salmon et al. 2011): a function of seed, joint and tone alone.
  /// Tone k of N has its frequency anywhere in the k-th of N equal parts of the band: no two beat slowly.
  /// @throws std::invalid_argument if `position` is negative or not finite, or the bandwidth not positive and finite.
  NoiseSignal(const TrackingNoise& noise, std::uint32_t joint);
  /// n, n', n''.
  JointPoint at(double t) const;

  struct Tone {
    double angular_frequency, phase;
  };
  /// n(t) = amplitude() sum cos(w_k t + phase_k); none where it is silent.
  double amplitude() const { return amplitude_; }
  const std::vector<Tone>& tones() const { return tones_; }

 private:
  double amplitude_ = 0;
  std::vector<Tone> tones_;
};

}  // namespace grapnel
