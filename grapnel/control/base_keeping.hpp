#pragma once

/// @file
/// Attitude control of a free-floating base by its joints alone: reactionless motion and distributed momentum control
/// (15.9)-(15.13), after Nenchev & Yoshida (1999) and Dimitrov & Yoshida (2004).

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/control/joint_law.hpp"

namespace grapnel {

struct BaseKeepingLaw {
  int root = -1;                           // body index of the base, a free root
  Rotationd R_WD = Rotationd::identity();  // desired attitude of the base
  double rate = 0;                         // decay rate of deviations, critically damped [1/s]
  std::vector<double> posture;  // per driven joint: goal of the null-space motion; empty: no goal, the joints
                                // come to rest as far as the momentum allows
  double posture_rate = 0;      // of that motion, critically damped [1/s]
  /// Number of axes about which the joints can rotate the base; further singular directions are ignored (2 for a planar
  /// robot).
  int rank = 3;
};

/// Output of the law.
struct BaseKeepingCommand {
  Eigen::VectorXd effort;     // per driven joint, within the joints' limits [N m or N]
  double share = 1;           // applied share of the reactionless motion: below 1 if effort limits require it
  bool within_limits = true;  // whether the base's own part is within the limits; otherwise efforts are clipped
  /// Singular values of B, the base's rotation per joint rate, in decreasing order; missing ones are 0. A value near 0
  /// means a direction about which no joint motion rotates the base.
  Vector3d singular_values = Vector3d::zero();
  double condition = 0;  // singular value at the law's rank over the largest
};

/// The efforts for a base angular acceleration of -2 r w_B - r^2 phi with the minimum-norm joint accelerations (15.12).
/// Accelerations without effect on the base are added: (1 - B^+ B) of those towards the posture. The law uses the
/// model, its state and `force`; joints that it does not drive, such as wheels, respond passively. `response` is
/// updated; it has no closures.
BaseKeepingCommand base_keeping_command(const BaseKeepingLaw& law, const State& state, std::span<const double> force,
                                        const Vector3d& gravity, EffortResponse& response);

/// The same law as a JointLaw, without closures; its scale is the share.
class BaseKeeping : public JointLaw {
 public:
  BaseKeeping(const Model& model, BaseKeepingLaw law, LawScope scope)
      : JointLaw(model, std::move(scope)), law_(std::move(law)) {}
  const BaseKeepingLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;

 private:
  BaseKeepingLaw law_;
};

/// Rotation vector of R_DB, in B: attitude error of the base [rad].
Vector3d attitude_deviation(const BaseKeepingLaw& law, const Rotationd& R_WB);

}  // namespace grapnel
