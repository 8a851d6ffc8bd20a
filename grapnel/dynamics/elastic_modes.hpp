#pragma once

/// @file
/// Frequencies of a system with springs at its joints, at rest in a posture: small vibrations M x'' + C x' + K x = 0.

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

/// The modes of vibration, slowest first, as many as there are springs that can move: those at frequency zero, in which
/// the system moves as a whole, are left out exactly, by eliminating what no spring holds: with y what is free of
/// springs and d what has one, M* = M_dd - M_dy M_yy^-1 M_yd, K d = omega^2 M* d (22.7). Joints that move by
/// the modes of a chain are in d by these, and stay zero together if one of them is locked. `locked`: velocities that
/// stay zero (a base that is held, joints that are braked). Springs are at rest, and gravity, rates and loops count
/// nothing.
std::vector<ElasticMode> elastic_modes(const Model& model, const State& state, std::span<const int> locked);

/// What a mode does to the free root `body` that would have to hold it, where that is locked: row by row (angular, then
/// linear, about its origin, in its axes) the participation x^T M e_k, whose square is the effective mass [kg] or
/// inertia [kg m^2] of that direction.
Eigen::VectorXd participation(const Model& model, const State& state, const ElasticMode& mode, int body);

}  // namespace grapnel
