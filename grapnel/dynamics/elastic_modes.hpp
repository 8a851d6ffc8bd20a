#pragma once

/// @file
/// Natural frequencies of a system with joint springs, at rest in a posture: small vibrations M x'' + C x' + K x = 0.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/dynamics/state.hpp"

namespace grapnel {

/// One mode of vibration. Shapes are normalized: x^T M x = 1.
struct ElasticMode {
  double frequency = 0;      // undamped [Hz]
  double damping_ratio = 0;  // x^T C x / (2 omega): exact where damping does not couple modes
  Eigen::VectorXd shape;     // x, per velocity of the model; zero where locked
};

/// The modes of vibration in order of increasing frequency, one per movable spring. Rigid-body modes at frequency zero
/// are eliminated exactly: with y the coordinates without springs and d those with springs, M* = M_dd - M_dy M_yy^-1
/// M_yd, K d = omega^2 M* d (22.7). Modal joints contribute their modes to d; they are all zero if one joint of the
/// chain is locked. `locked`: velocities fixed at zero (a held base, braked joints). Springs are undeflected; gravity,
/// rates and loops are not considered.
std::vector<ElasticMode> elastic_modes(const Model& model, const State& state, std::span<const int> locked);

/// Participation factors of a mode at the locked free root `body`: x^T M e_k per direction (angular, then linear, about
/// its origin, in its axes). Their squares are the effective mass [kg] or inertia [kg m^2].
Eigen::VectorXd participation(const Model& model, const State& state, const ElasticMode& mode, int body);

}  // namespace grapnel
