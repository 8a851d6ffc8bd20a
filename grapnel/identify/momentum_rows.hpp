#pragma once

/// @file
/// The momentum of one sample as a linear function of the held body's parameters and of the velocities: the equations
/// of docs/theory, section 16, before weighting.

#include <Eigen/Core>

#include "grapnel/identify/identify_target.hpp"

namespace grapnel {

/// Mass, first moment and inertia about the frame's origin, in the frame; momentum is linear in these. With
/// MeasuredBase::rotation the reduced parameters of (16.5).
using LinearParameters = Eigen::Matrix<double, kInertialParameters, 1>;

/// One sample. Rows: [angular; linear] about the reference point, or angular alone.
struct MomentumRows {
  Rotationd R_WT;
  Vector3d p;                // from the reference point to the frame's origin, in W [m]
  Eigen::MatrixXd known;     // rows x velocities: momentum of the known bodies
  Eigen::MatrixXd J;         // 6 x velocities: twist of the held frame, in its axes, relative to the reference
  Eigen::VectorXd velocity;  // measured
  Eigen::VectorXd impulse;   // rows; since the first sample, about the reference point
};

/// Quantities common to all samples.
struct KnownBodies {
  double mass = 0;    // [kg]
  double radius = 0;  // of gyration at the first sample [m]
  Vector3d p_WO;      // the reference point if the base's twist is measured: the initial position of the held frame
  int rows = 6;
};
KnownBodies known_bodies(const IdentificationTask& task);

MomentumRows momentum_rows(const IdentificationTask& task, const KnownBodies& known, const MotionSample& sample);

/// The regressor Y of (16.2): rows x 10, at a twist of the held frame, in its axes.
Eigen::MatrixXd regressor(const MomentumRows& rows, const Eigen::VectorXd& twist);
/// The total momentum per velocity, (16.3): rows x velocities.
Eigen::MatrixXd momentum_matrix(const MomentumRows& rows, const LinearParameters& x);

}  // namespace grapnel
