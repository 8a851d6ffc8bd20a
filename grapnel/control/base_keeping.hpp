#pragma once

/// @file
/// Keeping the attitude of a free-floating base by the joints alone: reactionless motion and distributed momentum
/// control (15.9)-(15.13), after Nenchev & Yoshida (1999) and Dimitrov & Yoshida (2004).

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/control/joint_law.hpp"

namespace grapnel {

struct BaseKeepingLaw {
  int root = -1;                           // body index of the base, a free root
  Rotationd R_WD = Rotationd::identity();  // its attitude to be kept
  double rate = 0;                         // at which deviations decay, critically damped [1/s]
  std::vector<double> posture;             // per driven joint: towards which they go as far as the base allows; empty:
                                           // they go nowhere, and come to rest as far as the momentum allows
  double posture_rate = 0;                 // of that motion, critically damped [1/s]
  /// Axes about which the joints turn the base: directions of the singular values beyond are left alone (of a planar
  /// robot two).
  int rank = 3;
};

/// What the law says at an instant.
struct BaseKeepingCommand {
  Eigen::VectorXd effort;     // per driven joint, within the joints' limits [N m or N]
  double share = 1;           // of the motion that leaves the base alone: less than 1 where effort limits ask for it
  bool within_limits = true;  // whether the base's own part keeps within them; else efforts are cut
  /// Of B, the base's turning by the joint rates, falling; missing ones are 0. Near 0 there is a direction about which
  /// no joint motion turns the base.
  Vector3d singular_values = Vector3d::zero();
  double condition = 0;  // that of the law's rank over the largest
};

/// The efforts with which the base's angular acceleration is -2 r w_B - r^2 phi, by the least joint accelerations
/// (15.12), beside accelerations that do not turn the base at all, (1 - B^+ B) of those towards the posture. The law
/// knows the model, its state and `force`; joints that it does not drive, of wheels say, answer as they do.
/// `response` is updated; it has no closures.
BaseKeepingCommand base_keeping_command(const BaseKeepingLaw& law, const State& state, std::span<const double> force,
                                        const Vector3d& gravity, EffortResponse& response);

/// The same as a law of all joints, without closures; its scale is the share.
class BaseKeeping : public JointLaw {
 public:
  BaseKeeping(const Model& model, BaseKeepingLaw law, LawScope scope)
      : JointLaw(model, std::move(scope)), law_(std::move(law)) {}
  const BaseKeepingLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;

 private:
  BaseKeepingLaw law_;
};

/// Rotation vector of R_DB, in B: how far the base is from its attitude [rad].
Vector3d attitude_deviation(const BaseKeepingLaw& law, const Rotationd& R_WB);

}  // namespace grapnel
